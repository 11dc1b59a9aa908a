"""Trade-off curves: the best cost against one limit, swept with warm starts.

limits from the loosest to the tightest --each start from the last solution--> designs, each verified
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from workbench.analysis.analysis import analyse
from workbench.control import Gains
from workbench.design.design import STARTS, design, refine
from workbench.design.problem import Problem
from workbench.design.requirement import QUANTITIES, Requirement
from workbench.design.verdict import verdicts
from workbench.errors import InfeasibleError, InputError, unknown_name
from workbench.result import Result, Row


@dataclass(frozen=True, kw_only=True, repr=False)
class TradeOff(Result):
    """The best cost for each allowed value of one quantity; None where no design was found.

    quantity, unit : what was swept;  limits : (k,);  costs, gains : per limit
    """

    quantity: str
    unit: str
    limits: tuple[float, ...]
    costs: tuple[float | None, ...]
    gains: tuple[Gains | None, ...]

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
    on_limit: Callable[[float, float | None], None] | None = None,
) -> TradeOff:
    """Sweeps the limit of one requirement, the others as they are.

    limits : SI units, in any order; solved from the loosest to the tightest, each from the one before
    start : gains of the first solution's start; without them the first limit is designed from `starts` random ones
    """
    if quantity not in QUANTITIES:
        raise unknown_name("requirement", quantity, QUANTITIES)
    if not limits:
        raise InputError("a trade-off needs at least one limit; got none.")
    sense, unit = QUANTITIES[quantity][:2]
    order = sorted(limits, reverse=sense == "<=")
    others = [r for r in problem.requirements if r.name != quantity]
    found: dict[float, tuple[float | None, Gains | None]] = {}
    for limit in order:
        one = replace(problem, requirements=(*others, Requirement(quantity, limit)))
        try:
            best = refine(one, start) if start is not None else design(one, starts=starts, seed=seed)
        except InfeasibleError:
            found[limit] = _as_they_are(one, start)
        else:
            start = best.gains
            found[limit] = (best.analysis.cost, best.gains)
        if on_limit:
            on_limit(limit, found[limit][0])
    return TradeOff(
        quantity=quantity, unit=unit, limits=tuple(order),
        costs=tuple(found[x][0] for x in order), gains=tuple(found[x][1] for x in order),
    )  # fmt: skip


def _as_they_are(problem: Problem, gains: Gains | None) -> tuple[float | None, Gains | None]:
    """The starting gains themselves where they meet the requirements; nothing otherwise."""
    if gains is None:
        return None, None
    analysis = analyse(problem.setting, gains, problem.name)
    met = analysis.stable and all(v.met for v in verdicts(problem, analysis))
    return (analysis.cost, gains) if met else (None, None)
