"""The equations of motion with the coil sets' forces left open, so that each may have a strength of its own.

    equations (of one vehicle)  --forces become inputs-->  Assembly: kinematics, then dynamics
    law  --law_function-->  compiled, mappable

The exact law of a coil set is ten thousand operations long. Kept apart from the rigid body it is generated once and
mapped over the sets, and a linearisation needs its slopes as numbers only.
"""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca

from workbench.physics.forces.law import ForceLaw
from workbench.physics.vehicle.equations import equations
from workbench.physics.vehicle.parameters import Vehicle


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
    forces, asked = ca.SX.sym("forces", 3, vehicle.count), []

    def left_open(i: int, deviation, rates, alpha):
        asked.append(deviation)
        return forces[0, i], forces[1, i], forces[2, i]

    m = equations(vehicle.with_values(joined=()).with_extras(coil_length=0.0), left_open)
    deviation = ca.horzcat(*asked)
    rates = ca.horzcat(*(ca.jtimes(gap, m.pose, m.pose_rate) for gap in (m.gap, m.gap_lateral))).T
    place = [m.pose, m.velocity, m.zeta, m.eta, m.bank]
    return Assembly(
        vehicle=vehicle,
        kinematics=ca.Function("kinematics", place, [ca.densify(deviation), ca.densify(rates)], {"cse": True}),
        dynamics=ca.Function(
            "dynamics", [m.pose, m.velocity, forces, m.zeta, m.eta, m.bank, m.external],
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
