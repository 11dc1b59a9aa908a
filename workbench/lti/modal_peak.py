"""The gain of a stable system over frequency and its local maxima, fast rather than proved.

    poles --`grid.around`--> sampling --peaks--> local maxima, refined --at--> singular vectors and resolvents

Slopes over frequency come with the values, so a refinement takes five of them; `peak_search` knows values alone, and
`modal.peaks` a stack of systems. What steers static gains; `norm.peak_gain` decides.
"""

import math

import numpy as np

from workbench.lti.modal import WORST_VECTORS, modes
from workbench.lti.realisation import spectral

REFINED = 1e-12  # relative width of the frequency bracket at which a peak is found
LEFT = 3e-9  # relative gain still expected there, by the secant of the slope
ROUGHLY = 1e-5  # the same where the largest sample already tells that a minimiser will not go there
BELOW = 1e-3  # share of a lower peak's distance from the highest that is good enough for it
STEPS = 30  # of the refinement; five are typical


def _leading(G: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(u (k, p), σ_max (k,), v (k, m)) of matrices (k, p, m), G v = σ u."""
    if 1 in G.shape[1:]:
        sigma = spectral(G)
        flat = G.reshape(len(G), -1) / np.where(sigma > 0, sigma, 1.0)[:, None]
        one = np.ones((len(G), 1))
        return (flat, sigma, one) if G.shape[2] == 1 else (one, sigma, flat.conj())
    U, sigma, Vh = np.linalg.svd(G, full_matrices=False)
    return U[:, :, 0], sigma[:, 0], Vh[:, 0].conj()


class GainCurve:
    """σ_max of D + C (jωI − A)⁻¹ B, its slope and its local maxima.

    Resolvents come from eigenvectors where those are conditioned well enough for steering, else from linear solves.
    """

    def __init__(self, A, B, C, D) -> None:
        self._A, self._B, self._C, self._D = A, B, C, D
        self._modes = modes(A)
        self.poles = self._modes.poles
        self._inverse: np.ndarray | None = None  # of the eigenvectors, where they serve
        try:
            inverse = np.linalg.inv(self._modes.vectors)
        except np.linalg.LinAlgError:
            return
        if np.linalg.norm(self._modes.vectors) * np.linalg.norm(inverse) < WORST_VECTORS:
            self._inverse, self._left, self._right = inverse, C @ self._modes.vectors, inverse @ B

    def at(self, omega: np.ndarray):
        """(U, σ, Vᴴ, (jω − A)⁻¹B, C(jω − A)⁻¹), each (k, …), at finite frequencies (k,)."""
        if self._inverse is not None:
            R = self._modes.kernel(omega)
            X = self._modes.vectors @ (R[:, :, None] * self._right)
            Y = (self._left * R[:, None, :]) @ self._inverse
        else:
            X, shifted = self._states(omega)
            turned = shifted.transpose(0, 2, 1)
            Y = np.linalg.solve(turned, np.broadcast_to(self._C.T, (len(omega), *self._C.T.shape))).transpose(0, 2, 1)
        U, sigma, Vh = np.linalg.svd(self._D + self._C @ X, full_matrices=False)
        return U, sigma, Vh, X, Y

    def at_infinity(self):
        """The same at ω = ∞, where the resolvents vanish."""
        U, sigma, Vh = np.linalg.svd(self._D[None], full_matrices=False)
        return U, sigma, Vh, np.zeros((1, *self._B.shape)), np.zeros((1, *self._C.shape))

    def largest(self, omega: np.ndarray) -> np.ndarray:
        """σ_max (k,) at finite frequencies (k,)."""
        return spectral(self._D + self._response(omega))

    def _states(self, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """((jω − A)⁻¹B, jω − A), each (k, …), by linear solves."""
        shifted = 1j * omega[:, None, None] * np.eye(len(self._A)) - self._A
        return np.linalg.solve(shifted, np.broadcast_to(self._B, (len(omega), *self._B.shape))), shifted

    def _response(self, omega: np.ndarray) -> np.ndarray:
        """C (jω − A)⁻¹ B, (k, p, m)."""
        if self._inverse is None:
            return self._C @ self._states(omega)[0]
        R = self._modes.kernel(omega)
        return (self._left * R[:, None, :]) @ self._right

    def sampled_above(self, level: float, most: int) -> np.ndarray:
        """Some of the frequencies of the last `peaks` where the gain was above a level."""
        found = self._omega[self._values >= level]
        return found[:: max(1, -(-len(found) // most))]

    def _slope(self, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(σ_max, dσ_max/dω) at finite frequencies (k,)."""
        if self._inverse is not None:
            R = self._modes.kernel(omega)
            u, sigma, v = _leading(self._D + (self._left * R[:, None, :]) @ self._right)
            return sigma, np.sum((u.conj() @ self._left) * R**2 * (v @ self._right.T), axis=1).imag
        X, shifted = self._states(omega)
        u, sigma, v = _leading(self._D + self._C @ X)
        state = (X @ v[:, :, None])[:, :, 0]
        turned = np.linalg.solve(shifted, state[:, :, None])[:, :, 0]
        return sigma, np.sum((u.conj() @ self._C) * turned, axis=1).imag

    def peaks(self, omega: np.ndarray, near: float, useless: float = math.inf) -> list[tuple[float, float]]:
        """Local maxima (ω, σ_max) within the factor e^−near of the largest, that first; ω = ∞ for the feedthrough.

        Where a sample is above `useless` the maxima are found roughly.
        """
        omega = np.unique(omega)
        values = self.largest(omega)
        self._omega, self._values = omega, values
        infinite = float(np.linalg.norm(self._D, 2))
        padded = np.r_[-math.inf, values, infinite]
        tops = np.flatnonzero((padded[1:-1] >= padded[:-2]) & (padded[1:-1] >= padded[2:]))
        floor = max(float(values.max()), infinite) * math.exp(-1.5 * near)
        tops = tops[values[tops] >= floor]
        low = np.where(tops > 0, omega[tops - 1], 0.0)
        high = np.where(tops + 1 < len(omega), omega[np.minimum(tops + 1, len(omega) - 1)], 2 * omega[tops] + 1.0)
        wanted = LEFT if values.max() <= useless else ROUGHLY
        found: list[tuple[float, float]] = []
        if len(tops):
            found = list(zip(*self._refined(low, omega[tops], high, values[tops], wanted), strict=True))
        if infinite >= floor and padded[-1] > padded[-2]:
            found.append((math.inf, infinite))
        found.sort(key=lambda peak: -peak[1])
        distinct: list[tuple[float, float]] = []
        for where, value in found:
            if all(not abs(where - other) <= 1e-9 * other for other, _ in distinct):
                distinct.append((float(where), float(value)))
        return [peak for peak in distinct if peak[1] >= distinct[0][1] * math.exp(-near)]

    def _refined(self, low, middle, high, values, wanted: float) -> tuple[np.ndarray, np.ndarray]:
        """The maxima between low and high, all at a time: zeros of the slope by Hermite cubics, bisection as guard."""
        best, where = values.copy(), middle.copy()
        value, slope = self._slope(np.concatenate([low, middle, high]))
        v_low, v_mid, v_high = np.split(value, 3)
        s_low, s_mid, s_high = np.split(slope, 3)
        rising = s_mid > 0
        a, v_a, s_a = (np.where(rising, m, l) for m, l in ((middle, low), (v_mid, v_low), (s_mid, s_low)))
        b, v_b, s_b = (np.where(rising, h, m) for m, h in ((middle, high), (v_mid, v_high), (s_mid, s_high)))
        todo = (middle > 0) & (s_mid != 0)
        for _ in range(STEPS):
            k = np.flatnonzero(todo)
            if len(k) == 0:
                break
            width = b[k] - a[k]
            theta = 3 * (v_a[k] - v_b[k]) / width + s_a[k] + s_b[k]
            root = np.sqrt(np.maximum(theta**2 - s_a[k] * s_b[k], 0))
            with np.errstate(divide="ignore", invalid="ignore"):
                point = b[k] - width * (-s_b[k] + root + theta) / (s_a[k] - s_b[k] + 2 * root)
            inside = (s_a[k] > 0) & (s_b[k] < 0) & (point > a[k]) & (point < b[k])
            point = np.where(inside, point, (a[k] + b[k]) / 2)
            value, slope = self._slope(point)
            better = value > best[k]
            best[k[better]], where[k[better]] = value[better], point[better]
            up = slope > 0
            near_end = np.where(up, b[k] - point, point - a[k])
            other = np.where(up, s_b[k], s_a[k])
            left = np.abs(slope) * np.minimum(near_end, width * np.abs(slope) / (np.abs(slope - other) + 1e-300))
            for ends, now in ((a, point), (v_a, value), (s_a, slope)):
                ends[k[up]] = now[up]
            for ends, now in ((b, point), (v_b, value), (s_b, slope)):
                ends[k[~up]] = now[~up]
            enough = wanted * value + BELOW * np.maximum(best.max() - value, 0)
            todo[k] = (left > enough) & (b[k] - a[k] > REFINED * b[k])
        return where, best
