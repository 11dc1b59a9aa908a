"""A plant closed by a static gain: u = K y, and what its spectral abscissa, H∞ norm and H2 norm say about K.

    dx/dt = A x + B1 w + B2 u,   z = C1 x + D11 w + D12 u,   y = C x + D21 w
    K --closed--> (A + B2 K C, B1 + B2 K D21, C1 + D12 K C, D11 + D12 K D21) --abscissa, peaks, variance--> pieces

Each measure returns pieces (value, gradient with respect to K), gradients exact. Norms are steered by their logarithm:
a factor counts the same everywhere, and the growth towards the edge of stability is that of a barrier.
"""

import math
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.lti.eigen import eigen
from workbench.lti.energy import gramians
from workbench.lti.grid import around
from workbench.lti.modal_peak import GainCurve
from workbench.lti.norm import proposals
from workbench.lti.realisation import matrix, square

NEAR = 0.2  # in log: local peaks and second singular values this close to the largest are pieces of their own
BESIDE = 0.03  # in log: singular values this close are mixed, and sampled frequencies this close are pieces too
MOST_BESIDE = 6
MIXTURES = (1.0, -1.0, 1j, -1j)  # relative phases of two singular vectors
NEAR_EDGE = 1e3  # least decays from the axis within which slow poles are pieces
CHECKS = 4  # rounds of looking for peaks that sampling missed
MISSED = 1e-5  # relative height above the peaks found that counts as missed
FURTHER_EIGENVALUES = 12  # beside the rightmost
FIXED = 1e-12  # of ‖A‖: singular value at which a mode counts as fixed
FLAT = 1e-10  # of the first metric: a direction that costs less than this share of the dearest counts as this much


@dataclass(frozen=True, slots=True)
class StaticLoop:
    """The matrices of the plant; A (n, n), B1 (n, w), B2 (n, u), C1 (z, n), C (y, n), D11, D12, D21 to fit."""

    A: np.ndarray
    B1: np.ndarray
    B2: np.ndarray
    C1: np.ndarray
    C: np.ndarray
    D11: np.ndarray
    D12: np.ndarray
    D21: np.ndarray

    @classmethod
    def of(cls, A, B1, B2, C1, C, D11=None, D12=None, D21=None) -> "StaticLoop":
        """Checked matrices; D11, D12, D21 zero if left out."""
        A = square("A", A)
        B1, B2, C1, C = (matrix(name, M) for name, M in (("B1", B1), ("B2", B2), ("C1", C1), ("C", C)))
        w, u, z, y = B1.shape[1], B2.shape[1], len(C1), len(C)
        feed = [
            np.zeros(shape) if M is None else matrix(name, M)
            for name, M, shape in (("D11", D11, (z, w)), ("D12", D12, (z, u)), ("D21", D21, (y, w)))
        ]
        n = len(A)
        wanted = ((n, w), (n, u), (z, n), (y, n), (z, w), (z, u), (y, w))
        for name, M, shape in zip(
            ("B1", "B2", "C1", "C", "D11", "D12", "D21"), (B1, B2, C1, C, *feed), wanted, strict=True
        ):
            if M.shape != shape or 0 in M.shape:
                raise InputError(f"{name} must have shape {shape}, none of it zero; got {M.shape}. Make them agree.")
        return cls(A, B1, B2, C1, C, *feed)

    @property
    def shape(self) -> tuple[int, int]:
        """(inputs, measurements): the shape of K."""
        return self.B2.shape[1], len(self.C)

    def closed(self, K: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A, B, C, D of the closed loop from w to z."""
        BK, DK = self.B2 @ K, self.D12 @ K
        return self.A + BK @ self.C, self.B1 + BK @ self.D21, self.C1 + DK @ self.C, self.D11 + DK @ self.D21

    def size(self) -> np.ndarray:
        """Typical size of each entry of K: what moves A by its own norm."""
        rows, columns = np.linalg.norm(self.B2, axis=0), np.linalg.norm(self.C, axis=1)
        product = np.outer(np.where(rows > 0, rows, 1.0), np.where(columns > 0, columns, 1.0))
        return (np.linalg.norm(self.A, 2) or 1.0) / product

    def regulator(self) -> np.ndarray | None:
        """The linear-quadratic regulator's state feedback, read from the measurements as well as they show the state.

        With the state measured it stabilises; else it is a place to start. Prices are each input's `size`. None where
        the Riccati equation has no solution.
        """
        from scipy.linalg import solve_continuous_are

        rate = float(np.linalg.norm(self.A, 2)) or 1.0
        rows = np.linalg.norm(self.B2, axis=0)
        rows[rows == 0] = 1.0
        B = self.B2 / rows
        try:
            X = solve_continuous_are(self.A / rate, B, np.eye(len(B)), np.eye(B.shape[1]))
        except (np.linalg.LinAlgError, ValueError):
            return None
        K = -(rate / rows)[:, None] * (B.T @ X @ np.linalg.pinv(self.C))
        return K if np.all(np.isfinite(K)) else None

    def fixed_mode(self) -> tuple[complex, str]:
        """An unstable eigenvalue that no feedback moves, and which side misses it ("" where there is none).

        [A − λ, B2] or [A − λ; C] loses rank there (Popov, Belevitch, Hautus), to rounding.
        """
        size = float(np.linalg.norm(self.A, 2))
        for value in np.linalg.eigvals(self.A):
            if value.real < 0:
                continue
            shifted = self.A - value * np.eye(len(self.A))
            for side, pair in (("inputs", (shifted, self.B2)), ("measurements", (shifted.T, self.C.T))):
                weight = size / (np.linalg.norm(pair[1]) or 1.0)
                if np.linalg.svd(np.hstack([pair[0], weight * pair[1]]), compute_uv=False)[-1] < FIXED * size:
                    return complex(value), side
        return 0j, ""

    def metric(self, K: np.ndarray) -> np.ndarray | None:
        """A factor (u y, u y) of an inverse Hessian in the entries of K, row by row; None where K does not stabilise.

        A change dK costs √trace(U dK Y dK') to first order, Y the covariance C P C' of the measurements under white
        noise and U = B2' Q B2 + D12' D12 the price of the inputs: the Hessian of the squared H2 norm but for the
        change of P and Q. Signals that are nearly parallel, or of different sizes, become independent and equal.
        """
        A, B, C, _ = self.closed(K)
        gramians = _gramians(A, B, C)
        if gramians is None:
            return None
        P, Q = gramians
        measured = _inverse_root(self.C @ P @ self.C.T + self.D21 @ self.D21.T)
        priced = _inverse_root(self.B2.T @ Q @ self.B2 + self.D12.T @ self.D12)
        found = np.kron(priced, measured)
        return found if np.all(np.isfinite(found)) and found.any() else None

    def abscissa(self, K: np.ndarray) -> list[tuple[float, np.ndarray]]:
        """Largest real parts of the closed loop's eigenvalues [1/s], each with its gradient.

        A defective eigenvalue has no gradient; rounding splits it and leaves large ones, which the solver's line search
        and gradient sampling are made for.
        """
        values, left, right = eigen(self.A + self.B2 @ K @ self.C)
        keep = np.flatnonzero(values.imag >= 0)
        keep = keep[np.argsort(-values[keep].real)][: FURTHER_EIGENVALUES + 1]
        pieces = []
        for k in keep:
            gradient = np.outer(self.B2.T @ left[:, k].conj(), self.C @ right[:, k])
            pieces.append((float(values[k].real), gradient.real))
        return pieces

    def variance(self, K: np.ndarray) -> list[tuple[float, np.ndarray]]:
        """log of the H2 norm and its gradient; nothing outside the domain."""
        A, B, C, _ = self.closed(K)
        gramians = _gramians(A, B, C)
        if gramians is None:
            return []
        P, Q = gramians
        square_norm = float(np.sum((C @ P) * C))
        if not (square_norm > 0 and math.isfinite(square_norm)):
            return []
        gradient = self.B2.T @ Q @ (P @ self.C.T + B @ self.D21.T) + self.D12.T @ C @ P @ self.C.T
        return [(math.log(square_norm) / 2, gradient / square_norm)]


def _gramians(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Those of a stable system; None if it is none."""
    stable = np.isfinite(A).all() and np.linalg.eigvals(A).real.max(initial=-math.inf) < 0
    return gramians(A, B, C) if stable else None


def _inverse_root(M: np.ndarray) -> np.ndarray:
    """M^−½ of a symmetric M, eigenvalues below FLAT of the largest raised to that."""
    values, vectors = np.linalg.eigh((M + M.T) / 2)
    top = float(values[-1])
    if not (top > 0 and math.isfinite(top)):
        return np.eye(len(M))
    return vectors / np.sqrt(np.maximum(values, FLAT * top)) @ vectors.T


class Peaks:
    """log of the closed loop's largest gain over frequency, one piece per local peak; for one descent.

    Frequencies are sampled around the closed loop's poles; local maxima are refined.
    A value below all before it, the only kind a minimiser accepts, is checked: the eigenvalues that `proposals`
    names show every frequency where the gain is higher. This steers; `peak_gain` decides.
    """

    def __init__(self, loop: StaticLoop, min_decay: float = 0.0) -> None:
        self._loop, self._min_decay = loop, min_decay
        self._least = math.inf  # smallest gain that was checked
        self._level = math.nan  # log of the first gain

    def __call__(self, K: np.ndarray) -> list[tuple[float, np.ndarray]]:
        """Pieces (log of the gain, gradient with respect to K), none if the loop is unstable."""
        A, B, C, D = self._loop.closed(K)
        if not np.all(np.isfinite(A)):
            return []
        gain = GainCurve(A, B, C, D)
        slowest = gain.poles.real.max(initial=-math.inf)
        if slowest >= 0 or slowest >= -self._min_decay:
            return []
        sampled = around(gain.poles)
        peaks = gain.peaks(sampled, NEAR, self._least)
        for _ in range(CHECKS):
            if not peaks or not peaks[0][1] > 0:
                return []
            if peaks[0][1] > self._least:
                break
            level = peaks[0][1] * (1 + MISSED)
            proposed = proposals(A, B, C, D, level)
            missed = proposed[gain.largest(proposed) > level]
            if not len(missed):
                self._least = peaks[0][1]
                break
            sampled = np.r_[sampled, missed, [omega for omega, _ in peaks if math.isfinite(omega)]]
            peaks = gain.peaks(sampled, NEAR, self._least)
        top = peaks[0][1]
        beside = gain.sampled_above(top * math.exp(-BESIDE), most=MOST_BESIDE)
        finite = np.unique(np.r_[[omega for omega, _ in peaks if math.isfinite(omega)], beside])
        pieces = self._pieces(gain.at(finite), top) if len(finite) else []
        if not all(math.isfinite(omega) for omega, _ in peaks):
            pieces += self._pieces(gain.at_infinity(), top)
        if math.isnan(self._level):
            self._level = math.log(top)
        if -slowest < NEAR_EDGE * self._min_decay:
            pieces += self._slow(K)
        return pieces

    def _slow(self, K: np.ndarray) -> list[tuple[float, np.ndarray]]:
        """log(least decay / decay) of the slowest poles above the first gain: a constraint that binds at the least."""
        return [
            (self._level + math.log(self._min_decay / -value), gradient / -value)
            for value, gradient in self._loop.abscissa(K)
            if 0 < -value < NEAR_EDGE * self._min_decay
        ]

    def _pieces(self, answers, top: float) -> list[tuple[float, np.ndarray]]:
        """Pieces at each frequency: singular values near the top, and mixtures of those that nearly coincide.

        For unit vectors y the number Re (U y)ᴴ T (V y) never exceeds σ_max and is smooth in K; where singular values
        coincide these, not the singular values, span the subdifferential.
        """
        U, sigma, Vh, X, Y = answers
        left = self._loop.D12 + Y @ self._loop.B2  # (k, z, u)
        right = self._loop.D21 + self._loop.C @ X  # (k, y, w)
        pieces = []
        for k in range(len(sigma)):
            count = int(np.sum(sigma[k] >= top * math.exp(-NEAR)))
            u, v = left[k].T @ U[k][:, :count].conj(), right[k] @ Vh[k][:count].conj().T  # (u, count), (y, count)
            pairs = [(np.eye(count)[i], sigma[k][i]) for i in range(count)]
            for i in range(count):
                for j in range(i + 1, count):
                    if sigma[k][j] >= top * math.exp(-BESIDE):
                        for turn in MIXTURES:
                            y = np.zeros(count, complex)
                            y[i], y[j] = math.sqrt(0.5), turn * math.sqrt(0.5)
                            pairs.append((y, (sigma[k][i] + sigma[k][j]) / 2))
            for y, value in pairs:
                gradient = np.outer(u @ np.conj(y), v @ y).real
                pieces.append((math.log(value), gradient / value))
        return pieces
