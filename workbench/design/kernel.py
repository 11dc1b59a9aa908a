"""One frequency of one group's closed loop, with exact derivatives by the seventeen parameters.

    parameters, ω, plant at jω --law--> K(jω) --> S = (I − K G)⁻¹ --> commands --> |outputs|², largest σ(S)²

The plant enters as numbers, so one compiled kernel serves every vehicle, speed and mass of the same structure. Complex
matrices are pairs (real, imaginary) of SX. Sign: the law's matrices already hold the minus of the feedback.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from workbench.control import filters
from workbench.control.gains import GAIN_NAMES
from workbench.control.law import VERTICAL_CHANNELS, modal_factors
from workbench.design.compiled import compile_function
from workbench.errors import InputError

EQUAL_SINGULAR_VALUES = 1e-12  # keeps the square root differentiable where both singular values of S meet


@dataclass(frozen=True, slots=True)
class Shape:
    """What fixes the kernel's code: the group's channels, number of patterns, irregularity types and output rows."""

    channels: tuple[int, ...]
    patterns: int
    types: int
    rows: tuple[int, ...]  # output rows in each class of outputs; squared moduli add within a class

    @property
    def signals(self) -> int:
        """Modal signals: gap and acceleration of each channel."""
        return 2 * len(self.channels)


class Complex:
    """A complex SX matrix as its real and imaginary parts."""

    __slots__ = ("im", "re")

    def __init__(self, re, im) -> None:
        self.re, self.im = re, im

    def __matmul__(self, other: "Complex") -> "Complex":
        return Complex(
            ca.mtimes(self.re, other.re) - ca.mtimes(self.im, other.im),
            ca.mtimes(self.re, other.im) + ca.mtimes(self.im, other.re),
        )

    def __add__(self, other: "Complex") -> "Complex":
        return Complex(self.re + other.re, self.im + other.im)

    def scaled(self, other: "Complex") -> "Complex":
        """Product with a complex scalar."""
        return Complex(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)

    def squared(self):
        """|entry|², elementwise."""
        return self.re**2 + self.im**2


def _inverse(M: Complex) -> tuple[Complex, Complex]:
    """Inverse and determinant of a 1×1 or 2×2 complex matrix."""
    if M.re.shape == (1, 1):
        det, adjugate = M, Complex(ca.SX(1), ca.SX(0))
    else:
        a, b, c, d = (Complex(M.re[i, j], M.im[i, j]) for i in (0, 1) for j in (0, 1))
        ad, bc = a.scaled(d), b.scaled(c)
        det = Complex(ad.re - bc.re, ad.im - bc.im)
        adjugate = Complex(
            ca.vertcat(ca.horzcat(d.re, -b.re), ca.horzcat(-c.re, a.re)),
            ca.vertcat(ca.horzcat(d.im, -b.im), ca.horzcat(-c.im, a.im)),
        )
    size = det.squared()
    return adjugate.scaled(Complex(det.re / size, -det.im / size)), det


@lru_cache(maxsize=32)
def kernel(shape: Shape) -> ca.Function:
    """Function (theta (17), omega, plant (q)) -> (values (classes + 1), jacobian (classes + 1, 17)).

    values: Σ|output|² of each class (a density where W and Zw carry √density), then σ_max(S)². `plant` is laid out by `plant_column`.
    """
    if shape.patterns > 2:
        raise InputError(f"a design works on groups with one or two current patterns; got {shape.patterns}. Use the two groups of motion.")
    k, m, t, r, c = shape.patterns, shape.signals, shape.types, sum(shape.rows), len(shape.channels)
    theta, omega = ca.SX.sym("theta", len(GAIN_NAMES)), ca.SX.sym("omega")
    sizes = {"G": (m, k), "W": (m, t), "Zw": (r, t), "Zu": (r, k)}
    columns = ca.SX.sym("columns", k, c)  # patterns' · command per unit of each filtered modal signal, before its gain
    parts = {name: Complex(ca.SX.sym(f"{name}_re", *size), ca.SX.sym(f"{name}_im", *size)) for name, size in sizes.items()}
    plant = ca.vertcat(ca.vec(columns), *(ca.vec(part) for p in parts.values() for part in (p.re, p.im)))

    K = _law(theta, omega, columns, shape.channels)
    loop = K @ parts["G"]
    S, det = _inverse(Complex(ca.SX.eye(k) - loop.re, -loop.im))
    outputs = parts["Zw"] + parts["Zu"] @ (S @ (K @ parts["W"]))
    squares = ca.sum2(outputs.squared())
    ends = np.cumsum((0, *shape.rows))
    classes = [ca.sum1(squares[int(a) : int(b)]) for a, b in zip(ends[:-1], ends[1:], strict=True)]
    total = ca.sum1(ca.sum2(S.squared()))
    if k == 1:
        peak = total
    else:  # σ_max² of a 2×2 matrix from its Frobenius norm and determinant, |det S| = 1/|det S⁻¹|
        peak = (total + ca.sqrt(total**2 - 4 / det.squared() + EQUAL_SINGULAR_VALUES)) / 2
    values = ca.vertcat(*classes, peak)
    name = f"loop_{'_'.join(map(str, shape.channels))}_{k}_{t}_{'_'.join(map(str, shape.rows))}"
    function = ca.Function(name, [theta, omega, plant], ca.cse([values, ca.densify(ca.jacobian(values, theta))]))
    return compile_function(function)


def plant_column(columns: np.ndarray, G: np.ndarray, W: np.ndarray, Zw: np.ndarray, Zu: np.ndarray) -> np.ndarray:
    """The kernel's plant argument at one frequency, from real `columns` (k, c) and complex G, W, Zw, Zu."""
    parts = [np.ravel(columns, "F")]
    for matrix in (G, W, Zw, Zu):
        parts += [np.ravel(matrix.real, "F"), np.ravel(matrix.imag, "F")]
    return np.concatenate(parts)


def _law(theta, omega, columns, channels: Sequence[int]) -> Complex:
    """K(jω) from the group's modal signals (gaps, then accelerations) to its pattern commands."""
    g = dict(zip(GAIN_NAMES, ca.vertsplit(theta), strict=True))
    factors = modal_factors(theta)
    gap, acceleration = [], []
    for channel in channels:
        if channel < VERTICAL_CHANNELS:
            gap.append(filters.gap_response(g["K_h"], g["K_hdot"], g["tau_h"], omega))
            acceleration.append(filters.acceleration_response(g["K_zddot"], g["K_zdot"], g["tau_z"], omega))
        else:
            gap.append(filters.gap_response(g["K_hp"], g["K_hpdot"], g["tau_hp"], omega))
            acceleration.append(filters.acceleration_response(g["K_yddot"], g["K_ydot"], g["tau_y"], omega))
    weighted = ca.mtimes(columns, ca.diag(ca.vertcat(*(factors[k] for k in channels))))
    real = [ca.mtimes(weighted, ca.diag(ca.vertcat(*(h[0] for h in part)))) for part in (gap, acceleration)]
    imaginary = [ca.mtimes(weighted, ca.diag(ca.vertcat(*(h[1] for h in part)))) for part in (gap, acceleration)]
    return Complex(ca.horzcat(*real), ca.horzcat(*imaginary))
