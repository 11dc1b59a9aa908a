"""The integrated error: how far below its set point a signal stays, summed over time, after a step.

    T(0) = 0 (integral action) --> ∫ z dt after unit steps of w = T'(0) = −C M⁻¹ E M⁻¹ B,  M = Λ(0) − A, E = Λ'(0)

With a load step at the plant's outputs and the error there this is (P(0) K_I)⁻¹: the largest integral gain that limits
of the sensitivities leave. Dead times and samples are exact in both ways of measuring: the slopes of their symbols at
s = 0 are the dead times themselves, and the sample time.

Source: guide, Definitions: Integrated error; Åström & Hägglund, Advanced PID Control (2006), section 4.3; Boyd, Hast &
Åström (2016).
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.goals.goal import stability_reason
from workbench.goals.key import Key
from workbench.goals.measure import NEAR, Asked, Measure, Value, infinite, near
from workbench.goals.registry import register
from workbench.goals.signals import ChannelGoal

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

REST = 1e-9  # of |T| at the rates of its slowest pole: what is smaller at rest is rounding
REMAINS = "the error does not vanish: T(0) = {:.3g}. The integrated error needs integral action."


@register
@dataclass(frozen=True, slots=True, kw_only=True)
class IntegratedError(ChannelGoal):
    """∫ outputs dt after unit steps at the inputs stays small: value = σ_max(T'(0))/limit, T(0) = 0.

    limit : [s] times units of the outputs per unit of the inputs
    """

    kind, proof = "integrated_error", "integrated error"
    unit = "s"
    keys = (Key("limit_s", "limit"),)
    sizes, all_frequencies = (("limit", "s"),), True

    limit: float = 1.0

    def asked(self) -> Asked:
        return Asked("<=", self.limit, "s", lambda v: self.limit * v)

    def measure(self, channel: Any) -> Measure:
        return SlopeAtRest(channel, self.limit)


@dataclass(frozen=True, slots=True)
class SlopeAtRest:
    """σ_max(T'(0))/limit of a channel whose T(0) is zero."""

    channel: Any
    limit: float

    def evaluate(self, K: "Controller") -> Value:
        """By the states' linear systems at s = 0, with the gradient of every singular value near the largest.

        Whether T(0) is zero is for `exact` to say: beside a controller with integral action there are others without.
        """
        A, B, C, D = self.channel.lined_system(K)
        at_rest, slope = self._symbols(K)
        M = np.diag(at_rest) - A
        try:
            X, Y = np.linalg.solve(M, B), np.linalg.solve(M.T, C.T).T
        except np.linalg.LinAlgError:
            return infinite("the closed loop has a pole at s = 0.")
        u, sizes, v = np.linalg.svd(-(Y * slope) @ X)
        pieces = []
        for k in range(len(sizes)):
            if sizes[k] < sizes[0] * (1 - NEAR):
                break
            left, right = Y.T @ u[:, k], X @ v[k]
            after, before = np.linalg.solve(M, slope * right), np.linalg.solve(M.T, slope * left)
            GA = -(np.outer(left, after) + np.outer(before, right)) / self.limit
            GB, GC = -np.outer(before, v[k]) / self.limit, -np.outer(u[:, k], after) / self.limit
            gradient = self.channel.lined_pullback(K, GA, GB, GC, np.zeros_like(D))
            pieces.append((float(sizes[k]) / self.limit, gradient))
        value = float(sizes[0]) / self.limit
        return Value(
            value=value, gradients=near(pieces), frequency=0.0, channel=self._label(u, v), method="slope at rest"
        )

    def exact(self, K: "Controller") -> Value:
        """By frequency responses beside s = 0: T(jω)/jω at two small ω, extrapolated; stability is looked at first."""
        reason = stability_reason(self.channel.poles(K), self.channel.sample_time)
        if reason:
            return infinite(reason)
        found = self.evaluate(K)
        remains = self._remains(K)
        if remains or not np.isfinite(found.value):
            return infinite(remains or found.reason)
        slowest = self._slowest(K)
        at = slowest * np.array([1e-3, 2e-3])
        near_rest = (self.channel.response(K, at) / (1j * at[:, None, None])).real  # even in ω: T'(0) + O(ω²)
        value = float(np.linalg.norm((4 * near_rest[0] - near_rest[1]) / 3, 2)) / self.limit
        return Value(
            value=value, frequency=0.0, channel=found.channel, method="responses beside rest",
            upper=max(value, found.value),
        )  # fmt: skip

    def _remains(self, K: "Controller") -> str:
        """Why the integral does not exist: T(0) is not zero beside the channel's size elsewhere; empty if it is."""
        A, B, C, D = self.channel.lined_system(K)
        left = np.abs(D + C @ np.linalg.solve(np.diag(self._symbols(K)[0]) - A, B)).max()
        elsewhere = np.abs(self.channel.response(K, self._slowest(K) * np.array([0.1, 1.0, 10.0]))).max()
        return REMAINS.format(left) if left > REST * elsewhere else ""

    def _symbols(self, K: "Controller") -> tuple[np.ndarray, np.ndarray]:
        """Λ(0) and Λ'(0) of the rows: 0 and 1 of a state, 1 and the dead time of a line, 1 and h of a sampled state."""
        late, h = self.channel.late(K), self.channel.sample_time
        if h is None:
            return (late > 0).astype(float), np.where(late > 0, late, 1.0)
        return np.ones(len(late)), np.where(late > 0, late, h)

    def _slowest(self, K: "Controller") -> float:
        """Smallest rate of a closed-loop pole [1/s], or of a dead time."""
        poles, h = self.channel.poles(K), self.channel.sample_time
        rates = np.abs(poles if h is None else np.log(poles[poles != 0].astype(complex)) / h)
        late = self.channel.late(K)
        return float(min([*rates[rates > 0], *(1 / late[late > 0])], default=1.0))

    def _label(self, u: np.ndarray, v: np.ndarray) -> str:
        into, out = int(np.argmax(np.abs(v[0]))), int(np.argmax(np.abs(u[:, 0])))
        return f"{self.channel.inputs[into]} → {self.channel.outputs[out]}"
