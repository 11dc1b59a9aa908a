"""Mutual inductance of two loops of straight filaments.

    two sides:  parallel  -->  closed form
                otherwise -->  Gauss along one, closed form along the other
    WireLoop, WireLoop  -->  sum over all pairs of sides  -->  M

Neumann: M = μ0/4π ΣΣ ∬ ds·ds'/r. Exact for parallel sides; the rest converges geometrically with `order`, the faster
the shorter the outer side compared with the distance. The closed form for inclined filaments is not used: it loses all
digits as the angle goes to zero, which is where a vehicle flies.
"""

from functools import cache
from math import isfinite, log

import casadi as ca
import numpy as np

from workbench.constants import MU_0
from workbench.errors import InputError
from workbench.physics.coils.loop import Vector, WireLoop

NEUMANN = MU_0 / (4 * ca.pi)  # [H/m]
SAME_DIRECTION = 1e-12  # sine of the angle below which rounding alone can have turned two numeric sides


def mutual_inductance(loop_a: WireLoop, loop_b: WireLoop, order: int = 8, panels: int = 1):
    """Mutual inductance of two loops of one turn each.

    Parameters
    ----------
    loop_a, loop_b : WireLoop
        Coordinates are numbers or SX; filaments must not overlap.
    order : int
        Gauss points on each side of `loop_a` (per panel) that is not parallel to the side of `loop_b` it meets.
    panels : int
        Equal parts into which such a side is cut first; 4 × 8 points give 1e-8 for 3 m sides 0.4 m apart.

    Returns
    -------
    float, or SX if a coordinate is one
        M [H]; positive when the flux of a current in one links the other in its own sense.

    Raises
    ------
    InputError
        If the numbers of points are not positive, or filaments overlap.

    Source: Neumann; report, Appendix A.1 (a); F. W. Grover, Inductance Calculations, ch. 7 for parallel filaments.

    Examples
    --------
    >>> coil = WireLoop.rectangle(0.5, 3.0)
    >>> print(f"{mutual_inductance(coil, coil.placed((0.0, 0.0, 0.6))):.6e} H")
    3.152073e-07 H
    """
    if order < 1 or panels < 1:
        raise InputError(
            f"order and panels must be at least 1; got {order!r} and {panels!r}. 8 and 1 suit coils half a width apart."
        )
    total = 0.0
    for start_a, side_a in zip(loop_a.vertices, loop_a.sides, strict=True):
        for start_b, side_b in zip(loop_b.vertices, loop_b.sides, strict=True):
            total = total + _pair(start_a, side_a, start_b, side_b, order, panels)
    if isinstance(total, float) and not isfinite(total):
        raise InputError("filaments of the two loops must not touch; at least one pair does. Move a loop.")
    return NEUMANN * total


def _pair(p0: Vector, p: Vector, q0: Vector, q: Vector, order: int, panels: int):
    """∬ ds·ds'/r of two sides [m]."""
    dot = _dot(p, q)
    scale = ca.sqrt(_dot(p, p) * _dot(q, q))
    if _vanishes(dot, scale):
        return 0.0
    if all(_vanishes(component, scale) for component in _cross(p, q)):
        return _parallel(p0, p, q0, q)
    return _inclined(p0, p, q0, q, order, panels)


def _parallel(p0: Vector, p: Vector, q0: Vector, q: Vector):
    """Closed form; s is the start of p measured along q from the start of q, d the distance of the two lines."""
    length = ca.sqrt(_dot(q, q))
    u = tuple(component / length for component in q)
    offset = _difference(p0, q0)
    s, reach, across = _dot(offset, u), _dot(p, u), _cross(offset, u)
    d = ca.sqrt(_dot(across, across))
    if isinstance(d, float) and d <= SAME_DIRECTION * length:
        return _collinear(s, reach, length)
    return (
        _antiderivative(s + reach, d)
        - _antiderivative(s, d)
        - _antiderivative(s + reach - length, d)
        + _antiderivative(s - length, d)
    )


def _antiderivative(u, d):
    """Twice integrated 1/√(u² + d²)."""
    return u * ca.asinh(u / d) - ca.sqrt(u * u + d * d)


def _collinear(s: float, reach: float, length: float) -> float:
    """The limit d → 0 of `_parallel` for two sides on one line."""
    near, far = sorted((s, s + reach))
    slack = 1e-9 * length
    if near < length - slack and far > slack:
        raise InputError("filaments of the two loops must not overlap; two sides lie upon each other. Move a loop.")

    def limit(u: float) -> float:
        return abs(u) * (log(abs(u)) - 1) if abs(u) > slack else 0.0

    return limit(s + reach) - limit(s) - limit(s + reach - length) + limit(s - length)


def _inclined(p0: Vector, p: Vector, q0: Vector, q: Vector, order: int, panels: int):
    """Gauss along p; along q the potential of a straight filament, 2 artanh(|q|/(R1 + R2))."""
    length = ca.sqrt(_dot(q, q))
    q1 = tuple(a + b for a, b in zip(q0, q, strict=True))
    t, weights = np.array(gauss_nodes(order, panels)).T
    points = tuple(b * t + a for a, b in zip(p0, p, strict=True))  # all nodes at once: arrays, or columns of symbols
    to_start, to_end = _difference(points, q0), _difference(points, q1)
    potential = ca.atanh(length / (ca.sqrt(_dot(to_start, to_start)) + ca.sqrt(_dot(to_end, to_end))))
    return 2 * _dot(p, q) / length * (potential.T @ weights)


@cache
def gauss_nodes(order: int, panels: int = 1) -> tuple[tuple[float, float], ...]:
    """Points and weights of Gauss–Legendre quadrature on [0, 1], cut into equal panels."""
    points, weights = np.polynomial.legendre.leggauss(order)
    return tuple(
        ((panel + (1 + point) / 2) / panels, weight / (2 * panels))
        for panel in range(panels)
        for point, weight in zip(points.tolist(), weights.tolist(), strict=True)
    )


def _vanishes(value, scale) -> bool:
    """Zero by construction (symbols) or to rounding (numbers): decides which formula is built, never a value."""
    if isinstance(value, ca.SX | ca.MX):
        return value.is_zero()
    return (isinstance(scale, float) and abs(value) <= SAME_DIRECTION * scale) or value == 0.0


def _dot(a: Vector, b: Vector):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _difference(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
