"""The two parts of a response's distance from a reference model's: the transient's energy, and what remains.

E = T − R = (A, B, C, D) --start N^{-k} B, N = A or A − I--> √∫|C e^{At} start|² dt     TransientMeasure
                         --D − C N⁻¹ B, −C N⁻² B---------> σ_max of static error, lag   StaticMeasure
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.errors import InputError
from workbench.goals.goal import stability_reason
from workbench.goals.history import BY_STEPS, delayed_pieces, delayed_reason, unjudged
from workbench.goals.measure import Value, infinite
from workbench.lti.energy import energy, energy_by_doubling
from workbench.lti.join import difference
from workbench.lti.march import Lined, lined_difference
from workbench.lti.realisation import EPS, Realisation

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

STRAIGHT = "the impulse passes straight to the output (D ≠ 0), so its energy is infinite; add a filter."


def transient_size(system: Realisation, order: int, sample_time: float | None) -> float:
    """√energy of the transient of a system."""
    A, B, C, D = system
    h = sample_time
    square, *_ = energy(A, _started(A, B, order, h)[0], C, sampled=h is not None)
    if h is not None and order == 0:
        square += float(np.sum(D**2))
    return math.sqrt(square * (1.0 if h is None else h))


def _started(A: np.ndarray, B: np.ndarray, order: int, sample_time: float | None):
    """The starts N^{-order} B (times h for a sampled ramp), N = A or A − I, and the stages [B, N⁻¹B, …]."""
    N = A if sample_time is None else A - np.eye(len(A))
    stages = [B]
    for _ in range(order):
        stages.append(np.linalg.solve(N, stages[-1]))
    if sample_time is not None and order == 2:
        stages = [sample_time * stage for stage in stages]
    return stages[-1], stages, N


def _stable_error(channel: Any, K: "Controller", model: Realisation) -> tuple[Realisation | None, str]:
    """T − R for a stable T."""
    try:
        T = Realisation(*channel.system(K))
    except InputError as error:
        return None, str(error)
    if not all(np.isfinite(block).all() for block in T):
        return None, "the closed loop's matrices overflow."
    reason = stability_reason(np.linalg.eigvals(T.A) if len(T.A) else np.zeros(0), channel.sample_time)
    return (None, reason) if reason else (difference(T, model), "")


@dataclass(frozen=True, slots=True)
class TransientMeasure:
    """√energy of the transient of T − R under an impulse, step or ramp, over a size."""

    channel: Any
    model: Realisation
    order: int
    size: float

    def evaluate(self, K: "Controller") -> Value:
        """Lyapunov equations; the gradient goes back through the starts N⁻¹B."""
        E, reason = _stable_error(self.channel, K, self.model)
        reason = reason or self._direct(E)
        if E is None or reason:
            return infinite(reason)
        A, B, C, D = E
        h = self.channel.sample_time
        start, stages, N = _started(A, B, self.order, h)
        square, GA, GB, GC = energy(A, start, C, sampled=h is not None)
        GD = np.zeros_like(D)
        if h is not None and self.order == 0:
            square, GD = square + float(np.sum(D**2)), 2 * D
        step = 1.0 if h is None else h
        value = math.sqrt(square * step) / self.size
        method = "Lyapunov equations" + ("; dead times by Padé" if self.channel.delayed else "")
        if value == 0:
            return Value(value=0.0, method=method)
        for stage in reversed(stages[1:]):  # stage = N⁻¹ before
            GB = np.linalg.solve(N.T, GB)
            GA = GA - GB @ stage.T
        if h is not None and self.order == 2:
            GB = GB * h
        scale = step / (2 * value * self.size**2)
        n = len(A) - len(self.model.A)
        back = self.channel.system_pullback(K, scale * GA[:n, :n], scale * GB[:n], scale * GC[:, :n], scale * GD)
        return Value(value=value, gradients=((value, back),), channel=self._label(), method=method)

    def exact(self, K: "Controller") -> Value:
        """The energy by doubling of the sampled equivalent; with dead times by the method of steps."""
        if self.channel.delayed:
            return self._with_dead_times(K)
        E, reason = _stable_error(self.channel, K, self.model)
        reason = reason or self._direct(E)
        if E is None or reason:
            return infinite(reason)
        A, B, C, D = E
        h = self.channel.sample_time
        square = energy_by_doubling(A, _started(A, B, self.order, h)[0], C, sampled=h is not None)
        if h is not None and self.order == 0:
            square += float(np.sum(D**2))
        value = math.sqrt(max(square, 0.0) * (1.0 if h is None else h)) / self.size
        return Value(value=value, channel=self._label(), method="energy by doubling")

    def _with_dead_times(self, K: "Controller") -> Value:
        model = Lined.of(self.model)
        try:
            pieces, reason = delayed_pieces(
                self.channel, K, lambda T: lined_difference(T, model), STRAIGHT * (self.order == 0)
            )
        except InputError as error:
            return unjudged(self.evaluate(K), str(error))
        if pieces is None:
            return infinite(reason)
        value = math.sqrt(pieces.energy(self.order)) / self.size
        return Value(value=value, upper=value * (1 + pieces.error), channel=self._label(), method=BY_STEPS)

    def _direct(self, E: Realisation | None) -> str:
        if E is None or self.order or self.channel.sample_time is not None or not E.D.any():
            return ""
        return "" if (np.abs(E.D) <= 4 * EPS * np.abs(self.model.D)).all() else STRAIGHT  # T's feedthrough is R's

    def _label(self) -> str:
        return f"{', '.join(self.channel.inputs)} → {', '.join(self.channel.outputs)}, transient"


@dataclass(frozen=True, slots=True)
class StaticMeasure:
    """σ_max of G(0) (order 0) or G'(0) (order 1) of G = T − R, over a limit; sampled: at z = 1, per second."""

    channel: Any
    model: Realisation
    order: int
    limit: float

    def evaluate(self, K: "Controller") -> Value:
        """G(0) = D − C N⁻¹ B, G'(0) = −C N⁻² B."""
        E, reason = _stable_error(self.channel, K, self.model)
        if E is None:
            return infinite(reason)
        A, B, C, D = E
        h = self.channel.sample_time
        N = A if h is None else A - np.eye(len(A))
        stages, sights = [np.linalg.solve(N, B)], [np.linalg.solve(N.T, C.T)]
        error = D - C @ stages[0]
        if self.order == 1:
            stages.append(np.linalg.solve(N, stages[0]))
            sights.append(np.linalg.solve(N.T, sights[0]))
            error = -(C @ stages[1]) * (1.0 if h is None else h)
        u, sizes, v = np.linalg.svd(error)
        value = float(sizes[0]) / self.limit
        W = np.outer(u[:, 0], v[0]) / self.limit
        if self.order == 0:
            GA, GB, GC, GD = sights[0] @ W @ stages[0].T, -sights[0] @ W, -W @ stages[0].T, W
        else:
            W = W * (1.0 if h is None else h)
            GA = sights[0] @ W @ stages[1].T + sights[1] @ W @ stages[0].T
            GB, GC, GD = -sights[1] @ W, -W @ stages[1].T, np.zeros_like(D)
        n = len(A) - len(self.model.A)
        back = self.channel.system_pullback(K, GA[:n, :n], GB[:n], GC[:, :n], GD)
        return Value(
            value=value, gradients=((value, back),), frequency=0.0, channel=self._label(), method="static gain"
        )

    def exact(self, K: "Controller") -> Value:
        """The static gain once more from the response; the lag from the state space."""
        found = self.evaluate(K)
        if math.isfinite(found.value) and self.channel.delayed:
            try:
                reason = delayed_reason(self.channel, K)
            except InputError as error:
                return unjudged(found, str(error))
            if reason:
                return infinite(reason)
        if not math.isfinite(found.value) or self.order == 1:  # Padé fractions have the dead time's lag exactly
            return Value(value=found.value, channel=found.channel, reason=found.reason, method="static lag")
        T = self.channel.response(K, np.zeros(1))[0]
        A, B, C, D = self.model
        if self.channel.sample_time is not None:
            A = A - np.eye(len(A))
        error = T - (D - C @ np.linalg.solve(A, B) if len(A) else D)
        return Value(
            value=float(np.linalg.norm(error, 2)) / self.limit,
            frequency=0.0,
            channel=found.channel,
            method="response at 0",
        )

    def _label(self) -> str:
        what = "static error" if self.order == 0 else "static lag"
        return f"{', '.join(self.channel.inputs)} → {', '.join(self.channel.outputs)}, {what}"
