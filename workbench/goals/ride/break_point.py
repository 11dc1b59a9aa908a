"""Margins at break points: disk, gain, phase and delay at currents, patterns, sensors, kinds of sensors, modal signals.

Source: guide, Definitions: Margins at break points.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from workbench.analysis.loop_rows import point_names
from workbench.analysis.setting import Setting
from workbench.goals.goal import Rows, some_names
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found
from workbench.goals.ride.reserve import Reserve, chosen, told_apart_by_sides
from workbench.lti.break_point import BreakPoint

FAMILIES = {
    "currents": "current:", "patterns": "pattern:", "sensors": "sensor:", "kinds": "kind:", "modal": "modal:",
}  # fmt: skip
STABLE = 1e-3  # damping that steering asks of a loop at its margin: the sign is judged elsewhere


def points_of(setting: Setting, asked: Sequence[str], known: Sequence[str]) -> tuple[str, ...]:
    """Break points by name, `kind:*` or family."""
    families = {word: [n for n in known if n.startswith(head)] for word, head in FAMILIES.items()}
    return chosen(asked, known, {w: names for w, names in families.items() if names}, "break point")


@dataclass(frozen=True, slots=True, kw_only=True)
class AtPoints(Reserve):
    """A margin at several break points, one broken at a time: the smallest counts.

    points : names such as "kind:vertical", or "currents", "patterns", "sensors", "kinds", "modal" for all of a family
    """

    sense = ">="
    margin_of: ClassVar[Callable[[BreakPoint], float]]

    points: tuple[str, ...] = ("currents", "patterns", "kinds")

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", some_names("points", self.points))
        Reserve.__post_init__(self)

    def looked_at(self) -> str:
        return ", ".join(self.points)

    def check(self, problem: str, setting: Setting) -> None:
        points_of(setting, self.points, point_names(setting))

    def steered_points(self, point: Evaluated) -> list[str]:
        """Those whose rows differ from another's."""
        names = points_of(point.setting, self.points, tuple(point.reserve.whole.points))
        return told_apart_by_sides(point.setting, names)

    def found(self, loop: Flown) -> Found:
        at = {b.point: b for b in loop.break_points}
        names = points_of(loop.setting, self.points, tuple(at))
        value, name = min((type(self).margin_of(at[name]), name) for name in names)
        return (
            [(value if math.isfinite(value) else None, name)]
            if math.isfinite(value)
            else [(self.limit, f"{name}, unlimited")]
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class DiskMargin(AtPoints):
    """The balanced disk margin at every point is at least this."""

    kind, unit = "disk margin", "1"
    keys = (Key("at_least", "limit"), Key("points"))
    margin_of = staticmethod(lambda b: b.disk)

    def steer(self, point: Evaluated) -> Rows:
        asked = self.asked_at(point.back_off)
        return [(f"{self.kind} at {n}", *point.reserve.rows(n, asked)) for n in self.steered_points(point)]


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseMargin(AtPoints):
    """The phase margin at every point is at least this; steered by the disk that guarantees it."""

    kind, unit = "phase margin", "rad"
    keys = (Key("at_least_deg", "limit", factor=math.pi / 180), Key("points"))
    margin_of = staticmethod(lambda b: b.phase)

    def steer(self, point: Evaluated) -> Rows:
        disk = 2 * math.tan(self.asked_at(point.back_off) / 2)
        return [(f"{self.kind} at {n}", *point.reserve.rows(n, disk)) for n in self.steered_points(point)]


@dataclass(frozen=True, slots=True, kw_only=True)
class GainMargin(AtPoints):
    """At every point the gain may rise to this factor and fall to its inverse."""

    kind, unit = "gain margin", "1"
    keys = (Key("at_least", "limit"), Key("points"))
    margin_of = staticmethod(lambda b: min(b.gain_up, 1 / b.gain_down if b.gain_down > 0 else math.inf))

    def steer(self, point: Evaluated) -> Rows:
        asked, at = self.asked_at(point.back_off), point.reserve
        return [
            (f"{self.kind} at {n}", *at.damping(at.whole.scaled(n, factor), STABLE))
            for n in self.steered_points(point)
            for factor in (asked, 1 / asked)
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class DelayMargin(AtPoints):
    """At every point the loop bears this dead time."""

    kind, unit = "dead time borne", "s"
    keys = (Key("at_least_ms", "limit", factor=1e-3), Key("points"))
    margin_of = staticmethod(lambda b: b.delay)

    def steer(self, point: Evaluated) -> Rows:
        asked, at = self.asked_at(point.back_off), point.reserve
        return [
            (f"{self.kind} at {n}", *at.damping(at.whole.late(n, asked), STABLE)) for n in self.steered_points(point)
        ]
