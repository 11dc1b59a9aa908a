"""Limits in the time domain: overshoot of a step response, and how a step disturbance is taken back.

    A, B, C, D --states at many instants, by doubling--> y(t) --extrema, refined by Newton--> value
               --derivative of the matrix exponential--> ∂y(t*)/∂(A, B, C, D) at each extremum near the largest

At an extremum the instant's own shift does not count, so the gradient is that of y at a fixed time. Instants are spread
over windows of 1000 that grow eightfold from a tenth of the fastest pole's time to eight times the slowest's. `exact`
brackets the largest value by branch and bound over the modes (goal_modes), and with dead times marches from one to the
next (goal_history) where `evaluate` has Padé fractions.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.errors import InputError
from workbench.goals.goal import stability_reason
from workbench.goals.history import BY_STEPS, delayed_pieces, unjudged
from workbench.goals.key import Key
from workbench.goals.measure import NEAR, Asked, Bound, Largest, Value, infinite, near
from workbench.goals.registry import register
from workbench.goals.signals import ChannelGoal
from workbench.lti.modes import largest, step_response
from workbench.lti.realisation import Realisation
from workbench.lti.step import Steps, final_value, first_sample, step_gradient

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

ENDS_AT_ZERO = "the step response ends at zero, so its overshoot has no measure; use StepRejection."


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class Overshoot(ChannelGoal):
    """A step response exceeds its final value by at most a percentage: value = overshoot/limit, 0 without any.

    inputs, outputs : names, in pairs; percent : float
    """

    kind = "overshoot"
    keys = (Key("percent"),)
    sizes, in_pairs, all_frequencies = (("percent", "%"),), True, True
    scales = (("percent", 1),)

    percent: float = 10.0

    def asked(self) -> Asked:
        return Asked("<=", self.percent, "%", lambda v: self.percent * v)

    def bind(self, loop: Any) -> Bound:
        """The goal on one loop, pair by pair."""
        parts = []
        for into, out in zip(self.inputs, self.outputs, strict=True):
            channel = loop.channel(inputs=(into,), outputs=(out,), openings=self.openings)
            parts.append(StepMeasure(channel, "overshoot", self.percent / 100))
        return Bound(self, Largest(tuple(parts)))


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class StepRejection(ChannelGoal):
    """The response to a step disturbance stays within a peak, and after a settling time within a fraction of it.

    Parameters
    ----------
    inputs, outputs : names; every output counts for every input
    peak : float
        |y(t)| at most this for a unit step, in output units.
    settling_time : float
        [s]
    fraction : float
        |y(t)| at most fraction × peak from the settling time on.

    value = the largest |y(t)|/limit(t).
    """

    kind = "step_rejection"
    keys = (Key("peak"), Key("settling_time_s", "settling_time"), Key("fraction"))
    sizes, all_frequencies = (("peak", ""), ("settling_time", "s")), True
    scales = (("peak", 1),)

    peak: float
    settling_time: float
    fraction: float = 0.05

    def check_fields(self) -> None:
        if not 0 < self.fraction <= 1:
            raise InputError(f"fraction must lie above 0 and up to 1; got {self.fraction!r}. Usual: 0.05.")

    def bind(self, loop: Any) -> Bound:
        """The goal on one loop, pair by pair."""
        parts = []
        for into in self.inputs:
            for out in self.outputs:
                channel = loop.channel(inputs=(into,), outputs=(out,), openings=self.openings)
                parts += [
                    StepMeasure(channel, "size", self.peak),
                    StepMeasure(channel, "size", self.peak * self.fraction, self.settling_time),
                ]
        return Bound(self, Largest(tuple(parts)))


@dataclass(frozen=True, slots=True)
class StepMeasure:
    """The largest overshoot (y/y(∞) − 1) or size |y| of a unit step response from `begin` on, over a limit."""

    channel: Any
    kind: str  # "overshoot" | "size"
    limit: float
    begin: float = 0.0

    def evaluate(self, K: "Controller") -> Value:
        """Extrema of the exact response between instants; ∞ counts with the static gain. Dead times by Padé."""
        system, reason = self._system(K)
        if system is None:
            return infinite(reason)
        steps = Steps(system, self.channel.sample_time)
        final = steps.final
        if self.kind == "overshoot" and abs(final) <= steps.rounding:
            return infinite(ENDS_AT_ZERO)
        try:
            times, y = steps.extrema(self.begin)
        except InputError as error:
            return infinite(str(error))
        measured = self._measure(y, final)
        pieces = []
        top = max(float(measured.max(initial=0.0)), self._at_infinity(final))
        for t, value, sample in zip(times, measured, y, strict=True):
            if value >= top - NEAR * max(abs(top), NEAR) and value > 0:
                pieces.append((float(value), self._pulled(K, system, float(t), float(sample), final)))
        at_end = self._at_infinity(final)
        if not pieces or at_end >= top:
            pieces.append((at_end, self._pulled(K, system, math.inf, final, final)))
        best = int(np.argmax(measured)) if len(measured) and measured.max() >= at_end else None
        return Value(
            value=top, gradients=near(pieces), time=float(times[best]) if best is not None else math.inf,
            channel=self._label(),
            method="exponentials and Newton's method" + ("; dead times by Padé" if self.channel.delayed else ""),
        )  # fmt: skip

    def exact(self, K: "Controller") -> Value:
        """A bracket by branch and bound over the modes; with dead times by the method of steps."""
        if self.channel.delayed:
            return self._with_dead_times(K)
        system, reason = self._system(K)
        if system is None:
            return infinite(reason)
        h = self.channel.sample_time
        try:
            response = step_response(system, h)
        except InputError as error:
            return unjudged(self.evaluate(K), str(error))
        final, rounding = final_value(system, sampled=h is not None)
        if self.kind == "overshoot" and abs(final) <= rounding:
            return infinite(ENDS_AT_ZERO)
        sign = 0 if self.kind == "size" else int(math.copysign(1, final))
        begin = self.begin if h is None else first_sample(self.begin, h)
        found = largest(response, begin, sign, level=abs(final))
        value, upper = (self._of_size(size, final) for size in (found.value, found.upper))
        method = f"bracket by branch and bound over {len(system.A)} modes"
        return Value(
            value=value, upper=upper, time=found.time * (h or 1.0), channel=self._label(), method=method,
        )  # fmt: skip

    def _with_dead_times(self, K: "Controller") -> Value:
        try:
            pieces, reason = delayed_pieces(self.channel, K)
        except InputError as error:
            return unjudged(self.evaluate(K), str(error))
        if pieces is None:
            return infinite(reason)
        final, rounding = final_value(self.channel.lined_system(K), self.channel.late(K))
        if self.kind == "overshoot" and abs(final) <= rounding:
            return infinite(ENDS_AT_ZERO)
        turn = math.copysign(1, final)
        size, time = pieces.largest(self.begin, np.abs if self.kind == "size" else lambda y: turn * y)
        if size <= abs(final):
            size, time = abs(final), math.inf
        error = pieces.error * max(size, pieces.size)
        value, upper = (self._of_size(found, final) for found in (size, size + error))
        return Value(value=value, upper=upper, time=time, channel=self._label(), method=BY_STEPS)

    def _system(self, K: "Controller") -> tuple[Realisation | None, str]:
        try:
            system = Realisation(*self.channel.system(K))
        except InputError as error:
            return None, str(error)
        if not all(np.isfinite(block).all() for block in system):
            return None, "the closed loop's matrices overflow."
        reason = stability_reason(
            np.linalg.eigvals(system.A) if len(system.A) else np.zeros(0), self.channel.sample_time
        )
        return (None, reason) if reason else (system, "")

    def _measure(self, y: np.ndarray, final: float) -> np.ndarray:
        return (y / final - 1 if self.kind == "overshoot" else np.abs(y)) / self.limit

    def _at_infinity(self, final: float) -> float:
        return 0.0 if self.kind == "overshoot" else abs(final) / self.limit

    def _pulled(self, K: "Controller", system: Realisation, t: float, y: float, final: float) -> "Controller":
        """∂value: of y at t; for the overshoot also of the final value."""
        gradient = step_gradient(system, t, self.channel.sample_time)
        if self.kind == "overshoot":
            last = step_gradient(system, math.inf, self.channel.sample_time)
            weights = (1 / final, -y / final**2)
            parts = [a * weights[0] + b * weights[1] for a, b in zip(gradient, last, strict=True)]
        else:
            parts = [part * math.copysign(1.0, y) for part in gradient]
        return self.channel.system_pullback(K, *(part / self.limit for part in parts))

    def _of_size(self, size: float, final: float) -> float:
        """The measure of a largest y/sign(final), or |y|; at least what the final value gives."""
        return (size / abs(final) - 1 if self.kind == "overshoot" else size) / self.limit

    def _label(self) -> str:
        return f"{self.channel.inputs[0]} → {self.channel.outputs[0]}"
