"""Pareto fronts: the best ride for each limit on stroke, margin or current, and which designs no other one beats.

    sweeps --trade-off: each limit from starts of its own and from its neighbours--> designs --nondominated--> the front

What is swept is an objective beside the ride, and each design is held against the limit that it was made for.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
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
from workbench.study.quantity import Values, document_of, of_requirement, row_found
from workbench.study.store import Piece

Wanted = Mapping[str, tuple[tuple[str, ...], float]]  # name: quantities of which the largest counts, and its sign
# What a vehicle's front is drawn over, all to be small: name to the quantities of which the largest counts
OBJECTIVES = {
    "ride cost J": ("cost",),
    "stroke, rms gap change [m]": ("rms.gap.front", "rms.gap.rear"),
    **{goal.kind: of_requirement(goal.kind) for goal in (PeakSensitivity, MeanSquareCurrents)},
}


def plan(study: Study) -> list[tuple[str, float]]:
    """(requirement, limit) of every row: the sweeps in turn, each from its loosest limit."""
    return [(sweep.requirement, limit) for sweep in study.sweeps for limit in sweep.order]


def swept(study: Study, rows_of: Callable[[Sweep], list[Values]], done: Collection[int]) -> Iterator[Piece]:
    """The rows that are not done, sweep by sweep: every row of one depends on its neighbours on both sides.

    rows_of : the rows of a sweep, from its loosest limit;  done : numbers of the rows that are kept already
    """
    first = 0
    for sweep in study.sweeps:
        numbers = range(first, first + len(sweep.limits))
        first = numbers.stop
        if set(numbers) <= set(done):
            continue
        begun = perf_counter()
        found = rows_of(sweep)
        share = (perf_counter() - begun) / len(numbers)
        for k, row in zip(numbers, found, strict=True):
            if k not in done:
                yield Piece(k, [row], share)


def flown_rows(
    study: Study, problem: Problem, gains: dict[str, float] | None, quantities: Sequence[str], sweep: Sweep
) -> list[Values]:
    """The rows of one sweep of a vehicle's requirement."""
    found = trade_off(
        problem, sweep.requirement, sweep.limits, start=Gains.from_mapping(gains) if gains else None,
        starts=max(study.starts, 1), seed=study.seed,
    )  # fmt: skip
    return [
        row_found(None if own is None else document_of(problem, own, quantities), quantities, reason)
        for own, reason in zip(found.gains, found.reasons, strict=True)
    ]


def limits_by_row(
    study: Study, limits: Sequence[Limit], of: Callable[[str], tuple[str, ...]]
) -> dict[Limit, np.ndarray]:
    """Limit to the rows (rows,) held against it: rows of a sweep against their own limit, not the problem's.

    limits : the problem's, or those that the study names itself, which every row is held against
    of : the quantities that a requirement limits
    """
    rows = [(sweep, limit) for sweep in study.sweeps for limit in sweep.order]
    if study.limits:
        return {limit: np.ones(len(rows), bool) for limit in limits}
    names = [of(sweep.requirement) for sweep, _ in rows]
    out = {limit: np.array([limit.quantity not in own for own in names]) for limit in limits}
    for k, (sweep, value) in enumerate(rows):
        for quantity in names[k]:
            limit = Limit(quantity=quantity, sense=sweep.sense, value=value)
            out[limit] = out.get(limit, np.zeros(len(rows), bool)) | (np.arange(len(rows)) == k)
    return {limit: held for limit, held in out.items() if held.any()}


def wanted_of(requirements: Iterable[str]) -> Wanted:
    """What a vehicle's front is drawn over: `OBJECTIVES`, and what the sweeps limit."""
    wanted: dict[str, tuple[tuple[str, ...], float]] = {name: (parts, 1.0) for name, parts in OBJECTIVES.items()}
    for requirement in dict.fromkeys(requirements):
        if requirement not in wanted:
            large = requirement_class(requirement).sense == ">="
            name = f"minus {requirement}" if large else requirement
            wanted[name] = (of_requirement(requirement), -1.0 if large else 1.0)
    return wanted


def objectives(columns: Mapping[str, list[Any]], wanted: Wanted | None = None) -> tuple[list[str], np.ndarray]:
    """Names and values (rows, k) of what is to be small, as far as it is recorded; a vehicle's if not said.

    A quantity that is to be large counts with the other sign; NaN where a row has none.
    """
    names, values = [], []
    for name, (parts, sign) in (wanted or wanted_of(columns["requirement"])).items():
        own = [np.array([np.nan if v is None else v for v in columns[p]], float) for p in parts if p in columns]
        if own:
            names.append(name)
            values.append(np.max([sign * v for v in own], axis=0))
    return names, np.array(values).T.reshape(-1, len(names))


def nondominated(points: np.ndarray) -> np.ndarray:
    """(n,) whether no other point is at least as small in every column and smaller in one; false for rows with NaN.

    points : (n, k)
    """
    valid = np.asarray(~np.isnan(points).any(axis=1))  # a margin that nothing limits is infinite
    out = valid.copy()
    for k in np.flatnonzero(valid):
        others = points[valid]
        out[k] = not np.any((others <= points[k]).all(axis=1) & (others < points[k]).any(axis=1))
    return out
