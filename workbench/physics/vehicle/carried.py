"""Whether a force law carries the vehicle it is given to: what is left of an equilibrium at the nominal pose.

    residual of forces and moments at rest in the nominal pose --against weight and lever arms--> accepted or refused

A trim by constant help would hide any residual. The report's printed geometry leaves a pitch moment of 0.039 of weight
times length; a law of another vehicle, or in another unit, leaves a force.
"""

import numpy as np

from workbench.constants import GRAVITY
from workbench.errors import InputError
from workbench.physics.vehicle.body import held_by_moment
from workbench.physics.vehicle.parameters import Vehicle
from workbench.physics.vehicle.trim import Trim

FORCE_LEFT = 1e-3  # of the weight: coefficients are printed to four or five digits
MOMENT_LEFT = 0.1  # of weight × length, of weight × track for roll: more than ballast and thrust line balance
AXES = ("a force down", "a pitch moment", "a force to the right", "a roll moment", "a yaw moment")


def largest_residual(vehicle: Vehicle) -> np.ndarray:
    """(5,) residual a force law may leave at the nominal pose [N, N m], in the order of COORDINATES."""
    weight = vehicle.mass * GRAVITY
    length, track = np.ptp(np.array(vehicle.positions, float), axis=0)
    arms = MOMENT_LEFT * np.array([length, track, length])
    return weight * np.array([FORCE_LEFT, arms[0], FORCE_LEFT, arms[1], arms[2]])


def check_carried(vehicle: Vehicle, trim: Trim | None = None) -> None:
    """Refuses a vehicle whose forces at the nominal pose do not carry it, but for a moment that ballast can balance.

    trim : its `held_by_moment`, where that is known already
    """
    residual, allowed = (trim or held_by_moment(vehicle)).residual, largest_residual(vehicle)
    missed = np.flatnonzero(~(np.abs(residual) <= allowed))  # not a number is not carried either
    if missed.size:
        k = missed[0]
        unit = "N" if k in (0, 2) else "N m"
        raise InputError(
            f"the forces of the coil sets must carry the weight of {vehicle.mass * GRAVITY:.6g} N at the nominal pose; "
            f"{AXES[k]} of {residual[k]:.4g} {unit} is left, and {allowed[k]:.3g} {unit} may be. "
            "Mend the force law, the weight or the places of the coil sets."
        )
