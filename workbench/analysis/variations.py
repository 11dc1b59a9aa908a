"""What a law keeps when vehicle, sensors or commands are not the nominal ones: one thing changed at a time.

    scale:<kind>:<factor>  sensors of a kind read too much      mass:<factor>, force:<factor>   another vehicle
    lost:<command>         a command is zero                    dead:<sensor>                   a sensor reads zero

Damping is the least −Re p/|p| of all roots: a real unstable root counts −1. The peak sensitivity is the larger one of
the groups of motion, at the current patterns.  Source: guide, Definitions: Variations and losses.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.break_points import KINDS
from workbench.analysis.setting import Setting
from workbench.control import Gains
from workbench.control.loop import GROUPS, Subject, subject
from workbench.control.loop.closed import interconnect
from workbench.control.loop.group import commanded
from workbench.lti import Plant
from workbench.lti.norm import peak_gain
from workbench.result import Result, Row

SCALES = (0.9, 1.1)
MASSES = (0.85, 1.15)
FORCES = (0.9, 1.1)
PEAK_TOLERANCE = 1e-5  # relative width of the bracket


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Varied(Result):
    """One variation: least damping ratio [1] and decay [1/s], peak sensitivity of each group; None if unstable."""

    name: str
    damping: float
    decay: float
    peaks: Mapping[str, float | None]

    @property
    def stable(self) -> bool:
        """Whether every root decays."""
        return self.decay > 0

    @property
    def peak_sensitivity(self) -> float | None:
        """The largest of the groups."""
        values = [peak for peak in self.peaks.values() if peak is not None]
        return max(values) if values and len(values) == len(self.peaks) else None

    def to_dict(self) -> dict[str, float | str | None]:
        """In the command line's keys."""
        return {
            "name": self.name,
            "damping": self.damping,
            "decay": self.decay,
            "peak_sensitivity": self.peak_sensitivity,
        }

    def rows(self) -> list[Row]:
        return [
            ("variation", self.name, ""),
            ("smallest damping ratio", self.damping, "1"),
            ("decay rate", self.decay, "1/s"),
            ("peak sensitivity", self.peak_sensitivity, "1"),
        ]


def variations(setting: Setting, gains: Gains) -> tuple[Varied, ...]:
    """The loop under every variation that means something for it; another mass or force where a vehicle is known."""
    found = []
    for kind, kinds in KINDS.items():
        for factor in SCALES:
            scale = np.where(setting.law.of_kinds(kinds), factor, 1.0)
            loops = [(s, closed_scaled(s, gains, sensors=scale)) for s in setting.subjects]
            if any(_used(s, kinds) for s in setting.subjects):
                found.append(_grouped(f"scale:{kind}:{factor:g}", loops))
    if setting.elsewhere is not None:
        for word, name, factors in (("mass", "mass", MASSES), ("force", "current_force", FORCES)):
            for factor in factors:
                there = setting.elsewhere({name: factor})
                found.append(_grouped(f"{word}:{factor:g}", [(s, s.close(gains)) for s in there.subjects]))
    if set(setting.groups) == set(GROUPS):
        found += _losses(setting, gains)
    return tuple(found)


def names(setting: Setting) -> tuple[str, ...]:
    """Names of the variations that mean something for a setting."""
    kinds = [kind for kind, parts in KINDS.items() if any(_used(s, parts) for s in setting.subjects)]
    found = [f"scale:{kind}:{factor:g}" for kind in kinds for factor in SCALES]
    if setting.elsewhere is not None:
        found += [f"mass:{factor:g}" for factor in MASSES] + [f"force:{factor:g}" for factor in FORCES]
    if set(setting.groups) == set(GROUPS):
        found += [f"lost:{name.removeprefix('command_')}" for name in setting.law.commands]
        found += [f"dead:{name}" for name in setting.law.sensors]
    return tuple(found)


def _losses(setting: Setting, gains: Gains) -> list[Varied]:
    """Each command at zero, each sensor at zero: the groups meet then, and the vehicle is taken whole."""
    whole, law = subject(setting.plant, setting.law, "all"), setting.law
    patterns = {name: commanded(name, law).patterns for name in GROUPS}
    found = []
    for k, name in enumerate(law.commands):
        commands = np.array([float(i != k) for i in range(len(law.commands))])
        closed = closed_scaled(whole, gains, commands=commands)
        found.append(_whole(f"lost:{name.removeprefix('command_')}", whole, closed, patterns))
    for k, name in enumerate(law.sensors):
        sensors = np.array([float(i != k) for i in range(len(law.sensors))])
        found.append(_whole(f"dead:{name}", whole, closed_scaled(whole, gains, sensors=sensors), patterns))
    return found


def _used(s: Subject, kinds: Sequence[str]) -> bool:
    """Whether a group reads sensors of these kinds in its motions."""
    return bool(s.law.measurement_matrix()[s.modal_rows][:, s.law.of_kinds(kinds)].any())


def closed_scaled(
    s: Subject, gains: Gains, *, sensors: np.ndarray | None = None, commands: np.ndarray | None = None
) -> Plant:
    """The closed loop with the law's inputs and outputs scaled."""
    A, B, C, D = s.controller(gains)
    if sensors is not None:
        B, D = B * sensors, D * sensors
    if commands is not None:
        C, D = commands[:, None] * C, commands[:, None] * D
    names = tuple(f"filter {k + 1}" for k in range(len(A)))
    return interconnect(s.plant, (A, B, C, D), s.commands, s.law.sensors, names)


def _grouped(name: str, loops: Sequence[tuple[Subject, Plant]]) -> Varied:
    poles = np.concatenate([closed.poles() for _, closed in loops])
    stable = bool(poles.real.max() < 0)
    peaks = {
        s.name: peak_gain(*s.sensitivity(closed), tolerance=PEAK_TOLERANCE).upper if stable else None
        for s, closed in loops
    }
    return Varied(name=name, damping=damping_of(poles), decay=float(-poles.real.max()), peaks=peaks)


def _whole(name: str, whole: Subject, closed: Plant, patterns: Mapping[str, np.ndarray]) -> Varied:
    poles = closed.poles()
    stable = bool(poles.real.max() < 0)
    a, b, c, d = whole.sensitivity(closed)
    peaks = {
        group: peak_gain(a, b @ U, U.T @ c, U.T @ d @ U, tolerance=PEAK_TOLERANCE).upper if stable else None
        for group, U in patterns.items()
    }
    return Varied(name=name, damping=damping_of(poles), decay=float(-poles.real.max()), peaks=peaks)


def damping_of(poles: np.ndarray) -> float:
    """Least −Re p/|p| of all roots [1]; a root at zero counts 0."""
    size = np.abs(poles)
    return float((-poles.real / np.where(size > 0, size, 1.0)).min())
