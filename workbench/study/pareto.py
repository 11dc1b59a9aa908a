"""Pareto fronts: the best ride for each limit on stroke, margin or current, and which designs no other one beats.

    sweeps --from the loosest limit, each design from the one before--> designs --nondominated--> the front

Rows of a sweep depend on the rows before them, so they are computed one after the other, and go on from the last gains.
"""

from collections.abc import Iterator, Sequence
from time import perf_counter
from typing import Any

import numpy as np

from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.design.problem import Problem
from workbench.design.requirement import QUANTITIES
from workbench.design.tradeoff import trade_off
from workbench.errors import BudgetEnded, InfeasibleError, unknown_name
from workbench.study.definition import Study
from workbench.study.quantity import document_of, value_at
from workbench.study.store import Piece

# What a front is drawn over, all to be small: name to the quantities of which the largest counts
OBJECTIVES = {
    "ride cost J": ("cost",),
    "stroke, rms gap change [m]": ("rms.gap.front", "rms.gap.rear"),
    "peak sensitivity": ("peak_sensitivity.heave_pitch", "peak_sensitivity.sway_roll_yaw"),
    "sum of mean square currents": ("sum_alpha_squared",),
}


def plan(study: Study) -> list[tuple[str, float]]:
    """(requirement, limit) of every row: the sweeps in turn, each from its loosest limit."""
    out = []
    for sweep in study.sweeps:
        if sweep.requirement not in QUANTITIES:
            raise unknown_name("requirement", sweep.requirement, QUANTITIES)
        loosest_first = sorted(sweep.limits, reverse=QUANTITIES[sweep.requirement][0] == "<=")
        out += [(sweep.requirement, limit) for limit in loosest_first]
    return out


def swept(
    study: Study, problem: Problem, gains: dict[str, float] | None, quantities: Sequence[str], done: Sequence[list[Any]]
) -> Iterator[Piece]:
    """The rows that follow those done, one at a time."""
    rows = plan(study)
    at = [quantities.index(f"gains.{name}") for name in GAIN_NAMES]
    start = Gains.from_mapping(gains) if gains else None
    current = start
    known = [*done]
    for k, (requirement, limit) in enumerate(rows):
        if k == 0 or requirement != rows[k - 1][0]:
            current = start
        if k == len(known):
            begun = perf_counter()
            known.append(_designed(study, problem, requirement, limit, current, quantities))
            yield Piece(k, [known[k]], perf_counter() - begun)
        if not known[k][-1]:
            current = Gains(**{name: float(known[k][i]) for name, i in zip(GAIN_NAMES, at, strict=True)})


def _designed(study: Study, problem: Problem, requirement: str, limit: float, start, quantities) -> list[Any]:
    try:
        found = trade_off(
            problem, requirement, [limit], start=start, starts=max(study.starts, 1), seed=study.seed
        ).gains[0]  # fmt: skip
    except BudgetEnded:  # of the whole study, not of this row
        raise
    except InfeasibleError as error:
        return [*(None for _ in quantities), " ".join(str(error).split())]
    if found is None:
        return [*(None for _ in quantities), "no design found from the one before"]
    document = document_of(problem, found, quantities)
    return [*(value_at(document, q) for q in quantities), ""]


def objectives(columns: dict[str, list[Any]]) -> tuple[list[str], np.ndarray]:
    """Names and values (rows, k) of the objectives that are recorded; NaN where a row has none."""
    names, values = [], []
    for name, parts in OBJECTIVES.items():
        own = [np.array([np.nan if v is None else v for v in columns[p]], float) for p in parts if p in columns]
        if own:
            names.append(name)
            values.append(np.max(own, axis=0))
    return names, np.array(values).T.reshape(-1, len(names))


def nondominated(points: np.ndarray) -> np.ndarray:
    """(n,) whether no other point is at least as small in every column and smaller in one; false for rows with NaN.

    points : (n, k)
    """
    valid = np.isfinite(points).all(axis=1)
    out = valid.copy()
    for k in np.flatnonzero(valid):
        others = points[valid]
        out[k] = not np.any((others <= points[k]).all(axis=1) & (others < points[k]).any(axis=1))
    return out
