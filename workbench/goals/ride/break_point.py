"""Margins at break points: disk, gain, phase and delay at currents, patterns, sensors, kinds of sensors, modal signals.

Source: guide, Definitions: Margins at break points.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from workbench.analysis.break_parts import break_names
from workbench.analysis.break_points import ALL, Break
from workbench.analysis.plant_reserves import points_of_loop
from workbench.analysis.setting import Setting
from workbench.control.structure.loop import Loop
from workbench.errors import InputError
from workbench.goals.elsewhere import ExactMargin, disk_measure, least_factor
from workbench.goals.goal import Goal, Rows, some_names
from workbench.goals.key import Key
from workbench.goals.margin import DelayMeasure
from workbench.goals.measure import Bound, Largest, Measure
from workbench.goals.promise import Promise, Subject
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found
from workbench.goals.ride.reserve import Reserve, chosen, told_apart_by_sides
from workbench.goals.verdict import Verdict
from workbench.lti.break_point import BreakPoint

FAMILIES = {
    "currents": "current", "patterns": "pattern", "sensors": "sensor", "kinds": "kind", "modal": "modal",
    "commands": "command", "signals": "signal", "all": "all",
}  # fmt: skip
USUAL = ("currents", "patterns", "kinds")  # of a vehicle, where none are named; of another plant every signal
STABLE = 1e-3  # damping that steering asks of a loop at its margin: the sign is judged elsewhere


def points_of(asked: Sequence[str], known: Sequence[Break]) -> tuple[Break, ...]:
    """Break points by name, `kind:*` or family."""
    of = {word: [b.name for b in known if b.kind == kind] for word, kind in FAMILIES.items()}
    picked = chosen(asked, [b.name for b in known], {w: names for w, names in of.items() if names}, "break point")
    return tuple(b for b in known if b.name in picked)


@dataclass(frozen=True, slots=True, kw_only=True)
class AtPoints(Reserve):
    """A margin at several break points, one broken at a time: the smallest counts.

    points : names such as "kind:vertical", or "currents", "patterns", "sensors", "kinds", "modal" for all of a family;
        of a plant of one's own "command:<name>", "sensor:<name>", or "commands", "sensors"; every one if left out
    at_once : whether it can be asked of several signals at once, each with a factor of its own ("all:…")
    """

    sense = ">="
    at_once: ClassVar[bool] = False
    margin_of: ClassVar[Callable[[BreakPoint], float]]

    points: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if self.points != ():
            object.__setattr__(self, "points", some_names("points", self.points))
        Reserve.__post_init__(self)

    def looked_at(self) -> str:
        return ", ".join(self.points) or "the usual points"

    def chosen(self, known: Sequence[Break]) -> tuple[Break, ...]:
        """Of the break points there are, those that the goal names."""
        return points_of(self.points or USUAL, [b for b in known if self.at_once or b.kind != ALL])

    def check(self, problem: str, setting: Setting) -> None:
        Reserve.check(self, problem, setting)
        self.chosen(break_names(setting))

    def steered_points(self, point: Evaluated) -> list[str]:
        """Those whose rows differ from another's."""
        every = self.chosen([p.at for p in point.reserve.whole.points.values()])
        return [b.name for b in told_apart_by_sides(point.setting, every)]

    def found(self, loop: Flown) -> Found:
        value, name = min((type(self).margin_of(b), b.point) for b in self.among(loop))
        if not math.isfinite(value):
            return [(self.limit, f"{name}, unlimited")]
        return [(value, name)]

    def among(self, loop: Flown) -> list[BreakPoint]:
        """The margins looked at; a sensor that the law does not use has none, unless nothing else is asked for."""
        asked = self.chosen(break_names(loop.setting))
        names = {b.name for b in asked}
        known = [*loop.break_points, *(loop.together if any(b.kind == ALL for b in asked) else ())]
        return [b for b in known if b.point in names] or [BreakPoint(
            point=self.looked_at(), gain_up=math.inf, gain_down=0.0, phase=math.inf, delay=math.inf, disk=math.inf
        )]  # fmt: skip

    def bind(self, loop: Loop) -> Bound:
        """The goal on a loop of any plant."""
        return Bound(self, Largest(tuple(self.measured(loop, names) for names in self.signals(loop))))

    def signals(self, loop: Loop) -> list[tuple[str, ...]]:
        """Signals broken at each point: one, or several at once."""
        known = {b: names for b, names in points_of_loop(loop).items() if self.at_once or b.kind != ALL}
        usual = [b for b in known if b.kind != ALL]
        return [known[b] for b in (self.chosen(tuple(known)) if self.points else usual)]

    def promises_on(self, loop: Loop, verdict: Verdict) -> tuple[Promise, ...]:
        if not self.proof:
            return Goal.promises_on(self, loop, verdict)
        return self.promises_of(self.proof, verdict, (Subject(points=names) for names in self.signals(loop)))

    def measured(self, loop: Loop, points: tuple[str, ...]) -> Measure:
        """The margin at one point, or at several at once: a number that is at most 1 where it is kept."""
        raise TypeError(f"{type(self).__name__} must define measured()")  # a defect of ours, not of the input


@dataclass(frozen=True, slots=True, kw_only=True)
class DiskMargin(AtPoints):
    """The balanced disk margin at every point is at least this."""

    kind, unit, proof = "disk margin", "1", "disk margin"
    keys = (Key("at_least", "limit"), Key("points"))
    at_once = True
    margin_of = staticmethod(lambda b: b.disk)

    def measured(self, loop: Loop, points: tuple[str, ...]) -> Measure:
        return disk_measure(loop, points, self.limit, self.focus)

    def rows_of(self, point: Evaluated) -> Rows:
        asked = self.asked_at(point.back_off)
        return [(f"{self.kind} at {n}", *point.reserve.rows(n, asked)) for n in self.steered_points(point)]


@dataclass(frozen=True, slots=True, kw_only=True)
class PhaseMargin(AtPoints):
    """The phase margin at every point is at least this; steered by the disk that guarantees it."""

    kind, unit = "phase margin", "rad"
    all_frequencies = True
    keys = (Key("at_least_deg", "limit", factor=math.pi / 180), Key("points"))
    margin_of = staticmethod(lambda b: b.phase)

    def measured(self, loop: Loop, points: tuple[str, ...]) -> Measure:
        disk = disk_measure(loop, points, 2 * math.tan(self.limit / 2))
        return ExactMargin(disk, loop, points[0], lambda m: self.limit / m.phase)

    def rows_of(self, point: Evaluated) -> Rows:
        disk = 2 * math.tan(self.asked_at(point.back_off) / 2)
        return [(f"{self.kind} at {n}", *point.reserve.rows(n, disk)) for n in self.steered_points(point)]


@dataclass(frozen=True, slots=True, kw_only=True)
class GainMargin(AtPoints):
    """At every point the gain may rise to this factor and fall to its inverse."""

    kind, unit = "gain margin", "1"
    all_frequencies = True
    keys = (Key("at_least", "limit"), Key("points"))
    margin_of = staticmethod(lambda b: least_factor(b.gain_up, b.gain_down))

    def measured(self, loop: Loop, points: tuple[str, ...]) -> Measure:
        disk = disk_measure(loop, points, 2 * (self.limit - 1) / (self.limit + 1))
        return ExactMargin(disk, loop, points[0], lambda m: self.limit / least_factor(m.gain_up, m.gain_down))

    def __post_init__(self) -> None:
        if not self.limit > 1:
            raise InputError(f"a gain margin must be a factor above 1; got {self.limit!r}. Give 2.0 for 6 dB.")
        AtPoints.__post_init__(self)

    def rows_of(self, point: Evaluated) -> Rows:
        asked, at = self.asked_at(point.back_off), point.reserve
        return [
            (f"{self.kind} at {n}", *at.damping(at.whole.scaled(n, factor), STABLE))
            for n in self.steered_points(point)
            for factor in (asked, 1 / asked)
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class DelayBorne(AtPoints):
    """At every point the loop bears this dead time."""

    kind, unit, proof = "dead time borne", "s", "delay margin"
    all_frequencies = True
    keys = (Key("at_least_ms", "limit", factor=1e-3), Key("points"))
    margin_of = staticmethod(lambda b: b.delay)

    def measured(self, loop: Loop, points: tuple[str, ...]) -> Measure:
        return DelayMeasure(loop.sensitivity(points), self.limit, points[0])

    def rows_of(self, point: Evaluated) -> Rows:
        asked, at = self.asked_at(point.back_off), point.reserve
        return [
            (f"{self.kind} at {n}", *at.damping(at.whole.late(n, asked), STABLE)) for n in self.steered_points(point)
        ]
