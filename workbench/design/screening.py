"""The margins of many vehicles under the same gains at a time: what a search for the worst ones looks at.

    settings --read once--> readings, stacked --close--> loops (b, n, n) --eigenvalues, fractions--> margins (b,)

Damping, decay and the crossings of the delay margin are eigenvalues; the peak sensitivity is pursued on a grid. Good to
some digits, and a hundred times cheaper than the exact measures, which then judge the few worst.
"""

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from workbench.analysis.batch.closing import Closing
from workbench.analysis.batch.plants import Reading, read
from workbench.analysis.mode import REAL
from workbench.analysis.setting import Setting
from workbench.control.gains import GAIN_NAMES, Gains
from workbench.design.model import STABILITY, Model
from workbench.design.requirement import Requirement

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
        self, requirements: Sequence[Requirement], models: Sequence[Model], readings, gains: Gains
    ) -> np.ndarray:
        """(models, requirements) relative misses, negative where met; infinite where an unstable loop has no value."""
        values = self.values(models, readings, gains)
        out = np.array([[r.shortfall(v) for v in values[r.name]] for r in requirements]).T
        return np.where(np.isnan(out), np.inf, out)

    def values(self, models: Sequence[Model], readings, gains: Gains) -> dict[str, np.ndarray]:
        """Each of `model.STABILITY`, (models,); NaN for peaks and delays of unstable loops."""
        theta = np.array(list(gains.as_dict().values()))
        rows = np.array([m.scale * theta for m in models]).reshape(-1, len(GAIN_NAMES))
        parts = []
        for start in range(0, len(rows), AT_ONCE):
            some = slice(start, start + AT_ONCE)
            parts.append(self._values(rows[some], readings[some]))
        return {name: np.concatenate([p[name] for p in parts]) for name in STABILITY}

    def _values(self, theta: np.ndarray, readings) -> dict[str, np.ndarray]:
        closed = [c(theta, _stacked([r[k] for r in readings])) for k, c in enumerate(self._closings)]
        poles = np.concatenate([c.modes.poles for c in closed], axis=1)
        size = np.abs(poles)
        moving = np.abs(poles.imag) > REAL * size
        # guide, Definitions: Poles; a real root has no damping ratio, an unstable one counts as −1
        alone = np.where(poles.real > 0, -1.0, 1.0)
        damping = np.where(moving, -poles.real / np.maximum(size, 1e-300), alone).min(axis=1)
        decay = -poles.real.max(axis=1)
        peak, delay = np.full((2, len(theta)), np.nan)
        stable = np.flatnonzero(decay > 0)
        if len(stable):
            own = [c.only(stable) for c in closed]
            peak[stable] = np.max([c.peak() for c in own], axis=0)
            delay[stable] = np.min([c.delay()[0] for c in own], axis=0)
        return dict(zip(STABILITY, (damping, decay, peak, delay), strict=True))


def _stacked(readings: Sequence[Reading]) -> Reading:
    return Reading(**{f.name: np.array([getattr(r, f.name) for r in readings]) for f in fields(Reading)})
