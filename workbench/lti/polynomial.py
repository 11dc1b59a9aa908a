"""Polynomial matrices in s with symbolic or numeric coefficients: determinant, roots, value at a point.

    M(s) = M_0 + M_1 s + … + M_k s^k   -->  det M(s)   (coefficients symbolic in the gains)
                                       -->  roots      (eigenvalues of the companion pencil, numeric)

A determinant of floating coefficients loses half the digits near double roots; roots therefore come from the pencil.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.errors import InputError


@dataclass(frozen=True, slots=True)
class PolynomialMatrix:
    """M(s) = Σ coefficients[k] s^k, each coefficient an (n, n) SX or DM."""

    coefficients: tuple

    @classmethod
    def of(cls, coefficients: Sequence) -> "PolynomialMatrix":
        """From a sequence of matrices, lowest power first."""
        matrices = tuple(c if isinstance(c, ca.SX | ca.DM) else ca.DM(c) for c in coefficients)
        shapes = {m.shape for m in matrices}
        if len(shapes) != 1:
            raise InputError(f"coefficients of a polynomial matrix must have one shape; got {sorted(shapes)}.")
        return cls(matrices)

    @property
    def size(self) -> int:
        """Number of rows."""
        return self.coefficients[0].shape[0]

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

    def determinant(self) -> list:
        """Coefficients of det M(s), lowest power first, exact in the symbols (Laplace expansion along the first row)."""
        entries = [
            [[c[i, j] for c in self.coefficients] for j in range(self.size)] for i in range(self.size)
        ]
        return [ca.simplify(c) if isinstance(c, ca.SX) else c for c in _determinant(entries)]

    def roots(self) -> np.ndarray:
        """All finite roots of det M(s) = 0: eigenvalues of the companion pencil (numeric coefficients only)."""
        import scipy.linalg

        blocks = [np.array(ca.DM(ca.evalf(c) if isinstance(c, ca.SX) else c)) for c in self.coefficients]
        while len(blocks) > 1 and not blocks[-1].any():
            blocks.pop()
        n, degree = self.size, len(blocks) - 1
        scale = _scale(blocks)
        blocks = [block * scale**k for k, block in enumerate(blocks)]
        left, right = np.eye(n * degree), np.zeros((n * degree, n * degree))
        left[-n:, -n:] = blocks[-1]
        right[:-n, n:] = np.eye(n * (degree - 1))
        right[-n:] = -np.hstack(blocks[:-1])
        values = scipy.linalg.eigvals(right, left, homogeneous_eigvals=True)
        finite = np.abs(values[1]) > 1e-12 * np.abs(values[0])  # a zero leading block gives roots at infinity
        return scale * values[0][finite] / values[1][finite]


def _scale(blocks: list[np.ndarray]) -> float:
    """Geometric-mean root: makes the first and last coefficients of equal size."""
    first, last = (np.linalg.norm(blocks[k]) for k in (0, -1))
    return (first / last) ** (1 / (len(blocks) - 1)) if first > 0 and last > 0 else 1.0


def _determinant(entries: list[list[list]]) -> list:
    if len(entries) == 1:
        return entries[0][0]
    total: list = []
    for column, factor in enumerate(entries[0]):
        minor = [row[:column] + row[column + 1 :] for row in entries[1:]]
        term = multiply(factor, _determinant(minor))
        total = _sum(total, term if column % 2 == 0 else [-c for c in term])
    return total


def multiply(p: Sequence, q: Sequence) -> list:
    """Product of two scalar polynomials, lowest power first; structural zeros are dropped at the end."""
    out: list = [0] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            out[i + j] = out[i + j] + a * b
    return out


def _sum(p: Sequence, q: Sequence) -> list:
    return [(p[k] if k < len(p) else 0) + (q[k] if k < len(q) else 0) for k in range(max(len(p), len(q)))]
