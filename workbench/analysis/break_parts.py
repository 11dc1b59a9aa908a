"""Where a loop may be broken, as parts of the groups of motion: what steers and what judges look at the same places.

    Setting --groups--> loops at the commands and at the modal signals --> Point: Break, its parts
    a part: left (S − I) right of one group's sensitivity at its commands, its sensors or its modal signals

One signal is a sum of parts (S = 1 + Σ), several at once too (S = I + Σ); a common factor on a kind of sensors acts in
each group's motions for itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.analysis.break_points import ALL, KINDS, PATTERNS, Break
from workbench.analysis.setting import Setting
from workbench.control.law import CHANNELS, MODAL
from workbench.control.loop import Subject
from workbench.control.loop.affine import LawFunction, Stacked
from workbench.lti.delay import pade

PADE = 3  # order of the fraction that stands for a dead time


@dataclass(frozen=True)
class GroupLoops:
    """The loops of one group of motion, at its commands and at its modal signals; their laws are made when asked."""

    subject: Subject
    loop: Stacked
    modal_loop: Stacked
    modal: tuple[str, ...]

    @classmethod
    def of(cls, setting: Setting, subject: Subject) -> "GroupLoops":
        """Of a group of a setting."""
        loop = Stacked.of(subject)
        own = [k for k, name in enumerate(MODAL) if CHANNELS.index(name) in subject.channels]
        spread = subject.patterns.T @ setting.law.modal_spread()[:, own]
        E = loop.E.copy()
        through = np.hstack([E[:, : loop.commands] @ spread, E[:, loop.commands :]])
        modal_loop = Stacked(f"{loop.name}, modal", loop.A0, through, loop.F, len(own), loop.sensors)
        return cls(subject, loop, modal_loop, tuple(MODAL[k] for k in own))

    @cached_property
    def law(self) -> LawFunction:
        """From the parameters to the pattern commands."""
        return LawFunction(self.subject)

    @cached_property
    def modal_law(self) -> LawFunction:
        """From the parameters to the modal signals."""
        return LawFunction(self.subject, modal=[MODAL.index(name) for name in self.modal])

    def read(self, kinds: Sequence[str]) -> np.ndarray:
        """(r, sensors) the motions that the law resolves from kinds of sensors; the other sensors' columns are zero."""
        law = self.subject.law
        read = law.measurement_matrix()[self.subject.modal_rows] * law.of_kinds(kinds)
        return read[np.abs(read).max(axis=1) > 0]


@dataclass(frozen=True, slots=True)
class Part:
    """What one group contributes to a break point: left (S − I) right of its sensitivity, (r, r).

    group : its number;  modal : whether the loop is broken at the modal signals;  at_sensors : or at the sensors; else
        at the commands
    left : (r, signals), right : (signals, r)
    """

    group: int
    left: np.ndarray
    right: np.ndarray
    at_sensors: bool = False
    modal: bool = False


@dataclass(frozen=True, slots=True)
class Point:
    """A break point: what its groups add up to, or a common factor, each group for itself.

    apart : whether each group is looked at for itself;  together : whether every signal has a factor of its own
    """

    at: Break
    parts: tuple[Part, ...]
    apart: bool = False
    together: bool = False


def break_names(setting: Setting) -> tuple[Break, ...]:
    """The break points of a setting, without their loops."""
    return tuple(p.at for p in points_of(setting, tuple(GroupLoops.of(setting, s) for s in setting.subjects)))


def points_of(setting: Setting, groups: Sequence[GroupLoops]) -> list[Point]:
    """Every break point of a setting."""
    return [
        *_at_commands(setting, groups), *_at_sensors(setting, groups), *_at_modal_signals(groups),
    ]  # fmt: skip


def _at_commands(setting: Setting, groups: Sequence[GroupLoops]) -> list[Point]:
    found, uniform = [], []
    whole = tuple(Part(g, group.subject.patterns, group.subject.patterns.T) for g, group in enumerate(groups))
    for k, name in enumerate(setting.law.commands):
        parts = tuple(Part(p.group, p.left[[k]], p.right[:, [k]]) for p in whole)
        found.append(Point(Break("current", name.removeprefix("command_")), parts))
    for g, group in enumerate(groups):
        each = np.eye(group.loop.commands)
        names = PATTERNS.get(group.subject.name, group.subject.commands)[: len(each)]
        found += [Point(Break("pattern", n), (Part(g, each[[k]], each[:, [k]]),)) for k, n in enumerate(names)]
        uniform.append(Part(g, each, each))
    found.append(Point(Break("currents", "uniform"), tuple(uniform), apart=True))
    return [*found, Point(Break(ALL, "currents"), whole, together=True)]


def _at_sensors(setting: Setting, groups: Sequence[GroupLoops]) -> list[Point]:
    law, found = setting.law, []

    def at(rows: np.ndarray) -> tuple[Part, ...]:
        return tuple(Part(g, rows, rows.T, at_sensors=True) for g in range(len(groups)))

    each = np.eye(len(law.sensors))
    found += [Point(Break("sensor", name), at(each[[k]])) for k, name in enumerate(law.sensors)]
    for name, kinds in KINDS.items():
        seen = [(g, group.read(kinds)) for g, group in enumerate(groups)]
        parts = tuple(Part(g, R, np.linalg.pinv(R), at_sensors=True) for g, R in seen if len(R))
        if parts:
            found.append(Point(Break("kind", name), parts, apart=True))
            found.append(Point(Break(ALL, name), at(each[law.of_kinds(kinds)]), together=True))
    return found


def _at_modal_signals(groups: Sequence[GroupLoops]) -> list[Point]:
    names = [(g, k) for g, group in enumerate(groups) for k in range(len(group.modal))]
    found, whole = [], []
    for g, group in enumerate(groups):
        own = np.eye(len(group.modal))
        found += [
            Point(Break("modal", name), (Part(g, own[[k]], own[:, [k]], modal=True),))
            for k, name in enumerate(group.modal)
        ]
        into = np.array([own[k] if of == g else np.zeros(len(own)) for of, k in names])
        whole.append(Part(g, into, into.T, modal=True))
    return [*found, Point(Break(ALL, "modal"), tuple(whole), together=True)]


def delayed(point: Point, groups: Sequence[GroupLoops], dead_time: float) -> list[tuple[Stacked, bool]]:
    """Loops with a dead time [s] at a point, one a part: (loop, whether its commands are the modal signals)."""
    found = []
    for part in point.parts:
        group = groups[part.group]
        loop = group.modal_loop if part.modal else group.loop
        found.append((with_dead_time(loop, part, dead_time, point.at.name), part.modal))
    return found


def with_dead_time(loop: Stacked, part: Part, dead_time: float, name: str) -> Stacked:
    """The part's directions of commands or sensors pass a fraction in place of a dead time."""
    left, right = part.left, part.right
    a, b, c, d = pade(dead_time, PADE)
    r = len(left)
    A, B, C, D = (np.kron(np.eye(r), matrix) for matrix in (a, b, c, d))
    n, k = len(loop.A0), len(A)
    A0 = np.zeros((n + k, n + k))
    A0[:n, :n], A0[n:, n:] = loop.A0, A
    E, F = np.vstack([loop.E, np.zeros((k, loop.E.shape[1]))]), np.hstack([loop.F, np.zeros((len(loop.F), k))])
    if part.at_sensors:
        seen = loop.F[: loop.sensors]
        A0[n:, :n] = B @ left @ seen
        F[: loop.sensors, :n] = seen - right @ left @ seen + right @ D @ left @ seen
        F[: loop.sensors, n:] = right @ C
    else:
        acts = loop.E[:, : loop.commands]
        A0[:n, n:] = acts @ right @ C
        E[:n, : loop.commands] = acts - acts @ right @ left + acts @ right @ D @ left
        E[n:, : loop.commands] = B @ left
    return Stacked(name, A0, E, F, loop.commands, loop.sensors, loop.sample_time)
