"""What a design keeps when the vehicle is not the nominal one: mass, force per current, sensor scale, a lost command.

problem, gains --each case--> closed loop --> stable, smallest damping ratio, peak sensitivity of each group
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.analysis.mode import REAL
from workbench.analysis.setting import Setting
from workbench.analysis.variations import closed_scaled
from workbench.control import Gains
from workbench.control.gains import LATERAL, VERTICAL
from workbench.control.loop import GROUPS, Subject, subject
from workbench.control.loop.group import commanded
from workbench.design.problem import Problem
from workbench.lti import Plant
from workbench.lti.norm import peak_gain
from workbench.result import Result, Row

CASES: dict[str, Mapping[str, float]] = {
    "nominal": {},
    "mass −15 %": {"mass": 0.85},
    "mass +15 %": {"mass": 1.15},
    "current force −10 %": {"current_force": 0.90},
    "current force +10 %": {"current_force": 1.10},
}
# All sensors of one direction reading too little or too much is the same as their filter gains being off.
SENSOR_CASES = {
    "vertical sensors −10 %": (VERTICAL, 0.90),
    "vertical sensors +10 %": (VERTICAL, 1.10),
    "lateral sensors −10 %": (LATERAL, 0.90),
    "lateral sensors +10 %": (LATERAL, 1.10),
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


def robustness(problem: Problem, gains: Gains, vary: Callable[..., Any]) -> tuple[Case, ...]:
    """The cases of `CASES` and `SENSOR_CASES` and, where both groups are looked at, the loss of each current command.

    vary : (vehicle, **factors) -> vehicle, such as `vehicle.varied`
    """
    cases = []
    for name, factors in CASES.items():
        setting = problem.with_vehicle(vary(problem.vehicle, **factors)).setting if factors else problem.setting
        cases.append(_case(name, [(s, s.close(gains)) for s in setting.subjects]))
    for name, (signals, factor) in SENSOR_CASES.items():
        scaled = gains.with_values(**{gain: factor * getattr(gains, gain) for gain in signals})
        cases.append(_case(name, [(s, s.close(scaled)) for s in problem.subjects]))
    if set(problem.setting.groups) == set(GROUPS):
        cases += [_lost_command(problem.setting, gains, k) for k in range(len(problem.law.commands))]
    return tuple(cases)


def _case(name: str, loops: list[tuple[Subject, Plant]]) -> Case:
    poles = np.concatenate([closed.poles() for _, closed in loops])
    stable = bool(poles.real.max() < 0)
    peaks = {s.name: peak_gain(*s.sensitivity(closed)).upper if stable else None for s, closed in loops}
    return Case(
        name=name, stable=stable, damping=_damping(poles), decay=float(-poles.real.max()), peak_sensitivity=peaks
    )


def _lost_command(setting: Setting, gains: Gains, lost: int) -> Case:
    """The whole vehicle with one command at zero, a motor keeping its mean current; sensitivity at the others."""
    whole = subject(setting.plant, setting.law, "all")
    closed = closed_scaled(whole, gains, commands=np.array([float(k != lost) for k in range(len(whole.commands))]))
    poles = closed.poles()
    stable = bool(poles.real.max() < 0)
    peaks: dict[str, float | None] = {}
    for name in GROUPS:
        U = commanded(name, setting.law).patterns
        a, b, c, d = whole.sensitivity(closed)
        peaks[name] = peak_gain(a, b @ U, U.T @ c, U.T @ d @ U).upper if stable else None
    return Case(
        name=f"{setting.law.commands[lost].replace('_', ' ')} lost",
        stable=stable,
        damping=_damping(poles),
        decay=float(-poles.real.max()),
        peak_sensitivity=peaks,
    )


def _damping(poles: np.ndarray) -> float:
    moving = poles[np.abs(poles.imag) > REAL * np.abs(poles)]
    return float((-moving.real / np.abs(moving)).min()) if len(moving) else 1.0
