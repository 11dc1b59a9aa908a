"""Lift and drag of a rectangular coil flying at constant speed over a conducting plane.

    spectrum of the coil × exp(-2 k h) × reflection R(kx, ky, v)  -->  integral over kx, ky  -->  PlaneForces

Fourier integral by tensor Gauss quadrature, panels graded towards kx = 0, where R turns from 0 to 1 within kx ~ k w/v;
2e-9 of the value at the default order. Per ampere-turn squared. Heights and speeds are numbers; the derivative by
height comes along.
"""

import math
from dataclasses import dataclass
from functools import cache, lru_cache

import casadi as ca
import numpy as np

from workbench.coils.conductor import Conductor, reflection
from workbench.constants import MU_0
from workbench.errors import InputError
from workbench.result import Result, Row

GRADED_ACROSS = 2  # panels that shrink by thirds towards ky = 0, where k = √(kx² + ky²) has a corner
FAR = 11.0  # k h beyond which exp(-2 k h) < 3e-10 of the whole is left out


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PlaneForces(Result):
    """Forces of a coil over a plane at one height and speed.

    lift, drag, lift_infinite : [N/A²], positive up and backward; the last at infinite speed.
    by_height : (3,) their derivatives by height [N/A²/m].
    """

    height: float
    speed: float
    lift: float
    drag: float
    lift_infinite: float
    by_height: tuple[float, float, float]

    @property
    def lift_ratio(self) -> float:
        """f_L/f_L∞ [1]."""
        return self.lift / self.lift_infinite

    @property
    def drag_ratio(self) -> float:
        """f_D/f_L [1]."""
        return self.drag / self.lift

    @property
    def lift_to_drag(self) -> float:
        """f_L/f_D [1]."""
        return self.lift / self.drag

    @property
    def lift_ratio_by_height(self) -> float:
        """∂(f_L/f_L∞)/∂h [1/m]."""
        return (self.by_height[0] - self.lift_ratio * self.by_height[2]) / self.lift_infinite

    def rows(self) -> list[Row]:
        return [
            ("height", self.height, "m"),
            ("speed", self.speed, "m/s"),
            ("lift over lift at infinite speed", self.lift_ratio, ""),
            ("lift over drag", self.lift_to_drag, ""),
            ("lift", self.lift * 1e6, "N/kA²"),
            ("drag", self.drag * 1e6, "N/kA²"),
        ]


@lru_cache(maxsize=4096)
def plane_forces(
    width: float, length: float, height: float, speed: float, conductor: Conductor, order: int = 8
) -> PlaneForces:
    """Lift and drag of a rectangular coil over an endless plate.

    Parameters
    ----------
    width, length : float
        Coil across and along the track [m].
    height : float
        Coil plane above the surface [m].
    speed : float
        [m/s], positive.
    conductor : Conductor
    order : int
        Gauss points per panel along kx (two fewer across, two more in the graded part): 6 gives 4e-6, 8 gives 2e-9.

    Returns
    -------
    PlaneForces

    Raises
    ------
    InputError
        If a length or the speed is not positive and finite.

    Source: report, A.1 (c), references A-1 and A-2: F_L - i F_D = μ0 I²/2 ∬ dkx dky/(2π)² k ψ² exp(-2kh) (k Re R - i
    kx Im R).

    Examples
    --------
    >>> thin = Conductor(thickness=0.0254, conductivity=3.422e7, model="thin")
    >>> over = plane_forces(0.5, 3.0, 0.3, 134.0, thin)
    >>> print(f"{over.lift_to_drag:.3f}")  # mu_0 sigma t v / 2, whatever the coil
    73.181
    """
    for name, value, unit in (
        ("width", width, "m"),
        ("length", length, "m"),
        ("height", height, "m"),
        ("speed", speed, "m/s"),
    ):
        if not 0 < value < math.inf:
            raise InputError(f"the coil's {name} must be positive and finite; got {value!r} {unit}. Give SI units.")
    if order < 4:
        raise InputError(f"order must be at least 4; got {order!r}. 8 gives nine digits.")
    kx, ky, weight = _nodes(width, length, height, order)
    densities = _integrand(conductor.model).map(len(weight))
    values = densities(kx, ky, width, length, height, speed, conductor.thickness, conductor.conductivity)
    lift, drag, infinite, *slopes = (float(value) for value in values.full() @ weight)
    return PlaneForces(
        height=height,
        speed=speed,
        lift=lift,
        drag=drag,
        lift_infinite=infinite,
        by_height=(slopes[0], slopes[1], slopes[2]),
    )


@cache
def _integrand(model: str) -> ca.Function:
    """Lift, drag, lift at v = ∞ per dkx dky in the quadrant kx, ky > 0, and their derivatives by height."""
    kx, ky, width, length, height, speed, thickness, conductivity = inputs = [ca.SX.sym(n) for n in "xyABhvts"]
    k = ca.sqrt(kx**2 + ky**2)
    spectrum = (2 * ca.sin(kx * length / 2) / kx) ** 2 * (2 * ca.sin(ky * width / 2) / ky) ** 2
    density = 4 * MU_0 / 2 / (2 * ca.pi) ** 2 * k * spectrum * ca.exp(-2 * k * height)
    lifting, dragging = reflection(kx, ky, speed, thickness, conductivity, model)
    values = density * ca.vertcat(k * lifting, kx * dragging, k)
    return ca.Function("plane_forces", inputs, [ca.vertcat(values, ca.jacobian(values, height))], {"cse": True})


@lru_cache(maxsize=32)
def _nodes(width: float, length: float, height: float, order: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Quadrature points (1, n), (1, n) and weights (n,) of the quadrant.

    Panels along kx: 6/length wide, the first half panel cut geometrically from 2e-5/m. Across: as narrow as the coil's
    side lobes or the decay with height ask for.
    """
    end = FAR / height
    seam = 3 / length
    graded = np.concatenate([[0.0], np.geomspace(min(2e-5, seam / 10), seam, order + 3)])
    even = np.linspace(seam, max(end, 2 * seam), 1 + math.ceil(max(end - seam, seam) * length / 6))
    step = end / math.ceil(end / min(4 / width, 1.2 / height))
    first = step / 3.0 ** np.arange(GRADED_ACROSS, 0, -1)
    across = np.concatenate([[0.0], first, np.arange(1, round(end / step) + 1) * step])
    x, wx = (np.concatenate(pair) for pair in zip(_panels(graded, order + 2), _panels(even, order), strict=True))
    y, wy = _panels(across, order - 2)
    return np.repeat(x, len(y))[None, :], np.tile(y, len(x))[None, :], np.outer(wx, wy).ravel()


def _panels(edges: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
    points, weights = np.polynomial.legendre.leggauss(order)
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (1 + points)).ravel(), (half * weights).ravel()
