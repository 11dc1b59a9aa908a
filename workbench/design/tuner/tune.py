"""Tuning the free parameters of a structure: soft goals as small as they get, every hard one at most 1.

    models, structure, goals --starts--> stabilise --> descend --> best start --exact goals--> Tuning

Steering and deciding are apart: the nonsmooth solver follows `goal.evaluate`, and every figure of the result is
`goal.exact`, another algorithm. Where the exact value of a hard goal is above 1 although the steering one is below, the
search is repeated with a smaller target for that goal.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.design.effort import check_starts
from workbench.design.tuner.constrained import Descent, descend
from workbench.design.tuner.pieces import USUAL, GoalPieces, Labelled
from workbench.design.tuner.result import StartReport, TunedGoal, Tuning
from workbench.design.tuner.stabilise import random_start, stabilise
from workbench.errors import InfeasibleError, InputError
from workbench.goals.goal import Goal, told_apart
from workbench.goals.measure import Value
from workbench.lti.model import Model
from workbench.machine.budget import checked_budget
from workbench.machine.threads import one_thread
from workbench.solve.exchange import Found, exchange
from workbench.solve.multistart import check_workers, ends

ROUNDS = 3  # of repeating the best start with a smaller target where exact and steering values differ
FAR = 2.0  # exact hard value beyond which steering and exact measure do not speak of the same thing: no repetition
ROOM = 10.0  # decay asked of a stabilising start, over the least one
ALIKE = 1e-3  # relative: soft values this close are the same; the earlier start is taken


@dataclass(frozen=True, slots=True)
class Progress:
    """What a running tuning tells after each step: the start (1, 2, …), the phase, largest values, seconds so far."""

    start: int
    phase: str
    soft: float
    hard: float
    seconds: float


@dataclass(frozen=True, slots=True)
class _End:
    """A start's outcome; `refusal` is the sentence where it could not be stabilised."""

    number: int
    descent: Descent | None
    seconds: float
    refusal: str


def tune(
    models: Model | Sequence[Model], structure: Structure, goals: Sequence[Goal], *, starts: int = 4, seed: int = 0,
    budget_seconds: float = 60.0, workers: int = 1, start=None, min_decay: float | None = None,
    on_progress: Callable[[Progress], bool | None] | None = None,
) -> Tuning:  # fmt: skip
    """The structure's free parameters for which the largest soft goal is small and every hard goal is met.

    Parameters
    ----------
    models : Model or several
        One structure for all of them; a goal counts on each model it holds for, at its worst.
    structure : Structure
        Its values are the first start, its bounds are kept. Where they meet every hard goal they are never worsened.
    goals : Goal records
        Hard ones must be at most 1; the largest soft one is minimised. Stability of every loop is always required.
    starts, seed : int
        The first start is the structure's (or `start`), the others random around it; same seed, same result, as long
        as the budget does not end the search.
    budget_seconds : float
        Of the search; the exact values come on top.
    workers : int
        Processes; starts run side by side if more than one (a script then needs the `if __name__ == "__main__"` guard).
    start : (n,), optional
        Values of the free parameters for the first start.
    min_decay : float, optional
        Least decay of every closed-loop pole [1/s], for sampled loops of log|z|/h; 1e-7 of the fastest pole at the
        structure's start (of a sampled loop: of its Nyquist frequency) if left out. Without it an integrator whose gain
        goes to zero leaves a pole at zero that rounding calls stable.
    on_progress : Progress → bool, optional
        Called after each step, after each start if workers > 1; True ends the search, and the best so far is verified.

    Raises
    ------
    InputError
        If models, structure and goals do not fit together.
    InfeasibleError
        If no start is stabilised, or a hard goal is not met: names it, the best value reached, model and frequency.

    Source: Apkarian & Noll, IEEE Trans. Automat. Control 51 (2006) 71; Apkarian, Gahinet & Buhr, ECC 2014.
    """
    given = [models] if isinstance(models, Model) else list(models)
    names = [model.name for model in given]
    if len(set(names)) != len(names):
        raise InputError(f"models must have distinct names; got {names}. Rename the doubled one.")
    check_starts(starts)
    checked_budget(budget_seconds)
    if min_decay is not None and not (math.isfinite(min_decay) and min_decay >= 0):
        raise InputError(f"min_decay must be zero or more [1/s]; got {min_decay!r}. Leave it out for the usual.")
    labelled = [Labelled(model.name, model) for model in given]
    return tune_labelled(
        labelled, structure, list(goals), starts=starts, seed=seed, budget_seconds=budget_seconds, workers=workers,
        start=start, on_progress=on_progress, min_decay=min_decay,
    )  # fmt: skip


def tune_labelled(
    models: list[Labelled], structure: Structure, goals: list[Goal], *, starts: int, seed: int, budget_seconds: float,
    workers: int, start, on_progress, refuse: bool = True, min_decay: float | None = None,
) -> Tuning:  # fmt: skip
    """`tune` for labelled models; with refuse=False a hard goal that is not met is reported, not raised."""
    begun = perf_counter()
    with one_thread():  # small matrices: more threads only wait for each other
        programme = GoalPieces(models, structure, goals, USUAL if min_decay is None else min_decay)
        centre = structure.start if start is None else np.asarray(start, float).ravel()
        if centre.shape != structure.start.shape:
            raise InputError(
                f"start must hold {len(structure.start)} numbers ({', '.join(structure.names)}); got {len(centre)}."
            )
        box = structure.bounds
        if len(centre) and not np.all((centre >= box[:, 0]) & (centre <= box[:, 1])):
            raise InputError("start must lie within the structure's bounds; move it or widen them.")
        log = _ends(models, programme, centre, starts, seed, budget_seconds, workers, on_progress)
        if all(end.descent is None for end in log):
            raise InfeasibleError(log[0].refusal)
        chosen = _chosen(programme, log, centre, seed, begun + budget_seconds)
        return _tuning(programme, chosen, log, begun, refuse)


def _run_start(programme: GoalPieces, centre: np.ndarray, k: int, seed: int, budget: float, told) -> _End:
    """One start, from its parameters to where it ends."""
    begun = perf_counter()
    structure = programme.structure
    theta = centre if k == 0 else random_start(structure, centre, np.random.default_rng([seed, k]))
    try:
        stable = stabilise(
            programme.loops, structure, start=theta, starts=3, seed=seed + k, budget_seconds=budget / 2,
            margin=ROOM * programme.min_decay or None,
            on_step=lambda x, value: told is not None and told("stabilising", x, math.inf, math.inf),
        )  # fmt: skip
    except InfeasibleError as error:
        return _End(k + 1, None, perf_counter() - begun, str(error))
    end = descend(programme, stable.theta, until=begun + budget, seed=seed, on_step=told)
    return _End(k + 1, end, perf_counter() - begun, "")


def _starter(shared) -> Callable[[int], _End]:
    """What runs the starts in a process."""
    models, structure, goals, min_decay, centre, seed, budget = shared
    programme = GoalPieces(models, structure, goals, min_decay)
    return lambda k: _run_start(programme, centre, k, seed, budget, None)


def _ends(models, programme: GoalPieces, centre, starts, seed, budget, workers, on_progress) -> list[_End]:
    """How the starts ended, in their order; fewer where the time or whoever listens ends the search."""
    check_workers(workers)
    begun, ended, found = perf_counter(), False, []
    share = budget * min(workers, starts) / starts
    shared = (models, programme.structure, programme.goals, programme.min_decay, centre, seed, share)
    apart = workers > 1 and starts > 1

    def told(k: int, words: str, soft: float, hard: float) -> bool:
        nonlocal ended
        if on_progress is not None:
            ended = ended or bool(on_progress(Progress(k + 1, words, soft, hard, perf_counter() - begun)))
        return ended

    def here(k: int) -> _End:
        left = budget - (perf_counter() - begun)
        step = lambda words, _, soft, hard: told(k, words, soft, hard)  # noqa: E731
        return _run_start(programme, centre, k, seed, left / (starts - k), step)

    for k, end in ends(range(starts), _starter, shared, workers=workers, work="a tuning", here=here):
        found.append(end)
        if apart:
            told(k, "start ended", *((end.descent.soft, end.descent.hard) if end.descent else (math.inf, math.inf)))
        if ended or len(centre) == 0 or (not apart and perf_counter() - begun >= budget):
            break
    return sorted(found, key=lambda end: end.number)


@dataclass(frozen=True, slots=True)
class _Judged:
    """Where a search ended, by the exact measures of every task."""

    descent: Descent
    exact: list[Value]
    missed: float  # of the largest hard value over 1; 0 where all are met as far as can be told
    excess: float  # the same of the upper ends of their brackets, which decide
    soft: float
    improves: bool = True  # on what was there before

    @classmethod
    def of(cls, programme: GoalPieces, descent: Descent) -> "_Judged":
        exact = programme.exact_values(descent.theta)
        pairs = list(zip(programme.tasks, exact, strict=True))
        hard = [(value.value, value.upper) for task, value in pairs if task.goal.hard]
        missed, excess = (max(max((pair[k] for pair in hard), default=0.0) - 1, 0.0) for k in (0, 1))
        soft = max((value.value for task, value in pairs if not task.goal.hard), default=-math.inf)
        return cls(descent, exact, missed, excess, soft)

    @property
    def rank(self) -> tuple[float, float, float]:
        """Smaller is better: what hard goals miss, then what no bracket decides, then the soft value."""
        return self.missed, self.excess, self.soft


def _records(ends: list[_End]) -> list[Descent]:
    """The starts that were better than all before: the smallest hard value until it is below 1, then the soft one."""
    found: list[Descent] = []
    for d in (end.descent for end in ends if end.descent is not None):
        size = (0.0, d.soft) if d.feasible else (d.hard, d.soft)
        if not found:
            found.append(d)
            continue
        last = found[-1]
        least = (0.0, last.soft) if last.feasible else (last.hard, last.soft)
        k = 0 if size[0] != least[0] else 1
        if size[k] < least[k] - ALIKE * abs(least[k]):
            found.append(d)
    return found


def _chosen(programme: GoalPieces, ends: list[_End], centre: np.ndarray, seed: int, until: float) -> _Judged:
    """The best by the exact measures: of the record starts, verified, and of the given start as it is.

    A further start adds to the records and changes none, so that more starts are never worse, nor is the given one.
    """
    given = Descent(centre, math.inf, math.inf, None)
    candidates = [_verified(programme, record, seed, until) for record in _records(ends)]
    if programme.abscissa.value(centre) < -programme.min_decay:
        candidates.append(_Judged.of(programme, given))
    return min(candidates, key=lambda judged: judged.rank)


def _verified(programme: GoalPieces, best: Descent, seed: int, until: float) -> _Judged:
    """A start, searched again with smaller targets while exact hard values are above 1 that steering put below."""

    def solve(held: GoalPieces, last: _Judged | None) -> _Judged:
        if last is None:
            return _Judged.of(held, best)
        again = _Judged.of(held, descend(held, last.descent.theta, until=until, seed=seed))
        return again if again.rank < last.rank else replace(last, improves=False)

    def search(_: GoalPieces, judged: _Judged) -> Found[Value]:
        near = 0 < judged.excess < FAR - 1 and judged.descent.feasible and judged.improves
        return Found(not near, tuple(judged.exact))

    def add(held: GoalPieces, judged: _Judged, exact: tuple[Value, ...]) -> GoalPieces:
        return held.tightened(judged.descent.theta, exact)

    return exchange(programme, solve, search, add, rounds=1 + ROUNDS, expired=lambda: perf_counter() > until).answer


def _tuning(programme: GoalPieces, chosen: _Judged, ends: list[_End], begun: float, refuse: bool) -> Tuning:
    """Every goal by its exact measure, the worst model each; refused where a hard one is not met."""
    exact_begun, theta, exact = perf_counter(), chosen.descent.theta, chosen.exact
    smooth = programme.smooth_values(theta)
    goals = []
    for goal in programme.goals:
        own = [k for k, task in enumerate(programme.tasks) if task.goal is goal]
        worst = max(own, key=lambda k: exact[k].upper if not math.isnan(exact[k].upper) else math.inf)
        value = exact[worst]
        goals.append(TunedGoal(
            name=goal.name, hard=goal.hard, model=programme.tasks[worst].label, value=value.value, upper=value.upper,
            smooth=smooth[worst].value, frequency=value.frequency, time=value.time, channel=value.channel,
            method=value.method, reason=value.reason,
        ))  # fmt: skip
    structure = programme.structure
    tuned = structure.with_values(dict(zip(structure.names, theta.tolist(), strict=True)))
    result = Tuning(
        values=structure.values(theta), theta=theta, structure=tuned, goals=tuple(goals),
        abscissa=max(_abscissa(loop, structure.controller(theta)) for loop in programme.loops),
        minimum=chosen.descent.minimum,
        starts=tuple(_report(programme, end) for end in ends), seconds=exact_begun - begun,
        exact_seconds=perf_counter() - exact_begun,
    )  # fmt: skip
    if refuse:
        refuse_unmet(result, programme.goals)
    return result


def _abscissa(loop: Loop, K: Controller) -> float:
    """Largest real part of a loop's poles [1/s], infinite where it cannot be told; the goals then say why."""
    try:
        return loop.abscissa(K)
    except InputError:
        return math.inf


def refuse_unmet(result: Tuning, goals: Sequence[Goal]) -> None:
    """Raise InfeasibleError for the worst hard goal that is not met, in its own unit."""
    unmet = [goal for goal in result.goals if goal.hard and not goal.met]
    if not unmet:
        return
    worst = max(unmet, key=lambda goal: goal.upper)
    asked = next(goal for goal in told_apart(goals) if goal.name == worst.name).asked()
    bound = "at most" if asked.sense == "<=" else "at least"

    def shown(value: float) -> str:
        return f"{asked.value(value):.5g} {asked.unit}".removesuffix(" 1") if math.isfinite(value) else "none"

    proved = ""
    if math.isinf(worst.upper) and math.isfinite(worst.value):
        proved = ", but no bracket of it could be found"
    elif worst.upper > 1.0001 * worst.value:
        proved = f", proved to be {bound} {shown(worst.upper)}"
    others = ", ".join(repr(goal.name) for goal in unmet if goal is not worst)
    reason = f" ({worst.reason.rstrip('.')})" if worst.reason else ""
    limit = f"{asked.limit:.6g} {asked.unit}".removesuffix(" 1")
    raise InfeasibleError(
        f"hard goal {worst.name!r} must be {bound} {limit}; the best value reached is {shown(worst.value)}{proved}"
        f"{reason} ({worst.where()}).{f' Also not met: {others}.' if others else ''} "
        "Relax it, make it soft, free a parameter or try more starts."
    )


def _report(programme: GoalPieces, end: _End) -> StartReport:
    d = end.descent
    if d is None:
        return StartReport(
            number=end.number, soft=math.inf, hard=math.inf, abscissa=math.inf, seconds=end.seconds, message=end.refusal
        )
    return StartReport(
        number=end.number, soft=d.soft, hard=d.hard, abscissa=programme.abscissa.value(d.theta), seconds=end.seconds,
        message=d.minimum.message if d.minimum else "nothing to improve",
    )  # fmt: skip
