"""The poles of a closed loop as functions of its controller: values, and the gradient of each.

    A --eigenvalues--------------> λ, ∂λ = yᴴ ∂A x/(yᴴ x)
    A with dead times --located--> λ, ∂λ = yᴴ ∂A x/(yᴴ Λ' x),   (Λ(λ) − A) x = 0

What steers; nothing here says that no root of a loop with dead time was missed (`loop_count` does).
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np

from workbench.lti.roots import spectrum

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

DEFECTIVE = 1e-9  # |yᴴ Λ' x| of vectors of unit length below which a pole is multiple to rounding, its slope cut off

PullA = Callable[[np.ndarray], "Controller"]  # gradient (N, N) by A -> gradient by K


class Modes(NamedTuple):
    """Poles (k,) in s or z, and k, weight -> the gradient of Re(weight · λ_k) by the controller."""

    poles: np.ndarray
    pull: Callable[[int, complex], "Controller"]


def eigenvalues(A: np.ndarray, back: PullA) -> Modes:
    """All eigenvalues of A; infinite where A is not finite."""
    from scipy.linalg import eig

    if len(A) == 0 or not np.isfinite(A).all():
        return Modes(np.full(min(len(A), 1), np.inf + 0j), _none)
    poles, left, right = cast(tuple[np.ndarray, np.ndarray, np.ndarray], eig(A, left=True, right=True))

    def pull(k: int, weight: complex) -> "Controller":
        x, y = right[:, k], left[:, k]
        return back(_by_A(x, y, y.conj() @ x, weight))

    return Modes(poles, pull)


def roots(A: np.ndarray, late: np.ndarray, back: PullA) -> Modes:
    """The roots that collocation locates; A (N, N), dead times (N,) of its rows, 0 of states."""
    if not np.isfinite(A).all():
        return Modes(np.full(1, np.inf + 0j), _none)
    poles, line = spectrum(A, late), late > 0

    def pull(k: int, weight: complex) -> "Controller":
        symbol = np.where(line, np.exp(poles[k] * late), poles[k])
        slope = np.where(line, late * symbol, 1.0)
        size = np.maximum(1.0, np.abs(symbol))  # rows of like size: a line's symbol may be large or small
        left, _, right = np.linalg.svd((np.diag(symbol) - A) / size[:, None])
        y, x = left[:, -1] / size, right[-1].conj()
        return back(_by_A(x, y / np.linalg.norm(y), (y / np.linalg.norm(y)).conj() @ (slope * x), weight))

    return Modes(poles, pull)


def _by_A(x: np.ndarray, y: np.ndarray, overlap: complex, weight: complex) -> np.ndarray:
    """The gradient (N, N) of Re(weight · λ) by A."""
    overlap = overlap if abs(overlap) > DEFECTIVE else DEFECTIVE
    return (np.outer(y.conj(), x) * (weight / overlap)).real


def _none(k: int, weight: complex) -> "Controller":
    raise IndexError(k)  # there is no pole to ask for
