"""A goal's measure of a controller: a value with gradients to steer by, an exact one to judge by.

Measure --evaluate(K)--> Value with the near-active pieces --exact(K)--> Value by another algorithm
Asked: what the goal says of it in its own unit      Largest: several measures, the largest counts
"""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from workbench.goals.promise import Sense
from workbench.result import Result, Row

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller
    from workbench.goals.goal import Goal

NEAR = 0.01  # pieces within 1 % of the largest go to the optimiser with it


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Value(Result):
    """A goal's measure for one controller: up to 1 the goal is met, all of its bracket where `upper` differs.

    `gradients` holds the near-active pieces (value, gradient with respect to the controller's A, B, C, D), the largest
    first; empty where `value` is infinite and in answers of `exact`. `upper` is a certified upper bound where the
    method gives one, otherwise `value` itself.
    """

    value: float
    gradients: tuple[tuple[float, "Controller"], ...] = ()
    frequency: float | None = None  # [rad/s] where it binds; natural frequency of a binding pole
    time: float | None = None  # [s] where it binds, for goals in the time domain
    channel: str = ""  # which input, output or pole binds
    reason: str = ""  # why the value is infinite or says nothing
    method: str = ""
    upper: float = math.nan  # set to `value` if left out

    def __post_init__(self) -> None:
        if math.isnan(self.upper):
            object.__setattr__(self, "upper", self.value)

    def where(self) -> str:
        """Where it binds, else why there is no value, in words."""
        words = [f"{self.frequency:.4g} rad/s"] if self.frequency is not None else []
        words += [f"{self.time:.4g} s"] if self.time is not None else []
        words += [self.channel] if self.channel else []
        return ", ".join(words + ([self.reason] if self.reason and not math.isfinite(self.value) else []))

    def rows(self) -> list[Row]:
        """Value, where it binds, how it was found."""
        shown: list[Row] = [("value", self.value, ""), ("upper bound", self.upper, "")]
        shown += [("frequency", self.frequency, "rad/s")] if self.frequency is not None else []
        shown += [("time", self.time, "s")] if self.time is not None else []
        return shown + [(k, v, "") for k, v in (("channel", self.channel), ("reason", self.reason)) if v]


@dataclass(frozen=True, slots=True)
class Asked:
    """What a goal asks in its own unit, and how a normalised measure is said in it.

    value : the measure (1 at the limit) to the goal's own quantity
    """

    sense: Sense = "<="
    limit: float = 1.0
    unit: str = "1"
    value: Callable[[float], float] = float


def constant_limit(limit: Any) -> Asked:
    """What a goal with a constant limit asks; against a profile the measure stays normalised."""
    if not isinstance(limit, int | float | np.number):
        return Asked()
    return Asked(limit=float(limit), value=lambda v: v * float(limit))


def infinite(reason: str, *, method: str = "") -> Value:
    """The value of a goal that has none for this controller, and why."""
    return Value(value=math.inf, reason=reason, method=method)


class Measure(Protocol):
    """One way to put a number on a controller, and a second one."""

    def evaluate(self, K: "Controller") -> Value: ...

    def exact(self, K: "Controller") -> Value: ...


@dataclass(frozen=True, slots=True)
class Bound:
    """A goal on one loop."""

    goal: "Goal"
    measure: Measure

    def evaluate(self, K: "Controller") -> Value:
        """Value and gradients of the near-active pieces, fast."""
        return self.measure.evaluate(K)

    def exact(self, K: "Controller") -> Value:
        """The value by another algorithm; no gradients."""
        return self.measure.exact(K)


@dataclass(frozen=True, slots=True)
class Largest:
    """The largest of several measures."""

    measures: tuple[Measure, ...]

    def evaluate(self, K: "Controller") -> Value:
        found = [measure.evaluate(K) for measure in self.measures]
        worst = largest(found)
        if not math.isfinite(worst.value):
            return worst
        pieces = near(piece for value in found for piece in value.gradients)
        return Value(
            value=worst.value, gradients=pieces, frequency=worst.frequency, time=worst.time, channel=worst.channel,
            reason=worst.reason, method=worst.method,
        )  # fmt: skip

    def exact(self, K: "Controller") -> Value:
        found = [measure.exact(K) for measure in self.measures]
        worst = largest(found)
        highest = max(found, key=lambda value: value.upper)  # another than the worst if it could not be judged
        said = highest if math.isinf(highest.upper) else worst
        return Value(
            value=worst.value, frequency=worst.frequency, time=worst.time, channel=worst.channel,
            reason=said.reason, method=said.method, upper=highest.upper,
        )  # fmt: skip


def largest(values: Sequence[Value]) -> Value:
    """The value that binds."""
    return max(values, key=lambda value: value.value)


def near(pieces: Iterable[tuple[float, "Controller"]]) -> tuple[tuple[float, "Controller"], ...]:
    """The pieces within `NEAR` of the largest, the largest first."""
    ordered = sorted(pieces, key=lambda piece: -piece[0])
    if not ordered:
        return ()
    floor = ordered[0][0] - NEAR * max(abs(ordered[0][0]), NEAR)
    return tuple(piece for piece in ordered if piece[0] >= floor)
