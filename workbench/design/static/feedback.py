"""Static output feedback: the gain K of u = K y that makes the H∞ or the H2 norm of a plant small.

    plant, norm --starts--> K stable --minimise--> K locally best --exact norm--> StaticFeedback

The nonsmooth solver on the closed loop's own matrices, without the machinery of structures and goals. The norm reported
comes from another algorithm than the one that steered: for H∞ a bracket that holds it, for H2 a Lyapunov solution with
an error bound.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from workbench.design.static.affine import GainSet
from workbench.design.static.loop import Peaks, StaticLoop
from workbench.errors import InfeasibleError, InputError
from workbench.lti.norm import peak_gain
from workbench.lti.variance import stationary
from workbench.machine.budget import checked_budget
from workbench.result import Result, Row
from workbench.solve.nonsmooth import Minimum, minimise

NORMS = ("hinf", "h2")
COARSE = 1e-4  # of the log of the norm, per step: where starts are compared
FINE = {"hinf": 1e-6, "h2": 1e-9}  # where the best of them are finished
MOST_COARSE, MOST_FINE = (20, 60), 300  # evaluations of one round of each; a round begins with a new metric
FINE_ROUNDS = 8
RENEWED = 20  # tolerances that one of two rounds must gain for another one
WARM, MOST_WARM = 1e-2, 60  # of the H2 descent before the H∞ one: a glance, since cheap control has no H2 optimum
WARMED = 0  # even starts are warmed, odd ones are not
WITHIN = 0.15  # of the log of the norm of the best start so far: others are finished too
SCATTER = (-4.0, 0.5)  # decades of the size of random starts, over what moves A by its own norm
DECAY = 1e-6  # least decay of the closed loop, relative to the plant's fastest pole: slower ones defy certification
ROOM = 10.0  # of a start's own decay over the least one, where no start has come further
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
    minimum: Minimum  # of the log of the norm; x holds the entries of K row by row
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
        Zero if left out. For H2 the gain is sought among those with D11 + D12 K D21 = 0.
    norm : "hinf" or "h2"
    starts, seed : int
        The first start is K0 (zero if left out), the others random. The result is never worse than K0, where that
        stabilises, and within the time allowed never worse than with fewer starts.
    budget_seconds : float
        Of the whole search; shared by the starts.
    largest : float or (u, y), optional
        Bound on |K|, entry by entry; without it 1e5 times what moves A by its own norm, since optimal gains may be
        infinite.
    on_progress : (words, value) → bool, optional
        Called after every step; True ends the search.

    Raises
    ------
    InputError
        If matrices do not fit, K0 lies outside the bounds, or no gain gives a finite H2 norm.
    InfeasibleError
        If no start could be stabilised; the message names the eigenvalue that remained.

    Source: Apkarian & Noll, IEEE Trans. Automat. Control 51 (2006) 71; Burke, Henrion, Lewis & Overton (2006).
    """
    if norm not in NORMS:
        raise InputError(f"norm must be one of {', '.join(NORMS)}; got {norm!r}. Choose one.")
    if starts < 1:
        raise InputError(f"starts must be at least 1; got {starts!r}. Four is usual.")
    checked_budget(budget_seconds)
    loop = StaticLoop.of(A, B1, B2, C1, C, D11, D12, D21)
    gains = GainSet.everything(loop.size())
    if norm == "h2":
        gains = GainSet.without_feedthrough(loop.D11, loop.D12, loop.D21, loop.size())
    limit = WIDEST * loop.size() if largest is None else np.broadcast_to(np.asarray(largest, float), loop.shape)
    if largest is None and np.shape(K0) == loop.shape:  # a default gives way  # pyright: ignore[reportCallIssue]
        limit = np.maximum(limit, np.abs(np.asarray(K0, float)))
    if not np.all(limit > 0):
        raise InputError(f"largest must be positive; got {largest!r}. Leave it out for a wide default.")
    return _Search(loop, gains, norm, limit, seed, budget_seconds, on_progress).run(starts, K0)


class _Search:
    """One call: starts, comparison, finish."""

    def __init__(
        self, loop: StaticLoop, gains: GainSet, norm: str, limit: np.ndarray, seed: int, budget: float, on_progress
    ) -> None:
        self._limit, self._gains = limit, gains
        scale = np.linalg.norm(loop.C1) * np.linalg.norm(loop.B1) / (np.linalg.norm(loop.A, 2) or 1.0)
        self._least = math.log(NOTHING * (scale + np.linalg.norm(loop.D11) or 1.0))
        self._loop, self._norm, self._seed, self._on_progress = loop, norm, seed, on_progress
        self._deadline, self._begun = perf_counter() + budget, perf_counter()
        self._min_decay = DECAY * (float(np.abs(np.linalg.eigvals(loop.A)).max()) or float(np.linalg.norm(loop.A, 2)))
        self._ended = False

    def _measure(self) -> Callable[[np.ndarray], list[tuple[float, np.ndarray]]]:
        """The norm to make small, for one descent."""
        if self._norm == "hinf":
            return Peaks(self._loop, self._min_decay)

        def variance(K: np.ndarray) -> list[tuple[float, np.ndarray]]:
            slow = self._loop.abscissa(K)
            return self._loop.variance(K) if max(value for value, _ in slow) < -self._min_decay else []

        return variance

    def _minimise(self, measure, K: np.ndarray, words: str, until: float, *, plain=False, **options) -> Minimum:
        gains, limit = self._gains, self._limit

        def flat(z: np.ndarray):
            gain = gains.gain(z)
            if gains.basis is not None and np.any(np.abs(gain) > limit):
                return []  # a box in K is none in the coordinates: its walls are the edge of the domain
            return [(value, gains.gradient(gradient)) for value, gradient in measure(gain)]

        def told(z: np.ndarray, value: float) -> bool:
            self._ended = self._on_progress is not None and bool(self._on_progress(words, value))
            return self._ended

        begin = gains.coordinates(K)
        if gains.size == 0 or not flat(begin):
            value = max((value for value, _ in flat(begin)), default=math.inf)
            return Minimum(
                x=gains.gain(begin).ravel(), value=value, stationarity=0.0, radius=0.0, evaluations=1, steps=0,
                seconds=0.0, message="the feedthrough fixes the gain, or the start lies outside the bounds",
            )  # fmt: skip
        found = minimise(
            flat, begin, bounds=np.column_stack([-limit.ravel(), limit.ravel()]) if gains.basis is None else None,
            scale=gains.scale, metric=None if plain else gains.metric(self._loop.metric(K)), seed=self._seed,
            on_step=told, budget_seconds=max(until - perf_counter(), 1e-3), **options,
        )  # fmt: skip
        return replace(found, x=gains.gain(found.x).ravel())

    def run(self, starts: int, K0) -> StaticFeedback:
        shape = self._loop.shape
        first = np.zeros(shape) if K0 is None else np.asarray(K0, float)
        if first.shape != shape:
            raise InputError(
                f"K0 must have shape {shape}; got {first.shape}. One row per input, one column per measurement."
            )
        if np.any(np.abs(first) > self._limit):
            raise InputError(
                f"K0 must lie within the bounds, |K| at most {self._limit.tolist()}; got {first.tolist()}. "
                "Move it, or give a larger `largest`."
            )
        generator = np.random.default_rng(self._seed)
        ends: list[Minimum | None] = []
        unstable: list[Minimum] = []
        finished: list[Minimum] = []  # the best first
        for k in range(starts):
            K = first if k == 0 else first + self._scatter(k, generator)
            if self._ended or (perf_counter() > self._deadline and ends):
                break
            until = self._share(starts - k, 0.5)
            stable = self._stabilised(K, until)
            if k == 0 and stable.value >= 0 and (other := self._loop.regulator()) is not None:
                other = self._stabilised(np.clip(other, -self._limit, self._limit), until)
                stable = min(stable, other, key=lambda m: m.value)
            if stable.value < 0 and not any(ends):  # a plant that can hardly be stabilised: less is asked of it
                self._min_decay = min(self._min_decay, -stable.value / ROOM)
            if stable.value >= 0 or not self._measure()(stable.x.reshape(shape)):
                unstable.append(stable)
                ends.append(None)
                continue
            K = stable.x.reshape(shape)
            if self._norm == "hinf" and k % 2 == WARMED:
                K = self._warmed(K, until)
            for most in MOST_COARSE:  # the metric of a loop that is barely stable serves for a few steps only
                end = self._descended(K, f"start {k + 1}", until, tolerance=COARSE, polish=False, evaluations=most)
                K = end.x.reshape(shape)
            self._finish(end, [m for m in ends if m is not None], finished, starts - k)
            ends.append(end)
        given = self._given(first)
        if not finished and given is None:
            self._refuse(min(unstable, key=lambda m: m.value), starts)
        tuned = perf_counter() - self._begun
        return self._reported(finished, given, [math.inf if m is None else math.exp(m.value) for m in ends], tuned)

    def _share(self, parts: int, of: float = 1.0) -> float:
        """The end of a share of the time left, or of a part of that share."""
        return perf_counter() + of * max(self._deadline - perf_counter(), 0.0) / parts

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

    def _warmed(self, K: np.ndarray, until: float) -> np.ndarray:
        """A gain of small H2 norm, feedthrough not counted: smooth, cheap, often in a good valley of the H∞ norm."""
        if not self._loop.variance(K):
            return K
        warm = self._minimise(
            self._loop.variance, K, "small variance", until, tolerance=WARM, size=1.0, polish=False,
            evaluations=MOST_WARM,
        ).x.reshape(K.shape)  # fmt: skip
        return warm if self._measure()(warm) else K

    def _descended(self, K: np.ndarray, words: str, until: float, **options) -> Minimum:
        return self._minimise(self._measure(), K, words, until, stop_below=self._least, size=1.0, **options)

    def _finish(self, end: Minimum, before: list[Minimum], finished: list[Minimum], parts: int) -> None:
        """One round for a start that may be the best so far, further rounds if it is: metric of where it stands, plain.

        What is done for a start depends on those before it alone, so further starts take nothing back. `finished` is
        kept in order, and what the best one came from stays in it: the certificate decides between them.
        """
        least = min((m.value for m in before), default=math.inf)
        if end.value >= least + WITHIN or any(abs(m.value - end.value) <= ALIKE for m in before):
            return
        tolerance, until = FINE[self._norm], self._share(parts)

        def round_of(m: Minimum, plain: bool) -> Minimum:
            found = self._descended(
                m.x.reshape(self._loop.shape), "finish", until, tolerance=tolerance, evaluations=MOST_FINE, plain=plain
            )
            return found if found.value <= m.value else m

        here, idle = round_of(end, False), 0
        finished += [here] if here is end else [here, end]
        for k in range(1, FINE_ROUNDS):
            finished.sort(key=lambda m: m.value)
            if finished[0] is not here or idle == 2 or here.value < self._least:
                break
            if self._ended or perf_counter() > until:
                break
            found = round_of(here, k % 2 == 1)
            idle = idle + 1 if here.value - found.value < RENEWED * tolerance else 0
            if found is not here:
                finished.append(found)
                here = found
        finished.sort(key=lambda m: m.value)

    def _given(self, K: np.ndarray) -> Minimum | None:
        """The given gain as it is, where it has a norm."""
        if np.any(K - self._gains.gain(self._gains.coordinates(K))) or not self._loop.abscissa(K)[0][0] < 0:
            return None
        value = max((value for value, _ in self._measure()(K)), default=math.inf)
        return Minimum(
            x=K.ravel(), value=value, stationarity=math.inf, radius=0.0, evaluations=1, steps=0, seconds=0.0,
            message="nothing better than the given gain was found",
        )  # fmt: skip

    def _reported(
        self, candidates: list[Minimum], given: Minimum | None, starts: list[float], tuned: float
    ) -> StaticFeedback:
        """The record with the smallest proved norm; further ones only where the best one's bracket is wide.

        A gain whose norm cannot be certified is passed over for the next one. The given gain wins where it is better.
        """
        begun = perf_counter()
        records: list[StaticFeedback] = []
        refusals: list[str] = []
        for m in candidates:
            if math.exp(m.value) >= min((record.upper for record in records), default=math.inf):
                break
            try:
                records.append(self._record(m, starts, tuned, begun))
            except (InputError, np.linalg.LinAlgError) as error:
                refusals.append(str(error))
        best = min(records, key=lambda record: record.upper, default=None)
        if given is not None and (best is None or math.exp(given.value) < best.value):
            try:
                own = self._record(given, starts, tuned, begun)
                best = own if best is None or own.value < best.value else best
            except (InputError, np.linalg.LinAlgError) as error:
                refusals.append(str(error))
        if best is None:
            raise InfeasibleError(
                f"the norm of the gain that was found must be certified; it cannot be: {refusals[0]} "
                "Bound the gain, or price it."
            )
        return best

    def _record(self, best: Minimum, starts: list[float], tuned: float, begun: float) -> StaticFeedback:
        """The exact norm of one gain."""
        K = best.x.reshape(self._loop.shape)
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
        mode, side = self._loop.fixed_mode()
        cure = "Try more starts, or give the controller states."
        if side:
            cure = f"No controller can: the mode {mode.real:.4g} ± {abs(mode.imag):.4g}j is out of reach of the {side}."
        if self._gains.basis is not None:
            cure = f"Only gains without feedthrough count here ({self._gains.size} free directions). {cure}"
        raise InfeasibleError(
            f"a static gain must make every eigenvalue stable; the best of {starts} starts leaves "
            f"{worst.real:.4g} ± {abs(worst.imag):.4g}j 1/s. {cure}"
        )
