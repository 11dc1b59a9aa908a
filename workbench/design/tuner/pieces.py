"""Goals on models as functions of the free parameters.

    models, structure, goals --GoalPieces--> theta -> pieces of the soft and of the hard goals, stable loops only
                                         --> theta -> every goal's exact value

A model may appear many times under different labels (robust tuning adds copies with other parameters); goals are
filtered by the model's own name.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.design.tuner.stabilise import Abscissa
from workbench.errors import InputError
from workbench.goals.goal import Goal, told_apart
from workbench.goals.measure import Bound, Value, infinite
from workbench.lti.model import Model

LEAST_DECAY = 1e-7  # usual least decay over the fastest pole: a billion times what rounding makes of a pole at zero
HELD = 1 - 5e-7  # what a hard goal is asked to stay below: its exact measure differs by rounding, 1e-9 and less
USUAL = math.nan
NEAR_EDGE = 1e2  # least decays from the axis within which slow poles are pieces

Pieces = list[tuple[float, np.ndarray]]


class Labelled(NamedTuple):
    """A model and what to call it in results."""

    label: str
    model: Model


class Task(NamedTuple):
    """One goal on one model."""

    goal: Goal
    label: str
    bound: Bound


@dataclass(frozen=True, slots=True)
class Smooth:
    """All goals at one theta: pieces (value, gradient (n,)) of the soft and of the hard ones, these over their targets.

    `decay` holds least decay / decay of the slowest poles: 1 where the least is reached, those below 0.01 left out.
    """

    soft: Pieces
    hard: Pieces
    decay: Pieces

    @property
    def largest_soft(self) -> float:
        return max((value for value, _ in self.soft), default=-math.inf)

    @property
    def largest_hard(self) -> float:
        return max((value for value, _ in self.hard), default=-math.inf)


@dataclass(frozen=True, eq=False, repr=False)
class GoalPieces:
    """Goals on models of one structure as pieces of a maximum: a value; `tightened` makes another on the same loops.

    min_decay : least decay of every pole [1/s]; `USUAL` for what suits the loops
    targets : what each hard goal's steering value is asked to stay below; `HELD` at first
    loops, abscissa, tasks : made if left out
    """

    models: Sequence[Labelled]
    structure: Structure
    goals: Sequence[Goal]
    min_decay: float = 0.0
    targets: tuple[float, ...] = ()
    loops: tuple[Loop, ...] = ()
    abscissa: Abscissa = None  # pyright: ignore[reportAssignmentType]
    tasks: tuple[Task, ...] = ()

    def __post_init__(self) -> None:
        if self.tasks:
            return
        models, structure = self.models, self.structure
        if not models or not self.goals:
            raise InputError(
                f"a tuning must have at least one model and one goal; got {len(models)} and {len(self.goals)}. "
                "Give both."
            )
        goals = told_apart(self.goals)
        loops = tuple(Loop(entry.model, structure) for entry in models)
        tasks = tuple(
            Task(goal, entry.label, goal.bind(loop))
            for goal in goals
            for entry, loop in zip(models, loops, strict=True)
            if goal.holds_for(entry.model.name)
        )
        for goal in goals:
            if not any(task.goal is goal for task in tasks):
                names = ", ".join(sorted({entry.model.name for entry in models}))
                raise InputError(
                    f"goal {goal.name!r} must hold for a model that is given; there are {names}. Mend its models."
                )
        made = {"goals": goals, "loops": loops, "tasks": tasks, "abscissa": Abscissa(list(loops), structure)}
        for name, value in {**made, "targets": (HELD,) * len(tasks)}.items():
            object.__setattr__(self, name, value)
        if math.isnan(self.min_decay):
            object.__setattr__(self, "min_decay", self._usual_decay())

    def _usual_decay(self) -> float:
        """1e-7 of the fastest pole at the structure's start, of a sampled loop of its Nyquist frequency [1/s]."""
        K = self.structure.controller()
        fastest = 0.0
        for loop in self.loops:
            poles = loop.poles(K) if loop.sample_time is None else np.array([math.pi / loop.sample_time])
            size = np.abs(poles)
            fastest = max(fastest, float(size[np.isfinite(size)].max(initial=0.0)))
        return LEAST_DECAY * fastest

    def at(self, theta: np.ndarray) -> Smooth | None:
        """Every goal's near-active pieces; None where a loop decays too slowly or a goal has no value."""
        slowest = self.abscissa.value(theta)
        if not (slowest < -self.min_decay and slowest < 0):
            return None
        K = self.structure.controller(theta)
        found = Smooth([], [], [])
        if -slowest < NEAR_EDGE * self.min_decay:
            for value, gradient in self.abscissa(theta):
                if 0 < -value < NEAR_EDGE * self.min_decay:
                    found.decay.append((-self.min_decay / value, self.min_decay / value**2 * gradient))
        for task, target in zip(self.tasks, self.targets, strict=True):
            value = _undefined_is_infinite(task.bound.evaluate, K)
            if not math.isfinite(value.value):
                return None
            pieces, share = (found.hard, 1 / target) if task.goal.hard else (found.soft, 1.0)
            pieces += [(share * v, share * self.structure.pullback(theta, G)) for v, G in value.gradients]
        return found

    def tightened(self, theta: np.ndarray, exact: Sequence[Value]) -> "GoalPieces":
        """With lower targets of the hard goals whose exact value is above 1 where the steering one is not."""
        targets = list(self.targets)
        for k, (task, steered, judged) in enumerate(zip(self.tasks, self.smooth_values(theta), exact, strict=True)):
            if task.goal.hard and judged.upper > 1:
                targets[k] = min(targets[k], HELD * steered.value / judged.upper)
        return replace(self, targets=tuple(targets))

    def smooth_values(self, theta: np.ndarray) -> list[Value]:
        """The steering value of each task; infinite, with the reason, where there is none."""
        K = self.structure.controller(theta)
        return [_undefined_is_infinite(task.bound.evaluate, K) for task in self.tasks]

    def exact_values(self, theta: np.ndarray) -> list[Value]:
        """The deciding value of each task; every one infinite where a loop is unstable."""
        K = self.structure.controller(theta)
        if reason := self.unstable(K):
            return [infinite(reason) for _ in self.tasks]
        return [_undefined_is_infinite(task.bound.exact, K) for task in self.tasks]

    def unstable(self, K: Controller) -> str:
        """Why a loop is not stable, the whole of it, whatever the goals see; empty if all are."""
        for loop in self.loops:
            try:
                count = loop.unstable_poles(K)
            except InputError as error:
                return str(error)
            if count:
                return f"the closed loop of {loop.name!r} is unstable: {count} poles on or beyond the limit."
        return ""


def _undefined_is_infinite(measure: Callable[[Controller], Value], K: Controller) -> Value:
    """The measure of a controller; a point where it does not exist is one outside the domain, not the end of a search.

    That is an algebraic loop without solution, a pole on the axis at a frequency that is asked for, an eigenvalue
    problem that does not converge.
    """
    try:
        return measure(K)
    except (InputError, np.linalg.LinAlgError) as error:
        return infinite(str(error))
