"""The report's way to the characteristic polynomial: fit it through values of the determinant (Appendix C.3).

    D(0), D(±s_1), …, D(±s_M)  --even and odd parts-->  a_0 … a_{M_0}      s_i = β^{i−1}

Kept as a demonstration, with the row −s_i and the last term mended: `PolynomialMatrix.determinant` gives the same
coefficients exactly, and `DeterminantFit` says how far off the fit is. The even and odd parts share one Vandermonde
matrix in s_i², whose condition grows from 4e2 (order 6) to 2e6 (order 12): double precision can pay for that,
single precision cannot. Source: report, Appendix C.3.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.lti import PolynomialMatrix
from workbench.result import Result, Row

EXPONENT = 10.0  # K of the report: no product of determinant elements beyond 10^K


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DeterminantFit(Result):
    """Coefficients fitted through determinant values, beside the exact ones.

    coefficients, exact : (order + 1,) lowest power first;  points : (M,) the s_i > 0;  beta : their ratio
    condition : of the Vandermonde matrix of the even powers
    coefficient_error : largest relative error of a coefficient
    root_error : largest distance of a root from the nearest root of the companion matrix, relative to its modulus
    """

    coefficients: np.ndarray
    exact: np.ndarray
    points: np.ndarray
    beta: float
    condition: float
    coefficient_error: float
    root_error: float

    def rows(self) -> list[Row]:
        return [
            ("order", len(self.coefficients) - 1, ""),
            ("ratio of points β", self.beta, ""),
            ("condition of the even Vandermonde matrix", self.condition, ""),
            ("largest relative error of a coefficient", self.coefficient_error, ""),
            ("largest relative error of a root", self.root_error, ""),
        ]


def pair_count(order: int) -> int:
    """M, the number of pairs ±s_i: half the order, rounded up.

    Examples
    --------
    >>> pair_count(12)
    6
    """
    if order < 1:
        raise InputError(
            f"the order of the characteristic polynomial must be at least 1; got {order}. "
            "Give the order known in advance."
        )
    return (order + 1) // 2


def point_ratio(pairs: int, exponent: float = EXPONENT) -> float:
    """β: 2, or 10^(3K/((M−1)(2M−1)M)) if that is smaller.

    So that the left diagonal product of the Vandermonde determinant, ∏ s_i^{2(i−1)}, does not exceed 10^K.

    Examples
    --------
    >>> [round(point_ratio(pairs), 3) for pairs in (2, 3, 4, 5, 6, 7)]  # report, C.3
    [2.0, 2.0, 2.0, 1.468, 1.233, 1.135]
    """
    if pairs < 1:
        raise InputError(f"the number of pairs of points must be at least 1; got {pairs}.")
    return 2.0 if pairs == 1 else min(2.0, 10 ** (3 * exponent / ((pairs - 1) * (2 * pairs - 1) * pairs)))


def fit_coefficients(
    determinant: Callable[[float], float],
    order: int,
    *,
    beta: float | None = None,
    first: float = 1.0,
    dtype=np.float64,
):
    """Coefficients (order + 1,), lowest power first, of the polynomial through the values of a determinant.

    Parameters
    ----------
    determinant : callable
        D at a real s.
    order : int
        M_0, known in advance.
    beta, first : float
        s_i = first · β^{i−1}; β by the report's rule unless given. The report has first = 1.
    dtype : numpy float type
        Precision of all arithmetic after the determinant values.

    Returns
    -------
    (coefficients, points, condition)
    """
    pairs = pair_count(order)
    ratio = point_ratio(pairs) if beta is None else beta
    if not ratio > 1 or not first > 0:
        raise InputError(f"points need a ratio above 1 and a positive first one; got {ratio!r} and {first!r}.")
    points = (first * ratio ** np.arange(pairs)).astype(dtype)
    plus, minus = (np.array([determinant(float(sign * s)) for s in points], dtype) for sign in (1, -1))
    zero = np.asarray(determinant(0.0), dtype)
    even = np.vander(points**2, pairs, increasing=True)
    right = np.column_stack([(plus + minus - 2 * zero) / (2 * points**2), (plus - minus) / (2 * points)])
    solved = np.linalg.solve(even, right)
    out = np.empty(2 * pairs + 1, dtype)
    out[0], out[2::2], out[1::2] = zero, solved[:, 0], solved[:, 1]
    return out[: order + 1].astype(float), points.astype(float), float(np.linalg.cond(even.astype(float)))


def determinant_fit(
    matrix: PolynomialMatrix, *, beta: float | None = None, first: float = 1.0, dtype=np.float64
) -> DeterminantFit:
    """The fit of a numeric polynomial matrix's determinant, and what it lost against the exact expansion.

    Roots are compared as roots of the fitted polynomial against eigenvalues of the companion matrix.
    """
    blocks = matrix.blocks()
    exact = np.array(matrix.determinant())
    order = len(exact) - 1

    def value(s: float) -> float:
        return float(np.linalg.det(np.tensordot(float(s) ** np.arange(len(blocks)), blocks, axes=1).astype(dtype)))

    found, points, condition = fit_coefficients(value, order, beta=beta, first=first, dtype=dtype)
    scale = np.where(exact == 0, np.abs(exact).max(), np.abs(exact))
    roots, right = np.roots(found[::-1]), matrix.roots()
    distance = np.abs(roots[:, None] - right[None, :]) / np.abs(right)[None, :]
    return DeterminantFit(
        coefficients=found, exact=exact, points=points, beta=float(points[1] / points[0]) if len(points) > 1 else 2.0,
        condition=condition, coefficient_error=float(np.max(np.abs(found - exact) / scale)),
        root_error=float(distance.min(axis=1).max()),
    )  # fmt: skip
