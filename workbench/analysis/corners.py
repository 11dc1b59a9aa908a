"""Vehicles at the corners of a box of changes: every end of every interval with every end of the others.

    ((kind, target, low, high), …) --product--> corners, each a change of every axis --closed--> roots

Plants are made once for each end of what changes the vehicle; sensors and commands only scale the law's signals.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

from workbench.analysis.change import VEHICLE, Change
from workbench.analysis.setting import Setting
from workbench.analysis.variations import changed, check_change, closed
from workbench.control import Gains
from workbench.errors import InputError

MOST = 10  # axes: 1024 corners

Box = tuple[tuple[Change, Change], ...]  # of each axis its two ends


def box_of(intervals: Mapping[str, Sequence[float]]) -> Box:
    """The box of `{"mass": [0.85, 1.15], "scale:vertical": [0.9, 1.1]}`; refuses what is no interval of a change."""
    found = []
    for name, ends in intervals.items():
        if len(ends) != 2 or not ends[0] < ends[1]:
            raise InputError(f"the interval of {name} must be [low, high] with low < high; got {list(ends)!r}.")
        low, high = (Change.named(f"{name}:{float(end)!r}") for end in ends)
        found.append((low, high))
    if not 1 <= len(found) <= MOST:
        raise InputError(f"a box must have 1 to {MOST} intervals; got {len(found)}. Leave out what matters least.")
    return tuple(found)


def intervals_of(box: Box) -> dict[str, list[float]]:
    """What `box_of` takes."""
    return {":".join(p for p in (low.kind, low.target) if p): [low.amount or 0.0, high.amount or 0.0]
            for low, high in box}  # fmt: skip


def check_box(setting: Setting, box: Box) -> None:
    """Refuses changes of what a setting does not have."""
    for low, _ in box:
        check_change(setting, low)


def corners(box: Box) -> tuple[tuple[Change, ...], ...]:
    """Every corner, 2^axes of them."""
    return tuple(product(*box))


class Plants:
    """The settings at corners, one for each of the different vehicles."""

    def __init__(self, setting: Setting) -> None:
        self.setting = setting
        self._made: dict[tuple[Change, ...], Setting] = {}

    def at(self, corner: Sequence[Change]) -> Setting:
        """The setting of a corner's vehicle."""
        own = tuple(c for c in corner if c.on == VEHICLE)
        if own not in self._made:
            self._made[own] = changed(self.setting, *own)
        return self._made[own]


@dataclass(frozen=True, slots=True)
class Corner:
    """Slowest root of one corner: its decay rate [1/s], negative where it grows."""

    changes: tuple[Change, ...]
    decay: float

    @property
    def name(self) -> str:
        """Every change."""
        return ", ".join(c.name for c in self.changes)


def corner_decays(setting: Setting, gains: Gains, box: Box) -> tuple[Corner, ...]:
    """The loop at every corner."""
    plants = Plants(setting)
    return tuple(Corner(c, closed(setting, gains, *c, there=plants.at(c)).decay) for c in corners(box))
