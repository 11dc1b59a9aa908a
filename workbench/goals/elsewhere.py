"""Measures of loops beside the nominal one: at one point, under a change, as a computer runs them.

    loop --point--> disk, or the exact gain, phase    loop --change--> roots, peak    loop --held, Tustin--> the same

Each is 1 at its limit and less where the limit is kept, with gradients by the controller's own matrices.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from workbench.analysis.loop_channel import channel_margins
from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.errors import InputError
from workbench.goals.gain import GainShape
from workbench.goals.goal import FULL_BAND, Goal
from workbench.goals.loop_shape import Sensitivity
from workbench.goals.margin import MU_CLOSE, DiskMeasure, MuShape
from workbench.goals.measure import Asked, Measure, Value, infinite
from workbench.goals.peak import PeakMeasure
from workbench.goals.poles import PoleMeasure, Region
from workbench.lti.margin import ChannelMargin
from workbench.lti.peak_bound import CLOSE
from workbench.lti.realisation import Realisation

Band = tuple[float, float]  # [rad/s]


def disk_measure(loop: Loop, points: tuple[str, ...], alpha: float, focus: Band = FULL_BAND) -> Measure:
    """α μ(S − I/2) at points, each with a factor of its own."""
    channel, m = loop.sensitivity(points), len(points)
    if m == 1:
        half = Realisation(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.eye(1) / 2)
        return PeakMeasure(channel, GainShape.of(channel, minus=half, profile=1 / alpha), focus)
    return DiskMeasure(PeakMeasure(channel, MuShape(alpha, points), focus, CLOSE if m == 2 else MU_CLOSE))


def damping_measure(loop: Loop, limit: float, focus: Band) -> Measure:
    """2 − ζ/limit of the worst root."""
    return PoleMeasure(Region(None, limit, None, focus), loop.channel((), ()))


def decay_measure(loop: Loop, limit: float, focus: Band) -> Measure:
    """2 − decay/limit of the slowest root; limit in 1/s."""
    return PoleMeasure(Region(limit, None, None, focus), loop.channel((), ()))


def peak_measure(loop: Loop, limit: float, focus: Band) -> Measure:
    """‖S‖∞/limit at all commands."""
    return Sensitivity(loop.commands, limit=limit, focus=focus).bind(loop).measure


def linear(goal: Goal) -> Asked:
    """What 2 − value/limit says in the goal's own unit."""
    limit: float = goal.limit  # type: ignore[attr-defined]
    return Asked(goal.sense, limit, goal.unit, lambda v: limit * (2 - v))


def least_factor(up: float, down: float) -> float:
    """The smaller of a factor up and the inverse of one down."""
    return min(up, 1 / down if down > 0 else math.inf)


@dataclass(frozen=True, slots=True)
class Elsewhere:
    """A measure of another loop, which says whose it is."""

    measure: Measure
    name: str

    def evaluate(self, K: Controller) -> Value:
        return self._said(self.measure.evaluate(K))

    def exact(self, K: Controller) -> Value:
        return self._said(self.measure.exact(K))

    def _said(self, value: Value) -> Value:
        return replace(value, channel=f"{self.name}, {value.channel}" if value.channel else self.name)


@dataclass(frozen=True, slots=True)
class ExactMargin:
    """A gain or phase margin at one point: steered by the disk that guarantees it, judged by every crossing.

    value : margins of the point to a number that is at most 1 where the limit is kept
    """

    disk: Measure
    loop: Loop
    point: str
    value: Callable[[ChannelMargin], float]

    def evaluate(self, K: Controller) -> Value:
        return self.disk.evaluate(K)

    def exact(self, K: Controller) -> Value:
        try:
            if self.loop.unstable_poles(K):
                return infinite("the closed loop is unstable; it has no margins.")
            (found,) = channel_margins(self.loop, K, (self.point,))
        except InputError as error:
            return infinite(str(error))
        return Value(value=self.value(found), channel=self.point, method="every crossing of the loop gain")


@dataclass(frozen=True, slots=True)
class Sampling:
    """A measure of a sampled loop as one of the continuous controller, which Tustin's rule samples at a time [s]."""

    measure: Measure
    sample_time: float

    def evaluate(self, K: Controller) -> Value:
        value = self.measure.evaluate(tustin(K, self.sample_time))
        pieces = tuple((v, tustin_pullback(K, self.sample_time, G)) for v, G in value.gradients)
        return replace(value, gradients=pieces)

    def exact(self, K: Controller) -> Value:
        return self.measure.exact(tustin(K, self.sample_time))


def tustin(K: Controller, h: float) -> Controller:
    """The controller sampled every h [s], s = (2/h)(z − 1)/(z + 1), in the states of `Block.sampled`."""
    if not K.order:
        return K
    N = np.linalg.inv(np.eye(K.order) - h / 2 * K.A)
    return Controller(2 * N - np.eye(K.order), h * N @ K.B, K.C @ N, K.D + h / 2 * K.C @ N @ K.B)


def tustin_pullback(K: Controller, h: float, G: Controller) -> Controller:
    """Gradient with respect to K of a scalar whose gradient with respect to `tustin(K, h)` is G."""
    if not K.order:
        return G
    N = np.linalg.inv(np.eye(K.order) - h / 2 * K.A)
    through = 2 * G.A + h * G.B @ K.B.T + K.C.T @ G.C + h / 2 * K.C.T @ G.D @ K.B.T  # with respect to N
    return Controller(
        h / 2 * N.T @ through @ N.T, h * N.T @ G.B + h / 2 * (K.C @ N).T @ G.D,
        G.C @ N.T + h / 2 * G.D @ (N @ K.B).T, G.D,
    )  # fmt: skip
