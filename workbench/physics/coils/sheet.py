"""Lift and drag of a rectangular coil flying at constant speed over a conducting plane.

    spectrum of the coil × exp(-2 k h) × reflection R(kx, ky, v)  -->  integral over kx, ky  -->  PlaneForces

Fourier integral by a product of Gauss rules over panels that double from zero on, the waves of the coil's spectrum
integrated exactly: the nodes number as the square of the logarithm of length over height, so a coil close to the plate
costs no more memory than one far off. Per ampere-turn squared. Heights and speeds are numbers; the derivative by height
comes along.
"""

import math
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import pairwise

import casadi as ca
import numpy as np

from workbench.constants import MU_0
from workbench.errors import InputError
from workbench.physics.coils.conductor import Conductor, reflection
from workbench.result import Result, Row

ORDERS = (6, 10, 14, 18, 22)  # nodes per panel, tried in turn
BLOCK = 20_000  # nodes evaluated together: a few megabytes, and an interrupt is heard between two
LOWEST = 1e-2  # first edge over 1/side: below, the spectrum is constant and a corner holds 1e-4 of the whole
SHARP = 0.6  # first edge over w/v, of 1/side: how near zero R turns from 0 to 1
WIDEST = 1.2  # of 1/height, of a panel: exp(−2kh) falls by a tenth within
WAVE = 1.5  # side × half a panel beyond which the spectrum waves within it
FARTHEST = 1e9  # between the smallest and the largest size: forty panels
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
    width: float, length: float, height: float, speed: float, conductor: Conductor, accuracy: float = 1e-9
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
    accuracy : float
        Of the quadrature, relative to each value; more nodes are taken until it is reached.

    Raises
    ------
    InputError
        If a length or the speed is not positive and finite, or the accuracy is not reached.

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
    shortest, longest = min(width, length), max(width, length, height)
    if not min(shortest, height) > longest / FARTHEST:
        raise InputError(
            f"width, length and height must lie within a factor {FARTHEST:g} of each other; got {width:g}, {length:g} "
            f"and {height:g} m. Check their units."
        )
    if not 1e-12 <= accuracy < 1:
        raise InputError(f"accuracy must lie between 1e-12 and 1; got {accuracy!r}. 1e-9 gives nine digits.")
    before = _integral(width, length, height, speed, conductor, ORDERS[0])
    for fewer, order in pairwise(ORDERS):
        values = _integral(width, length, height, speed, conductor, order)
        apart = float(np.max(np.abs(values - before) / np.abs(values)))
        # Gauss rules converge geometrically: ε(n) = ρ⁻ⁿ, so ε(order) = ε(fewer)^(order/fewer)
        if apart ** (order / fewer) <= accuracy:
            break
        before = values
    else:
        raise InputError(
            f"lift and drag over the plate must be integrated to {accuracy:g}; at a height of {height:g} m and "
            f"{speed:g} m/s the last two rules differ by {apart:.1g}. Ask for less, or give sizes nearer to each other."
        )
    lift, drag, infinite, *slopes = values.tolist()
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
    """Lift, drag, lift at v = ∞ per dkx dky in the quadrant kx, ky > 0, and their derivatives by height; all but for
    the coil's spectrum."""
    kx, ky, height, speed, thickness, conductivity = inputs = [ca.SX.sym(n) for n in "xyhvts"]
    k = ca.sqrt(kx**2 + ky**2)
    density = 4 * MU_0 / 2 / (2 * ca.pi) ** 2 * k * ca.exp(-2 * k * height)
    lifting, dragging = reflection(kx, ky, speed, thickness, conductivity, model)
    values = density * ca.vertcat(k * lifting, kx * dragging, k)
    return ca.Function("plane_forces", inputs, [ca.vertcat(values, ca.jacobian(values, height))], {"cse": True})


def _integral(width: float, length: float, height: float, speed: float, conductor: Conductor, order: int) -> np.ndarray:
    """Lift, drag, lift at v = ∞ and their derivatives by height (6,), with so many nodes per panel; block by block."""
    lowest = min(LOWEST, SHARP * conductor.characteristic_speed / speed)
    kx, wx = _axis(length, height, order, lowest)
    ky, wy = _axis(width, height, order, LOWEST)
    rows = max(1, BLOCK // len(ky))
    function, total = _integrand(conductor.model), np.zeros(6)
    for start in range(0, len(kx), rows):
        part, weight = kx[start : start + rows], wx[start : start + rows]
        x, y = np.repeat(part, len(ky))[None, :], np.tile(ky, len(part))[None, :]
        values = function.map(x.size)(x, y, height, speed, conductor.thickness, conductor.conductivity).full()
        total += values @ np.outer(weight, wy).ravel()
    return total


def _axis(side: float, height: float, order: int, lowest: float) -> tuple[np.ndarray, np.ndarray]:
    """Nodes k and weights, (n,) each, of ∫ (2 sin(k·side/2)/k)² f(k) dk from 0 to FAR/height, for smooth f.

    Panels double from lowest/side, below which f has corners, up to the reach of exp(−2kh). Where the
    spectrum, 2 (1 − cos(k·side))/k², waves within a panel it is integrated exactly against the Legendre polynomials
    through the nodes (Filon): ∫ P_n(t) cos(c + ωt) dt = Re 2 iⁿ e^{ic} j_n(ω). So the nodes number as the logarithm of
    the gap.
    """
    from scipy.special import spherical_jn

    end = FAR / height
    edges = [0.0, lowest * min(1 / side, end)]
    while edges[-1] < end:
        edges.append(min(end, 2 * edges[-1], edges[-1] + WIDEST / height))
    low, high = np.array(edges[:-1])[:, None], np.array(edges[1:])[:, None]
    t, w = np.polynomial.legendre.leggauss(order)
    middle, half = (high + low) / 2, (high - low) / 2
    k, weight, n = middle + half * t, half * w, np.arange(order)
    resolved = weight * (side * np.sinc(k * side / (2 * np.pi))) ** 2
    moments = 2 * np.real(np.exp(1j * side * middle) * 1j**n * spherical_jn(n, side * half))  # (panel, n)
    onto = np.polynomial.legendre.legvander(t, order - 1) * (2 * n + 1) / 2  # (node, n)
    averaged = 2 * weight * (1 - moments @ onto.T) / k**2
    return k.ravel(), np.where(side * half > WAVE, averaged, resolved).ravel()
