"""Eigenvalues as functions of the matrix: values, and how each moves with the entries.

    A --eigen--> λ, x, y with yᴴx = 1:   dλ = yᴴ dA x
    Λ(s) − A with dead times --its null vectors--> the same with yᴴ Λ' x = 1, Λ' from `count`'s symbols

At a defective eigenvalue yᴴx is zero and there is no derivative: eigenvalues leave it like a root of the change, and
rounding puts ‖yᴴx‖ of unit vectors at √ε ≈ 1e-8 for a double one. Slopes of such a pair are true at the matrix as
rounded; below `DEFECTIVE`, a triple one or an exact zero, they are noise, and a slope is cut off where it would be
steeper than 1/`DEFECTIVE` times the change. That keeps optimisers in finite numbers and changes no slope that means
something.

Source: Wilkinson, The Algebraic Eigenvalue Problem (1965), ch. 2.
"""

from typing import NamedTuple, cast

import numpy as np

DEFECTIVE = 1e-9  # |yᴴ x| of vectors of unit length below which slopes are cut off


class Eigen(NamedTuple):
    """Eigenvalues (n,), right vectors (n, n) of unit length and left ones (n, n) with leftᴴ_k right_k = 1, columns."""

    values: np.ndarray
    left: np.ndarray
    right: np.ndarray

    def slopes(self, by: np.ndarray) -> np.ndarray:
        """Derivatives (n, p) of the eigenvalues from those (n², p) of A, its entries column by column."""
        n = len(self.values)
        products = self.left.conj()[:, None, :] * self.right[None, :, :]  # (i, j, k), against rows i + n j
        return products.transpose(2, 1, 0).reshape(n, -1) @ by

    def gradient(self, k: int, weight: complex = 1.0) -> np.ndarray:
        """The gradient (n, n) of Re(weight · λ_k) by A."""
        return (np.outer(self.left[:, k].conj(), self.right[:, k]) * weight).real


def eigen(A: np.ndarray) -> Eigen:
    """Of a real square matrix (n, n) of finite entries."""
    from scipy.linalg import eig

    values, left, right = cast(tuple[np.ndarray, np.ndarray, np.ndarray], eig(A, left=True, right=True))
    return Eigen(values, left / apart(np.einsum("ik,ik->k", left.conj(), right)).conj(), right)


def apart(overlap):
    """Overlaps yᴴx of unit vectors, scalar or (k,), kept at `DEFECTIVE` or more in their own direction."""
    size = np.abs(overlap)
    with np.errstate(invalid="ignore", divide="ignore"):
        direction = np.where(size > 0, overlap / size, 1.0)
    return np.where(size > DEFECTIVE, overlap, DEFECTIVE * direction)
