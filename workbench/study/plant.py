"""A study of a plant of one's own: parameters of its structure and numbers of its data, verdicts as quantities.

    Study, Source --PlantTask--> rows: problem with the row's data, values with the row's parameters --> analysis
    "Kp" a parameter of the structure;  "model.0.A.0.0" a number of the data;  "factor.model.0.A.0.0" times its value

Quantities are dotted paths in the JSON of `workbench analyse`, and "goals.<name>" the value of a verdict, a dot of the
name written as "_".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workbench.design.design import design
from workbench.design.plant_analysis import plant_analysis
from workbench.design.plant_tradeoff import goal_named, plant_trade_off, with_goal_limit
from workbench.design.problem import Problem
from workbench.design.record import given
from workbench.machine.threads import one_thread
from workbench.study.definition import Limit, Study, Sweep
from workbench.study.pareto import Wanted
from workbench.study.quantity import Values, row_found, row_of, value_at
from workbench.study.source import FACTOR, Source

OF_STABLE = ("peak_sensitivity", "margins")  # what only stable loops have: no value elsewhere
ALWAYS = ("stable", "damping", "decay", "peak_sensitivity")


@dataclass
class PlantTask:
    """What a study of a plant computes and from what; rows are computed one by one.

    values : of the structure's parameters at the middle of the study
    """

    study: Study
    source: Source
    quantities: tuple[str, ...]
    values: dict[str, float]
    samples: np.ndarray
    batched: bool = False
    block: int = 1

    def rows(self, first: int, last: int) -> list[list[Any]]:
        """Rows first … last − 1: quantities in order, then why there are none."""
        with one_thread():
            return [row_of(lambda row=row: self._document(row), self.quantities) for row in range(first, last)]

    def _document(self, row: int) -> dict[str, Any]:
        own, changes = {}, {}
        for p, value in zip(self.study.parameters, map(float, self.samples[row]), strict=True):
            (own if p.name in self.values else changes)[p.name] = value
        problem = self.source.problem(changes)
        if self.study.task == "analyse":
            return document_of(problem, {**self.values, **own}, self.quantities)
        found = design(problem.with_fixed(own), starts=max(self.study.starts, 1), seed=self.study.seed)
        return document_of(problem, dict(found.values), self.quantities)


@dataclass(frozen=True)
class PlantStudy:
    """What a study of a plant asks of its problem."""

    study: Study
    source: Source
    problem: Problem

    def check(self) -> None:
        """Refuses tasks and parameters that a plant does not have."""
        for sweep in self.study.sweeps:
            for limit in sweep.limits:
                with_goal_limit(self.problem, sweep.requirement, limit)
        for p in self.study.parameters:
            if p.name not in self.values():
                self.source.check(p.name.removeprefix(FACTOR), tuple(self.values()))
        for name in self.study.gains or {}:
            self.problem.structure.parameter(name)

    def with_senses(self) -> "PlantStudy":
        """The same, its sweeps in the sense of the goals that they sweep."""
        sweeps = tuple(
            replace(sweep, sense=goal_named(self.problem, sweep.requirement).asked().sense)
            for sweep in self.study.sweeps
        )
        return replace(self, study=replace(self.study, sweeps=sweeps))

    def limited(self, name: str) -> tuple[str, ...]:
        """The quantity of a goal."""
        return (_path(name),)

    def wanted(self) -> Wanted:
        """What a front is drawn over: the soft goals, and what the sweeps limit."""
        swept = [sweep.requirement for sweep in self.study.sweeps]
        soft = [goal for goal in self.problem.goals if not goal.hard]
        shown = [*soft, *(goal_named(self.problem, name) for name in swept)]
        large = {goal.name: goal.asked().sense == ">=" for goal in shown}
        return {
            f"minus {name}" if up else name: (self.limited(name), -1.0 if up else 1.0) for name, up in large.items()
        }

    def rows_of(self, quantities: Sequence[str], sweep: Sweep) -> list[Values]:
        """The rows of one sweep of a goal's limit."""
        found = plant_trade_off(
            self.problem, sweep.requirement, sweep.limits, start=self.study.gains, starts=max(self.study.starts, 1),
            seed=self.study.seed,
        )  # fmt: skip
        return [
            row_found(
                None if one is None else document_of(self.problem, dict(one.values), quantities), quantities, reason
            )
            for one, reason in zip(found.designs, found.reasons, strict=True)
        ]

    def values(self) -> dict[str, float]:
        """Of every parameter: the study's, the approved, the structure's own."""
        approved = self.problem.approved if isinstance(self.problem.approved, dict) else {}
        return {**self.problem.structure.values(), **approved, **(self.study.gains or {})}

    def quantities(self) -> tuple[str, ...]:
        """Those asked for, or the usual ones; and what the hard goals limit where the study has no limits."""
        goals = tuple(self._goals())
        asked = self.study.quantities or (*ALWAYS, *goals)
        if self.study.task == "pareto":  # what the front is drawn over is recorded whatever else is
            asked = tuple(dict.fromkeys([*asked, *(q for parts, _ in self.wanted().values() for q in parts)]))
        if self.study.task != "analyse" and not self.study.quantities:
            asked = (*asked, *(f"values.{name}" for name in self.values()))
        return asked if self.study.limits else (*asked, *(limit.quantity for limit in self.limits()
                                                          if limit.quantity not in asked))  # fmt: skip

    def limits(self) -> tuple[Limit, ...]:
        """The hard goals."""
        return tuple(
            Limit(quantity=quantity, sense=v.sense, value=v.limit)
            for quantity, (hard, v) in self._goals().items() if hard
        )  # fmt: skip

    def check_quantities(self, quantities: Sequence[str]) -> None:
        """Refuses quantities that no row could have."""
        document = document_of(self.problem, self.values(), quantities)
        for name in quantities:
            value_at(document, name)

    def task(self, quantities: Sequence[str], samples: np.ndarray) -> PlantTask:
        """The work."""
        return PlantTask(self.study, self.source, tuple(quantities), self.values(), samples)

    def _goals(self):
        """Quantity to whether its goal is hard, and its verdict at the middle of the study."""
        hard = {goal.name: goal.hard for goal in self.problem.goals}
        judged = given(self.problem, self.values()).verdicts
        return {_path(v.name): (hard.get(v.name, True), v) for v in judged}


def document_of(problem: Problem, values: dict[str, float], quantities: Sequence[str]) -> dict[str, Any]:
    """The JSON of an analysis with "goals" beside it; margins only where a quantity needs them."""
    needed = any(q.partition(".")[0] in OF_STABLE for q in quantities)
    found = plant_analysis(problem, values, margins=needed)
    document = found.to_dict()
    document["goals"] = {_path(v.name).removeprefix("goals."): v.value for v in found.design.verdicts}
    return {**(dict.fromkeys(OF_STABLE) if needed else {}), **document}


def _path(name: str) -> str:
    return f"goals.{name.replace('.', '_')}"
