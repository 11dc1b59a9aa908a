"""The guideway a simulation runs along: drawn at random, or of known shape.

    Realisation, ShapedGuideway, Scaled  --inputs(positions, speed, time)-->  ζ, η of the coil sets

Every coil set meets the guideway at its own place, the rear ones later by the wheel base.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from workbench.errors import InputError
from workbench.physics.guideway.irregularity import Positions, leads, patterns
from workbench.physics.guideway.shape import Shape


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
