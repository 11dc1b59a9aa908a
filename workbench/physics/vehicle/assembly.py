"""The equations of motion with the coil sets' forces left open, so that each may have a strength of its own.

    equations (of one vehicle)  --forces become inputs-->  Assembly: kinematics, then dynamics
    law, deviation of one set   --tangent-->  values and slopes        law  --law_function-->  compiled, mappable

The exact law of a coil set is ten thousand operations long. Kept apart from the rigid body it is generated once and
mapped over the sets, and a linearisation needs its slopes as numbers only.
"""

from dataclasses import dataclass, field
from functools import lru_cache

import casadi as ca
import numpy as np

from workbench.physics.forces.corner import CornerLaw
from workbench.physics.forces.law import ForceLaw
from workbench.physics.vehicle.equations import equations
from workbench.physics.vehicle.parameters import Vehicle
from workbench.physics.vehicle.variation import ScaledLaw


@dataclass(frozen=True, slots=True)
class Assembly:
    """A rigid body on n coil sets whose forces are inputs.

    kinematics : Function (pose (5), velocity (5), zeta, eta, bank (n each)) -> deviation (3, n): gap change, lateral
        gap change [m], roll [rad] of each set;  rate (2, n): of the two gaps, the guideway held [m/s]
    dynamics : Function (pose, velocity, forces (3, n): lift, lateral [N], roll moment [N m], zeta, eta, bank,
        external (5)) -> rate (10): of pose and velocity;  sensed (2n): accelerometers, vertical then lateral [m/s²]
    """

    vehicle: Vehicle
    kinematics: ca.Function
    dynamics: ca.Function


@lru_cache(maxsize=32)
def assembly(vehicle: Vehicle) -> Assembly:
    """The open equations of a vehicle; magnetic damping and coil length are left to `set_forces` and `coil_moments`."""
    n = vehicle.count
    law = _OpenLaw(n, vehicle.force_law.drag_ratio)
    m = equations(
        vehicle.with_values(force_law=law, joined=()).with_extras(
            coil_length=0.0, lift_damping=0.0, lateral_damping=0.0
        )
    )
    deviation = ca.horzcat(*(ca.vertcat(*asked) for asked in law.asked))
    rates = ca.horzcat(*(ca.jtimes(gap, m.pose, m.pose_rate) for gap in (m.gap, m.gap_lateral))).T
    place = [m.pose, m.velocity, m.zeta, m.eta, m.bank]
    return Assembly(
        vehicle=vehicle,
        kinematics=ca.Function("kinematics", place, [ca.densify(deviation), ca.densify(rates)], {"cse": True}),
        dynamics=ca.Function(
            "dynamics", [m.pose, m.velocity, law.symbols, m.zeta, m.eta, m.bank, m.external],
            [ca.vertcat(m.pose_rate, m.acceleration), ca.vertcat(m.sensed_z, m.sensed_y)], {"cse": True},
        ),
    )  # fmt: skip


def set_forces(vehicle: Vehicle, values, rates, strength):
    """(3, n) forces of the sets: the law's values less the damping of the gap rates, times the strengths (n)."""
    extras, n = vehicle.extras, vehicle.count
    damping = ca.vertcat(extras.lift_damping * rates[0, :], extras.lateral_damping * rates[1, :], ca.DM.zeros(1, n))
    return (values - damping) * ca.repmat(ca.reshape(strength, 1, n), 3, 1)


def coil_moments(vehicle: Vehicle, pose, lift_by_gap, lateral_by_gap, strength):
    """(5,) external loads that stand for the coils' own pitch and yaw moments, L²/12 times the local stiffness."""
    share = vehicle.extras.coil_length**2 / 12
    stiffness = (ca.dot(ca.vec(part), ca.vec(strength)) for part in (lift_by_gap, lateral_by_gap))
    pitch, yaw = (share * k * angle for k, angle in zip(stiffness, (pose[1], pose[4]), strict=True))
    return ca.vertcat(0, pitch, 0, 0, yaw)


@lru_cache(maxsize=64)
def law_function(law: ForceLaw) -> ca.Function:
    """A force law as Function (Δh, Δh', φ, α) -> (F_L, F_G, L) as a column, to be mapped over coil sets."""
    symbols = [ca.SX.sym(name) for name in ("gap", "gap_lateral", "roll", "alpha")]
    return ca.Function("force_law", symbols, [ca.vertcat(*law.forces(*symbols))], {"cse": True})


def tangent(law: ForceLaw, deviation, alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """Forces (3,) and their slopes (3, 4) by Δh, Δh', φ, α at one deviation (3,)."""
    gap, lateral, roll = (float(value) for value in deviation)
    if isinstance(law, ScaledLaw):
        g = law.gap_force
        values, slopes = tangent(law.law, (g * gap, g * lateral, g * roll), law.current_force * alpha)
        return values, slopes * [g, g, g, law.current_force]
    if isinstance(law, CornerLaw):
        slopes = [law.stiffness(gap, lateral, roll, alpha), law.current_action(gap, lateral, roll, alpha)[:, None]]
        return np.array(law.forces(gap, lateral, roll, alpha)), np.hstack(slopes)
    values, slopes = _slopes(law)(gap, lateral, roll, alpha)
    return values.full().ravel(), slopes.full()


@lru_cache(maxsize=64)
def _slopes(law: ForceLaw) -> ca.Function:
    symbols = [ca.SX.sym(name) for name in ("gap", "gap_lateral", "roll", "alpha")]
    forces = ca.vertcat(*law.forces(*symbols))
    return ca.Function("slopes", symbols, [forces, ca.densify(ca.jacobian(forces, ca.vertcat(*symbols)))])


@dataclass(slots=True)
class _OpenLaw:
    """A law that leaves its answer open: each set in turn gets the next column of symbols."""

    count: int
    drag_ratio: float
    symbols: ca.SX = field(init=False)
    asked: list[tuple] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.symbols = ca.SX.sym("forces", 3, self.count)

    def forces(self, gap_change, gap_lateral_change, roll, alpha):
        """The open forces of the next set; what it was asked at is kept."""
        column = len(self.asked)
        self.asked.append((gap_change, gap_lateral_change, roll))
        return tuple(self.symbols[row, column] for row in range(3))
