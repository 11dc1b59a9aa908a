"""The gains that leave no feedthrough: every K with D11 + D12 K D21 = 0, and coordinates on that set.

    D11, D12, D21, sizes --GainSet.without_feedthrough--> K = centre + Σ z_i N_i  --minimise--> z

The H2 norm is infinite wherever white noise reaches the output directly. Where D12 or D21 is zero, every gain is in the
set and the coordinates are the entries of K.
"""

from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError

SOLVED = 1e-10  # of ‖D11‖: what may remain of the feedthrough
RANK = 1e-12  # of the largest singular value: below, a direction of K does not change the feedthrough


@dataclass(frozen=True, slots=True)
class GainSet:
    """K = centre + basis z, entries row by row; `basis` None where every K belongs."""

    shape: tuple[int, int]
    units: np.ndarray  # (u y,) typical size of each entry
    centre: np.ndarray  # (u y,)
    basis: np.ndarray | None  # (u y, r), orthonormal columns in typical sizes

    @classmethod
    def everything(cls, units: np.ndarray) -> "GainSet":
        """All gains of the shape of `units` (u, y)."""
        return cls(units.shape, units.ravel(), np.zeros(units.size), None)

    @classmethod
    def without_feedthrough(cls, D11: np.ndarray, D12: np.ndarray, D21: np.ndarray, units: np.ndarray) -> "GainSet":
        """The gains of the shape of `units` (u, y) with D11 + D12 K D21 = 0.

        Raises
        ------
        InputError
            If there is none.
        """
        left, right = D12.any(), D21.any()
        if not D11.any() and not (left and right):
            return cls.everything(units)
        M = np.kron(D12, D21.T) * units.ravel()  # acts on the entries of K in typical sizes
        U, sigma, Vh = np.linalg.svd(M)
        rank = int(np.sum(sigma > RANK * sigma.max(initial=0.0)))
        wanted = -D11.ravel()
        scaled = Vh[:rank].T @ ((U[:, :rank].T @ wanted) / sigma[:rank])
        if np.linalg.norm(M @ scaled - wanted) > SOLVED * np.linalg.norm(wanted):
            raise InputError(
                "the H2 norm must have no feedthrough from w to z: D11 + D12 K D21 = 0 for some K; no K gives that. "
                "Filter w or z, or take D11 out."
            )
        return cls(units.shape, units.ravel(), units.ravel() * scaled, units.ravel()[:, None] * Vh[rank:].T)

    @property
    def size(self) -> int:
        """How many coordinates there are."""
        return len(self.units) if self.basis is None else self.basis.shape[1]

    @property
    def scale(self) -> np.ndarray:
        """Typical size of each coordinate."""
        return self.units if self.basis is None else np.ones(self.size)

    def gain(self, z: np.ndarray) -> np.ndarray:
        """K (u, y) at the coordinates."""
        return (z if self.basis is None else self.centre + self.basis @ z).reshape(self.shape)

    def coordinates(self, K: np.ndarray) -> np.ndarray:
        """Those of the nearest gain of the set, in typical sizes."""
        if self.basis is None:
            return K.ravel()
        return (self.basis / self.units[:, None] ** 2).T @ (K.ravel() - self.centre)

    def gradient(self, G: np.ndarray) -> np.ndarray:
        """Gradient with respect to the coordinates from the one (u, y) with respect to K."""
        return G.ravel() if self.basis is None else self.basis.T @ G.ravel()

    def metric(self, factor: np.ndarray | None) -> np.ndarray | None:
        """Factor of the inverse Hessian in the coordinates from the one (u y, u y) in the entries of K."""
        if self.basis is None or factor is None:
            return factor
        try:
            R = np.linalg.qr(np.linalg.solve(factor, self.basis), mode="r")
            found = np.linalg.inv(R)
        except np.linalg.LinAlgError:
            return None
        return found if np.all(np.isfinite(found)) else None
