"""Every key that a data file may have, and what can be seen of a problem: the two sides of `test_every_key`."""

from collections.abc import Iterator
from functools import cached_property
from typing import Any, get_args

import numpy as np
from pydantic import BaseModel

from workbench.analysis.analysis import analyse
from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.design.problem import Problem
from workbench.design.robust import robust_design
from workbench.design.verdict import verdicts
from workbench.design.worst import Search
from workbench.errors import InputError
from workbench.files.problem import ProblemData, parse_problem
from workbench.files.schema import BoundsBlock, FixedBlock, ProblemFile, RequirementsBlock
from workbench.goals.ride.requirement import limit_keys, margin_kinds
from workbench.study.quantity import document_of, judged, value_at

LIMITS = tuple(limit_keys())
FREE_KEYS = {RequirementsBlock: LIMITS, BoundsBlock: GAIN_NAMES, FixedBlock: GAIN_NAMES}
LIMITED = {"variation.limits": LIMITS, "schedule.limits": tuple(limit_keys(margin_kinds()))}


def every_key(model: type[BaseModel] = ProblemFile, path: str = "") -> Iterator[str]:
    """Dotted path of every key; a table of several kinds as "force_law[corner]"."""
    for name, field in model.model_fields.items():
        here = f"{path}{name}"
        tables = _models(field.annotation)
        for table in tables:
            kind = f"[{_kind(table)}]" if len(tables) > 1 else ""
            yield from every_key(table, f"{here}{kind}.")
        if here in LIMITED:
            yield from (f"{here}.{key}" for key in LIMITED[here])
        elif not tables:
            yield here
    if model.model_config.get("extra") == "allow":
        yield from (f"{path}{key}" for key in FREE_KEYS[model])


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for part in get_args(annotation) for found in _models(part)]


def _kind(table: type[BaseModel]) -> str:
    return get_args(table.model_fields["kind"].annotation)[0]


class Seen:
    """What can be asked of a problem, by name; computed when asked."""

    def __init__(self, mapping: dict, approved: Gains) -> None:
        self.problem: Problem = ProblemData(parse_problem(mapping), "seen", "0" * 64, approved).build()
        self.gains = self.problem.approved

    def __getitem__(self, name: str) -> Any:
        head, _, rest = name.partition(":")
        return getattr(self, head)(rest) if rest else self._figure(name)

    def _figure(self, name: str) -> Any:
        if name in ("title", "sample_time"):
            return getattr(self.problem, name)
        if name == "plant":
            p = self.problem.setting.plant
            return np.concatenate([m.ravel() for m in (p.A, p.B, p.C, p.D)])
        if name == "clearance":
            return np.array(self.problem.setting.clearance)
        if name == "poles":
            return self.analysis.poles
        if name == "robust_cost":
            return robust_design(self.problem, start=self.gains).design.analysis.cost
        if name in judged():
            return value_at(document_of(self.problem, self.gains, (name,)), name)
        document = self.document
        try:
            return value_at(document, name)
        except InputError:  # a place or a group that this problem does not have
            return None

    @cached_property
    def analysis(self):
        return analyse(self.problem.setting, self.gains)

    @cached_property
    def document(self):
        return self.analysis.to_dict()

    def source(self, block: str) -> str:
        return self.problem.sources[block]

    def bound(self, name: str):
        return self.problem.bounds.get(name)

    def fixed(self, name: str):
        return self.problem.fixed.get(name)

    def point(self, name: str):
        return self.problem.setting.points.get(name)

    def met(self, key: str) -> tuple[bool, ...]:
        """Verdicts on the requirement of a key; none where it is not required."""
        name = limit_keys()[key]
        return tuple(v.met for v in verdicts(self.problem, self.analysis) if v.name == name)

    def worst(self, key: str) -> tuple[float | None, float] | None:
        """Value of the worst of the varied vehicles and its limit, by a limit's key; None where it is not asked."""
        name = limit_keys()[key]
        search = Search(self.problem, self.problem.variation)
        return next(
            ((w.verdict.value, w.verdict.limit) for w in search.worst(self.gains) if w.verdict.name == name), None
        )

    def soft(self, _: str) -> tuple[str, ...]:
        """Kinds of the goals that are made small."""
        return tuple(type(goal).__name__ for goal in self.problem.goals if not goal.hard)

    def effort(self, name: str):
        return getattr(self.problem.effort, name)

    def plan(self, name: str):
        return getattr(self.problem.plan, name)

    def varied(self, name: str):
        return getattr(self.problem.variation, name)
