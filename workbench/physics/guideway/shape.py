"""Guideways of known shape: heights h(x) [m] along the distance x [m], upward (or, for a wall, outward) positive.

    sagging girders   joint steps   ramps   single bumps   --Superposition--> one profile

`height` takes a number, an array, DM, or an SX/MX symbol, elementwise, so that a profile can stand inside a model.
Shapes are felt at points: a coil a few metres long averages what is shorter than itself, so shapes shorter than a
coil are felt too strongly here. All are small against the gap and of small slope, as the linear model demands; a
slope above 1/20 is refused.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Literal, Protocol

import casadi as ca
import numpy as np

from workbench.errors import InputError

SLOPE_MAX = 0.05  # 3°: 1 - cos of it is 1.2e-3, below what the linear kinematics neglect elsewhere


class Shape(Protocol):
    """A height along the guideway."""

    def height(self, distance) -> Any:
        """Height [m] at a distance [m], elementwise."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class GirderSpans:
    """Equal simply supported girders that hang between their piers, without end.

    profile "uniform_load": the static deflection 16/5 (ξ − 2ξ³ + ξ⁴) of a beam under its own weight, kinked at the
    piers; profile "sine": sin πξ, the first bending mode; ξ is the place in the span, 0…1.
    """

    span: float  # L [m]
    sag: float  # at midspan, downward [m]; negative: camber
    start: float = 0.0  # place of a pier [m]
    profile: Literal["uniform_load", "sine"] = "uniform_load"

    def __post_init__(self) -> None:
        _positive("GirderSpans.span", self.span)
        if self.profile not in ("uniform_load", "sine"):
            raise InputError(f"profile must be 'uniform_load' or 'sine'; got {self.profile!r}. Use 'uniform_load'.")
        _gentle("GirderSpans", (3.2 if self.profile == "uniform_load" else np.pi) * self.sag / self.span)

    def height(self, distance):
        """−sag times the profile at the place in its span, elementwise."""
        return _elementwise(self, distance)

    def _formula(self, x):
        xi = (x - self.start) / self.span
        xi = xi - ca.floor(xi)
        if self.profile == "sine":
            return -self.sag * ca.sin(np.pi * xi)
        return -self.sag * 3.2 * xi * (1 - 2 * xi**2 + xi**3)

    def harmonics(self, count: int) -> tuple[float, np.ndarray]:
        """Fourier series of the height about a pier: mean [m] and cosine amplitudes (count,) at wavelengths L/n [m].

        height(x) = mean + Σ_n c_n cos(2πn (x − start)/L). Each line can be a `Wave` of type A1.
        """
        k = 2 * np.pi * np.arange(1, count + 1)
        if self.profile == "sine":
            return -self.sag * 2 / np.pi, self.sag * 4 / np.pi / ((k / np.pi) ** 2 - 1)
        return -self.sag * 0.64, self.sag * 2 * (6.4 / k**2 + 76.8 / k**4)


@dataclass(frozen=True, slots=True, kw_only=True)
class JointSteps:
    """Sudden changes of height at joints; between them the guideway is level. At a joint the new height holds.

    A step excites every frequency: peak accelerations need the coil's own length, which smooths it over length/V; the
    mean squares of a point model grow with its bandwidth.
    """

    places: tuple[float, ...]  # (k,) [m]
    steps: tuple[float, ...]  # (k,) [m], upward

    def __post_init__(self) -> None:
        count = len(self.places)
        if not 0 < count == len(self.steps) or not np.all(np.isfinite([*self.places, *self.steps])):
            raise InputError(
                f"JointSteps needs one finite step per joint; got {count} places and {len(self.steps)} steps. "
                "Give equally many, in metres."
            )

    def height(self, distance):
        """Sum of the steps passed, elementwise."""
        return _elementwise(self, distance)

    def _formula(self, x):
        return sum(step * (x >= place) for place, step in zip(self.places, self.steps, strict=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class Ramp:
    """A rise from level to level: straight with two kinks, or a half cosine without kinks."""

    start: float  # [m]
    length: float  # [m]
    rise: float  # [m]
    profile: Literal["straight", "cosine"] = "straight"

    def __post_init__(self) -> None:
        _positive("Ramp.length", self.length)
        if self.profile not in ("straight", "cosine"):
            raise InputError(f"profile must be 'straight' or 'cosine'; got {self.profile!r}. Use 'straight'.")
        _gentle("Ramp", (1 if self.profile == "straight" else np.pi / 2) * self.rise / self.length)

    def height(self, distance):
        """0 before, rise after, elementwise."""
        return _elementwise(self, distance)

    def _formula(self, x):
        xi = ca.fmin(ca.fmax((x - self.start) / self.length, 0), 1)
        return self.rise * (xi if self.profile == "straight" else (1 - ca.cos(np.pi * xi)) / 2)


@dataclass(frozen=True, slots=True, kw_only=True)
class VersineBump:
    """One bump (or dip, with negative height) h/2 (1 − cos 2πξ), smooth in height and slope.

    Examples
    --------
    >>> bump = VersineBump(start=10.0, length=4.0, peak=0.02)
    >>> [round(float(bump.height(x)), 6) for x in (9.0, 11.0, 12.0, 20.0)]
    [0.0, 0.01, 0.02, 0.0]
    """

    start: float  # [m]
    length: float  # [m]
    peak: float  # h [m]

    def __post_init__(self) -> None:
        _positive("VersineBump.length", self.length)
        _gentle("VersineBump", np.pi * self.peak / self.length)

    def height(self, distance):
        """The bump between start and start + length, 0 elsewhere, elementwise."""
        return _elementwise(self, distance)

    def _formula(self, x):
        xi = ca.fmin(ca.fmax((x - self.start) / self.length, 0), 1)
        return self.peak / 2 * (1 - ca.cos(2 * np.pi * xi))


@dataclass(frozen=True, slots=True)
class Superposition:
    """Several shapes, one on top of the other."""

    shapes: tuple[Shape, ...]

    def __post_init__(self) -> None:
        if not self.shapes:
            raise InputError("a Superposition needs at least one shape; got none. Leave it out for a smooth guideway.")

    def height(self, distance):
        """Sum of the heights, elementwise."""
        return sum(shape.height(distance) for shape in self.shapes)


def _elementwise(shape, distance):
    """The shape's formula: on CasADi values as it stands, on numbers through its compiled function."""
    if isinstance(distance, ca.SX | ca.MX | ca.DM):
        return shape._formula(distance)
    x = np.asarray(distance, float)
    if not np.all(np.isfinite(x)):
        raise InputError(f"distance must be finite [m]; got {distance!r}. Give metres along the guideway.")
    heights = _compiled(shape)(x.reshape(1, -1)).full().reshape(x.shape)
    return float(heights) if x.ndim == 0 else heights


@lru_cache(maxsize=64)
def _compiled(shape) -> ca.Function:
    symbol = ca.SX.sym("x")
    return ca.Function("height", [symbol], [shape._formula(symbol)])


def _positive(name: str, value: float) -> None:
    if not 0 < value < np.inf:
        raise InputError(f"{name} must be positive and finite [m]; got {value!r}. Give metres.")


def _gentle(name: str, slope: float) -> None:
    if not abs(slope) <= SLOPE_MAX:
        raise InputError(
            f"{name} must not be steeper than {SLOPE_MAX:g}; got a slope of {slope:.3g}. Make it longer or lower: "
            "the linear model holds for gentle guideways."
        )
