"""How fast the slowest root decays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.sampled import SampledLoop
from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated, count
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found, MarginRequirement, Screened

STABLE_DECAY = 1e-3  # [1/s] kept by a design even where no decay rate is asked for


@dataclass(frozen=True, slots=True, kw_only=True)
class DecayRate(MarginRequirement):
    """Every root decays at least this fast [1/s]. Source: guide, Definitions: Poles."""

    kind, sense, unit = "decay rate", ">=", "1/s"
    keys = (Key("decay_rate_at_least_per_s", "limit"),)
    in_analysis = True
    of_roots = boxed = True

    def steer(self, point: Evaluated) -> Rows:
        decay = self._steered(point.back_off)
        out = []
        for group, (values, slopes) in zip(point.groups, point.poles, strict=True):
            slow = np.argsort(-values.real)[: count(group)]
            out.append(
                (f"{self.name} of {group.subject.name}", -values.real[slow] / decay - 1, -slopes.real[slow] / decay)
            )
        return out

    def _steered(self, back_off: float) -> float:
        return max(self.asked_at(back_off), STABLE_DECAY)

    def floor(self, back_off: float) -> float:
        return STABLE.limit / self._steered(back_off) - 1

    def sampled(self, loop: SampledLoop) -> float | None:
        return loop.decay

    def found(self, loop: Flown) -> Found:
        slowest = max(loop.analysis.modes, key=lambda m: m.pole.real)
        return [(loop.analysis.decay, f"{slowest.name}, {slowest.frequency_hz:.3g} Hz")]

    def least(self, loop: Flown) -> tuple[float, str]:
        return min((float(-p.real.max()), s.name) for (s, _), p in zip(loop.closed, loop.poles, strict=True))

    def screened(self, many: Screened) -> np.ndarray:
        return -many.poles.real.max(axis=1)

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        return ("decay",)


STABLE = DecayRate(STABLE_DECAY / 2)  # what is steered where no decay rate is asked for
