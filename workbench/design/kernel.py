"""One frequency of one group's closed loop, with exact derivatives by the seventeen parameters.

    parameters, ω, plant at jω --law--> K(jω) --> S = (I − K G)⁻¹ --> commands --> |outputs|², largest σ(S)²

The plant enters as numbers, so one compiled kernel serves every vehicle, speed and mass of the same structure. Complex
matrices are pairs (real, imaginary) of SX. Sign: the law's matrices already hold the minus of the feedback.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import casadi as ca
import numpy as np

from workbench.compiled import compile_function
from workbench.control import filters
from workbench.control.gains import GAIN_NAMES
from workbench.control.law import PATHS, VERTICAL_CHANNELS, modal_factors
from workbench.errors import InputError

EQUAL_SINGULAR_VALUES = 1e-12  # keeps square root and angle differentiable where singular values of S meet
MOST_PATTERNS = 3  # closed forms of inverse and largest singular value end here


@dataclass(frozen=True, slots=True)
class Shape:
    """What fixes the kernel's code: the group's channels, number of patterns, irregularity types and output rows.

    split : whether the law hands sway or yaw to an actuator (`ModalLaw.split`)
    """

    channels: tuple[int, ...]
    patterns: int
    types: int
    rows: tuple[int, ...]  # output rows in each class of outputs; squared moduli add within a class
    split: bool = False

    @property
    def signals(self) -> int:
        """Modal signals: gap and acceleration of each channel."""
        return 2 * len(self.channels)

    @property
    def paths(self) -> tuple[int, ...]:
        """Positions in `PATHS` of the paths that start at the group's channels."""
        return tuple(k for k, channel in enumerate(PATHS[self.split]) if channel in self.channels)


class Complex:
    """A complex SX matrix as its real and imaginary parts."""

    __slots__ = ("im", "re")

    def __init__(self, re, im) -> None:
        self.re, self.im = re, im

    def __matmul__(self, other: "Complex") -> "Complex":
        return Complex(
            ca.mtimes(self.re, other.re) - ca.mtimes(self.im, other.im),  # pyright: ignore[reportOperatorIssue]
            ca.mtimes(self.re, other.im) + ca.mtimes(self.im, other.re),
        )

    def __add__(self, other: "Complex") -> "Complex":
        return Complex(self.re + other.re, self.im + other.im)

    def scaled(self, other: "Complex") -> "Complex":
        """Product with a complex scalar."""
        return Complex(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)

    def __sub__(self, other: "Complex") -> "Complex":
        return Complex(self.re - other.re, self.im - other.im)

    def squared(self):
        """|entry|², elementwise."""
        return self.re**2 + self.im**2


def _inverse(M: Complex) -> tuple[Complex, Complex]:
    """Inverse and determinant of a complex matrix of order 1, 2 or 3."""
    if M.re.shape == (1, 1):
        det, adjugate = M, Complex(ca.SX(1), ca.SX(0))
    elif M.re.shape == (3, 3):
        det, adjugate = _adjugate(M)
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


def _adjugate(M: Complex) -> tuple[Complex, Complex]:
    """Determinant and adjugate of a 3×3 complex matrix, by cofactors."""

    def entry(i: int, j: int) -> Complex:
        return Complex(M.re[i % 3, j % 3], M.im[i % 3, j % 3])

    def cofactor(i: int, j: int) -> Complex:  # rows and columns in cyclic order, which holds the sign
        return entry(i + 1, j + 1).scaled(entry(i + 2, j + 2)) - entry(i + 1, j + 2).scaled(entry(i + 2, j + 1))

    C = [[cofactor(i, j) for j in range(3)] for i in range(3)]
    det = entry(0, 0).scaled(C[0][0]) + entry(0, 1).scaled(C[0][1]) + entry(0, 2).scaled(C[0][2])
    transposed = [[C[j][i] for j in range(3)] for i in range(3)]
    parts = (ca.vertcat(*(ca.horzcat(*(getattr(c, part) for c in row)) for row in transposed)) for part in ("re", "im"))
    return det, Complex(*parts)


def largest_square(S: Complex, det):
    """σ_max² of a complex matrix of order 1, 2 or 3, with det = det S⁻¹; smooth where singular values meet.

    Order 3: the largest root of λ³ − … = det(λ − S*S) by the trigonometric formula, q + 2p cos(θ/3), with the shifted
    matrix H = S*S − q, q the mean of its eigenvalues, p² = ‖H‖²/6 and cos θ = det H / 2p³.
    """
    total = ca.sum1(ca.sum2(S.squared()))
    if S.re.shape == (1, 1):
        return total
    if S.re.shape == (2, 2):  # from its Frobenius norm and determinant, |det S| = 1/|det S⁻¹|
        return (total + ca.sqrt(total**2 - 4 / det.squared() + EQUAL_SINGULAR_VALUES)) / 2
    square = Complex(S.re.T, -S.im.T) @ S
    q = total / 3
    a, b, c = (square.re[i, i] - q for i in range(3))
    x, y, z = (Complex(square.re[i, j], square.im[i, j]) for i, j in ((0, 1), (0, 2), (1, 2)))
    loop = x.scaled(z).scaled(Complex(y.re, -y.im)).re
    half = (a * b * c + 2 * loop - a * z.squared() - b * y.squared() - c * x.squared()) / 2
    p = ca.sqrt((a**2 + b**2 + c**2 + 2 * (x.squared() + y.squared() + z.squared())) / 6 + EQUAL_SINGULAR_VALUES)
    angle = ca.atan2(ca.sqrt(p**6 * (1 + EQUAL_SINGULAR_VALUES) - half**2), half)
    return q + 2 * p * ca.cos(angle / 3)


@lru_cache(maxsize=32)
def kernel(shape: Shape) -> ca.Function:
    """Function (theta (17), omega, plant (q)) -> (values (classes + 1), jacobian (classes + 1, 17)).

    values: Σ|output|² of each class (a density where W and Zw carry √density), then σ_max(S)².
    `plant` is laid out by `plant_column`.
    """
    if shape.patterns > MOST_PATTERNS:
        raise InputError(
            f"a design works on groups with one to three current patterns; got {shape.patterns}. "
            "Use the two groups of motion."
        )
    k, m, t, r, c = shape.patterns, shape.signals, shape.types, sum(shape.rows), len(shape.paths)
    theta, omega = ca.SX.sym("theta", len(GAIN_NAMES)), ca.SX.sym("omega")
    sizes = {"G": (m, k), "W": (m, t), "Zw": (r, t), "Zu": (r, k)}
    columns = ca.SX.sym("columns", k, c)  # patterns' · command per unit of each path's filtered signal, before its gain
    parts = {
        name: Complex(ca.SX.sym(f"{name}_re", *size), ca.SX.sym(f"{name}_im", *size)) for name, size in sizes.items()
    }
    plant = ca.vertcat(ca.vec(columns), *(ca.vec(part) for p in parts.values() for part in (p.re, p.im)))

    K = _law(theta, omega, columns, shape)
    loop = K @ parts["G"]
    S, det = _inverse(Complex(ca.SX.eye(k) - loop.re, -loop.im))
    outputs = parts["Zw"] + parts["Zu"] @ (S @ (K @ parts["W"]))
    squares = ca.sum2(outputs.squared())
    ends = np.cumsum((0, *shape.rows))
    classes = [ca.sum1(squares[int(a) : int(b)]) for a, b in pairwise(ends)]
    values = ca.vertcat(*classes, largest_square(S, det))
    size = "_".join(map(str, (*shape.channels, k, t, *shape.rows)))
    name = f"{'split' if shape.split else 'loop'}_{size}"
    function = ca.Function(name, [theta, omega, plant], ca.cse([values, ca.densify(ca.jacobian(values, theta))]))
    return compile_function(function)


def plant_column(columns: np.ndarray, G: np.ndarray, W: np.ndarray, Zw: np.ndarray, Zu: np.ndarray) -> np.ndarray:
    """The kernel's plant argument at one frequency, from real `columns` (k, c) and complex G, W, Zw, Zu."""
    parts = [np.ravel(columns, "F")]
    for matrix in (G, W, Zw, Zu):
        parts += [np.ravel(matrix.real, "F"), np.ravel(matrix.imag, "F")]
    return np.concatenate(parts)


def _law(theta, omega, columns, shape: Shape) -> Complex:
    """K(jω) from the group's modal signals (gaps, then accelerations) to its pattern commands."""
    g = dict(zip(GAIN_NAMES, ca.vertsplit(theta), strict=True))
    factors = modal_factors(theta, split=shape.split)
    gap, acceleration = [], []
    for channel in shape.channels:
        if channel < VERTICAL_CHANNELS:
            gap.append(filters.gap_response(g["K_h"], g["K_hdot"], g["tau_h"], omega))
            acceleration.append(filters.acceleration_response(g["K_zddot"], g["K_zdot"], g["tau_z"], omega))
        else:
            gap.append(filters.gap_response(g["K_hp"], g["K_hpdot"], g["tau_hp"], omega))
            acceleration.append(filters.acceleration_response(g["K_yddot"], g["K_ydot"], g["tau_y"], omega))
    weighted = _gathered(ca.mtimes(columns, ca.diag(ca.vertcat(*(factors[k] for k in shape.paths)))), shape)
    real = [ca.mtimes(weighted, ca.diag(ca.vertcat(*(h[0] for h in part)))) for part in (gap, acceleration)]
    imaginary = [ca.mtimes(weighted, ca.diag(ca.vertcat(*(h[1] for h in part)))) for part in (gap, acceleration)]
    return Complex(ca.horzcat(*real), ca.horzcat(*imaginary))


def _gathered(weighted, shape: Shape):
    """Columns by path added up to columns by channel."""
    start = [PATHS[shape.split][path] for path in shape.paths]
    own = [[at for at, first in enumerate(start) if first == channel] for channel in shape.channels]
    if all(len(paths) == 1 for paths in own):
        return weighted
    return ca.horzcat(*(ca.sum2(weighted[:, paths]) for paths in own))
