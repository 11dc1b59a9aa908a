"""Linear fractional forms: a system with the controller pulled out, closed for given numbers, and the way back.

          ┌─────────────┐
    z ◄───┤             │◄─── w        dx = A x + B1 w + B2 v
          │  Fraction   │               z = C1 x + D11 w + D12 v
    e ◄───┤             │◄─── v        e = C2 x + D21 w + D22 v
      │   └─────────────┘   ▲
      └────►  K (A … D)  ───┘

With K̂ = [[A_K, B_K], [C_K, D_K]] the closed system matrix is S = S₀ + L₀ K̂ R, and dS = L dK̂ R to first order.
"""

from typing import NamedTuple

import numpy as np

from workbench.control.structure.block import Controller
from workbench.errors import InputError
from workbench.lti.algebraic import IllPosedError, closing


class Closed(NamedTuple):
    """A closed system and the two factors that lead from its matrices back to the controller's."""

    A: np.ndarray  # (N, N), N = rows of the open system + states of the controller
    B: np.ndarray  # (N, m)
    C: np.ndarray  # (p, N)
    D: np.ndarray  # (p, m)
    left: np.ndarray  # L (N + p, nk + nu)
    right: np.ndarray  # R (nk + ny, N + m)

    def part(self, kept: np.ndarray) -> "Closed":
        """The states (k,) alone; the same channel if the others are not reached or not seen."""
        N = len(self.A)
        rows = np.r_[kept, np.arange(N, len(self.left))]
        columns = np.r_[kept, np.arange(N, self.right.shape[1])]
        return Closed(
            self.A[np.ix_(kept, kept)], self.B[kept], self.C[:, kept], self.D, self.left[rows], self.right[:, columns]
        )


class Fraction(NamedTuple):
    """The nine matrices of the picture; w (m), z (p), v (nu), e (ny)."""

    A: np.ndarray
    B1: np.ndarray
    B2: np.ndarray
    C1: np.ndarray
    C2: np.ndarray
    D11: np.ndarray
    D12: np.ndarray
    D21: np.ndarray
    D22: np.ndarray

    @property
    def direct(self) -> bool:
        """Whether v acts on e at once."""
        return bool(self.D22.any())

    def visible(self, pattern: np.ndarray, order: int) -> np.ndarray:
        """The closed system's states (k,) that w reaches and z sees, for every controller of a pattern.

        pattern : (order + nu, order + ny) of bool, the entries of [[A, B], [C, D]] that may differ from zero

        Decided on the graph of entries that are not zero, without a tolerance: what it leaves out is left out exactly.
        """
        n, (nz, m), (ny, nu) = len(self.A), self.D11.shape, self.D22.shape
        x, k, v, e, w, z = np.split(np.arange(n + order + nu + ny + m + nz), np.cumsum([n, order, nu, ny, m]))
        edges = np.zeros((n + order + nu + ny + m + nz,) * 2, bool)  # [to, from]
        for to, parts in ((x, (self.A, self.B2, self.B1)), (e, (self.C2, self.D22, self.D21)),
                          (z, (self.C1, self.D12, self.D11))):  # fmt: skip
            for origin, part in zip((x, v, w), parts, strict=True):
                edges[np.ix_(to, origin)] = part != 0
        edges[np.ix_(np.r_[k, v], np.r_[k, e])] = pattern
        seen = _reached(edges, w) & _reached(edges.T, z)
        return np.flatnonzero(seen[: n + order])

    def closed(self, K: Controller) -> Closed:
        """The system under a controller.

        Raises InputError for a controller that does not fit, IllPosedError for one that closes an algebraic loop
        without solution.
        """
        n, m, p = len(self.A), self.B1.shape[1], len(self.C1)
        nk, (nu, ny) = K.order, K.D.shape
        if (ny, nu) != self.D22.shape:
            raise InputError(
                f"the loop's controller must have {len(self.D22)} inputs and {self.D22.shape[1]} outputs; "
                f"got {ny} and {nu}. Take it from the loop's structure."
            )
        N = n + nk
        left, right = np.zeros((N + p, nk + nu)), np.zeros((nk + ny, N + m))
        left[n:N, :nk] = np.eye(nk)
        right[:nk, n:N] = np.eye(nk)
        if self.direct:
            E, sound = closing(self.D22, K.D)
            if not sound:
                raise IllPosedError(
                    "the controller's direct gain closes an algebraic loop without solution (I − D_plant D_controller "
                    "is singular); change that gain, or add a lag to the plant or the controller."
                )
            right[nk:, :n], right[nk:, N:] = E @ self.C2, E @ self.D21
            right[nk:, n:N] = E @ self.D22 @ K.C
            outer = np.eye(nu) + K.D @ E @ self.D22  # (I − D_K D22)⁻¹
            left[:n, nk:], left[N:, nk:] = self.B2 @ outer, self.D12 @ outer
            left[n:N, nk:] = K.B @ self.D22 @ outer
        else:
            right[nk:, :n], right[nk:, N:] = self.C2, self.D21
            left[:n, nk:], left[N:, nk:] = self.B2, self.D12
        made = K.stacked() @ right
        S = np.zeros((N + p, N + m))
        S[:n, :n], S[:n, N:], S[N:, :n], S[N:, N:] = self.A, self.B1, self.C1, self.D11
        S[:n] += self.B2 @ made[nk:]
        S[n:N] = made[:nk]
        S[N:] += self.D12 @ made[nk:]
        return Closed(S[:N, :N], S[:N, N:], S[N:, :N], S[N:, N:], left, right)


def _reached(edges: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Nodes (k,) of bool that lie on a path from the start; edges (k, k) [to, from]."""
    found = np.zeros(len(edges), bool)
    fresh = np.array(start, int)
    while len(fresh):
        found[fresh] = True
        fresh = np.flatnonzero(edges[:, fresh].any(axis=1) & ~found)
    return found


def pulled_back(closed: Closed, K: Controller, GA, GB, GC, GD) -> Controller:
    """Gradient with respect to K of a scalar with gradients GA … GD with respect to the closed system's matrices."""
    G = Controller(GA, GB, GC, GD).stacked()
    return Controller.from_stacked(closed.left.T @ G @ closed.right.T, K.order)
