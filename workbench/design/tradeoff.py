"""Trade-off curves: the best cost against one limit, every limit from starts of its own and from its neighbours.

limits --each from random starts, the given gains, the looser neighbour--> designs, each verified
       --back from the tightest, each from the tighter neighbour, whose gains meet it too--> costs that only rise
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from workbench.control import Gains
from workbench.design.design import Design, design, finished, refine
from workbench.design.effort import check_starts
from workbench.design.problem import Problem
from workbench.design.solve import HOMOTOPY, finish, relaxed
from workbench.design.starts import BACK_OFFS, STARTS, Job, bare, begin, jobs_of
from workbench.design.steering import Programme
from workbench.errors import InfeasibleError, InputError
from workbench.goals.ride.requirement import requirement, requirement_class
from workbench.machine.threads import one_thread
from workbench.result import Result, Row
from workbench.solve.multistart import ends
from workbench.solve.smooth import Outcome

VERIFIED = 2  # cheapest outcomes of the valleys that are judged at a limit


@dataclass(frozen=True, kw_only=True, repr=False)
class TradeOff(Result):
    """The best cost for each allowed value of one quantity; None where no design was found.

    quantity, unit : what was swept;  limits : (k,), from the loosest;  costs, gains : per limit
    reasons : why there is none, in a sentence; empty where there is one
    """

    quantity: str
    unit: str
    limits: tuple[float, ...]
    costs: tuple[float | None, ...]
    gains: tuple[Gains | None, ...]
    reasons: tuple[str, ...] = ()

    def rows(self) -> list[Row]:
        return [
            (f"{self.quantity} at {limit:.4g} {self.unit}", cost, "J")
            for limit, cost in zip(self.limits, self.costs, strict=True)
        ]


def trade_off(
    problem: Problem,
    quantity: str,
    limits: Sequence[float],
    *,
    start: Gains | None = None,
    starts: int = STARTS,
    seed: int = 0,
    workers: int = 1,
    on_limit: Callable[[float, float | None], None] | None = None,
) -> TradeOff:
    """Sweeps the limit of one requirement, the others as they are; a looser limit never costs more.

    limits : SI units, in any order
    start : gains whose valley is followed too, beside those of `starts` random ones; the best are never dearer
    workers : processes for the valleys, as of `design`
    on_limit : called with each limit and the cost found there on the way to the tightest
    """
    swept = requirement_class(quantity)
    if not limits:
        raise InputError("a trade-off needs at least one limit; got none.")
    if len(set(limits)) < len(limits):
        raise InputError(f"the limits of a trade-off must differ; got {', '.join(f'{x:g}' for x in limits)}.")
    order = sorted(limits, reverse=swept.sense == "<=")
    check_starts(starts)
    with one_thread():
        problems = [with_limit(problem, quantity, limit) for limit in order]
        programme = Programme(problems[0], back_off=BACK_OFFS[0])
        near = [] if start is None else [programme.start(start)]
        jobs = jobs_of(problems[0], starts, seed, "slsqp", None)
        jobs += [] if start is None else [(start, 0.0, np.random.SeedSequence(seed), "slsqp")]
        shared = [bare(one) for one in problems]
        valleys = dict(ends(jobs, _followed, shared, workers=workers, work="the valleys of a trade-off"))
        found: list[Design | None] = []
        leads: list[int | None] = []  # number of the valley that each design came from
        reasons = dict.fromkeys(order, "")
        for k, one in enumerate(problems):
            there = {n: valleys[n][k] for n in sorted(valleys) if len(valleys[n]) > k}
            best = sorted(there, key=lambda n: there[n].objective)[:VERIFIED]
            known = [*near, *(programme.x(d.gains) for d in found[-1:] if d is not None)]
            held = programme.with_requirements(one.requirements)
            try:
                found.append(_at(one, held, known, [there[n] for n in best], starts, seed, workers))
            except InfeasibleError as error:
                found.append(None)
                reasons[order[k]] = " ".join(str(error).split())
            leads.append(best[0] if best else None)
            if on_limit:
                on_limit(order[k], _cost(found[k]))
        for k in range(len(order) - 2, -1, -1):
            own, tighter = found[k], found[k + 1]
            cheaper = own is None or (tighter is not None and (_cost(tighter) or 0.0) < (_cost(own) or 0.0))
            if cheaper or leads[k] != leads[k + 1]:
                found[k] = better(problems[k], own, tighter)
    return TradeOff(
        quantity=quantity, unit=swept.unit, limits=tuple(order), costs=tuple(map(_cost, found)),
        gains=tuple(d and d.gains for d in found),
        reasons=tuple("" if d else reasons[limit] for d, limit in zip(found, order, strict=True)),
    )  # fmt: skip


def _followed(problems: list[Problem]) -> Callable[[Job], list[Outcome]]:
    """What follows one valley through problems whose limit gets tighter: feasible outcomes, until there is none."""
    first = Programme(problems[0], back_off=BACK_OFFS[0])

    def run(job: Job) -> list[Outcome]:
        held, x, found = first, begin(first, job), []
        if job[1] > 0:  # random: in which valley it lies shows where the limits are wide
            x = relaxed(first, x).x
        for one in problems:
            factors = HOMOTOPY if one is problems[0] else (1.0,)
            outcome, held = finish(held.with_requirements(one.requirements), x, factors)
            if not outcome.feasible:
                break
            x = outcome.x
            found.append(outcome)
        return found

    return run


def _at(problem: Problem, programme: Programme, known, outcomes: list[Outcome], starts, seed, workers) -> Design:
    """The best design at one limit: of the valleys' outcomes and of what is known; from fresh starts if none is met."""
    if outcomes:
        with suppress(InfeasibleError):
            return finished(problem, programme, known, (), seed, "slsqp", at_limits=outcomes, sampled=False)
    return design(problem, starts=starts, seed=seed, workers=workers, near=[programme.gains(x) for x in known])


def with_limit(problem: Problem, quantity: str, limit: float) -> Problem:
    """The problem with one limit on a quantity in place of its own."""
    others = [r for r in problem.requirements if r.name != quantity]
    return problem.with_requirements([*others, requirement(quantity, limit)])


def better(problem: Problem, own: Design | None, tighter: Design | None) -> Design | None:
    """The cheaper of a design and what the gains of a tighter limit, which meet this one too, lead to."""
    if tighter is None:
        return own
    other = refine(problem, tighter.gains, sampled=False)
    return other if own is None or (_cost(other) or 0.0) < (_cost(own) or 0.0) else own


def _cost(found: Design | None) -> float | None:
    return None if found is None else found.flown.cost
