"""What a design keeps when the vehicle is not the nominal one: mass, force per current, sensor scale, a lost command.

problem, gains --each case--> closed loop --> stable, smallest damping ratio, peak sensitivity of each group
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from workbench.analysis.change import Change
from workbench.analysis.mode import REAL
from workbench.analysis.variations import Closed, closed
from workbench.control import Gains
from workbench.control.loop import GROUPS
from workbench.design.problem import Problem
from workbench.result import Result, Row

TOLERANCE = 1e-9  # relative width of the brackets of peaks
CASES: dict[str, tuple[Change, ...]] = {
    "nominal": (),
    "mass −15 %": (Change("mass", amount=0.85),),
    "mass +15 %": (Change("mass", amount=1.15),),
    "current force −10 %": (Change("force", amount=0.90),),
    "current force +10 %": (Change("force", amount=1.10),),
    "vertical sensors −10 %": (Change("scale", "vertical", 0.90),),
    "vertical sensors +10 %": (Change("scale", "vertical", 1.10),),
    "lateral sensors −10 %": (Change("scale", "lateral", 0.90),),
    "lateral sensors +10 %": (Change("scale", "lateral", 1.10),),
}


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Case(Result):
    """One case: stable or not, smallest damping ratio, decay rate [1/s], peak sensitivities (None if unstable)."""

    name: str
    stable: bool
    damping: float
    decay: float
    peak_sensitivity: Mapping[str, float | None]

    def rows(self) -> list[Row]:
        return [
            ("case", self.name, ""),
            ("stable", self.stable, ""),
            ("smallest damping ratio", self.damping, "1"),
            ("decay rate", self.decay, "1/s"),
            *((f"peak sensitivity, {g}", v, "1") for g, v in self.peak_sensitivity.items()),
        ]


def robustness(problem: Problem, gains: Gains) -> tuple[Case, ...]:
    """The cases of `CASES` and, where both groups are looked at, the loss of each current command.

    With a command lost a motor keeps its mean current.
    """
    setting = problem.setting
    cases = dict(CASES)
    if set(setting.groups) == set(GROUPS):
        for name in setting.law.commands:
            cases[f"{name.replace('_', ' ')} lost"] = (Change("lost", name.removeprefix("command_")),)
    return tuple(_case(name, closed(setting, gains, *changes)) for name, changes in cases.items())


def _case(name: str, loop: Closed) -> Case:
    return Case(
        name=name, stable=loop.stable, damping=_damping(loop.poles), decay=loop.decay,
        peak_sensitivity=loop.peaks(TOLERANCE),
    )  # fmt: skip


def _damping(poles: np.ndarray) -> float:
    moving = poles[np.abs(poles.imag) > REAL * np.abs(poles)]
    return float((-moving.real / np.abs(moving)).min()) if len(moving) else 1.0
