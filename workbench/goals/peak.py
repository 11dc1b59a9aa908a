"""The largest value over frequency of something made from a channel's response, with the gradient of every near peak.

    channel --T(jω)--> Shape: size(ω, T) --search over the band--> peaks --pieces--> ∂size/∂T --pullback--> ∂/∂K

Continuous channels without dead time are sampled through one Schur form, and where the shape is the largest singular
value of a rational matrix its Hamiltonian tells whether a peak was missed. Sampled channels are taken to the w plane by
s = (2/h)(z − 1)/(z + 1), which keeps every response and turns the circle into the axis. What has no Hamiltonian (dead
times, bands, breakpoints, densities) is steered on a grid made from the poles and judged by branch and bound.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from workbench.errors import InputError
from workbench.goals.goal import FULL_BAND, stability_reason
from workbench.goals.measure import NEAR, Value, infinite, near
from workbench.lti.bilinear import in_w_plane, unwarped, warped
from workbench.lti.count import unstable_poles
from workbench.lti.grid import seeds
from workbench.lti.modal import modal_responder
from workbench.lti.norm import crossings, intervals_above, peak_gain
from workbench.lti.peak_bound import CLOSE, Bracket, bracket, farther
from workbench.lti.peak_ceiling import Ceiling, Panels
from workbench.lti.peak_search import local_peaks, peaks
from workbench.lti.realisation import Realisation, balanced

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

Piece = tuple[float, np.ndarray, str]  # value, W (p, m) with ∂value = Re Σ conj(W) ∂T, channel
BESIDE = 1e-4  # of the first frequency off an end: a limit's gradient there is right to the square of it
NO_END = (
    "towards ω = {} the limit vanishes beside the response, or asks for more than any gain; the measure is infinite."
)
INFINITE = "the response is infinite, or its limit vanishes, at {:.4g} rad/s."
TELLING = 1e-9  # relative width of a bracket that is to tell which side of 1 a value is on


class Shape(Protocol):
    """What is measured at each frequency."""

    def size(self, axis: "Axis", T: np.ndarray) -> np.ndarray:
        """The largest value (k,) at each frequency; T : (k, p, m)."""
        ...

    def pieces(self, axis: "Axis", T: np.ndarray) -> list[Piece]:
        """The values near the largest one at one frequency, T : (1, p, m), each with its gradient."""
        ...

    def system(self, T: Realisation, sampled: bool) -> Realisation | None:
        """A continuous system whose largest singular value is `size`, or None; T in the w plane if sampled."""
        ...

    def ends(self, T: Realisation, sampled: bool) -> tuple[float, float]:
        """Limits of `size` at ω = 0 and ∞ where it is 0·∞; NaN where it has a value of its own."""
        ...

    def ceiling(self, T: Realisation, late: np.ndarray, end: float | None) -> Ceiling:
        """Bounds of `size` on intervals; T with a row for each dead time `late` (N,), in the w plane if sampled."""
        ...

    def corners(self) -> np.ndarray:
        """Further frequencies (k,) that a grid must hold."""
        ...

    def refusal(self, T: Realisation) -> str:
        """Why the measure of this (stable) system does not exist; empty if it does."""
        ...


@dataclass(frozen=True, slots=True)
class Axis:
    """Frequencies as a response sees them: the true ones, and those of continuous filters by Tustin's rule."""

    omega: np.ndarray  # (k,) [rad/s]
    filters: np.ndarray  # (k,) (2/h) tan(ωh/2) on a sampled channel, ω otherwise

    @classmethod
    def of(cls, omega: np.ndarray, sample_time: float | None) -> "Axis":
        """The axis of a channel."""
        if sample_time is None:
            return cls(omega, omega)
        return cls(omega, warped(omega, sample_time))


@dataclass(frozen=True, slots=True)
class Sampled:
    """A channel's closed loop for one controller, ready to be asked for its response."""

    system: Realisation  # in the w plane if the channel is sampled; Padé if delayed
    poles: np.ndarray  # in the same plane
    response: Callable[[Axis], np.ndarray]
    reason: str  # why there is nothing to ask; empty for a stable loop


def sampled(channel: Any, K: "Controller", *, judged: bool = False) -> Sampled:
    """The response of a channel for K, or why there is none; `judged`: poles with dead times are counted, too."""
    if channel.delayed:
        return _late(channel, K, judged)
    h = channel.sample_time
    try:
        A, B, C, D = channel.system(K)
    except InputError as error:  # an algebraic loop without solution
        return _nothing(str(error))
    if not all(np.isfinite(block).all() for block in (A, B, C, D)):
        return _nothing("the closed loop's matrices overflow.")
    system: Realisation | None = Realisation(A, B, C, D)
    if h is not None:
        reason = stability_reason(np.linalg.eigvals(balanced(*system).A), h)  # in z, where the loop is given
        system = None if reason else in_w_plane(system, h)
        if system is None:
            return _nothing(reason or "the closed loop has a pole at z = −1; its measure does not exist.")
    system = balanced(*system)
    answer, poles = modal_responder(system)
    reason = stability_reason(poles, h, in_w_plane=h is not None)
    if reason:
        return _nothing(reason)
    return Sampled(system, poles, lambda axis: answer(axis.filters), "")


def _late(channel: Any, K: "Controller", judged: bool) -> Sampled:
    """The same with dead times, the poles those that are located; its `system` has Padé fractions and only steers."""
    try:
        system, poles = channel.system(K), channel.poles(K)
        reason = stability_reason(poles, None)
        count = unstable_poles(channel.lined(K), channel.late(K)) if judged and not reason else 0
    except InputError as error:
        return _nothing(str(error))
    if count:
        reason = f"the closed loop is unstable: {count} poles on or right of the axis; its measure does not exist."
    return Sampled(system, poles, lambda axis: channel.response(K, axis.omega), reason)


def _nothing(reason: str) -> Sampled:
    return Sampled(Realisation(*(np.zeros((0, 0)),) * 4), np.zeros(0), lambda axis: np.zeros(0), reason)


@dataclass(frozen=True, slots=True)
class PeakMeasure:
    """The largest value of a shape over a band of frequencies."""

    channel: Any
    shape: Shape
    band: tuple[float, float] = FULL_BAND
    close: float = CLOSE  # relative width of the bracket where branch and bound judges

    def __post_init__(self) -> None:
        h = self.channel.sample_time
        if h is not None and self.band[0] >= math.pi / h:
            raise InputError(
                f"focus must begin below the Nyquist frequency {math.pi / h:.4g} rad/s; got {self.band}. Lower it."
            )

    def evaluate(self, K: "Controller") -> Value:
        """Search with refinement, checked by the Hamiltonian where there is one."""
        state = sampled(self.channel, K)
        reason = state.reason or self.shape.refusal(state.system)
        if reason:
            return infinite(reason)
        ends = self._ends(state)
        size = self._size(state, tuple(-math.inf if end == math.inf else end for end in ends))
        rational = (
            None if self.channel.delayed else self.shape.system(state.system, self.channel.sample_time is not None)
        )
        grid = self._grid(state, "normal" if rational is None else "sparse")
        found = peaks(size, grid, None if rational is None else self._crossing(rational, size))
        if not math.isfinite(found[0][1]):
            return infinite(INFINITE.format(found[0][0]))
        pieces, label = [], ""
        for omega, value in found:
            if value < found[0][1] * (1 - NEAR) and pieces:
                continue
            omega = _beside(omega, grid, ends)
            axis = Axis.of(np.array([omega]), self.channel.sample_time)
            for piece, W, where in self.shape.pieces(axis, state.response(axis)):
                if not np.isfinite(W).all():
                    continue
                label = label or where
                pieces.append((piece, self._pulled(K, omega, W, state)))
        method = "pole-based grid, refined" if rational is None else "two-step on the Hamiltonian"
        value = max(found[0][1], *(piece for piece, _ in pieces)) if pieces else found[0][1]
        return Value(value=value, gradients=near(pieces), frequency=found[0][0], channel=label, method=method)

    def exact(self, K: "Controller") -> Value:
        """A bracket: by the Hamiltonian for rational shapes over all frequencies, else by branch and bound."""
        state = sampled(self.channel, K, judged=True)
        reason = state.reason or self._refusal(state, K)
        if reason:
            return infinite(reason)
        ends = self._ends(state)
        if math.inf in ends:
            return infinite(NO_END.format("0" if math.isinf(ends[0]) else "∞"), method="limit at the end of the axis")
        h = self.channel.sample_time
        rational = None if self.channel.delayed else self.shape.system(state.system, h is not None)
        if rational is not None and self.full and _stable(rational):
            peak = peak_gain(*rational)
            omega = peak.frequency if h is None else float(unwarped(peak.frequency, h))
            method = "certified bracket, Hamiltonian" + (" in the w plane" if h is not None else "")
            upper, value, near_omega = peak.upper, peak.value, omega
            if value < 1 < upper:  # rounding beside light modes leaves it open; intervals of frequency may tell
                upper = min(upper, self._bracketed(state, K, ends).upper)
        else:
            found = self._bracketed(state, K, ends)
            value, omega, upper = found.value, found.frequency, found.upper
            near_omega = _beside(omega, self._grid(state, "normal"), ends)
            method = f"bracket over {found.intervals} intervals of frequency" + (
                ", dead times exact" if self.channel.delayed else ""
            )
        if math.isinf(value):
            return infinite(INFINITE.format(omega), method=method)
        axis = Axis.of(np.array([near_omega]), h)
        label = next((where for _, _, where in self.shape.pieces(axis, state.response(axis))), "")
        return Value(value=value, frequency=omega, channel=label, method=method, upper=upper)

    def _refusal(self, state: Sampled, K: "Controller") -> str:
        """Why the measure does not exist, dead times exact."""
        late_refusal = getattr(self.shape, "late_refusal", None)
        if late_refusal is None or not self.channel.delayed:
            return self.shape.refusal(state.system)
        try:
            return late_refusal(self.channel.lined_system(K), self.channel.late(K))
        except InputError as error:
            return str(error)

    def _bracketed(self, state: Sampled, K: "Controller", ends: tuple[float, float]) -> Bracket:
        """Branch and bound over the band, in the frequency that filters see, and a bound beyond its last interval."""
        h = self.channel.sample_time
        end = None if h is None else math.pi / h

        def true(at: np.ndarray) -> np.ndarray:
            return at if h is None else unwarped(at, h)

        def seen(omega: np.ndarray) -> np.ndarray:
            return omega if h is None else warped(omega, h)

        T, late = state.system, np.zeros(len(state.system.A))
        if self.channel.delayed:
            T, late = self.channel.lined_system(K), self.channel.late(K)
        ceiling = self.shape.ceiling(T, late, end)
        low, high = seen(np.array(self.band))
        grid = seeds(state.poles, seen(self.shape.corners()), (float(low), float(high)))
        endless, grid = math.isinf(high), grid[np.isfinite(grid)]
        size = self._size(state, ends)

        def size_seen(at: np.ndarray) -> np.ndarray:
            return size(true(at))

        def above(low: np.ndarray, high: np.ndarray) -> np.ndarray:
            return ceiling.above(Panels(low, high, true(low), true(high)))

        rest = 0.0
        if endless:
            grid, rest = farther(grid, float(late.max(initial=0.0)), local_peaks(size_seen, grid)[0][1],
                                 lambda start: ceiling.beyond(start, float(true(np.array(start)))))  # fmt: skip
        found = bracket(size_seen, above, grid, self.close, rest)
        if found.value < 1 < found.upper and rest <= 1 and self.close == CLOSE:  # a closer one tells
            found = bracket(size_seen, above, grid, TELLING, rest)
        return found._replace(frequency=float(true(np.array(found.frequency))))

    @property
    def full(self) -> bool:
        """Whether the band holds all frequencies."""
        h = self.channel.sample_time
        return self.band[0] == 0 and (math.isinf(self.band[1]) or (h is not None and self.band[1] >= math.pi / h))

    def _ends(self, state: Sampled) -> tuple[float, float]:
        """Limits at ω = 0 and ∞ where the measure has no value of its own; NaN elsewhere and outside the band."""
        near, far = self.shape.ends(state.system, self.channel.sample_time is not None)
        endless = math.isinf(self.band[1]) and not self.channel.delayed  # a dead time has no value at infinity
        return near if self.band[0] == 0 else math.nan, far if endless else math.nan

    def _size(self, state: Sampled, ends: tuple[float, ...]) -> Callable[[np.ndarray], np.ndarray]:
        def size(omega: np.ndarray) -> np.ndarray:
            axis = Axis.of(omega, self.channel.sample_time)
            found = self.shape.size(axis, state.response(axis))
            for at, end in zip((0.0, math.inf), ends, strict=True):
                found = found if math.isnan(end) else np.where(omega == at, end, found)
            return found

        return size

    def _grid(self, state: Sampled, density: str) -> np.ndarray:
        h = self.channel.sample_time
        corners = self.shape.corners()
        if h is not None:
            top = min(self.band[1], math.pi / h)
            poles = np.where(state.poles == 0, 1e-300, state.poles)
            resonances = poles.real / (1 + (poles.imag * h / 2) ** 2) + 1j * unwarped(poles.imag, h)
            return seeds(resonances, corners[corners < top], (self.band[0], top), density)
        if not self.channel.delayed:
            return seeds(state.poles, corners, self.band, density)
        grid = seeds(state.poles, corners, self.band, density)
        grid = grid[np.isfinite(grid)]  # a dead time has no value at infinity
        extra = np.linspace(grid[0], np.abs(state.poles).max(initial=1.0) * 3, 6000 if density == "dense" else 600)
        return np.unique(np.r_[grid, extra[(extra > self.band[0]) & (extra < self.band[1])]])

    def _crossing(self, system: Realisation, size: Callable[[np.ndarray], np.ndarray]):
        h = self.channel.sample_time

        def true(omega):
            return omega if h is None else unwarped(omega, h)

        def crossing(level: float) -> list[tuple[float, float]]:
            ends = crossings(system, level)
            if ends is None:
                return [(float(true(a)), float(true(b))) for a, b in intervals_above(*system, level)]
            ends = true(np.unique(np.r_[0.0, ends]))
            middle = (ends[1:] + ends[:-1]) / 2
            above = np.flatnonzero(size(middle) > level) if len(middle) else []
            return [(float(ends[k]), float(ends[k + 1])) for k in above]

        return crossing

    def _pulled(self, K: "Controller", omega: float, W: np.ndarray, state: Sampled) -> "Controller":
        if math.isfinite(omega):
            return self.channel.response_pullback(K, np.array([omega]), W[None])
        A, B, C, _ = state.system
        return self.channel.system_pullback(K, np.zeros_like(A), np.zeros_like(B), np.zeros_like(C), W.real)


def _beside(omega: float, grid: np.ndarray, ends: tuple[float, float]) -> float:
    """The frequency itself, or one close to an end of the axis where only a limit has a value there."""
    if omega == grid[0] == 0 and not math.isnan(ends[0]):
        return float(BESIDE * grid[1])
    if math.isinf(omega) and not math.isnan(ends[1]):
        return float(grid[-2] / BESIDE)
    return omega


def _stable(system: Realisation) -> bool:
    return len(system.A) == 0 or bool(np.linalg.eigvals(system.A).real.max() < 0)
