"""Polynomial matrices in s with symbolic or numeric coefficients: determinant, roots, value at a point.

    M(s) = M_0 + M_1 s + … + M_k s^k   -->  det M(s)   (coefficients symbolic in the gains, or exact rationals)
                                       -->  roots      (eigenvalues of a companion matrix, numeric)

A determinant in floating point loses half the digits near double roots. So numeric determinants are expanded in exact
rational arithmetic, and roots never come from a determinant.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import casadi as ca
import numpy as np

from workbench.errors import InputError

SINGULAR = 1e12  # condition number of the equilibrated leading coefficients beyond which a root counts as infinite


@dataclass(frozen=True, slots=True)
class PolynomialMatrix:
    """M(s) = Σ coefficients[k] s^k, each coefficient an (n, n) SX or DM."""

    coefficients: tuple

    def __post_init__(self) -> None:
        shapes = {m.shape for m in self.coefficients}
        if len(shapes) != 1:
            raise InputError(
                f"coefficients of a polynomial matrix must have one shape; got {sorted(shapes)}. Pad the smaller ones."
            )
        rows, columns = shapes.pop()
        if rows != columns or rows == 0:
            raise InputError(
                f"a polynomial matrix must be square and not empty; got {rows} × {columns}. "
                "Give as many rows as unknowns."
            )

    @classmethod
    def of(cls, coefficients: Sequence) -> "PolynomialMatrix":
        """From a sequence of matrices, lowest power first."""
        return cls(tuple(c if isinstance(c, ca.SX | ca.DM) else ca.DM(c) for c in coefficients))

    @property
    def size(self) -> int:
        """Number of rows."""
        return self.coefficients[0].shape[0]

    @property
    def numeric(self) -> bool:
        """Whether every coefficient is a number."""
        return all(isinstance(c, ca.DM) or c.is_constant() for c in self.coefficients)

    def __add__(self, other: "PolynomialMatrix") -> "PolynomialMatrix":
        count = max(len(self.coefficients), len(other.coefficients))
        zero = ca.DM.zeros(*self.coefficients[0].shape)
        longer = [list(p.coefficients) + [zero] * (count - len(p.coefficients)) for p in (self, other)]
        return PolynomialMatrix(tuple(a + b for a, b in zip(*longer, strict=True)))

    def times(self, polynomial: Sequence) -> "PolynomialMatrix":
        """Product with a scalar polynomial (coefficients, lowest power first)."""
        out = [ca.DM.zeros(*self.coefficients[0].shape)] * (len(self.coefficients) + len(polynomial) - 1)
        for i, matrix in enumerate(self.coefficients):
            for j, factor in enumerate(polynomial):
                out[i + j] = out[i + j] + matrix * factor
        return PolynomialMatrix(tuple(out))

    def at(self, s):
        """M(s) at a real point or symbol, by Horner's rule."""
        value = self.coefficients[-1]
        for matrix in reversed(self.coefficients[:-1]):
            value = value * s + matrix
        return value

    def blocks(self) -> np.ndarray:
        """Numeric coefficients, (k + 1, n, n)."""
        if not self.numeric:
            raise InputError(
                "numbers are needed here but a coefficient holds a symbol; substitute values for the gains first."
            )
        return np.array([np.array(ca.densify(c if isinstance(c, ca.DM) else ca.evalf(c))) for c in self.coefficients])

    def determinant(self) -> list:
        """Coefficients of det M(s), lowest power first: SX if a coefficient holds a symbol, else correctly rounded."""
        if self.numeric:
            return [float(c) for c in self.exact_determinant()]
        return [ca.simplify(ca.SX(c)) for c in _determinant(_entries(self.coefficients, ca.SX), _vanishes)]

    def exact_determinant(self) -> list[Fraction]:
        """Coefficients of det M(s), lowest power first, as the rationals that the floating-point entries stand for."""
        return _determinant(
            _entries(list(self.blocks()), lambda value: Fraction(float(value))), lambda value: value == 0
        )

    def roots(self) -> np.ndarray:
        """All finite roots of det M(s) = 0 (numeric coefficients only).

        Eigenvalues of the companion matrix whose order is the sum of the column degrees. Where the leading column
        coefficients are singular a root is infinite; the finite ones then come from the generalised problem.
        """
        blocks = self.blocks()
        matrix = companion(blocks)
        return _pencil_roots(blocks) if matrix is None else np.linalg.eigvals(matrix)


def companion(blocks: np.ndarray) -> np.ndarray | None:
    """State matrix whose characteristic polynomial is det M(s) up to a factor; None if that needs an infinite root.

    Parameters
    ----------
    blocks : (k + 1, n, n)
        Coefficients of M(s), lowest power first. Columns may differ in degree; the state holds every unknown and its
        derivatives below its column's degree. An unknown of degree zero is eliminated.
    """
    present = np.abs(blocks).max(axis=1) > 0  # (k + 1, n)
    if not present.any(axis=0).all():
        return None
    degree = [int(np.flatnonzero(present[:, j])[-1]) for j in range(present.shape[1])]
    leading = np.column_stack([blocks[d, :, j] for j, d in enumerate(degree)])
    if np.linalg.cond(_equilibrated(leading)) > SINGULAR:
        return None
    first = np.concatenate([[0], np.cumsum(degree)])
    lower = np.zeros((len(leading), first[-1]))
    for j, d in enumerate(degree):
        lower[:, first[j] : first[j + 1]] = blocks[:d, :, j].T
    highest = -np.linalg.solve(leading, lower)
    matrix = np.eye(first[-1], k=1)
    for j, d in enumerate(degree):
        if d:
            matrix[first[j + 1] - 1] = highest[j]
    return matrix


def _equilibrated(matrix: np.ndarray) -> np.ndarray:
    """Rows, then columns, scaled to largest entry 1, so that units do not look like singularity."""
    for axis in (1, 0):
        largest = np.abs(matrix).max(axis=axis, keepdims=True)
        matrix = matrix / np.where(largest > 0, largest, 1.0)
    return matrix


def _pencil_roots(blocks: np.ndarray) -> np.ndarray:
    import scipy.linalg

    while len(blocks) > 1 and not blocks[-1].any():
        blocks = blocks[:-1]
    n, degree = blocks.shape[1], len(blocks) - 1
    if degree == 0:
        return np.zeros(0, complex)
    scale = _scale(blocks)
    blocks = blocks * (scale ** np.arange(degree + 1))[:, None, None]
    left, right = np.eye(n * degree), np.zeros((n * degree, n * degree))
    left[-n:, -n:] = blocks[-1]
    right[:-n, n:] = np.eye(n * (degree - 1))
    right[-n:] = -np.hstack(list(blocks[:-1]))
    above, below = np.asarray(scipy.linalg.eigvals(right, left, homogeneous_eigvals=True))
    # chains of length l at infinity are smeared to size ε^(1/l); 1e-7 keeps l = 2 out and |s| < 1e7 × scale in
    finite = np.abs(below) > 1e-7 * np.abs(above)
    return scale * above[finite] / below[finite]


def _scale(blocks: np.ndarray) -> float:
    """Geometric-mean root: makes the first and last coefficients of equal size."""
    first, last = (float(np.linalg.norm(blocks[k])) for k in (0, -1))
    return (first / last) ** (1 / (len(blocks) - 1)) if first > 0 and last > 0 else 1.0


def _entries(coefficients: Sequence, ring: Callable) -> list[list[list]]:
    """Polynomials by row and column, in the ring of the coefficients, without leading zeros."""
    size = range(coefficients[0].shape[0])
    out = [[[ring(c[i, j]) for c in coefficients] for j in size] for i in size]
    for row in out:
        for polynomial in row:
            while polynomial and _vanishes(polynomial[-1]):
                polynomial.pop()
    return out


def _vanishes(value) -> bool:
    return bool(value.is_zero()) if isinstance(value, ca.SX) else value == 0


def _determinant(entries: list[list[list]], vanishes: Callable) -> list:
    """Laplace expansion, sparsest rows first, every minor computed once."""
    n = len(entries)
    order = sorted(range(n), key=lambda i: sum(bool(p) for p in entries[i]))
    swaps = sum(order[i] > order[j] for i in range(n) for j in range(i + 1, n))

    @cache
    def minor(depth: int, columns: tuple[int, ...]) -> tuple:
        if not columns:
            return (1,)
        total: list = []
        for place, column in enumerate(columns):
            factor = entries[order[depth]][column]
            if not factor:
                continue
            rest = minor(depth + 1, columns[:place] + columns[place + 1 :])
            if rest:
                term = multiply(factor, rest)
                total = _sum(total, term if place % 2 == 0 else [-c for c in term])
        while total and vanishes(total[-1]):
            total.pop()
        return tuple(total)

    out = list(minor(0, tuple(range(n))))
    return [-c for c in out] if swaps % 2 else out


def multiply(p: Sequence, q: Sequence) -> list:
    """Product of two scalar polynomials, lowest power first.

    Examples
    --------
    >>> multiply([1, 1], [1, -1])  # (1 + s)(1 - s)
    [1, 0, -1]
    """
    out: list = [0] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            out[i + j] = out[i + j] + a * b
    return out


def _sum(p: Sequence, q: Sequence) -> list:
    return [(p[k] if k < len(p) else 0) + (q[k] if k < len(q) else 0) for k in range(max(len(p), len(q)))]
