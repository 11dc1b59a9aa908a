"""How much noise reaches an output: the H₂ norm of a channel, plain or between shaping filters.

    T --L T W--> √(tr C P C')/limit     rms of the outputs under unit white noise

White noise of unit two-sided intensity: a flat spectral density of 1, one-sided 2 per hertz. Continuous: the channel
must not feed it straight through (D = 0), or the value is infinite. Sampled every h: a flat density of 1 up to the
Nyquist frequency, that is a white sequence of variance 1/h, so the value tends to the continuous one as h does to 0 and
a density means the same on both. With dead times `evaluate` uses their Padé fractions; `exact` takes the energy of the
impulse response, marched from one dead time to the next.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.errors import InputError
from workbench.goals.goal import stability_reason
from workbench.goals.history import BY_STEPS, delayed_pieces, unjudged
from workbench.goals.key import Key, weight
from workbench.goals.measure import Asked, Measure, Value, constant_limit, infinite
from workbench.goals.registry import register
from workbench.goals.signals import ChannelGoal, check_weights
from workbench.lti.bilinear import tustin
from workbench.lti.energy import energy, energy_by_doubling
from workbench.lti.join import Weighted
from workbench.lti.march import Lined, lined_series
from workbench.lti.realisation import Realisation, balanced
from workbench.lti.variance import stationary
from workbench.lti.weight import Filter, WeightLike, filter_of

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

STRAIGHT = "white noise passes straight to the output (D ≠ 0), so its variance is infinite; add a filter."


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class Variance(ChannelGoal):
    """The outputs' rms under unit white noise at the inputs stays below a limit: value = ‖T‖₂/limit."""

    kind = "variance"
    keys = (Key("limit"),)
    sizes, all_frequencies = (("limit", ""),), True

    limit: float = 1.0

    def asked(self) -> Asked:
        return constant_limit(self.limit)

    def measure(self, channel: Any) -> Measure:
        return VarianceMeasure.of(channel, 1.0, 1.0, self.limit)


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class WeightedVariance(Variance):
    """value = ‖L T W‖₂/limit with filters L after the outputs and W, the shape of the noise, before the inputs.

    left, right : number, matrix, Plant, python-control system or (numerator, denominator)
        Stable. A noise with the one-sided PSD S(f) per hertz has |W(j2πf)|² = S/2.
    """

    kind = "weighted_variance"
    keys = (*weight("left"), *weight("right"), Key("limit"))

    left: WeightLike = 1.0
    right: WeightLike = 1.0

    def check_fields(self) -> None:
        check_weights(self)

    def measure(self, channel: Any) -> Measure:
        return VarianceMeasure.of(channel, self.left, self.right, self.limit)


def as_seen(filter_: Filter, sample_time: float | None) -> Realisation:
    """The filter as a loop sees it: itself, or sampled by Tustin's rule."""
    return filter_.system if sample_time is None else tustin(filter_.system, sample_time)


@dataclass(frozen=True, slots=True)
class VarianceMeasure:
    """‖left · T · right‖₂ over a limit."""

    channel: Any
    joined: Weighted
    limit: float
    filters: tuple[Filter, Filter]

    @classmethod
    def of(cls, channel: Any, left: WeightLike, right: WeightLike, limit: float) -> "VarianceMeasure":
        """The measure of a channel between two weights."""
        h = channel.sample_time
        before = filter_of("left", left, len(channel.outputs), side="left")
        after = filter_of("right", right, len(channel.inputs), side="right")
        return cls(channel, Weighted(as_seen(before, h), as_seen(after, h)), limit, (before, after))

    def evaluate(self, K: "Controller") -> Value:
        """Lyapunov equations for the norm and its gradient."""
        T, whole, reason = self._systems(K)
        if T is None or whole is None:
            return infinite(reason)
        A, B, C, D = whole
        h = self.channel.sample_time
        square, *gradient = energy(A, B, C, sampled=h is not None)
        GD = np.zeros_like(D)
        if h is not None:
            square, GD = (square + float(np.sum(D**2))) / h, 2 * D / h
        GA, GB, GC = (part / (h or 1.0) for part in gradient)
        value = math.sqrt(square) / self.limit
        method = "Lyapunov equations" + ("; dead times by Padé" if self.channel.delayed else "")
        if value == 0:
            return Value(value=0.0, reason="the channel carries nothing.", method=method)
        scale = 1 / (2 * value * self.limit**2)
        gradient = self.joined.pullback(T, Realisation(GA * scale, GB * scale, GC * scale, GD * scale))
        back = self.channel.system_pullback(K, *gradient)
        return Value(value=value, gradients=((value, back),), channel=self._label(), method=method)

    def exact(self, K: "Controller") -> Value:
        """Lyapunov with an error bound; sampled by doubling; dead times by the method of steps."""
        if self.channel.delayed:
            return self._with_dead_times(K)
        T, whole, reason = self._systems(K)
        if T is None or whole is None:
            return infinite(reason)
        A, B, C, D = balanced(*whole)
        label, h = self._label(), self.channel.sample_time
        if h is not None:
            square = (energy_by_doubling(A, B, C, sampled=True) + float(np.sum(D**2))) / h
            return Value(value=math.sqrt(square) / self.limit, channel=label, method="covariance by doubling")
        try:
            found = stationary(A, B, correlation=np.eye(B.shape[1]))
            rms = np.sqrt(found.covariance[0].diagonal())  # states in units of their own rms: the bound is narrow there
            units = 2.0 ** np.round(np.log2(np.where(rms > 0, rms, 1.0)))
            C = C * units
            found = stationary(A / units[:, None] * units, B / units[:, None], correlation=np.eye(B.shape[1]))
        except InputError as error:
            return infinite(str(error))
        square = max(float(found.mean_squares(C).sum()), 0.0)
        upper = math.sqrt(square + float(found.mean_square_bounds(C).sum())) / self.limit
        return Value(
            value=math.sqrt(square) / self.limit,
            upper=upper,
            channel=label,
            method="Lyapunov equation with error bound",
        )

    def _systems(self, K: "Controller") -> tuple[Realisation | None, Realisation | None, str]:
        try:
            T = Realisation(*self.channel.system(K))
        except InputError as error:
            return None, None, str(error)
        if not all(np.isfinite(block).all() for block in T):
            return None, None, "the closed loop's matrices overflow."
        h = self.channel.sample_time
        reason = stability_reason(np.linalg.eigvals(T.A) if len(T.A) else np.zeros(0), h)
        if reason:
            return None, None, reason
        whole = self.joined.system(T)
        if h is None and whole.D.any():
            return None, None, STRAIGHT
        return T, whole, ""

    def _with_dead_times(self, K: "Controller") -> Value:
        left, right = (Lined.of(part.system) for part in self.filters)
        try:
            pieces, reason = delayed_pieces(
                self.channel, K, lambda T: lined_series(left, lined_series(T, right)), STRAIGHT
            )  # fmt: skip
        except InputError as error:
            return unjudged(self.evaluate(K), str(error))
        if pieces is None:
            return infinite(reason)
        value = math.sqrt(pieces.energy(0)) / self.limit
        return Value(value=value, upper=value * (1 + pieces.error), channel=self._label(), method=BY_STEPS)

    def _label(self) -> str:
        return f"{', '.join(self.channel.inputs)} → {', '.join(self.channel.outputs)}"
