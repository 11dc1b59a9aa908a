"""What a law keeps when vehicle, sensors or commands are not the nominal ones: one change at a time.

    Setting, Gains, Change --groups it leaves apart, or the vehicle whole--> closed loops --> damping, decay, peak of S
                           --stuck, drifting sensors--> what a unit of the reading does at rest

Damping is the least −Re p/|p| of all roots: a real unstable root counts −1. The peak sensitivity is the larger one of
the groups of motion, at the current patterns.  Source: guide, Definitions: Variations and losses.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.analysis.break_points import KINDS as SENSORS
from workbench.analysis.change import COMMAND, KINDS, SENSOR, VEHICLE, Change
from workbench.analysis.setting import Setting
from workbench.control import Gains
from workbench.control.loop import GROUPS, Subject, subject
from workbench.control.loop.closed import interconnect
from workbench.control.loop.group import commanded
from workbench.errors import InputError, unknown_name
from workbench.lti import Plant
from workbench.lti.norm import peak_gain
from workbench.result import Result, Row

AT_REST = ("static_gap_per_unit", "static_current_per_unit")  # keys
PEAK_TOLERANCE = 1e-5  # relative width of the bracket


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Varied(Result):
    """One variation: least damping ratio [1] and decay [1/s], peak sensitivity of each group; None if unstable.

    at_rest : of a stuck or drifting sensor, the largest change of a gap [m] and of a current ratio [1] at rest per unit
        of its reading ([m] or [m/s²]) that depends on nothing; of one that drifts, rates per rate. None of others
    """

    name: str
    damping: float
    decay: float
    peaks: Mapping[str, float | None]
    at_rest: tuple[float, float] | None = None

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
        static = dict(zip(AT_REST, self.at_rest, strict=True)) if self.at_rest else {}
        return {
            "name": self.name, "damping": self.damping, "decay": self.decay, "peak_sensitivity": self.peak_sensitivity,
            **static,
        }  # fmt: skip

    def rows(self) -> list[Row]:
        return [
            ("variation", self.name, ""),
            ("smallest damping ratio", self.damping, "1"),
            ("decay rate", self.decay, "1/s"),
            ("peak sensitivity", self.peak_sensitivity, "1"),
            *((name, value, "1") for name, value in zip(AT_REST, self.at_rest or (), strict=False)),
        ]


def listed(setting: Setting) -> tuple[Change, ...]:
    """The changes that an analysis of a setting lists: of every kind, on whatever it can be."""
    whole = set(setting.groups) == set(GROUPS)
    found: list[Change] = []
    for kind, known in KINDS.items():
        amounts: Sequence[float | None] = known.amounts if known.factor is None else (None,)
        if known.on == SENSOR:
            used = [k for k in SENSORS if any(_used(s, SENSORS[k]) for s in setting.subjects)]
            targets = used if known.factor is None else list(setting.law.sensors) if whole else []
        elif known.on == COMMAND:
            targets = [name.removeprefix("command_") for name in setting.law.commands] if whole else []
        else:
            targets = [""] if setting.elsewhere is not None else []
        found += [Change(kind, target, amount) for target in targets for amount in amounts]
    return tuple(found)


def check_change(setting: Setting, change: Change) -> None:
    """Refuses a change on what a setting does not have."""
    if change.on == VEHICLE:
        if setting.elsewhere is None:
            raise InputError(f"the variation {change.name!r} needs a vehicle to vary; this is a plant alone.")
        return
    names = {
        SENSOR: [*(SENSORS if KINDS[change.kind].factor is None else ()), *setting.law.sensors],
        COMMAND: [name.removeprefix("command_") for name in setting.law.commands],
    }[change.on]
    if change.target not in names:
        raise unknown_name("variation", change.name, [replace(change, target=name).name for name in names])
    if change.target not in SENSORS and set(setting.groups) != set(GROUPS):
        raise InputError(
            f"the variation {change.name!r} couples the groups of motion; this problem looks at "
            f"{', '.join(setting.groups)}. Look at both, or leave it out."
        )


def variations(setting: Setting, gains: Gains, changes: Sequence[Change] | None = None) -> tuple[Varied, ...]:
    """The loop under every change; under those listed if left out."""
    known: dict[Change, Varied] = {}
    return tuple(varied(setting, gains, c, known) for c in (listed(setting) if changes is None else changes))


def varied(setting: Setting, gains: Gains, change: Change, known: dict[Change, Varied] | None = None) -> Varied:
    """The loop under one change.

    known : what was found for other changes, kept there; loops that are alike are closed once
    """
    kept, alike = {} if known is None else known, change.alike
    if alike not in kept:
        loop = closed(setting, gains, alike)
        kept[alike] = Varied(
            name=alike.name, damping=damping_of(loop.poles), decay=loop.decay, peaks=loop.peaks(PEAK_TOLERANCE)
        )
    found = kept[alike]
    rests = alike != change and found.stable
    return replace(found, name=change.name, at_rest=_at_rest(setting, gains, change) if rests else None)


@dataclass(frozen=True, slots=True)
class Closed:
    """Roots of a changed loop, and (A, B, C, D) of S at the current patterns of each group of motion."""

    poles: np.ndarray
    sensitivities: Mapping[str, Sequence[np.ndarray]]

    @property
    def stable(self) -> bool:
        """Whether every root decays."""
        return bool(self.poles.real.max() < 0)

    @property
    def decay(self) -> float:
        """Of the slowest root [1/s]."""
        return float(0.0 - self.poles.real.max())

    def peaks(self, tolerance: float) -> dict[str, float | None]:
        """Peak sensitivity of each group, upper end of a bracket of that relative width; None if unstable."""
        return {
            name: peak_gain(*S, tolerance=tolerance).upper if self.stable else None
            for name, S in self.sensitivities.items()
        }


def closed(setting: Setting, gains: Gains, *changes: Change, there: Setting | None = None) -> Closed:
    """The loop under changes: group by group where they leave the groups apart, else the vehicle whole.

    there : the setting of the changed vehicle, where it is at hand
    """
    there, scale = changed(setting, *changes) if there is None else there, factors(setting, *changes)
    if all(map(apart, changes)):
        loops = [(s, closed_scaled(s, gains, **scale)) for s in there.subjects]
        return Closed(np.concatenate([loop.poles() for _, loop in loops]), {s.name: s.sensitivity(c) for s, c in loops})
    whole = subject(there.plant, there.law, "all")
    loop = closed_scaled(whole, gains, **scale)
    a, b, c, d = whole.sensitivity(loop)
    patterns = {name: commanded(name, there.law).patterns for name in GROUPS}
    return Closed(loop.poles(), {name: (a, b @ U, U.T @ c, U.T @ d @ U) for name, U in patterns.items()})


def apart(change: Change) -> bool:
    """Whether groups of motion stay apart: all sensors of a kind, or the vehicle, are as they are right and left."""
    return change.on == VEHICLE or change.target in SENSORS


def changed(setting: Setting, *changes: Change) -> Setting:
    """The setting of another vehicle, under the law of this one."""
    values = {name: value for c in changes if c.on == VEHICLE for name, value in c.values.items()}
    if not values or setting.elsewhere is None:
        return setting
    return replace(setting.elsewhere(values), law=setting.law)


def factors(setting: Setting, *changes: Change) -> dict[str, np.ndarray]:
    """`sensors` (p,) and `commands` (m,): what multiplies each of them, where anything does."""
    law, found = setting.law, {}
    for c in changes:
        if c.on == SENSOR:
            own = law.of_kinds(SENSORS[c.target]) if c.target in SENSORS else _is(law.sensors, c.target)
            found["sensors"] = found.get("sensors", 1.0) * np.where(own, c.factor, 1.0)
        elif c.on == COMMAND:
            own = _is(law.commands, f"command_{c.target}")
            found["commands"] = found.get("commands", 1.0) * np.where(own, c.factor, 1.0)
    return found


def _is(names: Sequence[str], name: str) -> np.ndarray:
    return np.array([one == name for one in names])


def _at_rest(setting: Setting, gains: Gains, change: Change) -> tuple[float, float]:
    """The largest change of a gap, and of a current ratio, at rest by a unit that the law reads beside the truth."""
    whole, law = subject(setting.plant, setting.law, "all"), setting.law
    loop = closed_scaled(whole, gains, **factors(setting, change))
    A, B, C, D = whole.controller(gains)
    k = law.sensors.index(change.target)
    pushed = D[:, k] - C @ np.linalg.solve(A, B[:, k])  # pattern commands by a unit of the reading
    gaps = [name for name, own in zip(law.sensors, law.of_kinds(("gap", "gap_lateral")), strict=True) if own]
    seen = loop.select(inputs=[f"error_{c}" for c in whole.commands], outputs=(*gaps, *whole.commands))
    rest = (seen.D - seen.C @ np.linalg.solve(seen.A, seen.B)) @ pushed
    return float(np.abs(rest[: len(gaps)]).max()), float(np.abs(whole.patterns @ rest[len(gaps) :]).max())


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


def damping_of(poles: np.ndarray) -> float:
    """Least −Re p/|p| of all roots [1]; a root at zero counts 0."""
    size = np.abs(poles)
    return float(((0.0 - poles.real) / np.where(size > 0, size, 1.0)).min())
