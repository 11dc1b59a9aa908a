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

from workbench.errors import InputError
from workbench.tuning.loop_delay import inverse
from workbench.tuning.structure import Controller


class Closed(NamedTuple):
    """A closed system and the two factors that lead from its matrices back to the controller's."""

    A: np.ndarray  # (N, N), N = rows of the open system + states of the controller
    B: np.ndarray  # (N, m)
    C: np.ndarray  # (p, N)
    D: np.ndarray  # (p, m)
    left: np.ndarray  # L (N + p, nk + nu)
    right: np.ndarray  # R (nk + ny, N + m)


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

    def closed(self, K: Controller) -> Closed:
        """The system under a controller.

        Raises InputError for a controller that does not fit or closes an algebraic loop without solution.
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
            inner = np.eye(ny) - self.D22 @ K.D
            E = inverse(inner)
            if E is None:
                raise InputError(
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


def pulled_back(closed: Closed, K: Controller, GA, GB, GC, GD) -> Controller:
    """Gradient with respect to K of a scalar with gradients GA … GD with respect to the closed system's matrices."""
    G = np.block([[GA, GB], [GC, GD]])
    return Controller.from_stacked(closed.left.T @ G @ closed.right.T, K.order)
