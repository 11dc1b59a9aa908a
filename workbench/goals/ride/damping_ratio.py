"""How well the least damped root is damped."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.mode import REAL
from workbench.analysis.sampled import SampledLoop
from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated, count
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found, MarginRequirement, Screened


@dataclass(frozen=True, slots=True, kw_only=True)
class DampingRatio(MarginRequirement):
    """−Re p/|p| of every oscillatory root is at least this; a real root that grows counts −1.

    Source: guide, Definitions: Poles.
    """

    kind, sense, unit = "damping ratio", ">=", "1"
    keys = (Key("damping_ratio_at_least", "limit"),)
    in_analysis = True
    of_roots = boxed = True

    def steer(self, point: Evaluated) -> Rows:
        asked = self.asked_at(point.back_off)
        out = []
        for group, (values, slopes) in zip(point.groups, point.poles, strict=True):
            ratio = -values.real / np.abs(values)
            worst = np.argsort(ratio)[: count(group)]
            slope = damping_slope(values[worst], slopes[worst])
            out.append((f"{self.name} of {group.subject.name}", ratio[worst] / asked - 1, slope / asked))
        return out

    def sampled(self, loop: SampledLoop) -> float | None:
        return loop.damping

    def found(self, loop: Flown) -> Found:
        a = loop.analysis
        growing = [m for m in a.modes if not m.oscillates and m.pole.real > 0]
        if growing:
            grown = max(growing, key=lambda m: m.pole.real)
            return [(-1.0, f"{grown.name}, a real root at {grown.pole.real:.3g} 1/s")]
        worst = min((m for m in a.modes if m.oscillates), key=lambda m: m.damping, default=None)
        return [(a.damping, "no oscillatory root" if worst is None else f"{worst.name}, {worst.frequency_hz:.3g} Hz")]

    def least(self, loop: Flown) -> tuple[float, str]:
        ratios = [_smallest(poles) for poles in loop.poles]
        return min((ratio, s.name) for ratio, (s, _) in zip(ratios, loop.closed, strict=True))

    def screened(self, many: Screened) -> np.ndarray:
        size = np.abs(many.poles)
        moving = np.abs(many.poles.imag) > REAL * size
        # guide, Definitions: Poles; a real root has no damping ratio, an unstable one counts as −1
        alone = np.where(many.poles.real > 0, -1.0, 1.0)
        return np.where(moving, -many.poles.real / np.maximum(size, 1e-300), alone).min(axis=1)

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        return ("damping",)


def damping_slope(values: np.ndarray, slopes: np.ndarray) -> np.ndarray:
    """(k, 17) derivatives of −Re λ/|λ| from eigenvalues (k,) and their derivatives (k, 17)."""
    size = np.abs(values)
    turned = (values.conj()[:, None] * slopes).real
    return -slopes.real / size[:, None] + (values.real / size**3)[:, None] * turned


def _smallest(poles: np.ndarray) -> float:
    """Smallest −Re p/|p| of oscillatory roots, −1 where a real root is unstable; 1 if there is neither."""
    size = np.abs(poles)
    moving = np.abs(poles.imag) > REAL * size
    ratios = -poles.real[moving] / size[moving]
    return float(min(ratios.min(initial=1.0), -1.0 if (poles.real[~moving] > 0).any() else 1.0))
