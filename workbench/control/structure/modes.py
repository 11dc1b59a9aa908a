"""The poles of a closed loop as functions of its controller: values, and the gradient of each.

    A --eigenvalues--------------> λ, ∂λ = yᴴ ∂A x/(yᴴ x)
    A with dead times --located--> λ, ∂λ = yᴴ ∂A x/(yᴴ Λ' x),   (Λ(λ) − A) x = 0

What steers; nothing here says that no root of a loop with dead time was missed (`loop_count` does).
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from workbench.lti.eigen import apart, eigen
from workbench.lti.roots import spectrum

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

PullA = Callable[[np.ndarray], "Controller"]  # gradient (N, N) by A -> gradient by K


class Modes(NamedTuple):
    """Poles (k,) in s or z, and k, weight -> the gradient of Re(weight · λ_k) by the controller."""

    poles: np.ndarray
    pull: Callable[[int, complex], "Controller"]


def eigenvalues(A: np.ndarray, back: PullA) -> Modes:
    """All eigenvalues of A; infinite where A is not finite."""
    if len(A) == 0 or not np.isfinite(A).all():
        return Modes(np.full(min(len(A), 1), np.inf + 0j), _none)
    found = eigen(A)
    return Modes(found.values, lambda k, weight: back(found.gradient(k, weight)))


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
        y = y / np.linalg.norm(y)
        return back((np.outer(y.conj(), x) * (weight / apart(y.conj() @ (slope * x)))).real)

    return Modes(poles, pull)


def _none(k: int, weight: complex) -> "Controller":
    raise IndexError(k)  # there is no pole to ask for
