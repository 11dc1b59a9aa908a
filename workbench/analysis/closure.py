"""Statistical linearisation to second order: a linear loop whose forces bend, in Gaussian noise.

    loop, curvature --> mean slopes, noise of the bent forces, memory --> loop again, until nothing changes

Of every coil set's residual force r(d), d its deviations, with averages over the Gaussian d of mean μ and covariance C,
H = E[∂²r/∂d²], R(τ) the correlations of d and K(τ) the answers of d to forces:

    mean slopes           E[∂r/∂d] d                    plain statistical linearisation: alone it misses what follows
    noise                 autocorrelation ½ H:R(τ)R(τ):H    the squared force, uncorrelated with the motion that made it
    memory                H:R(τ)K(τ):H                  what that noise drives meets the motion again

The noise drives the loop, the memory acts in it, R and K are those of the loop so changed. Source: Kraichnan's direct
interaction approximation (J. Fluid Mech. 5 (1959) 497), with Gaussian averages of the force for its values at rest.
Limits: the deviations stay near to Gaussian. Terms beyond the second of the force's expansion in Hermite polynomials
count in the averages only; bursts of flutter, in which a vehicle loses its damping for seconds, do not count at all.

Arrays: K frequencies k/T, k = 0 … N/2; m = 4n deviations of n sets, p = 3n forces. Densities are two-sided per hertz.
"""

from dataclasses import dataclass
from functools import cached_property
from math import factorial

import numpy as np

from workbench.physics.vehicle.curvature import SIGNALS, ForceBend

STEPS = 40
SETTLED = 1e-7  # relative, of every mean square: below it gradients by the adjoint agree with differences to 1e-5


@dataclass(frozen=True)
class GridLoop:
    """The closed linear loop on a uniform grid of frequencies.

    duration, count : T [s] and even N of the times that belong to the grid
    wind : (K, m, t) deviations by t unit noises;  push : (K, m, 5) by loads
    felt_wind, felt_push : (K, r, t), (K, r, 5) what is looked at, by the same
    """

    duration: float
    count: int
    wind: np.ndarray
    push: np.ndarray
    felt_wind: np.ndarray
    felt_push: np.ndarray
    bend: ForceBend

    @cached_property
    def loads(self) -> np.ndarray:
        """(5, p) loads of the sets' forces."""
        return self.bend.loads.reshape(5, -1)

    @property
    def sets(self) -> int:
        """n."""
        return len(self.bend.by_pose)

    @property
    def time_step(self) -> float:
        """[s]"""
        return self.duration / self.count

    @cached_property
    def folds(self) -> np.ndarray:
        """(K,) how often a frequency stands on the two-sided axis: once at the ends, else twice."""
        return np.where((np.arange(len(self.wind)) % (self.count // 2)) == 0, 1.0, 2.0)

    def mean_squares(self, densities: np.ndarray) -> np.ndarray:
        """Of two-sided densities (K, …)."""
        return np.tensordot(self.folds / self.duration, densities, 1)

    def in_time(self, spectrum: np.ndarray) -> np.ndarray:
        """∫ spectrum(f) exp(2πjfτ) df of (K, a, b) at the N times, (a, b, N)."""
        from scipy.fft import irfft

        return irfft(np.moveaxis(spectrum, 0, -1), n=self.count) * (self.count / self.duration)  # pyright: ignore[reportOperatorIssue]

    def in_frequency(self, history: np.ndarray) -> np.ndarray:
        """∫ history(τ) exp(−2πjfτ) dτ of (a, b, N), (K, a, b); a history of fewer times is zero after them."""
        from scipy.fft import rfft

        return np.ascontiguousarray(np.moveaxis(rfft(history, n=self.count), -1, 0)) * self.time_step

    @property
    def at_rest(self) -> "Moments":
        """What the linear loop does: where the search begins."""
        mean = np.zeros((self.sets, SIGNALS))
        return Moments(self.wind @ adjoint(self.wind), self.push @ self.loads, mean)


@dataclass(frozen=True)
class Moments:
    """spectrum : (K, m, m) of the deviations;  answer : (K, m, p) of them to forces;  mean : (n, 4) of them"""

    spectrum: np.ndarray
    answer: np.ndarray
    mean: np.ndarray


@dataclass(frozen=True)
class Passage:
    """One round: from a state to what the bent forces make of it. Names as in the module's text.

    averages : E of derivatives 0 … 4 of the residual force, each (n, 3, 4, …)
    correlation : R (n, 4, n, 4, N);  kernel : K (n, 4, n, 3, N/2), half of it at τ = 0
    once, twice : HR (n, 3, 4, n, 4, N) and HRK (n, 3, n, 4, 3, N/2), which the gradient needs too
    slope : (K, p, m) mean slopes and memory;  noise : (K, p, p)
    turn : (K, 5, p) loads in the loop by forces;  carried : (K, 5, t) loads by the unit noises
    after : the state that follows;  felt : (K, r) densities of what is looked at
    """

    loop: GridLoop
    state: Moments
    averages: list[np.ndarray]
    correlation: np.ndarray
    kernel: np.ndarray
    once: np.ndarray
    twice: np.ndarray
    slope: np.ndarray
    noise: np.ndarray
    turn: np.ndarray
    carried: np.ndarray
    after: Moments
    felt: np.ndarray

    @property
    def covariance(self) -> np.ndarray:
        """(n, 4, 4) of each set's deviations, before this round."""
        return own(self.correlation[..., 0])


def passage(loop: GridLoop, state: Moments) -> Passage:
    """One round of the fixed point."""
    n, half = loop.sets, loop.count // 2
    R = loop.in_time(state.spectrum).reshape(n, SIGNALS, n, SIGNALS, -1)
    K = loop.in_time(state.answer)[..., :half].reshape(n, SIGNALS, n, 3, half)
    K[..., 0] *= 0.5
    averages = gaussian(loop.bend.derivatives, state.mean, own(R[..., 0]))
    force, slopes, H = averages[:3]
    once = (by_signal(H) @ R.reshape(n, SIGNALS, -1)).reshape(n, 3, SIGNALS, n, SIGNALS, -1)
    twice = sum(once[:, :, b, :, :, None, :half] * K[:, None, b, :, None] for b in range(SIGNALS))
    inner = np.swapaxes(H, 1, 2).reshape(n, -1, SIGNALS).swapaxes(1, 2)  # (n, d, cl)
    memory = (inner @ twice.reshape(n, 3, n, -1, half)).reshape(3 * n, SIGNALS * n, half)
    slope = loop.in_frequency(memory)
    for i in range(n):
        slope[:, 3 * i : 3 * i + 3, SIGNALS * i : SIGNALS * (i + 1)] += slopes[i]
    squared = sum(once[:, :, b, :, :, None] * R[:, None, b, :, None] for b in range(SIGNALS))
    squared = 0.5 * (H.reshape(n, 3, -1) @ squared.reshape(n, 3, n, SIGNALS**2, -1))
    noise = loop.in_frequency(squared.reshape(3 * n, 3 * n, -1))

    closed = np.eye(5) - loop.loads @ (slope @ loop.push)
    turn = np.linalg.solve(closed, np.broadcast_to(loop.loads.astype(complex), (len(closed), 5, 3 * n)))
    carried = turn @ (slope @ loop.wind)
    answer, moved = loop.push @ turn, loop.wind + loop.push @ carried
    spectrum = moved @ adjoint(moved) + answer @ noise @ adjoint(answer)
    mean = loop.push[0].real @ loop.loads @ force.ravel()
    direct, stirred = loop.felt_wind + loop.felt_push @ carried, loop.felt_push @ turn
    felt = (np.abs(direct) ** 2).sum(2) + ((stirred @ noise) * stirred.conj()).sum(2).real
    return Passage(
        loop, state, averages, R, K, once, twice, slope, noise, turn, carried,
        Moments(spectrum, answer, mean.reshape(n, SIGNALS)), felt,
    )  # fmt: skip


def settled(loop: GridLoop, tolerance: float = SETTLED) -> Passage | None:
    """The round that changes no mean square; None where the rounds find none, or the loop so changed is not stable."""
    state, before = loop.at_rest, np.full(loop.felt_wind.shape[1], np.inf)
    for _ in range(STEPS):
        with np.errstate(over="ignore", invalid="ignore"):  # rounds that run away: seen just below
            found = passage(loop, state)
        now = loop.mean_squares(found.felt)
        if not np.all(np.isfinite(now)):
            return None
        if np.all(np.abs(now - before) <= tolerance * np.abs(now)):
            return found if _causal(loop, found.after.answer) else None
        state, before = found.after, now
    return None


def _causal(loop: GridLoop, answer: np.ndarray) -> bool:
    """Whether the answers end: those of an unstable loop come before their cause."""
    half = loop.count // 2

    def early(response: np.ndarray) -> float:
        square = (loop.in_time(response) ** 2).sum(axis=(0, 1))
        return float(square[half:].sum() / square.sum())

    return early(answer) < early(loop.push @ loop.loads) + 0.1  # of all; a growing mode has most of it there


def gaussian(derivatives: tuple[np.ndarray, ...], mean: np.ndarray, covariance: np.ndarray) -> list[np.ndarray]:
    """Averages over Gaussian deviations of the derivatives 0 … 4 of the residual force of every set.

    derivatives : 2 … 5 at rest;  mean : (n, 4);  covariance : (n, 4, 4)

    E[f] of a polynomial is exp(½ C:∂∂) f at the mean, a finite sum.
    """
    n, most = len(mean), len(derivatives) + 1
    at_rest = [np.zeros((n, 3)), np.zeros((n, 3, SIGNALS)), *derivatives]
    moved = []
    for order in range(most + 1):
        total = np.zeros_like(at_rest[order])
        for more in range(most + 1 - order):
            part = at_rest[order + more]
            for _ in range(more):
                part = np.einsum("i...a,ia->i...", part, mean)
            total = total + part / factorial(more)
        moved.append(total)
    out = []
    for order in range(most):
        total = moved[order]
        if order + 2 <= most:
            total = total + 0.5 * np.einsum("i...ab,iab->i...", moved[order + 2], covariance)
        if order + 4 <= most:
            total = total + 0.125 * np.einsum("i...abcd,iab,icd->i...", moved[order + 4], covariance, covariance)
        out.append(total)
    return out


def by_signal(H: np.ndarray) -> np.ndarray:
    """(n, kb, a) of H (n, k, a, b), which is symmetric in a and b."""
    return H.reshape(len(H), -1, SIGNALS)


def own(between: np.ndarray) -> np.ndarray:
    """(n, a, b) of each set with itself, from (n, a, n, b)."""
    return np.einsum("iaib->iab", between)


def adjoint(matrices: np.ndarray) -> np.ndarray:
    """Conjugate transpose of each."""
    return matrices.conj().swapaxes(-1, -2)
