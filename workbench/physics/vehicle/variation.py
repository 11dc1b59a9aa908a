"""The same vehicle with other numbers: mass, inertias, force coefficients, for robustness studies."""

from dataclasses import dataclass, replace

import numpy as np

from workbench.errors import InputError
from workbench.physics.forces.law import ForceLaw, Tangent
from workbench.physics.vehicle.parameters import Vehicle


@dataclass(frozen=True, slots=True)
class ScaledLaw:
    """A force law whose answer to currents and to gap changes is scaled.

    current_force multiplies what a current does, gap_force what gap changes and roll do; the nominal force stays.
    """

    law: ForceLaw
    current_force: float = 1.0
    gap_force: float = 1.0

    @property
    def drag_ratio(self) -> float:
        """K_1 of the law underneath."""
        return self.law.drag_ratio

    def forces(self, gap_change, gap_lateral_change, roll, alpha):
        """F_L, F_G [N] and L [N m] at scaled deviations; see ForceLaw."""
        g = self.gap_force
        return self.law.forces(g * gap_change, g * gap_lateral_change, g * roll, self.current_force * alpha)

    @property
    def affine(self) -> bool:
        """As the law underneath."""
        return self.law.affine

    def tangent(self, deviation: np.ndarray, alpha: np.ndarray) -> Tangent:
        """Forces (3, n) and slopes (3, 4n); see ForceLaw."""
        scale = np.array([self.gap_force] * 3 + [self.current_force])
        values, slopes = self.law.tangent(self.gap_force * deviation, self.current_force * np.asarray(alpha))
        return values, slopes * np.tile(scale, deviation.shape[1])


def varied(
    vehicle: Vehicle,
    *,
    mass: float = 1.0,
    roll_inertia: float = 1.0,
    pitch_inertia: float = 1.0,
    yaw_inertia: float = 1.0,
    current_force: float = 1.0,
    gap_force: float = 1.0,
) -> Vehicle:
    """A vehicle with each named quantity multiplied by its factor; the pose stays nominal."""
    factors = (mass, roll_inertia, pitch_inertia, yaw_inertia, current_force, gap_force)
    if not all(f > 0 for f in factors):
        raise InputError(f"factors of a variation must be positive; got {factors}. Give 1.15 for 15 % more.")
    law = vehicle.force_law
    if (current_force, gap_force) != (1.0, 1.0):
        law = ScaledLaw(law, current_force, gap_force)
    return replace(
        vehicle, mass=mass * vehicle.mass, roll_inertia=roll_inertia * vehicle.roll_inertia,
        pitch_inertia=pitch_inertia * vehicle.pitch_inertia, yaw_inertia=yaw_inertia * vehicle.yaw_inertia,
        force_law=law,
    )  # fmt: skip
