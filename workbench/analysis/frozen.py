"""The loop frozen where the vehicle rides high, low or to one side: the slopes there, the law unchanged.

Setting, (heave, sway) --physics.vehicle.offset--> plant there --law--> damping and decay

Source: guide, Definitions: Frozen loop at a gap offset.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from workbench.analysis.setting import Setting
from workbench.analysis.variations import damping_of
from workbench.control import Gains
from workbench.control.loop import GROUPS, subject
from workbench.result import Result, Row

HEAVE = tuple(round(0.04 * k, 2) for k in range(-3, 4))  # [m]
SWAY = (-0.1, 0.0, 0.1)  # [m]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Frozen(Result):
    """One pose: gap offsets [m], current ratio that carries the weight there; None where the pose cannot be flown.

    damping [1], decay [1/s] : least of all roots; a real unstable root counts −1
    """

    heave: float
    sway: float
    current: float | None
    damping: float | None
    decay: float | None

    def to_dict(self) -> dict[str, float | None]:
        """In the command line's keys."""
        return {"heave_m": self.heave, "sway_m": self.sway, "damping": self.damping, "decay": self.decay}

    def rows(self) -> list[Row]:
        return [
            ("heave", self.heave, "m"),
            ("sway", self.sway, "m"),
            ("current that carries the weight", self.current, "of main coil"),
            ("smallest damping ratio", self.damping, "1"),
            ("decay rate", self.decay, "1/s"),
        ]


def frozen(
    setting: Setting, gains: Gains, *, heave: Sequence[float] = HEAVE, sway: Sequence[float] = SWAY
) -> tuple[Frozen, ...]:
    """The loop at every pair of offsets [m]; nothing where the setting does not know its coils.

    A pose in which a coil would touch, or whose weight no current carries, has no numbers.
    """
    if setting.offsets is None or setting.offsets.law is None:
        return ()
    return tuple(_at(setting, gains, float(h), float(y)) for h, y in product(heave, sway) if groups_at(setting, y))


def groups_at(setting: Setting, sway: float) -> tuple[str, ...]:
    """The groups of motion of a loop that rides to one side: they meet there; one looked at alone has no such loop."""
    if sway == 0 or "all" in setting.groups:
        return setting.groups
    return ("all",) if set(setting.groups) >= set(GROUPS) else ()


def _at(setting: Setting, gains: Gains, heave: float, sway: float) -> Frozen:
    found = setting.offsets.plant(heave, sway) if setting.offsets else None
    if found is None:
        return Frozen(heave=heave, sway=sway, current=None, damping=None, decay=None)
    plant, alpha = found
    closed = [subject(plant, setting.law, name).close(gains) for name in groups_at(setting, sway)]
    poles = np.concatenate([loop.poles() for loop in closed])
    return Frozen(heave=heave, sway=sway, current=alpha, damping=damping_of(poles), decay=float(-poles.real.max()))
