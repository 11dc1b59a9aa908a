"""The loops that a law's reserves are asked of, made once: varied, sampled, frozen, late, scaled; evaluated at any θ.

    Setting --change | sample time | gap offsets | dead time or factor at a point--> ((which law, Stacked loop), …)

They steer, by `loop_rows`; `break_points`, `variations`, `sampled_cases` and `frozen` judge.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from workbench.analysis.break_parts import GroupLoops, Part, Point, delayed, points_of, with_dead_time
from workbench.analysis.break_points import Break
from workbench.analysis.change import Change
from workbench.analysis.corners import Box, Plants, corners
from workbench.analysis.frozen import groups_at
from workbench.analysis.sampled import between_samples
from workbench.analysis.setting import Setting
from workbench.analysis.variations import apart, changed, factors
from workbench.control.loop import Subject, subject
from workbench.control.loop.affine import LawFunction, Stacked


@dataclass(frozen=True, slots=True)
class Law:
    """Which law closes a loop: of which group of motion, at its modal signals or not, sampled [s] or not."""

    group: str
    sample_time: float | None = None
    modal: bool = False


@dataclass(slots=True)
class Watched:
    """Which corners of a box steer, the worst when all were looked at; how often they did."""

    corners: list[int] = field(default_factory=list)
    count: int = 0


Loops = tuple[tuple[Law, Stacked], ...]


class ReserveLoops:
    """The loops of a setting whose rows steer: made once, evaluated at any θ."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting
        self.groups = tuple(GroupLoops.of(setting, s) for s in setting.subjects)
        self.points: dict[str, Point] = {p.at.name: p for p in points_of(setting, self.groups)}
        self.chosen: dict[tuple[str, ...], list[Change]] = {}  # what names of variations stand for, kept by goals
        self._subjects = {s.name: s for s in setting.subjects}
        self._laws: dict[Law, LawFunction] = {}
        self._loops: dict[tuple, Loops] = {}
        self._corners: dict[Box, tuple[Loops, ...]] = {}
        self.watched: dict[Box, Watched] = {}

    def law(self, which: Law) -> LawFunction:
        """The law's matrices as a function of θ."""
        if which not in self._laws:
            own = next((g for g in self.groups if g.subject.name == which.group), None)
            if own is not None and which.sample_time is None:
                self._laws[which] = own.modal_law if which.modal else own.law
            else:
                self._laws[which] = LawFunction(self._subject(which.group), which.sample_time)
        return self._laws[which]

    def _subject(self, name: str) -> Subject:
        if name not in self._subjects:
            self._subjects[name] = subject(self.setting.plant, self.setting.law, name)
        return self._subjects[name]

    def _kept(self, key: tuple, make: Callable[[], Loops]) -> Loops:
        if key not in self._loops:
            self._loops[key] = make()
        return self._loops[key]

    def varied(self, change: Change) -> Loops:
        """The loops under a change."""
        return self._kept(("varied", change), lambda: self._varied(change))

    def _varied(self, change: Change) -> Loops:
        return self._scaled(changed(self.setting, change), (change,))

    def _scaled(self, there: Setting, changes: Sequence[Change]) -> Loops:
        """The loops of a changed vehicle with its sensors and commands changed."""
        name, scale = ", ".join(c.name for c in changes), factors(self.setting, *changes)
        if not all(map(apart, changes)):
            whole = subject(there.plant, there.law, "all")
            return ((Law("all"), _scaled(Stacked.of(whole, name), name, scale)),)
        if there is self.setting:
            return tuple((Law(g.subject.name), _scaled(g.loop, name, scale)) for g in self.groups)
        return tuple((Law(s.name), _scaled(Stacked.of(s, name), name, scale)) for s in there.subjects)

    def corners(self, box: Box) -> tuple[Loops, ...]:
        """The loops at every corner of a box, made once."""
        if box not in self._corners:
            plants = Plants(self.setting)
            self._corners[box] = tuple(self._scaled(plants.at(c), c) for c in corners(box))
        return self._corners[box]

    def sampled(self, sample_time: float, delay: float) -> Loops:
        """The loops as they are sampled [s], commands late by a dead time [s]."""

        def make() -> Loops:
            found = []
            for s in self.setting.subjects:
                seen = s.plant.select(inputs=s.commands, outputs=self.setting.law.sensors)
                A, B, C = between_samples(seen, sample_time, delay)
                loop = Stacked.from_plant(f"{s.name}, sampled", A, B, C, len(s.modal_rows), sample_time)
                found.append((Law(s.name, sample_time), loop))
            return tuple(found)

        return self._kept(("sampled", sample_time, delay), make)

    def frozen(self, heave: float, sway: float) -> Loops:
        """The loops at gap offsets [m]; none where the pose cannot be flown."""

        def make() -> Loops:
            found = self.setting.offsets.plant(heave, sway) if self.setting.offsets else None
            if found is None:
                return ()
            groups = groups_at(self.setting, sway)
            return tuple((Law(n), Stacked.of(subject(found[0], self.setting.law, n))) for n in groups)

        return self._kept(("frozen", heave, sway), make)

    def late(self, point: str, dead_time: float) -> Loops:
        """The loops with a dead time [s] at a break point."""

        def make() -> Loops:
            where = self.points[point]
            if where.apart or len(where.parts) == 1:
                return tuple(
                    (Law(self.groups[part.group].subject.name, modal=modal), loop)
                    for part, (loop, modal) in zip(where.parts, delayed(where, self.groups, dead_time), strict=True)
                )
            whole, at_sensors = Stacked.of(self._subject("all"), point), where.parts[0].at_sensors
            one = np.eye(whole.sensors if at_sensors else whole.commands)[[self._number(where.at)]]
            part = Part(0, one, one.T, at_sensors=at_sensors)
            return ((Law("all"), with_dead_time(whole, part, dead_time, point)),)

        return self._kept(("late", point, dead_time), make)

    def _number(self, at: Break) -> int:
        """Of a sensor among the sensors, of a command among the commands."""
        law = self.setting.law
        return law.sensors.index(at.target) if at.kind == "sensor" else law.commands.index(f"command_{at.target}")

    def scaled(self, point: str, factor: float) -> Loops:
        """The loops with a factor at a break point."""

        def make() -> Loops:
            where = self.points[point]
            if where.at.kind in ("kind", "sensor"):
                return self._varied(Change("scale", where.at.target, factor))
            if where.at.kind == "current":
                return self._varied(Change("weak", where.at.target, factor))
            found = []
            for part in where.parts:  # of a pattern, a modal signal or all patterns: the part names them
                group = self.groups[part.group]
                loop = group.modal_loop if part.modal else group.loop
                own = np.where(np.abs(part.left).max(axis=0) > 0, factor, 1.0)
                found.append((Law(group.subject.name, modal=part.modal), loop.with_commands(point, own)))
            return tuple(found)

        return self._kept(("scaled", point, factor), make)


def _scaled(loop: Stacked, name: str, scale: dict[str, np.ndarray]) -> Stacked:
    """With sensors and commands times factors."""
    if "sensors" in scale:
        loop = loop.with_sensors(name, scale["sensors"])
    return loop.with_commands(name, scale["commands"]) if "commands" in scale else loop
