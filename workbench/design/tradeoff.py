"""Trade-off curves: the best cost against one limit, every limit from starts of its own and from its neighbours.

limits --each from random starts, the given gains, the looser neighbour--> designs, each verified
       --back from the tightest, each from the tighter neighbour, whose gains meet it too--> costs that only rise
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from workbench.control import Gains
from workbench.design.design import STARTS, Design, design, refine
from workbench.design.problem import Problem
from workbench.design.requirement import QUANTITIES, Requirement
from workbench.errors import BudgetEnded, InfeasibleError, InputError, unknown_name
from workbench.result import Result, Row


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
    start : gains that every limit is also solved from, beside `starts` random ones and its neighbours' gains
    workers : processes for the random starts, as of `design`
    on_limit : called with each limit and the cost found there on the way to the tightest
    """
    if quantity not in QUANTITIES:
        raise unknown_name("requirement", quantity, QUANTITIES)
    if not limits:
        raise InputError("a trade-off needs at least one limit; got none.")
    if len(set(limits)) < len(limits):
        raise InputError(f"the limits of a trade-off must differ; got {', '.join(f'{x:g}' for x in limits)}.")
    sense, unit = QUANTITIES[quantity][:2]
    order = sorted(limits, reverse=sense == "<=")
    found: list[Design | None] = []
    reasons = dict.fromkeys(order, "")
    near = [] if start is None else [start]
    for limit in order:
        one = with_limit(problem, quantity, limit)
        known = [d.gains for d in found[-1:] if d is not None]
        try:
            found.append(design(one, starts=starts, seed=seed, workers=workers, near=[*near, *known]))
        except BudgetEnded:
            raise
        except InfeasibleError as error:
            found.append(None)
            reasons[limit] = " ".join(str(error).split())
        if on_limit:
            on_limit(limit, _cost(found[-1]))
    for k in range(len(order) - 2, -1, -1):
        found[k] = better(with_limit(problem, quantity, order[k]), found[k], found[k + 1])
    return TradeOff(
        quantity=quantity, unit=unit, limits=tuple(order), costs=tuple(map(_cost, found)),
        gains=tuple(d and d.gains for d in found),
        reasons=tuple("" if d else reasons[limit] for d, limit in zip(found, order, strict=True)),
    )  # fmt: skip


def with_limit(problem: Problem, quantity: str, limit: float) -> Problem:
    """The problem with one limit on a quantity in place of its own."""
    others = [r for r in problem.requirements if r.name != quantity]
    return problem.with_requirements([*others, Requirement(quantity, limit)])


def better(problem: Problem, own: Design | None, tighter: Design | None) -> Design | None:
    """The cheaper of a design and what the gains of a tighter limit, which meet this one too, lead to."""
    if tighter is None:
        return own
    other = refine(problem, tighter.gains)
    return other if own is None or (_cost(other) or 0.0) < (_cost(own) or 0.0) else own


def _cost(found: Design | None) -> float | None:
    return None if found is None else found.analysis.cost
