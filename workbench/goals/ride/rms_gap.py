"""How far the gaps change on the guideway, rms, at one end of the vehicle."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.analysis import Analysis
from workbench.analysis.setting import Setting
from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found, Place, Requirement

ENDS = ("front", "rear")


@dataclass(frozen=True, slots=True, kw_only=True)
class RmsGap(Requirement):
    """The rms change of a gap [m] at the front or rear coil sets is at most this."""

    sense, unit = "<=", "m"
    in_analysis = True
    rests_on_squares = True
    places = {  # noqa: RUF012 (a mapping that nobody changes)
        "rms gap, front": Place(Key("rms_gap_front_at_most_mm", "limit", 1e-3), "gap", "front"),
        "rms gap, rear": Place(Key("rms_gap_rear_at_most_mm", "limit", 1e-3), "gap", "rear"),
        "rms lateral gap, front": Place(Key("rms_lateral_gap_front_at_most_mm", "limit", 1e-3), "gap_lateral", "front"),
        "rms lateral gap, rear": Place(Key("rms_lateral_gap_rear_at_most_mm", "limit", 1e-3), "gap_lateral", "rear"),
    }

    def steer(self, point: Evaluated) -> Rows:
        limit, square = self.asked_at(point.back_off) ** 2, f"{self.place.word}, {self.place.end}"
        return [(self.name, np.array([1 - point.squares[square] / limit]), -point.slopes[square][None] / limit)]

    def squares(self, analysis: Analysis) -> Mapping[str, float | None]:
        return gap_squares(analysis, self.place, (self.place.end,))

    def found(self, loop: Flown) -> Found:
        return [(loop.analysis.rms[self.place.kind][self.place.end], f"{self.place.end} coil sets")]

    def mean_square(self, setting: Setting) -> tuple[Sequence[str], float]:
        end = setting.ends[ENDS.index(self.place.end)]
        return [f"{self.place.kind}_{end + 1}"], self.limit**2

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        return (f"rms.{self.place.kind}.{self.place.end}",)


def gap_squares(analysis: Analysis, place: Place, ends: tuple[str, ...]) -> dict[str, float | None]:
    """Exact mean squares of a gap at some ends, by class."""
    rms = {end: analysis.rms[place.kind][end] for end in ends}
    return {f"{place.word}, {end}": None if value is None else value**2 for end, value in rms.items()}
