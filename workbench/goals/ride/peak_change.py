"""How far a gap changes at most: bias of the sensors, guideway and sensor noise together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.analysis import PEAK_SIGMAS, Analysis
from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found, Place, Requirement
from workbench.goals.ride.rms_gap import ENDS, gap_squares


@dataclass(frozen=True, slots=True, kw_only=True)
class PeakGapChange(Requirement):
    """Static error and 3σ of a gap [m] at the worse end is at most this."""

    sense, unit = "<=", "m"
    in_analysis = True
    rests_on_squares = True
    places = {  # noqa: RUF012 (a mapping that nobody changes)
        "peak gap change": Place(Key("peak_gap_change_at_most_mm", "limit", 1e-3), "gap"),
        "peak lateral gap change": Place(Key("peak_lateral_gap_change_at_most_mm", "limit", 1e-3), "gap_lateral"),
    }

    def steer(self, point: Evaluated) -> Rows:
        """Static error of each set and 3σ of guideway, at each end, and of the worst set's sensor noise together."""
        limit, word = self.asked_at(point.back_off), self.place.word
        static, (noise, noise_slope) = point.static[self.place.kind], point.noise(self.place.kind)
        values, slopes = [], []
        for end in ENDS:
            sigma = np.sqrt(point.squares[f"{word}, {end}"] + noise)
            values.append(static.value + PEAK_SIGMAS * sigma)
            slopes.append(static.gradient + PEAK_SIGMAS * (point.slopes[f"{word}, {end}"] + noise_slope) / (2 * sigma))
        return [(self.name, 1 - np.concatenate(values) / limit, -np.concatenate(slopes) / limit)]

    def squares(self, analysis: Analysis) -> Mapping[str, float | None]:
        return gap_squares(analysis, self.place, ENDS)

    def found(self, loop: Flown) -> Found:
        return [(loop.analysis.peak_gap_change[self.place.kind], "worse end, static + 3σ")]

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        return (f"peak_gap_change.{self.place.kind}",)
