"""What every loop of a design bears: each signal broken alone, and all commands or all measurements at once.

    Loop, K --S at all points--> each S_ii: gain up and down, phase, dead time; disk; largest |S_ii|
                                 S at the commands together, at the measurements together: disk; ‖S‖∞

Sampled loops are asked in the w plane, where every crossing is the root of an eigenvalue problem as in continuous time.
With dead times every crossing of |L| through 1 is enclosed; a gain margin is looked for on a grid there, up to a loop
gain of `SMALL`.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.control.structure.block import Controller
from workbench.control.structure.channel import Channel
from workbench.control.structure.loop import Loop
from workbench.errors import InputError
from workbench.goals.margin import Margins
from workbench.lti.bilinear import in_w_plane, unwarped
from workbench.lti.crossing import ScalarResponse
from workbench.lti.delay import LinedSystem
from workbench.lti.grid import seeds
from workbench.lti.margin import ChannelMargin, channel_margin, lags
from workbench.lti.measure import peak
from workbench.lti.norm import Peak
from workbench.lti.peak_ceiling import enclosure
from workbench.lti.peak_crossing import crossings, pursued
from workbench.lti.realisation import Realisation
from workbench.machine.threads import one_thread
from workbench.result import Result, Row, figure, plain

SMALL = 1e-3  # loop gain with dead times below which no gain margin is looked for: a factor of a thousand
TURN = 0.1  # [rad] of the dead times from one frequency of the grid to the next
MOST = 100_000  # frequencies of the grid
ASKED = 6.0  # [dB] of the goal that measures disks; any would do


@dataclass(frozen=True, slots=True, kw_only=True)
class Disk:
    """A balanced disk margin between two bounds: the lower one is guaranteed."""

    lower: float
    upper: float


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LoopMargin(Result):
    """What one signal of one model's loop bears, all others closed and unchanged."""

    model: str
    channel: ChannelMargin
    disk: Disk
    peak_sensitivity: Peak

    def to_dict(self) -> dict[str, Any]:
        """One level: model, point, margins (None without limit), disk, peak sensitivity."""
        own = plain(self.channel)
        return {
            "model": self.model, "point": own.pop("channel"), **own, "disk": plain(self.disk),
            "peak_sensitivity": self.peak_sensitivity.upper,
        }  # fmt: skip

    def rows(self) -> list[Row]:
        return [("model", self.model, ""), *self.channel.rows(), ("disk margin", self.disk.lower, "")]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class JointMargin(Result):
    """What several signals of one model's loop bear at the same time, each in its own way."""

    model: str
    what: str
    points: tuple[str, ...]
    disk: Disk
    peak_sensitivity: Peak

    def to_dict(self) -> dict[str, Any]:
        return {
            "model": self.model, "what": self.what, "points": list(self.points), "disk": plain(self.disk),
            "peak_sensitivity": self.peak_sensitivity.upper,
        }  # fmt: skip

    def rows(self) -> list[Row]:
        return [
            ("model", self.model, ""), (f"disk margin, {self.what} together", self.disk.lower, ""),
            ("peak sensitivity", self.peak_sensitivity.upper, ""),
        ]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LoopMargins(Result):
    """Margins at every point of the loops of one design."""

    single: tuple[LoopMargin, ...]
    joint: tuple[JointMargin, ...]

    def to_dict(self) -> dict[str, Any]:
        return {"single": [m.to_dict() for m in self.single], "joint": [m.to_dict() for m in self.joint]}

    def rows(self) -> list[Row]:
        single = [
            (f"{name}, {m.model}", f"{down} … {up}, {phase}°, {delay} ms", "")
            for m in self.single
            for name, down, up, phase, delay in (m.channel.cells(),)
        ]
        return single + [(f"disk margin, {m.what} together, {m.model}", m.disk.lower, "") for m in self.joint]

    def table(self) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
        """Heads and rows of text, one row a point or a group of them."""
        heads = ("point", "model", "gain down", "gain up", "phase [°]", "delay [s]", "disk", "peak S")
        single = [
            (
                m.channel.channel,
                m.model,
                *m.channel.cells()[1:-1],
                figure(m.channel.delay),
                figure(m.disk.lower),
                figure(m.peak_sensitivity.upper),
            )
            for m in self.single
        ]
        blank = ("",) * 4
        return heads, single + [
            (f"{m.what} together", m.model, *blank, figure(m.disk.lower), figure(m.peak_sensitivity.upper))
            for m in self.joint
        ]


def loop_margins(loops: tuple[Loop, ...], K: Controller) -> LoopMargins:
    """Margins of every loop under a controller.

    Parameters
    ----------
    loops : Loop records of one structure, one for each model
    K : Controller
        The structure's, at the values asked about.

    Raises
    ------
    InputError
        If a loop is unstable: its margins mean nothing.
    """
    with one_thread():  # small matrices: more threads only wait for each other
        return _of(loops, K)


def _of(loops: tuple[Loop, ...], K: Controller) -> LoopMargins:
    single, joint = [], []
    for loop in loops:
        if loop.unstable_poles(K):
            raise InputError(
                f"margins are of a stable loop; that of {loop.name!r} is unstable at these values. Stabilise it first."
            )
        points = loop.analysis_points
        alone = _margins(loop, K, points)
        single += [
            LoopMargin(model=loop.name, channel=found, disk=_disk(loop, K, (p,)), peak_sensitivity=_peak(loop, K, (p,)))
            for p, found in zip(points, alone, strict=True)
        ]
        commands = tuple(p for p in points if p in loop.model.inputs)
        measured = tuple(p for p in points if p in loop.model.outputs)
        joint += [
            JointMargin(
                model=loop.name, what=what, points=some, disk=_disk(loop, K, some),
                peak_sensitivity=_peak(loop, K, some),
            )
            for what, some in (("commands", commands), ("measurements", measured))
            if len(some) > 1
        ]  # fmt: skip
    return LoopMargins(single=tuple(single), joint=tuple(joint))


def lined(channel: Channel, K: Controller) -> LinedSystem:
    """A channel under K as a lined system: states first, then lines."""
    A, B, C, D = channel.lined_system(K)
    late = channel.late(K)
    order = np.argsort(late > 0, kind="stable")
    return LinedSystem(A[np.ix_(order, order)], B[order], C[:, order], D, late[late > 0], channel.sample_time)


def _disk(loop: Loop, K: Controller, points: tuple[str, ...]) -> Disk:
    goal = Margins(points=points, gain_db=ASKED)
    value = goal.bind(loop).exact(K)
    upper = math.inf if value.value == 0 else goal.alpha / value.value
    return Disk(lower=math.inf if value.upper == 0 else goal.alpha / value.upper, upper=upper)


def _peak(loop: Loop, K: Controller, points: tuple[str, ...]) -> Peak:
    return peak(lined(loop.sensitivity(points), K))


def _margins(loop: Loop, K: Controller, points: tuple[str, ...]) -> list[ChannelMargin]:
    """Of each point alone."""
    channel = loop.sensitivity(points)
    if loop.model.delayed:
        return [_delayed(loop, K, p) for p in points]
    S, h = channel.system(K), loop.sample_time
    if h is None:
        return [channel_margin(*S, channel=i, name=p) for i, p in enumerate(points)]
    mapped = in_w_plane(S, h)
    if mapped is None:
        raise InputError(f"the sampled loop of {loop.name!r} must have no pole at z = −1; it has. Stabilise it first.")
    return [_sampled(mapped, h, i, p) for i, p in enumerate(points)]


def _sampled(S: Realisation, h: float, i: int, point: str) -> ChannelMargin:
    """In the w plane gains and phases are those of the sampled loop; its frequencies are not, nor is dead time."""
    found = channel_margin(*S, channel=i, name=point)
    one = slice(i, i + 1)
    T = ScalarResponse(S.A, S.B[:, one], -S.C[one], 1 - S.D[one, one])

    def true(w: float | None) -> float | None:
        return None if w is None else float(unwarped(w, h))

    late = [(lag / float(unwarped(w, h)), w) for lag, w in lags(T) if w > 0]
    if abs(T(np.array([math.inf]))[0] / (1 - T(np.array([math.inf]))[0])) >= 1:  # still at the Nyquist frequency
        late.append((float(np.angle(-(_loop(T, math.inf)))) % (2 * math.pi) * h / math.pi, math.inf))
    delay = min(late, default=(math.inf, None))
    return ChannelMargin(
        channel=point, gain_up=found.gain_up, gain_up_frequency=true(found.gain_up_frequency),
        gain_down=found.gain_down, gain_down_frequency=true(found.gain_down_frequency),
        phase=found.phase, phase_frequency=true(found.phase_frequency),
        delay=delay[0], delay_frequency=true(delay[1]),
    )  # fmt: skip


def _loop(T: ScalarResponse, omega: float) -> complex:
    value = complex(T(np.array([omega]))[0])
    return value / (1 - value)


def _delayed(loop: Loop, K: Controller, point: str) -> ChannelMargin:
    """Phase and dead time from every crossing of |L| through 1, gains from a grid."""
    channel = loop.sensitivity((point,))
    system = channel.lined_system(K)

    def S(omega: np.ndarray) -> np.ndarray:
        return channel.response(K, omega)[:, 0, 0]

    poles = channel.poles(K)
    grid = seeds(poles, np.zeros(0), (0.0, math.inf))
    found = crossings(enclosure(system, channel.late(K)), grid[np.isfinite(grid)])
    if found.reason:
        raise InputError(f"the margins at {point!r} of {loop.name!r} must be decided; they are not: {found.reason}")
    angles: list[tuple[float, float]] = []
    if len(found.intervals):
        omega = pursued(lambda at: 0.5 - S(at).real, found.intervals)
        L = 1 / S(omega) - 1
        angles = list(zip((np.angle(-L) % (2 * math.pi)).tolist(), omega.tolist(), strict=True))
    direct = float(system.D[0, 0])
    gains = _factors(S, _grid(S, grid[np.isfinite(grid)], float(loop.model.lined().dead_times.sum())))
    return ChannelMargin.of(point, gains, angles, strong=direct <= 0.5)


def _grid(S, start: np.ndarray, longest: float) -> np.ndarray:
    """Frequencies so close that dead times turn little from one to the next, until the loop gain stays small."""
    small = np.flatnonzero(np.abs(1 / S(start[start > 0]) - 1) > SMALL)
    top = float(start[start > 0][min(small[-1] + 1, len(start) - 2)]) if len(small) else float(start[-1])
    count = min(math.ceil(top * longest / TURN), MOST)
    return np.unique(np.r_[start, np.geomspace(start[start > 0][0], top, 1000), np.linspace(0.0, top, count + 2)])


def _factors(S, grid: np.ndarray) -> list[tuple[float, float]]:
    """Factors −1/L at which L is real, with their frequencies; at rest too."""
    L = 1 / S(grid[grid > 0]) - 1
    grid = grid[grid > 0]
    sign = L.imag > 0
    ends = np.flatnonzero(sign[1:] != sign[:-1])
    low, high, above = grid[ends], grid[ends + 1], sign[ends]
    for _ in range(60):
        middle = (low + high) / 2
        stays = ((1 / S(middle) - 1).imag > 0) == above if len(middle) else np.zeros(0, bool)
        low, high = np.where(stays, middle, low), np.where(stays, high, middle)
    omega = np.r_[0.0, (low + high) / 2]
    with np.errstate(all="ignore"):
        real = (1 / S(omega) - 1).real if len(omega) else np.zeros(0)
        return [(float(-1 / x), float(w)) for x, w in zip(real, omega, strict=True) if x and math.isfinite(x)]
