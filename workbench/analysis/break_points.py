"""Margins wherever a loop may be broken: currents, their patterns, sensors, kinds of sensors, modal signals.

    Setting, Gains --each group closed--> S at the commands, at the sensors, at the modal signals --> BreakPoint each

A kind of sensors shares one factor: four signals, of which the law sees two or three motions, so that the loci are
those of the motions. Groups of motion share no state; what is common to both is limited by the worse.
Source: guide, Definitions: Margins at break points.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.setting import Setting
from workbench.control import Gains
from workbench.control.law import CHANNELS, MODAL
from workbench.control.loop import Subject, subject
from workbench.control.loop.closed import interconnect
from workbench.lti import Plant
from workbench.lti.break_point import BreakPoint, break_point, joint_point
from workbench.lti.disk import disk_margin
from workbench.lti.front import matrices, mixed
from workbench.lti.join import beside
from workbench.lti.realisation import Realisation

KINDS: Mapping[str, tuple[str, ...]] = {
    "gap": ("gap",), "gap_lateral": ("gap_lateral",), "acceleration_z": ("acceleration_z",),
    "acceleration_y": ("acceleration_y",), "vertical": ("gap", "acceleration_z"),
    "lateral": ("gap_lateral", "acceleration_y"),
}  # fmt: skip
PATTERNS = {"heave_pitch": ("heave", "pitch"), "sway_roll_yaw": ("sway_roll", "yaw"), "heave": ("heave",)}
ALL = "all"  # kind of a break point at which every signal has a factor of its own
SILENT = 1e-12  # of the largest: a sensor whose signal the law does not use has no loop through it


@dataclass(frozen=True, slots=True)
class Break:
    """Where a loop is broken: kind ("current", "sensor", "kind", "all" …) and which; its name is how files say it."""

    kind: str
    target: str

    @property
    def name(self) -> str:
        """As files and results say it."""
        return f"{self.kind}:{self.target}"


@dataclass(frozen=True, slots=True)
class _Closed:
    """One group of motion and its closed loop."""

    subject: Subject
    loop: Plant

    def sensitivity(self, names: Sequence[str]) -> Realisation:
        """S at sensors: from what is added to each to what the law reads."""
        seen = self.loop.select(inputs=[f"error_{name}" for name in names], outputs=names)
        return Realisation(seen.A, seen.B, seen.C, seen.D + np.eye(len(names)))


def break_points(setting: Setting, gains: Gains) -> tuple[BreakPoint, ...]:
    """Margins at every break point of a stable vehicle, one at a time.

    Points: `current:<command>`, `pattern:<motion>`, `currents:uniform`, `sensor:<name>`, `kind:<kind>`,
    `modal:<signal>`; those that the law does not use, or whose motion is not looked at, are absent.

    Raises
    ------
    InputError
        If the loop is not stable, or a rate is not filtered.
    """
    groups = [_Closed(s, s.close(gains)) for s in setting.subjects]
    commands = at_commands(setting, gains)
    found = [
        break_point(*channel(commands, k), point=Break("current", name.removeprefix("command_")).name)
        for k, name in enumerate(setting.law.commands)
        if _used(commands, k)
    ]
    for group in groups:
        S = group.subject.sensitivity(group.loop)
        for k, name in enumerate(PATTERNS.get(group.subject.name, group.subject.commands)[: len(S[3])]):
            found.append(break_point(*channel(S, k), point=Break("pattern", name).name))
    found.append(_worst(Break("currents", "uniform").name, [group.subject.sensitivity(group.loop) for group in groups]))
    sensors = _at_sensors(groups, setting.law.sensors)
    found += [
        break_point(*channel(sensors, k), point=Break("sensor", name).name)
        for k, name in enumerate(setting.law.sensors)
        if _used(sensors, k)
    ]
    for name, kinds in KINDS.items():
        parts = [part for part in (_along_motions(group, kinds) for group in groups) if part is not None]
        if parts:
            found.append(_worst(Break("kind", name).name, parts))
    modal, names = at_modal_signals(setting, gains)
    found += [break_point(*channel(modal, k), point=Break("modal", name).name) for k, name in enumerate(names)]
    return tuple(found)


def together(setting: Setting, gains: Gains) -> tuple[BreakPoint, ...]:
    """What all commands, all sensors of a kind and all modal signals bear at once, each with a factor of its own.

    Points `all:currents`, `all:<kind>`, `all:modal`. The disk margin is a certified lower bound, by scalings; gain and
    phase are those that it guarantees. Raises InputError as `break_points`.
    """
    groups = [_Closed(s, s.close(gains)) for s in setting.subjects]
    sensors = _at_sensors(groups, setting.law.sensors)
    found = [_at_once(Break(ALL, "currents"), at_commands(setting, gains))]
    for name, kinds in KINDS.items():
        own = np.flatnonzero(setting.law.of_kinds(kinds))
        used = [k for k in own if _used(sensors, k)]
        if used:
            A, B, C, D = sensors
            found.append(_at_once(Break(ALL, name), Realisation(A, B[:, used], C[used], D[np.ix_(used, used)])))
    return (*found, _at_once(Break(ALL, "modal"), at_modal_signals(setting, gains)[0]))


def _at_once(at: Break, S: Realisation) -> BreakPoint:
    return joint_point(at.name, disk_margin(*S).lower)


def channel(S: Sequence[np.ndarray], k: int) -> Realisation:
    """One diagonal entry of a sensitivity."""
    A, B, C, D = S
    return Realisation(A, B[:, [k]], C[[k]], D[k : k + 1, k : k + 1])


def _used(S: Sequence[np.ndarray], k: int) -> bool:
    """Whether a loop goes through a signal: T is not zero there."""
    _, B, C, _ = S
    return bool(np.abs(B[:, k]).max(initial=0.0) > SILENT * np.abs(B).max(initial=0.0) and np.abs(C[k]).any())


def _worst(point: str, parts: Sequence[Sequence[np.ndarray]]) -> BreakPoint:
    """A factor that several groups without common states share: each margin is that of the worst group."""
    found = [break_point(*part, point=point) for part in parts]
    return BreakPoint(
        point=point, gain_up=min(b.gain_up for b in found), gain_down=max(b.gain_down for b in found),
        phase=min(b.phase for b in found), delay=min(b.delay for b in found), disk=min(b.disk for b in found),
    )  # fmt: skip


def _at_sensors(groups: Sequence[_Closed], names: Sequence[str]) -> Realisation:
    """S at all sensors of the vehicle, put together from the groups."""
    parts = [group.sensitivity(names) for group in groups]
    each = np.eye(len(names))
    A, B, C, D = beside(*(Realisation(p.A, p.B, p.C, p.D - each) for p in parts))
    into = np.tile(each, (len(parts), 1))
    return Realisation(A, B @ into, into.T @ C, into.T @ D @ into + each)


def _along_motions(group: _Closed, kinds: Sequence[str]) -> Realisation | None:
    """S at the sensors of some kinds in the motions that the law resolves from them; None where it uses none."""
    law = group.subject.law
    own = law.of_kinds(kinds)
    names = [name for name, of_kind in zip(law.sensors, own, strict=True) if of_kind]
    read = law.measurement_matrix()[group.subject.modal_rows][:, own]
    read = read[np.abs(read).max(axis=1) > SILENT]
    if not len(read):
        return None
    S = group.sensitivity(names)
    onto = np.linalg.pinv(read)
    T = Realisation(S.A, S.B @ onto, read @ S.C, read @ (S.D - np.eye(len(names))) @ onto)
    if not (np.abs(T.B).any() and np.abs(T.C).any()):
        return None
    return Realisation(T.A, T.B, T.C, T.D + np.eye(len(read)))


def at_commands(setting: Setting, gains: Gains) -> Realisation:
    """The sensitivity at all current commands, put together from the groups."""
    parts = [(s, s.sensitivity(s.close(gains))) for s in _with_unused(setting)]
    A, B, C, D = beside(*(Realisation(*p) for _, p in parts))
    spread = np.column_stack([s.patterns for s, _ in parts])
    rest = np.eye(len(spread)) - spread @ spread.T  # patterns nobody commands
    return Realisation(A, B @ spread.T, spread @ C, spread @ D @ spread.T + rest)


def _with_unused(setting: Setting) -> tuple[Subject, ...]:
    """The groups with every coil pattern: an error of one current reaches the others through all of them."""
    if not setting.law.split:
        return setting.subjects
    return tuple(subject(setting.plant, setting.law, s.name, unused=s.name != "heave") for s in setting.subjects)


def at_modal_signals(setting: Setting, gains: Gains) -> tuple[Realisation, list[str]]:
    """The sensitivity at the scaled modal signals K_i q_i of the groups looked at, and their names."""
    law = setting.law
    resolve, spread = law.modal_matrix(gains), law.modal_spread()
    systems, names = [], []
    for s in setting.subjects:
        own = [k for k, name in enumerate(MODAL) if CHANNELS.index(name) in s.channels]
        labels = [MODAL[k] for k in own]
        through = mixed(s.plant, s.commands, labels, s.patterns.T @ spread[:, own])
        controller = s.controller(gains, resolve[own])
        closed = interconnect(
            through, controller, labels, law.sensors, [f"filter {k}" for k in range(len(controller[0]))]
        )
        seen = closed.select(inputs=[f"error_{n}" for n in labels], outputs=labels)
        systems.append(matrices(seen))
        names += labels
    return beside(*systems), names
