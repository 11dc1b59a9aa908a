"""Pareto fronts: the best ride for each limit on stroke, margin or current, and which designs no other one beats.

    sweeps --trade-off: each limit from starts of its own and from its neighbours--> designs --nondominated--> the front

What is swept is an objective beside the ride, and each design is held against the limit that it was made for.
"""

from collections.abc import Collection, Iterator, Sequence
from time import perf_counter
from typing import Any

import numpy as np

from workbench.control import Gains
from workbench.design.problem import Problem
from workbench.design.tradeoff import trade_off
from workbench.goals.ride.currents import MeanSquareCurrents
from workbench.goals.ride.peak_sensitivity import PeakSensitivity
from workbench.goals.ride.requirement import requirement_class
from workbench.study.definition import Limit, Study, Sweep
from workbench.study.quantity import document_of, limited, of_requirement, value_at
from workbench.study.store import Piece

# What a front is drawn over, all to be small: name to the quantities of which the largest counts
OBJECTIVES = {
    "ride cost J": ("cost",),
    "stroke, rms gap change [m]": ("rms.gap.front", "rms.gap.rear"),
    **{goal.kind: of_requirement(goal.kind) for goal in (PeakSensitivity, MeanSquareCurrents)},
}


def plan(study: Study) -> list[tuple[str, float]]:
    """(requirement, limit) of every row: the sweeps in turn, each from its loosest limit."""
    return [(sweep.requirement, limit) for sweep in study.sweeps for limit in _loosest_first(sweep)]


def _loosest_first(sweep: Sweep) -> list[float]:
    return sorted(sweep.limits, reverse=requirement_class(sweep.requirement).sense == "<=")


def swept(
    study: Study, problem: Problem, gains: dict[str, float] | None, quantities: Sequence[str], done: Collection[int]
) -> Iterator[Piece]:
    """The rows that are not done, sweep by sweep: every row of one depends on its neighbours on both sides.

    done : numbers of the rows that are kept already
    """
    start, first = Gains.from_mapping(gains) if gains else None, 0
    for sweep in study.sweeps:
        numbers = range(first, first + len(sweep.limits))
        first = numbers.stop
        if set(numbers) <= set(done):
            continue
        begun = perf_counter()
        found = trade_off(
            problem, sweep.requirement, sweep.limits, start=start, starts=max(study.starts, 1), seed=study.seed
        )  # fmt: skip
        share = (perf_counter() - begun) / len(numbers)
        for k, own, reason in zip(numbers, found.gains, found.reasons, strict=True):
            if k not in done:
                yield Piece(k, [_row(problem, own, reason, quantities)], share)


def _row(problem: Problem, gains: Gains | None, reason: str, quantities: Sequence[str]) -> list[Any]:
    if gains is None:
        return [*(None for _ in quantities), reason]
    document = document_of(problem, gains, quantities)
    return [*(value_at(document, q) for q in quantities), ""]


def limits_by_row(study: Study, problem: Problem, limits: Sequence[Limit]) -> dict[Limit, np.ndarray]:
    """Limit to the rows (rows,) held against it: rows of a sweep against their own limit, not the problem's.

    limits : the problem's, or those that the study names itself, which every row is held against
    """
    rows = plan(study)
    if study.limits:
        return {limit: np.ones(len(rows), bool) for limit in limits}
    names = [limited(problem, requirement) for requirement, _ in rows]
    out = {limit: np.array([limit.quantity not in own for own in names]) for limit in limits}
    for k, (requirement, value) in enumerate(rows):
        for quantity in names[k]:
            limit = Limit(quantity=quantity, sense=requirement_class(requirement).sense, value=value)
            out[limit] = out.get(limit, np.zeros(len(rows), bool)) | (np.arange(len(rows)) == k)
    return {limit: held for limit, held in out.items() if held.any()}


def objectives(columns: dict[str, list[Any]]) -> tuple[list[str], np.ndarray]:
    """Names and values (rows, k) of what is to be small: `OBJECTIVES` that are recorded, and what the sweeps limit.

    A quantity that is to be large counts with the other sign; NaN where a row has none.
    """
    wanted = {name: (parts, 1.0) for name, parts in OBJECTIVES.items()}
    for requirement in dict.fromkeys(columns["requirement"]):
        if requirement not in wanted:
            large = requirement_class(requirement).sense == ">="
            wanted[f"minus {requirement}" if large else requirement] = (
                of_requirement(requirement),
                -1.0 if large else 1.0,
            )
    names, values = [], []
    for name, (parts, sign) in wanted.items():
        own = [np.array([np.nan if v is None else v for v in columns[p]], float) for p in parts if p in columns]
        if own:
            names.append(name)
            values.append(np.max([sign * v for v in own], axis=0))
    return names, np.array(values).T.reshape(-1, len(names))


def nondominated(points: np.ndarray) -> np.ndarray:
    """(n,) whether no other point is at least as small in every column and smaller in one; false for rows with NaN.

    points : (n, k)
    """
    valid = ~np.isnan(points).any(axis=1)  # a margin that nothing limits is infinite
    out = valid.copy()
    for k in np.flatnonzero(valid):
        others = points[valid]
        out[k] = not np.any((others <= points[k]).all(axis=1) & (others < points[k]).any(axis=1))
    return out
