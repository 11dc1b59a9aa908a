"""How far a response is from a reference model's, as energy of the difference: tracking of steps, transients.

    E = T − R --impulse: B   step: A⁻¹B   ramp: A⁻²B --> energy of the decaying part, over that of the reference
      --G(0), G'(0)--> what does not decay: the static error, over its own limit

systune divides ‖(T − R)/s‖₂ likewise, which is infinite unless T(0) = R(0) exactly. Here the two parts are taken
separately, so the value is finite everywhere and a static error counts by its own size.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.errors import InputError
from workbench.goals.goal import positive
from workbench.goals.key import Key, weight
from workbench.goals.measure import Largest, Measure
from workbench.goals.registry import register
from workbench.goals.signals import ChannelGoal
from workbench.goals.transient import StaticMeasure, TransientMeasure, transient_size
from workbench.goals.variance import as_seen
from workbench.lti.join import difference
from workbench.lti.realisation import Realisation
from workbench.lti.weight import Filter, WeightLike, filter_of

ORDERS = {"impulse": 0, "step": 1, "ramp": 2}
SIZES = (("gap", ""), ("static_error", ""))
SCALES = (("gap", 1), ("static_error", 1))


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class StepTracking(ChannelGoal):
    """Step responses follow those of a reference model.

    Parameters
    ----------
    inputs, outputs : names, in pairs
    reference : filter of as many inputs and outputs (a scalar one for every pair); or
    time_constant : float
        [s]; instead of a reference: 1/(τ s + 1), and with an overshoot [%] the second-order model with that overshoot
        and natural frequency 1/τ.
    gap : float
        value = ‖(T − R)/s‖₂/(gap ‖(R − I)/s‖₂): the error relative to that of the reference against the step itself.
    static_error : float
        σ_max(T(0) − R(0)) over this is the other part of the value.
    """

    kind = "step_tracking"
    keys = (
        *weight("reference"),
        Key("time_constant_s", "time_constant"),
        *(Key(k) for k in ("overshoot_percent", "gap", "static_error")),
    )
    sizes, in_pairs, all_frequencies = SIZES, True, True
    scales = SCALES

    reference: WeightLike = None
    time_constant: float | None = None
    overshoot_percent: float = 0.0
    gap: float = 0.1
    static_error: float = 0.01

    def check_fields(self) -> None:
        if (self.reference is None) == (self.time_constant is None):
            raise InputError("StepTracking needs a reference or a time_constant, not both. Give one.")
        _reference(self)

    def measure(self, channel: Any) -> Measure:
        model = as_seen(_reference(self), channel.sample_time)
        count = len(self.inputs)
        one = Realisation(np.zeros((0, 0)), np.zeros((0, count)), np.zeros((count, 0)), np.eye(count))
        size = transient_size(difference(model, one), 1, channel.sample_time)
        if size == 0:
            raise InputError("the reference must differ from the step itself; got a model that follows at once.")
        return _parts(channel, model, "step", self.gap * size, self.static_error)


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class Transient(ChannelGoal):
    """The response to an impulse, step or ramp is close to that of a reference model.

    Parameters
    ----------
    inputs, outputs : names
    reference : filter
    signal : "impulse", "step" or "ramp"
    gap : float
        value = energy of the transient of T − R over gap × energy of the transient of R (square roots of both).
    static_error : float
        For step and ramp: σ_max of what remains (T(0) − R(0)) over this is the other part; for the ramp also the lag
        σ_max(T'(0) − R'(0)) [s] over this.
    """

    kind = "transient"
    keys = (*weight("reference"), Key("signal"), Key("gap"), Key("static_error"))
    sizes, all_frequencies = SIZES, True
    scales = SCALES

    reference: WeightLike
    signal: str = "step"
    gap: float = 0.1
    static_error: float = 0.01

    def check_fields(self) -> None:
        if self.signal not in ORDERS:
            raise InputError(f"signal must be impulse, step or ramp; got {self.signal!r}. Choose one of the three.")
        _reference(self)

    def measure(self, channel: Any) -> Measure:
        model = as_seen(_reference(self), channel.sample_time)
        if model.D.shape != (len(self.outputs), len(self.inputs)):
            raise InputError(
                f"the reference must have {len(self.outputs)} outputs and {len(self.inputs)} inputs; "
                f"got shape {model.D.shape}."
            )
        if self.signal == "impulse" and channel.sample_time is None and np.any(model.D):
            raise InputError("the reference of an impulse response must have no direct feedthrough; got D ≠ 0.")
        size = transient_size(model, ORDERS[self.signal], channel.sample_time)
        if size == 0:
            raise InputError("the reference must have a transient; got a static model. Use Gain for those.")
        return _parts(channel, model, self.signal, self.gap * size, self.static_error)


def _reference(goal: Any) -> Filter:
    """The goal's model as a filter of its signals."""
    count = len(goal.inputs)
    tau = getattr(goal, "time_constant", None)
    if tau is None:
        return filter_of("reference", goal.reference, count, side="left")
    tau = positive("time_constant", tau, "s")
    if not 0 <= goal.overshoot_percent < 100:
        raise InputError(f"overshoot_percent must lie between 0 and 100; got {goal.overshoot_percent!r}.")
    if goal.overshoot_percent == 0:
        return filter_of("reference", ([1.0], [tau, 1.0]), count, side="left")
    log = math.log(goal.overshoot_percent / 100)
    zeta = -log / math.hypot(math.pi, log)
    return filter_of("reference", ([1.0], [tau**2, 2 * zeta * tau, 1.0]), count, side="left")


def _parts(channel: Any, model: Realisation, signal: str, size: float, static: float) -> Largest:
    parts: list[Any] = [TransientMeasure(channel, model, ORDERS[signal], size)]
    parts += [StaticMeasure(channel, model, order, static) for order in range(ORDERS[signal])]
    return Largest(tuple(parts))
