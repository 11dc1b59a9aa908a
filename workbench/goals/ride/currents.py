"""How much control current the ride costs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.analysis import Analysis
from workbench.analysis.setting import Setting
from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found, Requirement
from workbench.lti.signals import numbered


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanSquareCurrents(Requirement):
    """Σ⟨α²⟩ over all coil sets, control current over main-coil current, is at most this."""

    kind, sense, unit = "sum of mean square currents", "<=", "1"
    keys = (Key("sum_alpha_squared_at_most", "limit"),)
    in_analysis = True
    rests_on_squares = True

    def steer(self, point: Evaluated) -> Rows:
        limit = self.asked_at(point.back_off)
        value, slope = point.squares["currents"], point.slopes["currents"]
        return [(self.name, np.array([1 - value / limit]), -slope[None] / limit)]

    def squares(self, analysis: Analysis) -> Mapping[str, float | None]:
        return {"currents": analysis.sum_alpha_squared}

    def found(self, loop: Flown) -> Found:
        return [(loop.analysis.sum_alpha_squared, "all coil sets")]

    def mean_square(self, setting: Setting) -> tuple[Sequence[str], float]:
        return numbered("current", setting.law.count), self.limit

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        return ("sum_alpha_squared",)
