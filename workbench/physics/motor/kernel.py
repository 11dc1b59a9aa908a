"""One plane wave of the winding's field through a tilted rectangle, and the sum of such waves with its derivatives.

    field of a row = Σ_m ∫ e^{K·r}  --flux through a rectangle-->  M_m, ∂M_m, ∂∂M_m by the rectangle's place and edges

With κ = mπ/pole pitch, K = (i kx, −g, iκ), g² = kx² + κ², edges e1 (across) and e2 (along), area vector S = e2 × e1:

    M_m = μ0/2 · c_m ∫ dkx/2π · 2 sin(kx w/2)/kx · (−K·S) · e^{K·r} · sinhc(K·e1/2) sinhc(K·e2/2)

is exact for an endless row of rectangles (w wide, l long, c_m = 4 sin(κl/2)/mπ) and a rectangle in any pose above it.
The substitution kx = κ sinh t makes the integrand entire and doubly exponentially small, so the trapezoidal rule
converges geometrically: its error falls as e^{−2πβ/h}, where β is the widest strip |Im t| < β in which no product of
edges makes the wave grow, tan β = (height)/(lateral distance) of the worst pair of a winding and a coil edge. Step and
range follow from that (`quadrature`). One wave is one small CasADi function; the sum over waves is its map.

A wave depends on the rectangle only through K·r, K·e1, K·e2 and K·S, and K is a constant. So the derivatives by the
twelve numbers (r, e1, e2, S) are those by four complex numbers times K and K Kᵀ; what a pose, a pivot or a vehicle does
to the twelve numbers is differentiated once, after the sum (`pose.py`, `hybrid.py`).
"""

from functools import cache

import casadi as ca
import numpy as np

from workbench.constants import MU_0
from workbench.errors import InputError
from workbench.physics.motor.winding import Winding

ACCURACY = 1e-9  # of the quadrature, relative to a centred coil at the same height; costs as its logarithm squared
CLEARANCE = 0.005  # [m] least height of a corner: a filament stands for a conductor at least that thick
BLEND = 0.05  # radius around 0 inside which sinhc is its series; see `sinhc`
LAST = 1e-12  # a harmonic this small against the fundamental is the last


def wave_sums(geometry: np.ndarray, winding: Winding, harmonic: int, order: int, accuracy: float = ACCURACY):
    """M_m of k rectangles and its derivatives by place, edges and area vector.

    Parameters
    ----------
    geometry : (12, k)
        Columns r, e1 (across), e2 (along), S = e2 × e1 in the winding's axes [m, m, m, m²].
    winding : Winding
    harmonic : int
        m, odd and positive: an alternating row has no even harmonics.
    order : int
        0, 1 or 2: highest derivative.
    accuracy : float
        Of the quadrature.

    Returns
    -------
    list of DM
        Real part above or beside imaginary part, one block of columns for each rectangle: (2, k) M_m [H];
        (12, 2k) gradient; (12, 24k) Hessian; the first `order` + 1 of them.

    Raises
    ------
    InputError
        If a corner is lower than 5 mm, the harmonic is even or the accuracy out of reach.

    Source: report, Appendix F, eqs. (25) and (26); the formula is the module's head.
    """
    if harmonic < 1 or harmonic % 2 == 0:
        raise InputError(f"the harmonic must be odd and positive; got {harmonic!r}. An alternating row has no others.")
    columns = _waves(geometry, winding, harmonic, accuracy)
    return _sum(order, columns.shape[1]).call([ca.DM(geometry), ca.DM(columns)])


def plane_wave(kx, g, kappa, strength, geometry, order: int = 0):
    """Flux, strength·(−K·S) e^{K·r} sinhc(K·e1/2) sinhc(K·e2/2), of a plane wave through a rectangle.

    Parameters
    ----------
    kx, g, kappa : scalar or SX
        Wave numbers [rad/m], g² = kx² + κ².
    strength : scalar or SX
        [H/m] for a result in henry.
    geometry : (12,) DM or SX
        r, e1, e2, S.
    order : int
        Highest derivative by `geometry`.

    Returns
    -------
    list of (real, imaginary)
        Scalar flux; (12,) gradient; (12, 12) Hessian.
    """
    K = ((0.0, kx), (-g, 0.0), (0.0, kappa))

    def project(vector):  # K·vector, complex
        return K[1][0] * vector[1], K[0][1] * vector[0] + K[2][1] * vector[2]

    decay, phase = project(geometry[:3])
    flat = project(geometry[9:])
    one, two = (sinhc_jet(*project(edge / 2), order) for edge in (geometry[3:6], geometry[6:9]))
    size = strength * ca.exp(decay)
    E = (-size * ca.cos(phase), -size * ca.sin(phase))
    sE = _times(flat, E)
    W = _times(sE, _times(one[0], two[0]))
    if order == 0:
        return [W]
    W_1, W_2 = _half(_times(sE, _times(one[1], two[0]))), _half(_times(sE, _times(one[0], two[1])))
    W_S = _times(E, _times(one[0], two[0]))
    first = (W, W_1, W_2, W_S)  # by K·r, K·e1, K·e2, K·S
    rows = [_times(K[i], part) for part in first for i in range(3)]
    gradient = tuple(ca.vertcat(*(row[side] for row in rows)) for side in (0, 1))
    if order == 1:
        return [W, gradient]
    W_11, W_22 = (_half(_half(_times(sE, _times(a, b)))) for a, b in ((one[2], two[0]), (one[0], two[2])))
    W_12 = _half(_half(_times(sE, _times(one[1], two[1]))))
    W_1S, W_2S = (_half(_times(E, _times(a, b))) for a, b in ((one[1], two[0]), (one[0], two[1])))
    second = (first, (W_1, W_11, W_12, W_1S), (W_2, W_12, W_22, W_2S), (W_S, W_1S, W_2S, (0.0, 0.0)))
    KK = [[_times(a, b) for b in K] for a in K]
    blocks = [[_times(KK[i][j], second[p][q]) for q in range(4) for j in range(3)] for p in range(4) for i in range(3)]
    hessian = tuple(ca.vertcat(*(ca.horzcat(*(entry[side] for entry in row)) for row in blocks)) for side in (0, 1))
    return [W, gradient, hessian]


def sinhc(real, imaginary):
    """sinh(a)/a of a = real + i·imaginary, smooth through a = 0 and good everywhere; scalar or SX.

    (|a|⁴ a* sinh a + b⁶ P(a)) / (|a|⁶ + b⁶) with P = 1 + a²/6 + a⁴/120 and b = 0.05: a weighted mean of the quotient
    and its series. No branch, so every derivative exists and is the derivative of what is computed. The weight of the
    series falls as (b/|a|)⁶ while its error grows as |a|⁶/5040, so values are good to b⁶/5040 = 3e-12 near 0 and to
    b⁶/120 = 1.3e-10 of 1/a² further out; second derivatives are good to 1e-7 in the ring |a| ≈ b, where one wave in
    hundreds may fall.
    """
    sinh = (ca.sinh(real) * ca.cos(imaginary), ca.cosh(real) * ca.sin(imaginary))
    square = _times((real, imaginary), (real, imaginary))
    fourth = _times(square, square)
    size = real * real + imaginary * imaginary
    turned = _times(sinh, (real, -imaginary))
    weight = BLEND**6
    total = size**3 + weight
    return (
        (size**2 * turned[0] + weight * (1 + square[0] / 6 + fourth[0] / 120)) / total,
        (size**2 * turned[1] + weight * (square[1] / 6 + fourth[1] / 120)) / total,
    )


def sinhc_jet(real, imaginary, order: int):
    """sinhc and its first `order` complex derivatives, each (real, imaginary); d/da = ∂/∂(real a) of both parts."""
    parts = _sinhc_jet(order)(real, imaginary)
    parts = parts if isinstance(parts, tuple) else (parts,)
    return [(part[0], part[1]) for part in parts]


@cache
def _sinhc_jet(order: int) -> ca.Function:
    real, imaginary = ca.SX.sym("real"), ca.SX.sym("imaginary")
    parts = [ca.vertcat(*sinhc(real, imaginary))]
    for _ in range(order):
        parts.append(ca.jacobian(parts[-1], real))
    return ca.Function("sinhc_jet", [real, imaginary], parts)


def quadrature(lowest, lateral, kappa: float, width: float, accuracy: float) -> tuple[np.ndarray, float]:
    """Nodes t and step of the trapezoidal rule, half a step off 0.

    Parameters
    ----------
    lowest, lateral : (k,) ndarray
        Height of each coil's lowest corner and distance of its outermost one from the row's middle [m]; the worst
        decides.
    kappa, width : float
        mπ/pole pitch [rad/m], width of the winding [m].
    accuracy : float
        Step: 2πβ/h = ln(1/accuracy) + κy, because at the edge of the strip the wave has lost its decay e^{−κy}. Range:
        until e^{−κ y cosh t} has fallen by `accuracy` from its largest value, with two more decades for the powers of
        the wave number that derivatives bring.
    """
    digits = np.log(1 / accuracy)
    strip = np.arctan2(lowest, lateral + width / 2).min()
    step = 2 * np.pi * strip / (digits + kappa * lowest.max())
    reach = np.arccosh(1 + (digits + 2 * np.log(10)) / (kappa * lowest.min()))
    half = 4 * int(np.ceil(reach / step / 4))  # in steps of 4: fewer compiled sizes
    return (np.arange(-half, half) + 0.5) * step, step


def harmonics(geometry: np.ndarray, winding: Winding) -> tuple[int, ...]:
    """The odd harmonics that reach the lowest corner with more than `LAST` of the fundamental's strength."""
    lowest = _extent(geometry, 1, -1).min()
    highest = 1 + np.log(1 / LAST) / (winding.wave_number * max(lowest, CLEARANCE))
    return tuple(range(1, int(highest) + 1, 2))


def _waves(geometry: np.ndarray, winding: Winding, harmonic: int, accuracy: float) -> np.ndarray:
    """Every plane wave of the sum: rows kx, g, κ and strength, filaments summed; (4, n)."""
    if not 1e-14 <= accuracy <= 1e-2:
        raise InputError(f"accuracy must lie between 1e-14 and 1e-2; got {accuracy!r}. Leave it out for 1e-9.")
    lowest = _extent(geometry, 1, -1)
    if not lowest.min() >= CLEARANCE:
        raise InputError(
            f"every corner of the coil must clear the winding by {CLEARANCE * 1e3:.0f} mm; the lowest is at "
            f"y = {lowest.min():.4g} m. Raise the coil (y) or turn it less (pitch, roll)."
        )
    lateral = np.maximum(_extent(geometry, 0, 1), -_extent(geometry, 0, -1))
    kappa = harmonic * winding.wave_number
    t, step = quadrature(lowest, lateral, kappa, winding.width, accuracy)
    kx, g = kappa * np.sinh(t), kappa * np.cosh(t)
    inset, depth = np.array(winding.filaments).T[:, :, None]
    along = 4 * np.sin(kappa * (winding.length / 2 - inset)) / (np.pi * harmonic)  # c_m
    across = 2 * np.sin(kx * (winding.width / 2 - inset)) / kx
    row = np.mean(along * across * np.exp(-g * depth), axis=0)
    return np.stack([kx, g, np.full_like(t, kappa), MU_0 / 2 * row * g * step / (2 * np.pi)])  # g dt = dkx


def _extent(geometry: np.ndarray, axis: int, sign: int) -> np.ndarray:
    """(k,) largest (+1) or smallest (−1) coordinate of the corners along an axis [m]."""
    return geometry[axis] + sign * (np.abs(geometry[3 + axis]) + np.abs(geometry[6 + axis])) / 2


@cache
def _sum(order: int, count: int) -> ca.Function:
    """The wave summed over `count` columns."""
    wave = _wave(order)
    return wave.map(f"wave_sum_{order}_{count}", "serial", count, [0], list(range(wave.n_out())))


@cache
def _wave(order: int) -> ca.Function:
    """One wave: (12,) geometry, (4,) column -> (2,) value, (12, 2) gradient, (12, 24) Hessian."""
    geometry, column = ca.SX.sym("geometry", 12), ca.SX.sym("column", 4)
    kx, g, kappa, strength = ca.vertsplit(column)
    parts = plane_wave(kx, g, kappa, strength, geometry, order)
    outputs = [ca.vertcat(*parts[0]), *(ca.horzcat(*part) for part in parts[1:])]
    return ca.Function("wave", [geometry, column], outputs, {"cse": True})


def _times(a, b):
    """Product of two complex numbers (real, imaginary)."""
    return a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]


def _half(a):
    return a[0] / 2, a[1] / 2
