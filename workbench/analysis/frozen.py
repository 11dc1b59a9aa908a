"""The loop frozen where the vehicle rides high, low or to one side: the slopes there, the law unchanged.

    vehicle, exact law of its coils, (heave, sway) --common current that carries the weight--> slopes --> closed loop

All vertical gaps change by heave, the lateral gaps by ± sway (right +, left −); the attitude stays level. The exact
corner law keeps the lift ratio of the nominal gap.  Source: DEFINITIONS, Frozen loop at a gap offset.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from workbench.analysis.setting import Setting
from workbench.analysis.variations import damping_of
from workbench.constants import GRAVITY
from workbench.control import Gains
from workbench.control.loop import GROUPS, subject
from workbench.errors import InputError
from workbench.physics.forces.corner import CornerLaw
from workbench.physics.vehicle import Vehicle
from workbench.physics.vehicle.body import held_by_moment, inertia, tangent_at
from workbench.physics.vehicle.linear import assembled
from workbench.physics.vehicle.operating import joined
from workbench.result import Result, Row

HEAVE = tuple(round(0.04 * k, 2) for k in range(-3, 4))  # [m]
SWAY = (-0.1, 0.0, 0.1)  # [m]
STEPS = 30  # of Newton's method for the common current: lift is a parabola in it
SETTLED = 1e-12  # of the weight


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
    setting: Setting,
    vehicle: Vehicle,
    exact: CornerLaw,
    gains: Gains,
    *,
    heave: Sequence[float] = HEAVE,
    sway: Sequence[float] = SWAY,
) -> tuple[Frozen, ...]:
    """The loop at every pair of offsets.

    Parameters
    ----------
    setting : whose law closes the loop;  vehicle : whose masses and places count
    exact : force law of one coil set, whose lift ratio is held
    heave, sway : offsets [m]

    A pose in which a coil would touch, or whose weight no current carries, has no numbers.
    """
    flown = replace(vehicle, force_law=exact)
    return tuple(_at(setting, flown, gains, float(h), float(y)) for h, y in product(heave, sway))


def _at(setting: Setting, vehicle: Vehicle, gains: Gains, heave: float, sway: float) -> Frozen:
    pose = np.array([-heave, 0.0, sway, 0.0, 0.0])
    try:
        alpha = _carrying(vehicle, pose)
    except InputError:
        alpha = None
    if alpha is None:
        return Frozen(heave=heave, sway=sway, current=None, damping=None, decay=None)
    currents = np.full(vehicle.count, alpha)
    there = tangent_at(vehicle, pose, currents)
    held = replace(
        held_by_moment(vehicle), pose=pose, currents=currents, external=-there.acceleration * inertia(vehicle)
    )
    there = tangent_at(vehicle, pose, currents, external=held.external)
    plant = joined(assembled(held, there.state_space).plant, vehicle)
    level = sway == 0 and set(setting.groups) == set(GROUPS)
    groups = setting.groups if level or len(setting.groups) == 1 else ("all",)
    poles = np.concatenate([subject(plant, setting.law, name).close(gains).poles() for name in groups])
    return Frozen(heave=heave, sway=sway, current=alpha, damping=damping_of(poles), decay=float(-poles.real.max()))


def _carrying(vehicle: Vehicle, pose: np.ndarray) -> float | None:
    """The common current ratio at which nothing is left of the vertical force; None if Newton's method finds none."""
    alpha, weight = 0.0, vehicle.mass * GRAVITY
    for _ in range(STEPS):
        there = tangent_at(vehicle, pose, np.full(vehicle.count, alpha))
        left = there.acceleration[0] * vehicle.mass
        if abs(left) <= SETTLED * weight:
            return alpha
        slope = float(there.slopes[5, 10 : 10 + vehicle.count].sum()) * vehicle.mass
        if slope == 0:
            return None
        alpha -= left / slope
    return alpha if abs(left) <= 1e-9 * weight else None
