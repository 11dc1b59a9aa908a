"""Static output feedback: the gain K of u = K y that makes the H∞ or the H2 norm of a plant small.

    plant, norm --starts--> K stable --minimise--> K locally best --exact norm--> StaticFeedback

The nonsmooth solver on the closed loop's own matrices, without the machinery of structures and goals. The norm reported
comes from another algorithm than the one that steered: for H∞ a bracket that holds it, for H2 a Lyapunov solution with
an error bound.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from workbench.analysis.norm import peak_gain
from workbench.analysis.variance import stationary
from workbench.errors import InfeasibleError, InputError
from workbench.result import Result, Row
from workbench.tuning.nonsmooth import Minimum, minimise
from workbench.tuning.static_loop import Peaks, StaticLoop

NORMS = ("hinf", "h2")
COARSE = 1e-4  # of the log of the norm, per step: where starts are compared
FINE = {"hinf": 1e-6, "h2": 1e-9}  # where the best of them are finished
MOST_COARSE, MOST_FINE = 200, 1000  # evaluations of each
FINISHED = 2  # starts that are finished, the second only if within
WITHIN = 0.15  # of the log of the norm of the first
SCATTER = (-4.0, 0.5)  # decades of the size of random starts, over what moves A by its own norm
MARGIN = 1e-4  # decay of a stabilising start, relative to ‖A‖
ALIKE = 1e-3  # of the log of the norm: starts closer than that ended in the same valley
WIDEST = 1e5  # default bound of |K| over what moves A by its own norm: beyond, closed loops drown in rounding
NOTHING = 1e-9  # norm over ‖C1‖‖B1‖/‖A‖ + ‖D11‖ below which nothing is left to gain


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class StaticFeedback(Result):
    """A static gain, the norm it reaches, and the evidence.

    `upper` bounds the norm of the closed loop (floating point, rounding estimated); `lower` likewise. `starts` holds
    the norm at which each start ended, infinite where it was not stabilised.
    """

    K: np.ndarray  # (u, y), u = K y
    norm: str
    value: float
    lower: float
    upper: float
    frequency: float | None  # [rad/s] of the peak; None for H2
    abscissa: float  # [1/s] largest real part of the closed loop's poles
    minimum: Minimum  # of the log of the norm
    starts: tuple[float, ...]
    tuning_seconds: float
    exact_seconds: float

    def rows(self) -> list[Row]:
        """Norm, bounds, times."""
        return [
            (f"{self.norm} norm", self.value, ""),
            ("upper bound", self.upper, ""),
            ("largest real part", self.abscissa, "1/s"),
            ("starts that reach it within 0.5 %", sum(v <= 1.005 * self.value for v in self.starts), ""),
            ("tuning", self.tuning_seconds, "s"),
            ("exact norm", self.exact_seconds, "s"),
        ]


def static_feedback(
    A, B1, B2, C1, C, D11=None, D12=None, D21=None, *,
    norm: str = "hinf", starts: int = 4, seed: int = 0, budget_seconds: float = 60.0, K0=None, largest=None,
    on_progress: Callable[[str, float], bool | None] | None = None,
) -> StaticFeedback:  # fmt: skip
    """The static gain K, u = K y, with the smallest norm from w to z that local search from several starts finds.

    Parameters
    ----------
    A, B1, B2, C1, C : (n, n), (n, w), (n, u), (z, n), (y, n)
        dx/dt = A x + B1 w + B2 u, z = C1 x + D11 w + D12 u, y = C x + D21 w.
    D11, D12, D21 : (z, w), (z, u), (y, w), optional
        Zero if left out. For H2, D11 = 0 and D12 K D21 = 0 for every K.
    norm : "hinf" or "h2"
    starts, seed : int
        The first start is K0 (zero if left out), the others random.
    budget_seconds : float
        Of the whole search; shared by the starts.
    largest : float or (u, y), optional
        Bound on |K|, entry by entry; without it 1e5 times what moves A by its own norm, since optimal gains may be
        infinite.
    on_progress : (words, value) → bool, optional
        Called after every step; True ends the search.

    Returns
    -------
    StaticFeedback

    Raises
    ------
    InputError
        If matrices do not fit, or H2 has no finite value.
    InfeasibleError
        If no start could be stabilised; the message names the eigenvalue that remained.

    Source: Apkarian & Noll, IEEE Trans. Automat. Control 51 (2006) 71; Burke, Henrion, Lewis & Overton (2006).
    """
    if norm not in NORMS:
        raise InputError(f"norm must be one of {', '.join(NORMS)}; got {norm!r}. Choose one.")
    if starts < 1:
        raise InputError(f"starts must be at least 1; got {starts!r}. Four is usual.")
    loop = StaticLoop.of(A, B1, B2, C1, C, D11, D12, D21)
    if norm == "h2" and (loop.D11.any() or (loop.D12.any() and loop.D21.any())):
        raise InputError(
            "the H2 norm must have no feedthrough from w to z: D11 = 0 and D12 = 0 or D21 = 0; filter w or z."
        )
    limit = WIDEST * loop.size() if largest is None else np.broadcast_to(np.asarray(largest, float), loop.shape)
    if not np.all(limit > 0):
        raise InputError(f"largest must be positive; got {largest!r}. Leave it out for a wide default.")
    return _Search(loop, norm, limit, seed, budget_seconds, on_progress).run(starts, K0)


class _Search:
    """One call: starts, comparison, finish."""

    def __init__(self, loop: StaticLoop, norm: str, limit: np.ndarray, seed: int, budget: float, on_progress) -> None:
        self._limit = limit.ravel()
        scale = np.linalg.norm(loop.C1) * np.linalg.norm(loop.B1) / (np.linalg.norm(loop.A, 2) or 1.0)
        self._least = math.log(NOTHING * (scale + np.linalg.norm(loop.D11) or 1.0))
        self._loop, self._norm, self._seed, self._on_progress = loop, norm, seed, on_progress
        self._deadline, self._begun = perf_counter() + budget, perf_counter()
        self._measure = Peaks(loop) if norm == "hinf" else loop.variance
        self._ended = False

    def _minimise(self, measure, K: np.ndarray, words: str, until: float, **options) -> Minimum:
        shape = self._loop.shape

        def flat(x: np.ndarray):
            return [(value, gradient.ravel()) for value, gradient in measure(x.reshape(shape))]

        def told(x: np.ndarray, value: float) -> bool:
            self._ended = self._on_progress is not None and bool(self._on_progress(words, value))
            return self._ended

        return minimise(
            flat, K.ravel(), bounds=np.column_stack([-self._limit, self._limit]), scale=self._loop.size().ravel(),
            seed=self._seed, on_step=told, budget_seconds=max(until - perf_counter(), 1e-3), **options,
        )  # fmt: skip

    def run(self, starts: int, K0) -> StaticFeedback:
        shape = self._loop.shape
        first = np.zeros(shape) if K0 is None else np.asarray(K0, float)
        if first.shape != shape:
            raise InputError(
                f"K0 must have shape {shape}; got {first.shape}. One row per input, one column per measurement."
            )
        generator = np.random.default_rng(self._seed)
        ends: list[Minimum | None] = []
        unstable: list[Minimum] = []
        for k in range(starts):
            K = first if k == 0 else first + self._scatter(k, generator)
            if self._ended or (perf_counter() > self._deadline and ends):
                break
            left = max(self._deadline - perf_counter(), 0.0)
            until = perf_counter() + left / (starts - k + 1)
            stable = self._stabilised(K, until)
            if stable.value >= 0 or not list(self._measure(stable.x.reshape(shape))):
                unstable.append(stable)
                ends.append(None)
                continue
            ends.append(self._minimise(
                self._measure, stable.x.reshape(shape), f"start {k + 1}", until, tolerance=COARSE, polish=False,
                stop_below=self._least, evaluations=MOST_COARSE,
            ))  # fmt: skip
        found = sorted((m for m in ends if m is not None), key=lambda m: m.value)
        if not found:
            self._refuse(min(unstable, key=lambda m: m.value), starts)
        chosen: list[Minimum] = []
        for m in found:
            if (
                len(chosen) < FINISHED
                and m.value < found[0].value + WITHIN
                and all(abs(m.value - other.value) > ALIKE for other in chosen)
            ):
                chosen.append(m)
        best = min((self._finished(m, len(chosen)) for m in chosen), key=lambda m: m.value)
        tuned = perf_counter() - self._begun
        return self._reported(best, [math.inf if m is None else math.exp(m.value) for m in ends], tuned)

    def _scatter(self, k: int, generator: np.random.Generator) -> np.ndarray:
        """A random gain; sizes take turns from the largest third of the decades to the smallest."""
        low, high = SCATTER
        decade = high - (high - low) * ((k - 1) % 3 + generator.random()) / 3
        return self._loop.size() * generator.normal(size=self._loop.shape) * 10**decade

    def _stabilised(self, K: np.ndarray, until: float) -> Minimum:
        wanted = -MARGIN * float(np.linalg.norm(self._loop.A, 2))
        return self._minimise(
            self._loop.abscissa, K, "stabilising", until, stop_below=wanted, tolerance=1e-6, evaluations=2000
        )  # fmt: skip

    def _finished(self, coarse: Minimum, share: int) -> Minimum:
        until = perf_counter() + max(self._deadline - perf_counter(), 0.0) / share
        return self._minimise(
            self._measure, coarse.x.reshape(self._loop.shape), "finish", until, tolerance=FINE[self._norm],
            stop_below=self._least, evaluations=MOST_FINE,
        )  # fmt: skip

    def _reported(self, best: Minimum, starts: list[float], tuned: float) -> StaticFeedback:
        """The exact norm and the record."""
        K = best.x.reshape(self._loop.shape)
        begun = perf_counter()
        A, B, C, D = self._loop.closed(K)
        frequency = None
        if self._norm == "hinf":
            peak = peak_gain(A, B, C, D)
            value, lower, upper, frequency = peak.value, peak.lower, peak.upper, peak.frequency
        else:
            solution = stationary(A, B, correlation=np.eye(B.shape[1]))
            mean, bound = float(solution.mean_squares(C).sum()), float(solution.mean_square_bounds(C).sum())
            value, lower, upper = (math.sqrt(max(v, 0.0)) for v in (mean, mean - bound, mean + bound))
        exact = perf_counter() - begun
        return StaticFeedback(
            K=K, norm=self._norm, value=value, lower=lower, upper=upper, frequency=frequency,
            abscissa=float(np.linalg.eigvals(A).real.max()), minimum=best, starts=tuple(starts),
            tuning_seconds=tuned, exact_seconds=exact,
        )  # fmt: skip

    def _refuse(self, nearest: Minimum, starts: int) -> None:
        K = nearest.x.reshape(self._loop.shape)
        poles = np.linalg.eigvals(self._loop.closed(K)[0])
        worst = poles[np.argmax(poles.real)]
        raise InfeasibleError(
            f"a static gain must make every eigenvalue stable; the best of {starts} starts leaves "
            f"{worst.real:.4g} ± {abs(worst.imag):.4g}j 1/s. Try more starts, or give the controller states."
        )
