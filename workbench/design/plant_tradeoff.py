"""What a limit costs, for a plant of one's own: the smallest soft goal over the limit of one goal.

limits --from the loosest, each from the values before--> designs --back from the tightest--> costs that only rise
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from workbench.design.design import design
from workbench.design.problem import Problem
from workbench.design.record import Design, given
from workbench.errors import InfeasibleError, InputError, unknown_name
from workbench.goals.goal import Goal
from workbench.goals.limit import checked_limit
from workbench.goals.verdict import Verdict, shortfall
from workbench.result import Result, Row


@dataclass(frozen=True, kw_only=True, repr=False)
class PlantTradeOff(Result):
    """The largest soft goal for each limit of one goal; None where the hard goals cannot be met together.

    goal, sense, unit : what was swept;  limits : (k,), from the loosest;  costs : 1 where a soft goal just meets its
    own limit;  reasons : why there is no design, in a sentence; empty where there is one
    """

    goal: str
    sense: str
    unit: str
    limits: tuple[float, ...]
    costs: tuple[float | None, ...]
    designs: tuple[Design | None, ...]
    reasons: tuple[str, ...]

    def rows(self) -> list[Row]:
        pairs = zip(self.limits, self.costs, strict=True)
        return [(f"{self.goal} at {limit:.4g} {self.unit}", cost, "") for limit, cost in pairs]


def goal_named(problem: Problem, name: str) -> Goal:
    """The goal of that name; refused with the nearest that there is."""
    known = {goal.name: goal for goal in problem.goals}
    if name not in known:
        raise unknown_name("goal", name, known)
    return known[name]


def with_goal_limit(problem: Problem, name: str, limit: float) -> Problem:
    """The problem with another limit of one goal, which is then hard."""
    swept = goal_named(problem, name)
    other = replace(swept.with_limit(limit), hard=True)
    return problem.with_goals([other if goal is swept else goal for goal in problem.goals])


def plant_trade_off(
    problem: Problem, name: str, limits: Sequence[float], *, start: Mapping[str, float] | None = None,
    starts: int | None = None, seed: int | None = None, workers: int = 1, seconds: float | None = None,
    on_limit: Callable[[float, float | None], None] | None = None,
) -> PlantTradeOff:  # fmt: skip
    """Sweeps the limit of one goal, the others as they are; see `design.asked.trade_off`."""
    asked = goal_named(problem, name).asked()
    order = sorted((checked_limit(name, limit) for limit in limits), reverse=asked.sense == "<=")
    if not order:
        raise InputError("a trade-off needs at least one limit; got none.")
    if len(set(order)) < len(order):
        raise InputError(f"the limits of a trade-off must differ; got {', '.join(f'{x:g}' for x in order)}.")
    problems = [with_goal_limit(problem, name, limit) for limit in order]
    found: list[Design | None] = []
    reasons: list[str] = []
    for limit, one in zip(order, problems, strict=True):
        try:
            found.append(design(one, starts=starts, seed=seed, workers=workers, start=start, seconds=seconds))
            start, reason = dict(found[-1].values), ""  # pyright: ignore[reportOptionalMemberAccess]
        except InfeasibleError as error:
            found.append(None)
            reason = " ".join(str(error).split())
        reasons.append(reason)
        if on_limit:
            on_limit(limit, cost_of(found[-1], name))
    for k in range(len(order) - 2, -1, -1):
        found[k] = _cheaper(problems[k], name, found[k], found[k + 1])
        reasons[k] = "" if found[k] else reasons[k]
    return PlantTradeOff(
        goal=name, sense=asked.sense, unit=asked.unit, limits=tuple(order),
        costs=tuple(cost_of(d, name) for d in found), designs=tuple(found), reasons=tuple(reasons),
    )  # fmt: skip


def _cheaper(problem: Problem, swept: str, own: Design | None, tighter: Design | None) -> Design | None:
    """The design of a tighter limit, which meets this one too, where it is cheaper than the one found here."""
    if tighter is None:
        return own
    mine, other = cost_of(own, swept), cost_of(tighter, swept)
    if own is not None and (mine is None or other is None or other >= mine):
        return own
    return given(
        problem, tighter.values, starts=tighter.starts, binding=tighter.binding, seed=tighter.seed,
        solver=tighter.solver,
    )  # fmt: skip


def cost_of(found: Design | None, swept: str = "") -> float | None:
    """The largest soft goal, 1 at its limit; None without a design or a soft goal."""
    if found is None:
        return None
    soft = {goal.name for goal in found.problem.goals if not goal.hard and goal.name != swept}
    return max((1 + _missed(verdict) for verdict in found.verdicts if verdict.name in soft), default=None)


def _missed(verdict: Verdict) -> float:
    """By which fraction of its limit a verdict's value misses it."""
    if verdict.value is None:
        return float("inf")
    value = verdict.value if verdict.upper is None else verdict.upper
    return shortfall(verdict.sense, verdict.limit, value) if verdict.limit else value
