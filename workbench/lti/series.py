"""State-space systems joined: one after another, one minus another, and the gradient of the joined back to a part."""

from dataclasses import dataclass

import numpy as np

from workbench.lti.realisation import Realisation


def series(second: Realisation, first: Realisation) -> Realisation:
    """second · first: what leaves `first` enters `second`. States: first's, then second's."""
    A1, B1, C1, D1 = first
    A2, B2, C2, D2 = second
    if len(A1) == 0 and len(A2) == 0:
        return Realisation(A1, np.zeros((0, D1.shape[1])), np.zeros((len(D2), 0)), D2 @ D1)
    return Realisation(
        np.block([[A1, np.zeros((len(A1), len(A2)))], [B2 @ C1, A2]]),
        np.vstack([B1, B2 @ D1]),
        np.hstack([D2 @ C1, C2]),
        D2 @ D1,
    )


def difference(one: Realisation, other: Realisation) -> Realisation:
    """one − other, side by side. States: one's, then other's."""
    n, k = len(one.A), len(other.A)
    return Realisation(
        np.block([[one.A, np.zeros((n, k))], [np.zeros((k, n)), other.A]]),
        np.vstack([one.B, other.B]),
        np.hstack([one.C, -other.C]),
        one.D - other.D,
    )


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
