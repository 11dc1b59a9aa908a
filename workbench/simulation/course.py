"""The guideway a simulation runs along: drawn at random, or of known shape.

    Realisation, ShapedGuideway, Scaled  --inputs(positions, speed, time)-->  ζ, η of the coil sets
    Guideways (many realisations)        --met(positions, first, count)--->   one cubic a step for each coil set

Every coil set meets the guideway at its own place, the rear ones later by the wheel base.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from workbench.errors import InputError
from workbench.physics.guideway.irregularity import Positions, leads, patterns
from workbench.physics.guideway.realisation import Realisation
from workbench.physics.guideway.shape import Shape

NEAR = 1e-9  # of a spacing: where a coil set stands on a point


class Course(Protocol):
    """Irregularities met along the way."""

    def inputs(self, positions: Positions, speed: float, time) -> np.ndarray:
        """(2n, k) [m] ζ_1…ζ_n, η_1…η_n at times (k,) [s]; at t = 0 the foremost set is at x = 0."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class ShapedGuideway:
    """Shapes of the vertical profile A1, cross-level A2, alignment A3 and gauge A4; None is smooth."""

    A1: Shape | None = None
    A2: Shape | None = None
    A3: Shape | None = None
    A4: Shape | None = None

    def inputs(self, positions: Positions, speed: float, time) -> np.ndarray:
        """What the coil sets meet; see Course."""
        distance = speed * (np.asarray(time, float) + leads(positions, speed)[:, None])
        shapes = (self.A1, self.A2, self.A3, self.A4)
        heights = [np.zeros_like(distance) if shape is None else shape.height(distance) for shape in shapes]
        return np.einsum("nt,tnk->nk", patterns(positions), np.array(heights))


@dataclass(frozen=True, slots=True, kw_only=True)
class Scaled:
    """A course with every height multiplied by a factor."""

    course: Course
    factor: float

    def __post_init__(self) -> None:
        if not np.isfinite(self.factor):
            raise InputError(f"Scaled.factor must be finite; got {self.factor!r}. 2 doubles every bump.")

    def inputs(self, positions: Positions, speed: float, time) -> np.ndarray:
        """What the coil sets meet; see Course."""
        return self.factor * self.course.inputs(positions, speed, time)


@dataclass(frozen=True, eq=False)
class Guideways:
    """Guideways of equal spacing and length, one a flight, as what is met in every step.

    cubics : (4, n, b, 4 types) [m] coefficients of the shares' powers 0 … 3 between neighbouring points
    split : steps from one point to the next
    """

    spacing: float  # [m]
    cubics: np.ndarray
    split: int = 1

    @classmethod
    def of(cls, tracks: Sequence[Realisation], factor: float = 1.0, split: int = 1) -> "Guideways":
        """Drawn guideways side by side, all heights times a factor."""
        spacing, n = tracks[0].spacing, tracks[0].heights.shape[1]
        out = np.empty((4, n, len(tracks), 4))
        scale = factor * spacing ** np.arange(4.0)[:, None, None]
        for flight, track in enumerate(tracks):
            out[:, :, flight] = scale * track.pieces()
        return cls(spacing, out, split)

    def met(self, positions: Positions, first: int, count: int) -> np.ndarray:
        """(count, b, 2n, 4) what the coil sets meet in the steps from `first` on, Σ coefficient · shareᵏ of the step.

        A set whose distance from the foremost is no whole number of spacings meets the cubic with the profile's values
        and slopes at both ends of the interval.
        """
        places = np.array([p[0] for p in positions], float)
        behind, pattern = (places - places.max()) / self.spacing, patterns(positions)
        out = np.empty((count, self.cubics.shape[2], len(pattern), 4))
        for place in np.unique(behind):
            rows = np.tile(behind == place, 2)
            out[:, :, rows] = np.einsum("rt,pkbt->kbrp", pattern[rows], self._steps(first, count, float(place)))
        return out

    def _steps(self, first: int, count: int, shift: float) -> np.ndarray:
        """(4, count, b, 4 types) of the steps: their part of each interval's cubic."""
        start, skipped = divmod(first, self.split)
        whole = self._between(start, -(-(skipped + count) // self.split), shift)
        if self.split == 1:
            return whole
        part = np.zeros((self.split, 4, 4))  # of ((j + u)/split)^q, the coefficients of u^p
        for p, q in zip(*np.triu_indices(4), strict=True):
            part[:, p, q] = math.comb(q, p) * np.arange(self.split) ** (q - p) / self.split**q
        finer = np.einsum("jpq,qkbt->pkjbt", part, whole)
        return finer.reshape(4, -1, *finer.shape[3:])[:, skipped : skipped + count]

    def _between(self, first: int, count: int, shift: float) -> np.ndarray:
        """(4, count, b, 4 types) the cubics of intervals that begin `shift` spacings from the points."""
        whole = int(np.floor(shift + NEAR))
        share = max(shift - whole, 0.0) if shift - whole > NEAR else 0.0
        at = (first + whole + np.arange(count + 1)) % self.cubics.shape[1]
        c = self.cubics[:, at]
        if share == 0.0:
            return c[:, :count]
        value = c[0] + share * (c[1] + share * (c[2] + share * c[3]))
        slope = c[1] + share * (2 * c[2] + share * 3 * c[3])
        rise, (a, b) = np.diff(value, axis=0), (slope[:-1], slope[1:])
        return np.array([value[:-1], a, 3 * rise - 2 * a - b, a + b - 2 * rise])
