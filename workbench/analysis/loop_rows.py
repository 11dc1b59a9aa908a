"""Smooth rows of what a law keeps in reserve, with exact derivatives by the seventeen parameters.

    Setting --groups, variations, dead times, sampling--> Stacked loops  --θ-->  damping of the worst roots
            --break points-->                             S at a point   --θ-->  |S − ½| at its highest crests

They steer; `break_points`, `variations`, `sampled_cases` and `frozen` judge. A row is >= 0 where its limit is met and
relative to it. A damping row of a root λ is (−Re λ − ζ|λ|)/√(|λ|² + ω0²): smooth, and with a slope at real roots too.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.analysis.break_points import KINDS, PATTERNS
from workbench.analysis.frozen import groups_at
from workbench.analysis.sampled import between_samples
from workbench.analysis.setting import Setting
from workbench.analysis.variations import names
from workbench.control.law import CHANNELS, MODAL
from workbench.control.loop import Subject, subject
from workbench.control.loop.affine import LawFunction, LawMatrices, Stacked
from workbench.lti.delay import pade

Rows = tuple[np.ndarray, np.ndarray]  # values (k,), derivatives (k, 17)

REFERENCE = 5.0  # ω0 [rad/s] below which a root counts by its size, not by its angle
WORST = 3  # roots of a loop that get a row
CRESTS = 3  # of |S − ½| over frequency that get a row, for each point
BAND = (0.02, 2e3)  # [rad/s]
GRID = np.geomspace(*BAND, 180)
FACTORS = {"mass": "mass", "force": "current_force"}  # word of a variation to the factor of `Setting.elsewhere`
PADE = 3  # order of the fraction that stands for a dead time


def point_names(setting: Setting) -> tuple[str, ...]:
    """Names of the break points of a setting."""
    return tuple(Reserve(setting).points)


def damping_rows(loop: Stacked, K: LawMatrices, damping: float, decay: float = 0.0) -> Rows:
    """The roots of a loop that miss, or nearly miss, a damping ratio and a decay rate [1/s]: the worst ones."""

    def room(values: np.ndarray) -> np.ndarray:
        size = np.abs(values)
        return (-values.real - damping * size - decay) / np.sqrt(size**2 + REFERENCE**2)

    values, slopes = loop.roots(K, lambda values: np.argsort(room(values))[:WORST])
    row, size = room(values), np.abs(values)
    along = (values.conj()[:, None] * slopes).real / np.maximum(size, 1e-12)[:, None]  # derivative of |λ|
    scale = np.sqrt(size**2 + REFERENCE**2)
    return row, (-slopes.real - damping * along) / scale[:, None] - (row * size / scale**2)[:, None] * along


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
    """A break point: one signal, to which the groups add (S = 1 + Σ), or a common factor, each group for itself."""

    name: str
    parts: tuple[Part, ...]
    apart: bool = False


@dataclass(frozen=True, slots=True)
class Law:
    """Which law closes a loop: of which group of motion, at its modal signals or not, sampled [s] or not."""

    group: str
    sample_time: float | None = None
    modal: bool = False


Loops = tuple[tuple[Law, Stacked], ...]


class Reserve:
    """The loops of a setting whose rows steer: made once, evaluated at any θ."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting
        self.groups = tuple(GroupLoops.of(setting, s) for s in setting.subjects)
        self.points: dict[str, Point] = {p.name: p for p in self._points()}
        self._subjects = {s.name: s for s in setting.subjects}
        self._laws: dict[Law, LawFunction] = {}
        self._loops: dict[tuple, Loops] = {}
        self.variations = names(setting)

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

    def varied(self, name: str) -> Loops:
        """The loops of a variation, by its name."""
        return self._kept(("varied", name), lambda: self._varied(name))

    def _varied(self, name: str) -> Loops:
        word, _, rest = name.partition(":")
        law = self.setting.law
        if word == "scale":
            kind, _, factor = rest.partition(":")
            scale = np.where(law.of_kinds(KINDS[kind]), float(factor), 1.0)
            used = [g for g in self.groups if len(g.read(KINDS[kind]))]
            return tuple((Law(g.subject.name), g.loop.with_sensors(name, scale)) for g in used)
        if word in FACTORS and self.setting.elsewhere is not None:
            there = self.setting.elsewhere({FACTORS[word]: float(rest)})
            return tuple((Law(s.name), Stacked.of(s, name)) for s in there.subjects)
        whole = Stacked.of(self._subject("all"), name)
        if word == "lost":
            kept = np.array([float(c != f"command_{rest}") for c in law.commands])
            return ((Law("all"), whole.with_commands(name, kept)),)
        return ((Law("all"), whole.with_sensors(name, np.array([float(s != rest) for s in law.sensors]))),)

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
            names = groups_at(self.setting, sway)
            return tuple((Law(n), Stacked.of(subject(found[0], self.setting.law, n))) for n in names)

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
            return ((Law("all"), self._late_one(point, dead_time)),)

        return self._kept(("late", point, dead_time), make)

    def _late_one(self, point: str, dead_time: float) -> Stacked:
        """A dead time at one command or one sensor, where the groups meet."""
        kind, _, name = point.partition(":")
        whole, law = Stacked.of(self._subject("all"), point), self.setting.law
        at_sensors = kind == "sensor"
        names = law.sensors if at_sensors else tuple(c.removeprefix("command_") for c in law.commands)
        one = np.eye(len(names))[[names.index(name)]]
        return with_dead_time(whole, Part(0, one, one.T, at_sensors=at_sensors), dead_time, point)

    def scaled(self, point: str, factor: float) -> Loops:
        """The loops with a factor at a break point."""

        def on(every: Sequence[str], name: str) -> np.ndarray:
            return np.where(np.array(every) == name, factor, 1.0)

        def make() -> Loops:
            kind, _, name = point.partition(":")
            law = self.setting.law
            if kind == "kind":
                return self._varied(f"scale:{name}:{factor!r}")
            found: list[tuple[Law, Stacked]] = []
            for g in self.groups:
                patterns = PATTERNS.get(g.subject.name, g.subject.commands)
                if kind == "modal" and name in g.modal:
                    found.append(
                        (Law(g.subject.name, modal=True), g.modal_loop.with_commands(point, on(g.modal, name)))
                    )
                elif kind == "pattern" and name in patterns:
                    found.append((Law(g.subject.name), g.loop.with_commands(point, on(patterns, name))))
                elif point == "currents:uniform":
                    found.append((Law(g.subject.name), g.loop.with_commands(point, np.full(g.loop.commands, factor))))
            if found:
                return tuple(found)
            whole = Stacked.of(self._subject("all"), point)
            if kind == "sensor":
                return ((Law("all"), whole.with_sensors(point, on(law.sensors, name))),)
            return ((Law("all"), whole.with_commands(point, on(law.commands, f"command_{name}"))),)

        return self._kept(("scaled", point, factor), make)

    def _points(self) -> list[Point]:
        law, found = self.setting.law, []
        for k, name in enumerate(law.commands):
            each = [group.subject.patterns[[k]] for group in self.groups]
            parts = tuple(Part(g, one, one.T) for g, one in enumerate(each))
            found.append(Point(f"current:{name.removeprefix('command_')}", parts))
        uniform = []
        for g, group in enumerate(self.groups):
            each = np.eye(group.loop.commands)
            names = PATTERNS.get(group.subject.name, group.subject.commands)[: len(each)]
            found += [Point(f"pattern:{n}", (Part(g, each[[k]], each[:, [k]]),)) for k, n in enumerate(names)]
            uniform.append(Part(g, each, each))
        found.append(Point("currents:uniform", tuple(uniform), apart=True))
        for k, name in enumerate(law.sensors):
            one = np.eye(len(law.sensors))[[k]]
            parts = tuple(Part(g, one, one.T, at_sensors=True) for g in range(len(self.groups)))
            found.append(Point(f"sensor:{name}", parts))
        for name, kinds in KINDS.items():
            seen = [(g, group.read(kinds)) for g, group in enumerate(self.groups)]
            parts = tuple(Part(g, R, np.linalg.pinv(R), at_sensors=True) for g, R in seen if len(R))
            if parts:
                found.append(Point(f"kind:{name}", parts, apart=True))
        for g, group in enumerate(self.groups):
            for k, name in enumerate(group.modal):
                one = np.eye(len(group.modal))[[k]]
                found.append(Point(f"modal:{name}", (Part(g, one, one.T, modal=True),)))
        return found

    def evaluated(self, theta: np.ndarray, omega: np.ndarray = GRID) -> "ReserveAt":
        """Everything at one θ."""
        return ReserveAt(self, theta, omega)


class ReserveAt:
    """The break points at one θ on one grid of frequencies."""

    def __init__(self, whole: Reserve, theta: np.ndarray, omega: np.ndarray) -> None:
        self.whole, self.theta, self.omega = whole, np.asarray(theta, float), omega
        self._matrices: dict[Law, LawMatrices] = {}
        self.K = [
            (self.matrices(Law(g.subject.name)), self.matrices(Law(g.subject.name, modal=True))) for g in whole.groups
        ]
        self.M = [
            (g.loop.closed(K[0], omega), g.modal_loop.closed(K[1], omega))
            for g, K in zip(whole.groups, self.K, strict=True)
        ]

    def matrices(self, law: Law) -> LawMatrices:
        """A law's matrices and their derivatives, computed once."""
        if law not in self._matrices:
            self._matrices[law] = self.whole.law(law)(self.theta)
        return self._matrices[law]

    def damping(self, loops: Loops, damping: float, decay: float = 0.0) -> Rows:
        """Rows of a damping ratio and a decay rate [1/s] that every root of the loops keeps."""
        found = [damping_rows(loop, self.matrices(law), damping, decay) for law, loop in loops]
        return np.concatenate([v for v, _ in found]), np.vstack([d for _, d in found])

    def peak(self, loops: Loops, limit: float) -> Rows:
        """Rows of σ_max(S) at the commands of the loops, at its highest crests."""
        found = [_peak_rows(loop, self.matrices(law), limit) for law, loop in loops]
        return np.concatenate([v for v, _ in found]), np.vstack([d for _, d in found])

    def rows(self, name: str, alpha: float) -> Rows:
        """Rows of a balanced disk margin α at a point: 1 − α |S − ½| at the highest crests of every locus."""
        point = self.whole.points[name]
        if not point.apart:
            return self._crests(*self._scalar(point), alpha)
        values, slopes = zip(*(self._crests(*self._largest(part), alpha) for part in point.parts), strict=True)
        return np.concatenate(values), np.vstack(slopes)

    def _loop(self, part: Part) -> tuple[LawMatrices, np.ndarray, int]:
        """The law's matrices, the closed map, and how many signals of the kind there are."""
        group = self.whole.groups[part.group]
        loop = group.modal_loop if part.modal else group.loop
        K, M = self.K[part.group][part.modal], self.M[part.group][part.modal]
        return K, M, loop.sensors if part.at_sensors else loop.commands

    def _beyond(self, part: Part) -> np.ndarray:
        """(k, r, r) S − I in the part's directions."""
        K, M, size = self._loop(part)
        if part.at_sensors:  # S = I + M K
            return (part.left @ M[:, :size, :]) @ (K.value[:, :size] @ part.right)
        return (part.left @ K.value[:size, :]) @ (M[:, :, :size] @ part.right)  # S = I + K M

    def _slope(self, part: Part, at: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """(17,) complex: y' dS x at frequency number `at`, of S in the part's directions."""
        K, M, size = self._loop(part)
        M, into, out = M[at], part.right @ x, y @ part.left
        if part.at_sensors:  # dS = M dK S
            row, column = out @ M[:size, :], M @ (K.value[:, :size] @ into)
            column[:size] += into
        else:  # dS = S dK M
            row, column = out @ (K.value[:size, :] @ M), M[:, :size] @ into
            row[:size] += out
        return (K.slope @ column) @ row

    def _scalar(self, point: Point):
        S = 1 + sum(self._beyond(part)[:, 0, 0] for part in point.parts)
        one = np.ones(1)

        def slope(at: int) -> np.ndarray:
            return sum(self._slope(part, at, one, one) for part in point.parts)

        return S - 0.5, slope

    def _largest(self, part: Part):
        beyond = self._beyond(part)
        values, right = np.linalg.eig(beyond + 0.5 * np.eye(beyond.shape[1]))
        which = np.abs(values).argmax(axis=1)
        picked = np.take_along_axis(values, which[:, None], 1)[:, 0]

        def slope(at: int) -> np.ndarray:
            V = right[at]
            y = np.linalg.inv(V)[which[at]]
            return self._slope(part, at, V[:, which[at]], y)

        return picked, slope

    def _crests(self, z: np.ndarray, slope, alpha: float) -> Rows:
        size = np.abs(z)
        values, slopes = [], []
        for at in _highest(size):
            values.append(1 - alpha * size[at])
            slopes.append(-alpha * (z[at].conj() * slope(at)).real / size[at])
        return np.array(values), np.array(slopes)


def _highest(size: np.ndarray) -> np.ndarray:
    """Places of the highest crests, `CRESTS` of them; the highest again where there are fewer."""
    crest = np.flatnonzero(np.r_[True, size[1:] >= size[:-1]] & np.r_[size[:-1] >= size[1:], True])
    crest = crest[np.argsort(-size[crest])][:CRESTS]
    return np.r_[crest, np.full(CRESTS - len(crest), crest[0])]


def _peak_rows(loop: Stacked, K: LawMatrices, limit: float) -> Rows:
    """1 − σ_max(S)/limit at the commands, at the highest crests over the frequencies up to half the sampling rate."""
    top = BAND[1] if loop.sample_time is None else min(BAND[1], np.pi / loop.sample_time)
    omega = np.geomspace(BAND[0], top, len(GRID))
    M, c = loop.closed(K, omega), loop.commands
    left, sizes, right = np.linalg.svd(np.eye(c) + K.value[:c] @ M[:, :, :c])
    values, slopes = [], []
    for at in _highest(sizes[:, 0]):
        u, v = left[at][:, 0].conj(), right[at][0].conj()
        row, column = u @ (K.value[:c] @ M[at]), M[at][:, :c] @ v  # dS = S dK M
        row[:c] += u
        values.append(1 - sizes[at, 0] / limit)
        slopes.append(-((K.slope @ column) @ row).real / limit)
    return np.array(values), np.array(slopes)


def delayed(point: Point, groups: Sequence[GroupLoops], dead_time: float) -> list[tuple[Stacked, bool]]:
    """Loops with a dead time [s] at a point, one a part: (loop, whether its commands are the modal signals)."""
    found = []
    for part in point.parts:
        group = groups[part.group]
        loop = group.modal_loop if part.modal else group.loop
        found.append((with_dead_time(loop, part, dead_time, point.name), part.modal))
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
