"""Stability of vehicles that differ in several things at once: every corner of a box.

Source: guide, Definitions: Variations and losses; Corners of a box.
"""

from dataclasses import dataclass

from workbench.analysis.corners import Box, box_of, check_box, corner_decays, intervals_of
from workbench.analysis.setting import Setting
from workbench.errors import InputError
from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found
from workbench.goals.ride.reserve import Reserve


@dataclass(frozen=True, slots=True, kw_only=True)
class CornerDecay(Reserve):
    """The decay rate at every corner of a box is at least this.

    box : of `analysis.corners.box_of`; a mapping of names of changes to [low, high] becomes one
    """

    kind, sense, unit = "decay rate at corners", ">=", "1/s"
    keys = (Key("at_least_per_s", "limit"), Key("box", read=box_of, written=intervals_of))
    of_roots = True

    box: Box = ()

    def __post_init__(self) -> None:
        if isinstance(self.box, dict):
            object.__setattr__(self, "box", box_of(self.box))
        if not self.box:
            raise InputError("a box must have at least one interval; got none. Give box = { mass = [0.85, 1.15] }.")
        Reserve.__post_init__(self)

    def looked_at(self) -> str:
        return ", ".join(intervals_of(self.box))

    def check(self, problem: str, setting: Setting) -> None:
        Reserve.check(self, problem, setting)
        check_box(setting, self.box)

    def rows_of(self, point: Evaluated) -> Rows:
        asked = self.asked_at(point.back_off)
        return [(f"decay at {name}", *rows) for name, rows in point.reserve.corners(self.box, asked)]

    def found(self, loop: Flown) -> Found:
        every = corner_decays(loop.setting, loop.gains, self.box)
        worst, grow = min(every, key=lambda c: c.decay), sum(c.decay <= 0 for c in every)
        return [(worst.decay, f"{worst.name} ({grow} of {len(every)} corners unstable)" if grow else worst.name)]
