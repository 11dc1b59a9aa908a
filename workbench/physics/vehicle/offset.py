"""The vehicle frozen at a gap offset: level, on the current that carries its weight, with the slopes there.

    exact corner law, (heave, sway) --common current--> slopes of every set there --> Plant

All vertical gaps change by heave, the lateral gaps by ± sway (right +, left −). The exact law keeps the lift ratio of
the nominal gap; a motor that steers keeps its slopes.  Source: guide, Definitions: Frozen loop at a gap offset.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from workbench.constants import GRAVITY
from workbench.errors import InputError
from workbench.lti import Plant
from workbench.physics.forces.corner import CornerLaw
from workbench.physics.forces.energy import CoilSet
from workbench.physics.vehicle.body import held_by_moment, inertia, tangent_at
from workbench.physics.vehicle.drive import with_motor
from workbench.physics.vehicle.linear import assembled
from workbench.physics.vehicle.operating import joined
from workbench.physics.vehicle.parameters import Vehicle

STEPS = 8  # for the common current: two find it, since lift is a parabola in it
SETTLED = 1e-10  # of the weight: rounding of the forces is a hundredth of it
ALIKE = 1e-3  # relative: printed coefficients that are those of the coils to their digits


@dataclass(frozen=True, slots=True)
class GapOffsets:
    """What a vehicle is at other gaps.

    vehicle : in level flight;  coils, gap, gap_lateral [m], current [A] : of one coil set there
    exact : its law, where the vehicle flies on coils; else the law of these coils whose lift is the printed one
    """

    vehicle: Vehicle
    coils: CoilSet
    gap: float
    gap_lateral: float
    current: float
    exact: CornerLaw | None = None

    @property
    def law(self) -> CornerLaw | None:
        """The exact law; None where the printed coefficients are not those of the coils."""
        return self.exact or _law(self)

    def plant(self, heave: float, sway: float) -> tuple[Plant, float] | None:
        """The plant at offsets [m] and the common current ratio; None where no current carries the weight clear."""
        law = self.law
        if law is None:
            return None
        vehicle, pose = replace(self.vehicle, force_law=law), np.array([-heave, 0.0, sway, 0.0, 0.0])
        try:
            found = _carrying(vehicle, pose)
        except InputError:  # a coil would touch
            found = None
        if found is None:
            return None
        alpha, left = found
        currents = np.full(vehicle.count, alpha)
        held = replace(held_by_moment(vehicle), pose=pose, currents=currents, external=-left * inertia(vehicle))
        there = tangent_at(vehicle, pose, currents, external=held.external)
        plant = joined(assembled(held, there.state_space).plant, vehicle)
        return plant if vehicle.drive is None else with_motor(plant, vehicle.drive), alpha


@lru_cache(maxsize=32)
def _law(offsets: GapOffsets) -> CornerLaw | None:
    printed = offsets.vehicle.force_law.tangent(np.zeros((3, 1)), np.zeros(1))
    unit = CornerLaw(
        coils=offsets.coils, gap=offsets.gap, gap_lateral=offsets.gap_lateral, current=offsets.current, lift_ratio=1.0,
        drag_ratio=offsets.vehicle.force_law.drag_ratio,
    )  # fmt: skip
    found = replace(unit, lift_ratio=float(printed[0][0, 0] / unit.tangent(np.zeros((3, 1)), np.zeros(1))[0][0, 0]))
    slopes = found.tangent(np.zeros((3, 1)), np.zeros(1))[1]
    return found if np.abs(slopes - printed[1]).max() <= ALIKE * np.abs(slopes).max() else None


def _carrying(vehicle: Vehicle, pose: np.ndarray) -> tuple[float, np.ndarray] | None:
    """The common current ratio that carries the weight, and the acceleration (5,) left there; None if there is none.

    Lift is a parabola in the current, so two slopes say where it carries; the rest is rounding.
    """
    alpha, before, weight = 0.0, None, vehicle.mass * GRAVITY
    for _ in range(STEPS):
        there = tangent_at(vehicle, pose, np.full(vehicle.count, alpha))
        left, slope = there.acceleration[0], float(there.slopes[5, 10 : 10 + vehicle.count].sum())
        if vehicle.mass * abs(left) <= SETTLED * weight:
            return alpha, there.acceleration
        bend = 0.0 if before is None or alpha == before[0] else (slope - before[1]) / (alpha - before[0]) / 2
        root = slope**2 - 4 * bend * left
        if slope == 0 or root < 0:
            return None
        before = alpha, slope
        alpha -= 2 * left / (slope + np.copysign(np.sqrt(root), slope))
    return None
