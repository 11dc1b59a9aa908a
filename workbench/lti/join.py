"""Matrices of state-space systems joined: the only place where A, B, C, D of several are put into one.

    systems --beside--> one system, nothing joined --wired--> outputs led back to inputs, some signals in, some out
    series, difference: cases of it without a loop

A row of A may also be that of a delay line (`lti.delay`): joining does not ask what a row's symbol is, so dead times go
through exactly. Names of signals belong to `lti.connect`.
"""

from dataclasses import dataclass

import numpy as np

from workbench.lti.algebraic import IllPosedError, closing
from workbench.lti.realisation import Realisation

CIRCLE = (
    "signals that pass round a feedback at once must have a solution; this algebraic loop has none (I − D K is "
    "singular). Add a lag, or change a direct gain."
)


def beside(*systems: Realisation) -> Realisation:
    """Systems side by side: block diagonal matrices, in the order given."""
    return Realisation(*(diagonal([system[i] for system in systems]) for i in range(4)))


def diagonal(parts: list[np.ndarray]) -> np.ndarray:
    """Blocks of any shape, empty ones included, along a diagonal."""
    whole = np.zeros((sum(len(part) for part in parts), sum(part.shape[1] for part in parts)))
    row = column = 0
    for part in parts:
        whole[row : row + len(part), column : column + part.shape[1]] = part
        row, column = row + len(part), column + part.shape[1]
    return whole


def wired(
    system: Realisation, back: np.ndarray, into: np.ndarray, out: np.ndarray, past: np.ndarray, circle: str = CIRCLE
) -> Realisation:
    """From w to z with u = back·y + into·w and z = out·y + past·w around y = G u.

    Parameters
    ----------
    system : (n, n), (n, m), (p, n), (p, m)
    back, into, out, past : (m, p), (m, k), (q, p), (q, k)
    circle : the sentence of an algebraic loop without solution

    Raises
    ------
    IllPosedError
        If what passes `back` at once has no solution to the digits of D.
    """
    A, B, C, D = system
    state, loop = back @ C, back @ D  # u = state x + loop u + into w
    if loop.any():
        E = _around(back, D, circle)
        state, into = E @ state, E @ into
    return Realisation(A + B @ state, B @ into, out @ (C + D @ state), out @ D @ into + past)


def _around(back: np.ndarray, D: np.ndarray, circle: str) -> np.ndarray:
    """(I − back D)⁻¹, exactly zero where no path of nonzero entries leads; a plain sum where nothing returns."""
    eye = np.eye(len(back))
    loop, paths = back @ D, np.eye(len(back), dtype=bool)
    for _ in range(len(loop)):
        longer = paths | ((loop != 0) @ paths)
        if (longer == paths).all():
            break
        paths = longer
    if not ((loop != 0) @ paths).diagonal().any():  # a chain
        E = eye
        for _ in range(len(loop)):
            E, before = eye + loop @ E, E
            if (before == E).all():
                break
        return E
    E, sound = closing(back, D)
    if not sound:
        raise IllPosedError(circle)
    return np.where(paths, E, 0.0)


def series(second: Realisation, first: Realisation) -> Realisation:
    """second · first: what leaves `first` enters `second`. States: first's, then second's."""
    A1, B1, C1, D1 = first
    A2, B2, C2, D2 = second
    n = len(A1)
    A, B = diagonal([A1, A2]), np.zeros((n + len(A2), B1.shape[1]))
    C = np.zeros((len(C2), n + len(A2)))
    A[n:, :n], B[:n], B[n:], C[:, :n], C[:, n:] = B2 @ C1, B1, B2 @ D1, D2 @ C1, C2
    return Realisation(A, B, C, D2 @ D1)


def difference(one: Realisation, other: Realisation) -> Realisation:
    """one − other, side by side. States: one's, then other's."""
    n = len(one.A)
    B = np.zeros((n + len(other.A), one.B.shape[1]))
    C = np.zeros((len(one.C), n + len(other.A)))
    B[:n], B[n:], C[:, :n], C[:, n:] = one.B, other.B, one.C, -other.C
    return Realisation(diagonal([one.A, other.A]), B, C, one.D - other.D)


@dataclass(frozen=True, slots=True, eq=False)
class Weighted:
    """left · T · right as one system, and how its gradient returns to T."""

    left: Realisation
    right: Realisation

    def system(self, T: Realisation) -> Realisation:
        """States: right's, T's, left's."""
        return series(self.left, series(T, self.right))

    def pullback(self, T: Realisation, gradient: Realisation) -> Realisation:
        """The gradient with respect to T's four matrices of a scalar whose gradient for the joined ones is given."""
        r, n = len(self.right.A), len(T.A)
        mine, before, after = slice(r, r + n), slice(0, r), slice(r + n, None)
        GA, GB, GC, GD = gradient
        Cr, Dr = self.right.C, self.right.D
        Bl, Dl = self.left.B, self.left.D
        return Realisation(
            GA[mine, mine],
            GA[mine, before] @ Cr.T + GB[mine] @ Dr.T,
            Bl.T @ GA[after, mine] + Dl.T @ GC[:, mine],
            Bl.T @ (GA[after, before] @ Cr.T + GB[after] @ Dr.T) + Dl.T @ (GC[:, before] @ Cr.T + GD @ Dr.T),
        )
