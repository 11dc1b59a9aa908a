"""The margins of many vehicles under the same gains at a time: what a search for the worst ones looks at.

    settings --read once--> readings, stacked --close--> loops (b, n, n) --eigenvalues, fractions--> margins (b,)

Damping, decay and the crossings of the delay margin are eigenvalues; the peak sensitivity is pursued on a grid. Good to
some digits, and a hundred times cheaper than the exact measures, which then judge the few worst.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from workbench.analysis.batch.closing import Closed, Closing
from workbench.analysis.batch.plants import Reading, read
from workbench.analysis.setting import Setting
from workbench.control.gains import GAIN_NAMES, Gains
from workbench.design.variation import Variant
from workbench.goals.ride.requirement import MarginRequirement

AT_ONCE = 128  # loops in a stack: few enough to stay in the cache


class Screening:
    """Margins of models of one vehicle; what it reads of a plant is kept by the caller as `readings`."""

    def __init__(self, setting: Setting) -> None:
        self._closings = [Closing(s) for s in setting.subjects]

    @staticmethod
    def readings(setting: Setting) -> tuple[Reading, ...]:
        """What the margins need of one vehicle, group by group."""
        return tuple(read(setting, s, []) for s in setting.subjects)

    def shortfalls(
        self, requirements: Sequence[MarginRequirement], models: Sequence[Variant], readings, gains: Gains
    ) -> np.ndarray:
        """(models, requirements) relative misses, negative where met; infinite where an unstable loop has no value."""
        values = self.values(requirements, models, readings, gains)
        out = np.array([[r.shortfall(v) for v in own] for r, own in zip(requirements, values, strict=True)]).T
        return np.where(np.isnan(out), np.inf, out)

    def values(
        self, requirements: Sequence[MarginRequirement], models: Sequence[Variant], readings, gains: Gains
    ) -> np.ndarray:
        """(requirements, models) their quantities; NaN for peaks and delays of unstable loops."""
        theta = np.array(list(gains.as_dict().values()))
        rows = np.array([m.scale * theta for m in models]).reshape(-1, len(GAIN_NAMES))
        parts = []
        for start in range(0, len(rows), AT_ONCE):
            some = slice(start, start + AT_ONCE)
            many = self._screened(rows[some], readings[some])
            parts.append(np.array([r.screened(many) for r in requirements]).reshape(len(requirements), -1))
        return np.concatenate(parts, axis=1)

    def _screened(self, theta: np.ndarray, readings) -> "Screened":
        closed = [c(theta, _stacked([r[k] for r in readings])) for k, c in enumerate(self._closings)]
        poles = np.concatenate([c.modes.poles for c in closed], axis=1)
        return Screened(poles, closed, np.flatnonzero(poles.real.max(axis=1) < 0))


@dataclass(frozen=True, slots=True)
class Screened:
    """Many loops at once: what a requirement screens (`goals.ride.requirement.Screened`)."""

    poles: np.ndarray
    closed: Sequence[Closed]
    stable: np.ndarray


def _stacked(readings: Sequence[Reading]) -> Reading:
    return Reading(**{f.name: np.array([getattr(r, f.name) for r in readings]) for f in fields(Reading)})
