"""What most goals look at: a channel from inputs to outputs, or the sensitivity at points of a loop.

    ChannelGoal  loop.channel(inputs, outputs)  ┐
    PointGoal    loop.sensitivity(points)       ┴--measure(channel)--> Bound

A kind says which of its fields are positive sizes, whether its signals come in pairs and whether it can look at a band;
what else must hold of its fields it says in `check_fields`.
"""

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from workbench.errors import InputError
from workbench.goals.goal import FULL_BAND, Goal, positive, some_names
from workbench.goals.measure import Bound, Measure
from workbench.lti.weight import filter_of


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalGoal(Goal):
    """A goal on named signals of a loop; refuses what its class says must not be."""

    sizes: ClassVar[tuple[tuple[str, str], ...]] = ()  # fields that are positive and finite, each with its unit
    in_pairs: ClassVar[bool] = False  # as many outputs as inputs
    all_frequencies: ClassVar[bool] = False  # no focus band

    def __post_init__(self) -> None:
        for key in ("inputs", "outputs", "points"):
            if hasattr(self, key):
                object.__setattr__(self, key, some_names(key, getattr(self, key)))
        for key, unit in self.sizes:
            object.__setattr__(self, key, positive(key, getattr(self, key), unit))
        if self.in_pairs:
            check_pairs(self)
        if self.all_frequencies and tuple(self.focus) != FULL_BAND:
            raise InputError(f"{type(self).__name__} looks at all frequencies; got focus {self.focus}. Leave it out.")
        self.check_fields()
        Goal.__post_init__(self)

    def check_fields(self) -> None:
        """Refuses values of the kind's own fields."""

    def measure(self, channel: Any) -> Measure:
        """What is measured on the channel."""
        raise InputError(f"{type(self).__name__} must define measure(channel), or bind(loop). Add one of them.")


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelGoal(SignalGoal):
    """A goal on the channel from inputs to outputs; names, the two first arguments."""

    inputs: tuple[str, ...] = field(kw_only=False)
    outputs: tuple[str, ...] = field(kw_only=False)

    def bind(self, loop: Any) -> Bound:
        """The goal on one loop."""
        return Bound(self, self.measure(loop.channel(self.inputs, self.outputs, self.openings)))


@dataclass(frozen=True, slots=True, kw_only=True)
class PointGoal(SignalGoal):
    """A goal on the sensitivity at points; names, the first argument."""

    points: tuple[str, ...] = field(kw_only=False)

    def bind(self, loop: Any) -> Bound:
        """The goal on one loop."""
        return Bound(self, self.measure(loop.sensitivity(self.points, self.openings)))


def check_pairs(goal: ChannelGoal) -> None:
    """As many outputs as inputs."""
    if len(goal.inputs) != len(goal.outputs):
        raise InputError(
            f"inputs and outputs must pair up; got {len(goal.inputs)} inputs and {len(goal.outputs)} outputs. "
            "Name each output beside its input."
        )


def check_scale(goal: Any) -> None:
    """The scale, if given, has one positive size per input."""
    if goal.scale is None:
        return
    sizes = np.atleast_1d(np.asarray(goal.scale, float))
    if sizes.shape != (len(goal.inputs),) or not (np.isfinite(sizes).all() and (sizes > 0).all()):
        raise InputError(f"scale must give one positive size for each of {list(goal.inputs)}; got {goal.scale!r}.")
    object.__setattr__(goal, "scale", tuple(float(size) for size in sizes))


def check_weights(goal: Any) -> None:
    """The weights are stable filters that fit the signals."""
    filter_of("left", goal.left, len(goal.outputs), side="left")
    filter_of("right", goal.right, len(goal.inputs), side="right")
