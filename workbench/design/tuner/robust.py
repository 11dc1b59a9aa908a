"""Tuning for the worst parameters inside a box: models are added where the tuned loop is worst, until none is worse.

    box --centre--> active set --tune--> theta --search the box--> a worse model? add it, tune again : done

Each round searches the box for the parameters that make a goal largest: vertices, seeded random points, then a compass
search from the worst of them. A search proves nothing; `worst` says what it found, `visited` where tuning looked.

Source: Apkarian, Dao & Noll, Parametric robust structured control design, IEEE Trans. Automat. Control 60 (2015) 1857.
"""

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from workbench.control.structure.structure import Structure
from workbench.design.tuner.pieces import GoalPieces, Labelled
from workbench.design.tuner.result import Tuning
from workbench.design.tuner.tune import Progress, refuse_unmet, tune_labelled
from workbench.errors import InfeasibleError, InputError
from workbench.goals.goal import Goal
from workbench.lti.model import Model
from workbench.machine.budget import checked_budget
from workbench.machine.threads import one_thread
from workbench.result import Result, Row
from workbench.solve.exchange import Found, exchange

MOST_VERTICES = 64  # of the box; a random choice of them where there are more
SHRINKS = 6  # halvings of the compass search's step, from a quarter of the box
SAME = 1e-6  # of the box's width: parameters closer than that are one


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Visited(Result):
    """Parameters that the tuning counted on, and the value of the goal that brought them in."""

    label: str
    parameters: Mapping[str, float]
    goal: str  # "" for the centre
    value: float  # when it was found, before tuning for it

    def rows(self) -> list[Row]:
        """Parameters, and what they did."""
        return [(name, value, "") for name, value in self.parameters.items()] + [(self.goal, self.value, "")]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class RobustTuning(Result):
    """A tuning for the worst parameters found in a box."""

    tuning: Tuning  # its goals' models are labels of `visited`
    visited: tuple[Visited, ...]
    worst_soft: float  # largest soft value the last search found anywhere in the box, −inf without soft goals
    worst_hard: float
    settled: bool  # whether the last search found nothing worse than the models tuned for
    rounds: int
    seconds: float

    def rows(self) -> list[Row]:
        """Worst values, the visited set's size, then the tuning."""
        return [
            ("worst soft value in the box", self.worst_soft, ""), ("worst hard value in the box", self.worst_hard, ""),
            ("settled", self.settled, ""), ("models tuned for", len(self.visited), ""), ("rounds", self.rounds, ""),
            ("time", self.seconds, "s"), *self.tuning.rows(),
        ]  # fmt: skip


def tune_robust(
    model_of: Callable[[Mapping[str, float]], Model], box: Mapping[str, tuple[float, float]], structure: Structure,
    goals: Sequence[Goal], *, starts: int = 4, seed: int = 0, budget_seconds: float = 120.0, workers: int = 1,
    start=None, rounds: int = 8, searches: int = 3, tolerance: float = 1e-2,
    on_progress: Callable[[Progress], bool | None] | None = None,
) -> RobustTuning:  # fmt: skip
    """The structure's parameters for the worst plant of a box, as far as a search finds it.

    Parameters
    ----------
    model_of : mapping of parameter values → Model
    box : mapping of parameter name to (low, high)
    structure, goals, starts, seed, budget_seconds, workers, start, on_progress : see `tune`
        Later rounds start at the result so far.
    rounds : int
        Most tunings.
    searches : int
        Compass searches per goal and round; each starts at one of the worst points seen.
    tolerance : float
        Relative excess over the largest soft value (over 1 for hard goals) that counts as worse.

    Raises
    ------
    InputError
        If the box is not one, or models and goals do not fit.
    InfeasibleError
        If a hard goal is not met on the visited models, or a worse model remains when rounds or time run out.
    """
    begun = perf_counter()
    checked_budget(budget_seconds)
    names, low, high = _checked(box)
    if rounds < 1 or searches < 1:
        raise InputError(f"rounds and searches must be at least 1; got {rounds!r} and {searches!r}.")
    generator = np.random.default_rng(seed)

    def visit(point: np.ndarray, goal: str, value: float, label: str = "") -> Visited:
        label = label or ", ".join(f"{name} {v:.4g}" for name, v in zip(names, point, strict=True))
        return Visited(label=label, parameters=_named(names, point), goal=goal, value=value)

    models: dict[str, Labelled] = {}

    def modelled(one: Visited) -> Labelled:
        if one.label not in models:
            models[one.label] = Labelled(one.label, model_of(one.parameters))
        return models[one.label]

    def solve(held: tuple[Visited, ...], last: _Tuned | None) -> _Tuned:
        left = budget_seconds - (perf_counter() - begun)
        tuning = tune_labelled(
            [modelled(one) for one in held], structure, list(goals),
            starts=starts if last is None else 1, seed=seed, workers=workers,
            start=start if last is None else last.tuning.theta,
            budget_seconds=max(left / 2 if last is None else left, 0.1), on_progress=on_progress, refuse=False,
        )  # fmt: skip
        refuse_unmet(tuning, goals)
        with one_thread():
            sought = _Sought(model_of, names, low, high, structure, goals, tuning.theta, generator)
            return _Tuned(tuning, tuple(sought.worst(searches)))

    def search(held: tuple[Visited, ...], tuned: _Tuned) -> Found[Visited]:
        soft = tuned.tuning.soft
        limit = (soft if soft is not None else math.inf) * (1 + tolerance)
        worse = [f for f in tuned.worst if f[2] > (1.0 if f[0].hard else limit)]
        fresh: list[Visited] = []
        for goal, point, value in worse:
            known = [np.array([one.parameters[name] for name in names]) for one in (*held, *fresh)]
            if all(np.max(np.abs(point - other) / _width(low, high)) > SAME for other in known):
                fresh.append(visit(point, goal.name, value))
        stop = "what is worse is among the models already" if worse and not fresh else ""
        return Found(not worse, tuple(fresh), stop=stop)

    done = exchange(
        (visit((low + high) / 2, "", math.nan, "centre"),), solve, search, lambda held, _, fresh: (*held, *fresh),
        rounds=rounds, expired=lambda: perf_counter() - begun > budget_seconds,
    )  # fmt: skip
    tuned = done.answer
    if tuned.largest(hard=True) > 1:
        goal, point, value = max((f for f in tuned.worst if f[0].hard), key=lambda f: f[2])
        raise InfeasibleError(
            f"hard goal {goal.name!r} must be at most 1 in the whole box; {value:.5g} was found at "
            f"{visit(point, '', value).label} after {len(done.rounds)} rounds. Shrink the box, relax the goal, or "
            "allow more rounds or time."
        )
    return RobustTuning(
        tuning=tuned.tuning, visited=done.held, worst_soft=tuned.largest(hard=False),
        worst_hard=tuned.largest(hard=True), settled=done.settled, rounds=len(done.rounds),
        seconds=perf_counter() - begun,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Tuned:
    """A tuning and the worst point of the box found for each goal, with its value there."""

    tuning: Tuning
    worst: tuple[tuple[Goal, np.ndarray, float], ...]

    def largest(self, *, hard: bool) -> float:
        """Largest value of a hard or of a soft goal, −inf without one."""
        return max((value for goal, _, value in self.worst if goal.hard == hard), default=-math.inf)


def _checked(box) -> tuple[tuple[str, ...], np.ndarray, np.ndarray]:
    if not box:
        raise InputError("the box must name at least one parameter; got none. Use tune for a fixed model.")
    for name, ends in box.items():
        if len(ends) != 2 or not (math.isfinite(ends[0]) and math.isfinite(ends[1]) and ends[0] <= ends[1]):
            raise InputError(f"the box of {name!r} must be (low, high), finite, low <= high; got {ends!r}. Mend it.")
    limits = np.array([box[name] for name in box], float)
    return tuple(box), limits[:, 0], limits[:, 1]


def _named(names, point: np.ndarray) -> dict[str, float]:
    return dict(zip(names, point.tolist(), strict=True))


def _width(low: np.ndarray, high: np.ndarray) -> np.ndarray:
    return np.where(high > low, high - low, 1.0)


class _Sought:
    """Goals as functions of the parameters, at fixed free parameters of the controller."""

    def __init__(self, model_of, names, low, high, structure, goals, theta, generator) -> None:
        self._model_of, self._names, self._low, self._high = model_of, names, low, high
        self._structure, self._goals, self._theta, self._generator = structure, list(goals), theta, generator
        self._known: dict[bytes, list[float]] = {}

    def _values(self, point: np.ndarray) -> list[float]:
        """The steering value of every goal, infinite where the loop is unstable."""
        key = point.tobytes()
        if key not in self._known:
            model = self._model_of(_named(self._names, point))
            programme = GoalPieces([Labelled("here", model)], self._structure, self._goals)
            if programme.abscissa.value(self._theta) < 0:
                self._known[key] = [value.value for value in programme.smooth_values(self._theta)]
            else:
                self._known[key] = [math.inf] * len(self._goals)
        return self._known[key]

    def worst(self, searches: int) -> list[tuple[Goal, np.ndarray, float]]:
        """For each goal the worst point found and its value there."""
        seen = self._vertices()
        seen += [self._generator.uniform(self._low, self._high) for _ in range(2 * len(self._names) + 4)]
        found = []
        for index, goal in enumerate(self._goals):
            order = sorted(seen, key=lambda point: -self._values(point)[index])
            ends = [self._climbed(point, index) for point in order[:searches]]
            point = max(ends, key=lambda point: self._values(point)[index])
            found.append((goal, point, self._values(point)[index]))
        return found

    def _vertices(self) -> list[np.ndarray]:
        count = len(self._names)
        if 2**count <= MOST_VERTICES:
            choices = np.array(list(itertools.product((0.0, 1.0), repeat=count)))
        else:
            choices = self._generator.integers(0, 2, size=(MOST_VERTICES, count)).astype(float)
        return [self._low + choice * (self._high - self._low) for choice in choices]

    def _climbed(self, point: np.ndarray, index: int) -> np.ndarray:
        """Compass search: the best of the steps along every axis, halved when none is better."""
        step = (self._high - self._low) / 4
        here, value = point, self._values(point)[index]
        for _ in range(SHRINKS):
            while math.isfinite(value):
                around = [
                    np.clip(here + sign * step[i] * np.eye(len(here))[i], self._low, self._high)
                    for i in range(len(here))
                    for sign in (1.0, -1.0)
                ]
                best = max(around, key=lambda p: self._values(p)[index])
                if self._values(best)[index] <= value * (1 + 1e-9):
                    break
                here, value = best, self._values(best)[index]
            step = step / 2
        return here
