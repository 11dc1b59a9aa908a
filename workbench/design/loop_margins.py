"""What every loop of a design bears: each signal broken alone, and all commands or all measurements at once.

Loop, K --S at all points--> each S_ii: gain up and down, phase, dead time; disk; largest |S_ii|
                             S at the commands together, at the measurements together: disk; ‖S‖∞
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from workbench.analysis.loop_channel import channel_margins, lined
from workbench.analysis.plant_reserves import points_of_loop
from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.errors import InputError
from workbench.goals.margin import Margins
from workbench.lti.break_point import BreakPoint, joint_point
from workbench.lti.margin import ChannelMargin
from workbench.lti.measure import peak
from workbench.lti.norm import Peak
from workbench.machine.threads import one_thread
from workbench.result import Result, Row, figure, plain

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
    """Margins at every point of the loops of one design.

    single, joint : of every signal that can be opened, and of all commands or measurements, with peaks of S
    points, together : break points, one at a time and several at once; of a vehicle those of its motions, kinds of
        sensors and modal signals too
    """

    single: tuple[LoopMargin, ...]
    joint: tuple[JointMargin, ...]
    points: tuple[BreakPoint, ...] = ()
    together: tuple[BreakPoint, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        return {
            "single": [m.to_dict() for m in self.single], "joint": [m.to_dict() for m in self.joint],
            "break_points": [b.to_dict() for b in self.points], "together": [b.to_dict() for b in self.together],
        }  # fmt: skip

    def rows(self) -> list[Row]:
        single: list[Row] = [
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
        alone = channel_margins(loop, K, points)
        single += [
            LoopMargin(model=loop.name, channel=found, disk=_disk(loop, K, (p,)), peak_sensitivity=_peak(loop, K, (p,)))
            for p, found in zip(points, alone, strict=True)
        ]
        joint += [
            JointMargin(
                model=loop.name, what=what, points=some, disk=_disk(loop, K, some),
                peak_sensitivity=_peak(loop, K, some),
            )
            for what, some in (("commands", loop.commands), ("measurements", loop.sensors))
            if len(some) > 1
        ]  # fmt: skip
    points, together = _break_points(loops, single, joint)
    return LoopMargins(single=tuple(single), joint=tuple(joint), points=points, together=together)


def _break_points(
    loops: tuple[Loop, ...], single: Sequence[LoopMargin], joint: Sequence[JointMargin]
) -> tuple[tuple[BreakPoint, ...], tuple[BreakPoint, ...]]:
    """The same as break points: one signal at a time, and several at once."""
    names = {signals: at.name for loop in loops for at, signals in points_of_loop(loop).items()}
    several = len(loops) > 1
    alone = (
        BreakPoint(
            point=names[(m.channel.channel,)], gain_up=m.channel.gain_up, gain_down=m.channel.gain_down,
            phase=m.channel.phase, delay=m.channel.delay, disk=m.disk.lower, model=m.model if several else "",
        )
        for m in single
    )  # fmt: skip
    at_once = (joint_point(names[j.points], j.disk.lower, model=j.model if several else "") for j in joint)
    return tuple(alone), tuple(at_once)


def _disk(loop: Loop, K: Controller, points: tuple[str, ...]) -> Disk:
    goal = Margins(points=points, gain_db=ASKED)
    value = goal.bind(loop).exact(K)
    upper = math.inf if value.value == 0 else goal.alpha / value.value
    return Disk(lower=math.inf if value.upper == 0 else goal.alpha / value.upper, upper=upper)


def _peak(loop: Loop, K: Controller, points: tuple[str, ...]) -> Peak:
    return peak(lined(loop.sensitivity(points), K))
