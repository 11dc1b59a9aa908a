"""What a tuning hands back: parameters, every goal wanted and reached, and where it binds."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.structure import Structure
from workbench.errors import unknown_name
from workbench.result import Result, Row, plain
from workbench.solve.nonsmooth import Minimum


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class TunedGoal(Result):
    """One goal on the model where it is largest; up to 1 it is met.

    `smooth` steered the optimiser, `value` is the exact measure by `method`; where that is a bracket, its upper end
    counts.
    """

    name: str
    hard: bool
    model: str
    value: float
    upper: float  # certified upper bound where the method gives one, otherwise `value`
    smooth: float
    frequency: float | None  # [rad/s]
    time: float | None  # [s]
    channel: str
    method: str
    reason: str

    @property
    def met(self) -> bool:
        """Whether the exact value is at most 1, all of its bracket if it is one."""
        return self.upper <= 1

    def where(self) -> str:
        """Model, frequency or time, and channel in words."""
        words = [f"model {self.model}"]
        words += [f"{self.frequency:.4g} rad/s"] if self.frequency is not None else []
        words += [f"{self.time:.4g} s"] if self.time is not None else []
        return ", ".join(words + ([self.channel] if self.channel else []))

    def rows(self) -> list[Row]:
        """Value against 1, and where."""
        return [
            ("goal", self.name, ""), ("exact value", self.value, ""), ("smooth value", self.smooth, ""),
            ("hard", self.hard, ""), ("met", self.met, ""), ("where", self.where(), ""),
        ]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class StartReport(Result):
    """How one start ended, by the smooth measures."""

    number: int
    soft: float  # largest soft goal, −inf if there is none
    hard: float
    abscissa: float  # [1/s]
    seconds: float
    message: str

    def rows(self) -> list[Row]:
        """Values and words."""
        return [
            ("start", self.number, ""), ("soft", self.soft, ""), ("hard", self.hard, ""), ("time", self.seconds, "s"),
            ("stopped", self.message, ""),
        ]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Tuning(Result):
    """A tuned structure with the evidence."""

    values: Mapping[str, float]  # every parameter by name
    theta: np.ndarray  # (n,) the free ones
    structure: Structure  # with the tuned values as its start
    goals: tuple[TunedGoal, ...]
    abscissa: float  # [1/s] largest real part over all models
    minimum: Minimum | None  # the solver's last certificate
    starts: tuple[StartReport, ...]
    seconds: float
    exact_seconds: float

    @property
    def controller(self) -> Controller:
        """The tuned controller."""
        return self.structure.controller()

    @property
    def soft(self) -> float | None:
        """Largest exact soft value, None without soft goals."""
        return max((goal.value for goal in self.goals if not goal.hard), default=None)

    @property
    def hard(self) -> float | None:
        """Largest exact hard value, None without hard goals."""
        return max((goal.value for goal in self.goals if goal.hard), default=None)

    @property
    def met(self) -> bool:
        """Whether every goal, soft ones too, is met."""
        return all(goal.met for goal in self.goals)

    def goal(self, name: str) -> TunedGoal:
        """The goal of a name."""
        for goal in self.goals:
            if goal.name == name:
                return goal
        raise unknown_name("goal", name, (goal.name for goal in self.goals))

    def to_dict(self) -> dict[str, Any]:
        """Every field but the structure, in JSON's types; `met` and `where` of each goal beside its fields."""
        shown = {f.name: plain(getattr(self, f.name)) for f in fields(self) if f.name != "structure"}
        shown["goals"] = [{**plain(goal), "met": goal.met, "where": goal.where()} for goal in self.goals]
        return shown

    def rows(self) -> list[Row]:
        """Goals, then parameters."""
        rows: list[Row] = [
            (f"{'hard' if g.hard else 'soft'} goal {g.name} ({g.where()})", g.value, "met" if g.met else "not met")
            for g in self.goals
        ]
        rows += [("largest real part", self.abscissa, "1/s"), ("time", self.seconds, "s")]
        return rows + [(name, value, "") for name, value in self.values.items()]

    def goal_frame(self):
        """The goals as a pandas.DataFrame, one row each."""
        import pandas as pd

        columns = ("name", "hard", "met", "value", "upper", "smooth", "model", "frequency", "time", "channel", "method")
        return pd.DataFrame([{field: getattr(goal, field) for field in columns} for goal in self.goals])
