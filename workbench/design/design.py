"""From a problem to gains that meet its requirements, verified by algorithms the optimiser did not use.

    seeded starts --solve--> candidates --round as printed--> exact analysis --> verdicts --> the best that meets all

When none does: which requirement binds, where, and by how much it misses.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.analysis.analysis import Analysis, analyse
from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.design.brought import LAST, Job, bringer, nominal
from workbench.design.multipliers import multipliers
from workbench.design.problem import Problem
from workbench.design.record import DIGITS, Design, Start, given
from workbench.design.refusal import refusal
from workbench.design.sampled import kept_sampled
from workbench.design.solve import finish, stable_start
from workbench.design.starts import (
    BACK_OFFS,
    CUT_SHORT,
    FEW,
    FINISHED,
    SAME_ROUGHLY,
    STARTS,
    distinct,
    in_bounds,
    jobs_of,
    relaxed_starts,
    time_after,
)
from workbench.design.steering import Programme
from workbench.design.valley import in_valley
from workbench.design.verdict import verdicts
from workbench.errors import InputError, unknown_name
from workbench.goals.ride.cost import RideCost
from workbench.goals.verdict import Verdict
from workbench.machine.budget import Deadline, current, keeping
from workbench.machine.threads import one_thread
from workbench.solve.multistart import ends
from workbench.solve.smooth import Outcome, least_violation

SMOOTH, NONSMOOTH = ("slsqp", "ipopt"), "nonsmooth"
RESTRICTED = ("slsqp", "restriction")  # of a controller affine in its parameters: least integrated error in limits
AT_ONCE = 2  # distinct valleys to which goals of other loops are brought; the next ones where these meet none
MOST_BROUGHT = 6


def design(
    problem: Problem,
    *,
    starts: int | None = None,
    seed: int | None = None,
    method: str | None = None,
    start: Gains | Mapping[str, float] | None = None,
    workers: int = 1,
    on_start: Callable[[Start], None] | None = None,
    models: Sequence[Mapping[str, float]] | None = None,
    near: Sequence[Gains] = (),
    seconds: float | None = None,
    valley: str | None = None,
) -> Design:
    """Chooses the free parameters of a problem so that its hard goals hold and its soft ones are small.

    Goals say how they steer: by many smooth rows (a vehicle's: SLSQP or IPOPT) or by few pieces with corners (margins,
    gains, tracking: the nonsmooth tuner). Either way the printed parameters are judged by other algorithms.

    Of a vehicle every start is first solved with the peak sensitivity relaxed; the best few that differ are then
    brought to the wanted limit, rounded and verified, and the cheapest that meets everything is the design.

    Parameters
    ----------
    starts, seed, seconds : as the problem's `effort` says if left out
    starts : number of seeded starts (16 of a vehicle, 4 else), random around a centre; with `start` given, the first
        is those values
    method : "slsqp", "ipopt" or "nonsmooth"; as the goals say if left out. Where hard goals limit gains, the soft one
        is an integrated error and the controller is affine in its free parameters: "slsqp" or "restriction", a sequence
        of convex problems; both start within the limits and need no random starts
    workers : processes among which the starts are shared; a script that asks for more than one needs the usual
        `if __name__ == "__main__"`. The starts do not depend on it.
    on_start : called after each start, for progress
    models : vehicles that must keep damping, decay, sensitivity and delay margin as well, as values of
        `design.variation.PARAMETERS`; boxes, other limits and costs, and the evidence: `design.robust.robust_design`
    near : gains brought straight to the wanted limits beside the starts: neighbours of a sweep
    seconds : of the search; without end for a vehicle, a minute else, if left out
    valley : "mirrored" or "conventional" (`design.valley`), on a vehicle; whichever is cheaper if left out

    Never dearer than `start` or one of `near`, where these meet the goals themselves.

    Raises
    ------
    InfeasibleError
        If no start meets every hard goal: names what binds, where, and by how much it misses.
    InputError
        If starts is not positive, nothing is free, or the problem cannot be designed.
    """
    problem = problem if valley is None else in_valley(problem, valley)
    how = method_of(problem, method)
    own = how not in SMOOTH or not problem.flies
    effort = problem.effort.said(starts, seed, seconds)
    count, seed, seconds = effort.starts or (FEW if own else STARTS), effort.seed, effort.budget
    if own:
        from workbench.design.nonsmooth import nonsmooth_design
        from workbench.design.restriction.design import restricted_design

        if models or near:
            raise InputError("models and near are for a vehicle's design. Give the problem several models instead.")
        options = {} if start is None else {"start": dict(start) if isinstance(start, Mapping) else start.as_dict()}
        if how != NONSMOOTH:
            return restricted_design(problem, how, seconds=seconds, on_start=on_start, **options)
        return nonsmooth_design(
            problem, starts=count, seed=seed, seconds=seconds, workers=workers, on_start=on_start, **options
        )
    begun = start if start is None or isinstance(start, Gains) else Gains.from_mapping(start)
    with keeping(current() if seconds is None else Deadline.after(seconds)):
        return _smooth_design(problem, count, seed, how, begun, workers, on_start, models, near)


def method_of(problem: Problem, method: str | None = None) -> str:
    """The method asked for, or the one that the goals' way of steering asks for; refused where they do not fit."""
    corners = any(goal.corners for goal in problem.goals) or not problem.flies
    own = (NONSMOOTH,) if corners else SMOOTH
    if not problem.flies:
        from workbench.design.restriction.affine import suited

        own = (*RESTRICTED, NONSMOOTH) if method in RESTRICTED or suited(problem) else own
    if method is None:
        return own[0]
    if method not in (*SMOOTH, NONSMOOTH, *RESTRICTED):
        raise unknown_name("method", method, (*SMOOTH, NONSMOOTH, RESTRICTED[1]))
    if method not in own:
        steered = "pieces with corners" if corners else "smooth rows"
        raise InputError(
            f"the goals of {problem.name!r} steer by {steered}, which {method} does not follow; "
            f"take {' or '.join(own)}."
        )
    return method


def _smooth_design(problem, starts, seed, solver, start, workers, on_start, models, near) -> Design:
    """The smooth programme: starts, candidates, the cheapest that meets everything."""
    if models:
        from workbench.design.robust import robust_design
        from workbench.design.variation import Variation, sentence

        named = {f"{k + 1}: {sentence(values)}": values for k, values in enumerate(models)}
        options = {"starts": starts, "seed": seed, "solver": solver, "workers": workers, "on_start": on_start}
        return robust_design(problem, Variation(models=named), start=start, **options).design
    with one_thread():  # matrices of order 15 are slower on two threads than on one
        programme = Programme(problem, back_off=BACK_OFFS[0])  # refuses what cannot be designed, before any process
        first, beside = nominal(problem), any(goal.beside for goal in problem.goals)
        jobs = jobs_of(problem, starts, seed, solver, start)
        warm = [programme.start(gains) for gains in ([start] if start else []) + list(near)]
        if beside and not warm and problem.gains is not None and in_bounds(problem, problem.gains, "K_yaw"):
            warm = [programme.x(problem.gains)]
        outcomes, log = relaxed_starts(first, jobs, workers, on_start, rough=beside)
        valleys = distinct(outcomes, SAME_ROUGHLY)[:MOST_BROUGHT] if beside else distinct(outcomes)[:FINISHED]
        candidates = [o.x for o in valleys]
        with keeping(time_after(len(log) == len(jobs))):
            at_limits = _brought(problem, candidates, warm, workers, solver) if beside else None
            looked_at = candidates[:AT_ONCE] if beside else candidates
            found = finished(problem, programme, [*looked_at, *warm], tuple(log), seed, solver, at_limits)
            try:
                return replace(found, multipliers=multipliers(programme, found.gains, BACK_OFFS))
            except CUT_SHORT:  # the gains are worth more than what their limits cost
                return found


def _brought(problem: Problem, candidates, warm, workers: int, solver: str) -> list[Outcome]:
    """Candidates for the nominal loop taken to all requirements, on processes; what is warm goes straight there.

    The first two always; where nothing meets everything yet, the others after them.
    """
    rounds = [[(x, True) for x in warm] + [(x, False) for x in candidates[:AT_ONCE]]]
    rounds += [[(x, False) for x in candidates[at : at + AT_ONCE]] for at in range(AT_ONCE, len(candidates), AT_ONCE)]
    found: dict[tuple[int, int], Outcome] = {}
    try:
        for number, jobs in enumerate(rounds):
            if any(outcome.feasible for outcome in found.values()):
                break
            for k, outcome in ends(jobs, _bringing, (problem, solver), workers=workers, work="a design"):
                found[number, k] = outcome
    except CUT_SHORT:
        if not found:
            raise
    return [found[k] for k in sorted(found)]


def _bringing(shared: tuple[Problem, str]) -> Callable[[Job], Outcome]:
    """What brings one start after another."""
    problem, solver = shared
    brought = bringer(problem, BACK_OFFS[0], solver)

    def run(job: Job) -> Outcome:
        with one_thread():
            return brought(job)

    return run


def refine(problem: Problem, start: Gains, *, sampled: bool = True) -> Design:
    """A design from given gains alone, straight at the wanted limits: for warm starts and small changes.

    Never dearer than the start itself, where that meets the requirements. Raises InfeasibleError like `design`.
    """
    with one_thread():
        programme = Programme(problem, back_off=BACK_OFFS[0])
        return finished(problem, programme, [programme.start(start)], (), 0, "slsqp", sampled=sampled)


def finished(
    problem: Problem, programme: Programme, candidates, log: tuple[Start, ...], seed: int, solver: str,
    at_limits: Sequence[Outcome] | None = None, sampled: bool = True,
) -> Design:  # fmt: skip
    """Candidates brought to the wanted limits; the cheapest gains that meet everything, the candidates' own included.

    at_limits : outcomes that are there already; the candidates are then looked at as they are alone
    sampled : whether the sampled law is to keep the requirements too, where moving from the limits is enough for that

    Where nothing does: the points of least violation are looked at as well, and the nearest says what binds. Where an
    interrupt or the end of a budget comes first: the cheapest that is verified by then.
    """
    looked_at: list[_Judged] = []
    ended = list(at_limits or ())
    try:
        for x in candidates if at_limits is None else ():
            outcome, programme = finish(programme, x, solver=solver)
            ended.append(outcome)
        looked_at += [_as_they_are(problem, programme, x) for x in candidates]
        verified = [(_verified(problem, programme, outcome, solver), outcome) for outcome in ended]
        looked_at += [judged for judged, _ in verified]
        best = _cheapest(looked_at, programme.ride_cost)
        if best is not None and sampled:
            chased = [_kept(problem, programme, j, outcome, solver) for j, outcome in verified if j is best]
            best = chased[0] if chased else best
        if best is None:
            begun = [_stable(programme, x) for x in [*candidates, *(o.x for o in ended)]]
            nearest = [least_violation(programme, x).x for x in begun]
            looked_at += [_as_they_are(problem, programme, x) for x in nearest]
            best = _cheapest(looked_at, programme.ride_cost)
    except CUT_SHORT:
        looked_at += [_judged(problem, rounded(programme.gains(o.x)), o.binding) for o in ended]
        best = _cheapest(looked_at, programme.ride_cost)
        if best is None:
            raise
    if best is None:
        raise refusal(problem.name, [(judged.analysis, judged.requirements) for judged in looked_at])
    return Design(
        problem=problem, values=best.gains.as_dict(), verdicts=best.requirements, starts=log, binding=best.binding,
        seed=seed, solver=solver, analysis=best.analysis,
    )  # fmt: skip


def _stable(programme: Programme, x: np.ndarray) -> np.ndarray:
    """x where its loop is stable, else what a descent from there finds."""
    return stable_start(programme, x, np.random.default_rng(0), 0.0)


@dataclass(frozen=True, slots=True)
class _Judged:
    """Gains with their exact measures and verdicts, and which constraints were at their limits."""

    gains: Gains
    analysis: Analysis
    requirements: tuple[Verdict, ...]
    binding: tuple[str, ...] = ()

    @property
    def met(self) -> bool:
        """Whether the loop is stable and every requirement holds."""
        return self.analysis.stable and all(v.met for v in self.requirements)


def _judged(problem: Problem, gains: Gains, binding: tuple[str, ...] = ()) -> _Judged:
    analysis = analyse(problem.setting, gains, problem.name)
    return _Judged(gains, analysis, verdicts(problem, analysis), binding)


def _as_they_are(problem: Problem, programme: Programme, x: np.ndarray) -> _Judged:
    """The gains at x, rounded as printed; to the last digit where only these meet the requirements."""
    printed = _judged(problem, rounded(programme.gains(x)))
    exact = printed if printed.met else _judged(problem, programme.gains(x))
    return exact if exact.met else printed


def _verified(problem: Problem, programme: Programme, outcome: Outcome, solver: str) -> _Judged:
    """Rounded gains with exact verdicts all met, moving further from the limits where they are not; else the first."""
    first = _judged(problem, rounded(programme.gains(outcome.x)), outcome.binding)
    if not outcome.feasible or first.met:
        return first
    return next((j for j in _further(problem, programme, outcome, solver) if j.met), first)


def _kept(problem: Problem, programme: Programme, best: _Judged, outcome: Outcome, solver: str) -> _Judged:
    """Gains whose sampled law keeps the requirements as well, moving further from the limits; else the best."""
    if kept_sampled(problem, best.gains):
        return best
    further = (j for j in _further(problem, programme, outcome, solver) if j.met and kept_sampled(problem, j.gains))
    return next(further, best)


def _further(problem: Problem, programme: Programme, outcome: Outcome, solver: str) -> Iterator[_Judged]:
    """Rounded gains further and further from every limit."""
    for back_off in BACK_OFFS[1:]:
        options = LAST if any(r.beside for r in problem.requirements) else None
        stricter = programme.with_back_off(back_off)
        outcome, programme = finish(stricter, outcome.x, (1.0,), solver=solver, options=options)
        yield _judged(problem, rounded(programme.gains(outcome.x)), outcome.binding)


def _cheapest(looked_at: Sequence[_Judged], cost: RideCost) -> _Judged | None:
    """Of the gains that meet everything; None if none does."""
    met = [(value, j) for j in looked_at if j.met and (value := cost.of(j.analysis)) is not None]
    return min(met, key=lambda pair: pair[0], default=(0.0, None))[1]


def rounded(gains: Gains) -> Gains:
    """The same gains to the digits they are printed with."""
    return Gains(**{name: float(f"{value:.{DIGITS}g}") for name, value in gains.as_dict().items()})


__all__ = ["GAIN_NAMES", "Design", "Start", "design", "given", "rounded"]
