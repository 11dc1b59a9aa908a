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

STEPS = 30  # of Newton's method for the common current: lift is a parabola in it
SETTLED = 1e-12  # of the weight
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
            alpha = _carrying(vehicle, pose)
        except InputError:  # a coil would touch
            alpha = None
        if alpha is None:
            return None
        currents = np.full(vehicle.count, alpha)
        left = tangent_at(vehicle, pose, currents).acceleration
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


def _carrying(vehicle: Vehicle, pose: np.ndarray) -> float | None:
    """The common current ratio at which nothing is left of the vertical force; None if Newton's method finds none."""
    alpha, left, weight = 0.0, np.inf, vehicle.mass * GRAVITY
    for _ in range(STEPS):
        there = tangent_at(vehicle, pose, np.full(vehicle.count, alpha))
        left = there.acceleration[0] * vehicle.mass
        slope = float(there.slopes[5, 10 : 10 + vehicle.count].sum()) * vehicle.mass
        if abs(left) <= SETTLED * weight or slope == 0:
            break
        alpha -= left / slope
    return alpha if abs(left) <= 1e3 * SETTLED * weight else None
