"""Nonlinear equations of motion in five degrees of freedom, from rigid-body kinematics and a local force law.

    pose, irregularity --kinematics--> gaps, roll of each coil set --force law--> forces --sums--> accelerations

The longitudinal equation is trivial at constant speed: thrust equals drag. Force equations hold in the inertial frame,
moment equations in body axes; coil-set forces stay normal to the guideway surfaces. Source: report, Appendix B.2, B.3.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca

from workbench.constants import GRAVITY
from workbench.lti.signals import COORDINATES as COORDINATES
from workbench.physics.vehicle.parameters import Vehicle

# (number of the set, its gap change, lateral gap change and roll (3,), rates of the two gaps (2,), α)
# -> lift, lateral force [N], roll moment [N m]
SetForces = Callable[[int, Any, Any, Any], tuple[Any, Any, Any]]


@dataclass(frozen=True, slots=True)
class Motion:
    """Symbols of the equations and what follows from them; columns of SX.

    pose : (5,)  Z, Θ, Y, Φ, Ψ;  velocity : (5,)  dZ/dt, body rate q, dY/dt, body rates p, r
    alpha, zeta, eta, bank : (n,)  currents, surface rise, wall outward, guideway roll at each coil set
    surface_rate : (2n,)  rates of zeta, then eta [m/s], which magnetic damping feels
    external : (5,)  force down, pitch moment, force right, roll moment, yaw moment [N, N m]
    pose_rate, acceleration : (5,)  time derivatives of pose and velocity
    gap, gap_lateral : (n,)  gap changes [m];  sensed_z, sensed_y : (n,)  accelerometer readings [m/s²]
    """

    pose: ca.SX
    velocity: ca.SX
    alpha: ca.SX
    zeta: ca.SX
    eta: ca.SX
    bank: ca.SX
    surface_rate: ca.SX
    external: ca.SX
    pose_rate: ca.SX
    acceleration: ca.SX
    gap: ca.SX
    gap_lateral: ca.SX
    sensed_z: ca.SX
    sensed_y: ca.SX


def rotation(Phi, Theta, Psi):
    """Body to inertial axes, (3, 3): yaw, then pitch, then roll (3-2-1)."""
    cf, sf, ct, st, cp, sp = ca.cos(Phi), ca.sin(Phi), ca.cos(Theta), ca.sin(Theta), ca.cos(Psi), ca.sin(Psi)
    yaw = ca.vertcat(ca.horzcat(cp, -sp, 0), ca.horzcat(sp, cp, 0), ca.horzcat(0, 0, 1))
    pitch = ca.vertcat(ca.horzcat(ct, 0, st), ca.horzcat(0, 1, 0), ca.horzcat(-st, 0, ct))
    roll = ca.vertcat(ca.horzcat(1, 0, 0), ca.horzcat(0, cf, -sf), ca.horzcat(0, sf, cf))
    return ca.mtimes([yaw, pitch, roll])


def gaps(vehicle: Vehicle, pose, zeta, eta):
    """Changes of gap and lateral gap of each coil set [m], two (n,) columns."""
    Z, Theta, Y, Phi, Psi = ca.vertsplit(pose)
    R = rotation(Phi, Theta, Psi)
    vertical, lateral = [], []
    for (x, y), side in zip(vehicle.positions, vehicle.sides, strict=True):
        place = ca.mtimes(R, ca.vertcat(x, y, vehicle.depth))
        vertical.append(-(Z + place[2] - vehicle.depth))
        lateral.append(side * (Y + place[1] - y))
    return ca.vertcat(*vertical) - zeta, ca.vertcat(*lateral) - eta


def equations(vehicle: Vehicle, forces_of_set: SetForces | None = None) -> Motion:
    """The equations of motion of a vehicle, in fresh symbols.

    forces_of_set : what each coil set answers, damping included; by the vehicle's own law and damping if left out
    """
    n, extras = vehicle.count, vehicle.extras
    answer = forces_of_set or _law_and_damping(vehicle)
    pose, velocity, external = ca.SX.sym("pose", 5), ca.SX.sym("velocity", 5), ca.SX.sym("external", 5)
    alpha, zeta, eta, bank = (ca.SX.sym(name, n) for name in ("alpha", "zeta", "eta", "bank"))
    surface_rate = ca.SX.sym("surface_rate", 2 * n)
    _, Theta, _, Phi, Psi = ca.vertsplit(pose)
    Z_rate, q, Y_rate, p, r = ca.vertsplit(velocity)
    R = rotation(Phi, Theta, Psi)
    swing = q * ca.sin(Phi) + r * ca.cos(Phi)
    pose_rate = ca.vertcat(
        Z_rate, q * ca.cos(Phi) - r * ca.sin(Phi), Y_rate, p + swing * ca.tan(Theta), swing / ca.cos(Theta)
    )
    gap, gap_lateral = gaps(vehicle, pose, zeta, eta)
    moving = (ca.jtimes(g, pose, pose_rate) for g in (gap, gap_lateral))
    gap_rate, gap_lateral_rate = (r - s for r, s in zip(moving, ca.vertsplit(surface_rate, n), strict=True))

    force, moment = ca.SX.zeros(3), ca.SX.zeros(3)
    for i, ((x, y), side) in enumerate(zip(vehicle.positions, vehicle.sides, strict=True)):
        roll = -side * (Phi - bank[i])
        deviation, rates = ca.vertcat(gap[i], gap_lateral[i], roll), ca.vertcat(gap_rate[i], gap_lateral_rate[i])
        lift, lateral, roll_moment = answer(i, deviation, rates, alpha[i])
        tilt = bank[i] if extras.bank_reading == "section" else ca.SX(0)
        at_coil = ca.mtimes(
            rotation(tilt, 0, 0), ca.vertcat(-vehicle.force_law.drag_ratio * (lift + lateral), side * lateral, -lift)
        )
        arm = ca.vertcat(x, y, vehicle.depth)
        force = force + at_coil
        moment = moment + ca.cross(arm, ca.mtimes(R.T, at_coil)) + ca.mtimes(R.T, ca.vertcat(-side * roll_moment, 0, 0))
        if extras.coil_length:
            share = extras.coil_length**2 / 12
            F_Lh, F_Ghp = _local_stiffness(vehicle, gap[i], gap_lateral[i], roll, alpha[i])
            moment = moment + share * ca.vertcat(0, F_Lh * Theta, F_Ghp * Psi)
    push = ca.mtimes(R, ca.vertcat(extras.thrust, 0, 0))
    Z_ext, M_ext, Y_ext, L_ext, N_ext = ca.vertsplit(external)
    Z_acc = GRAVITY + (force[2] + push[2] + Z_ext) / vehicle.mass
    Y_acc = (force[1] + push[1] + Y_ext) / vehicle.mass
    A, B, C = vehicle.roll_inertia, vehicle.pitch_inertia, vehicle.yaw_inertia
    p_acc = (moment[0] + L_ext - (C - B) * q * r) / A
    q_acc = (moment[1] + M_ext - (A - C) * r * p) / B
    r_acc = (moment[2] + N_ext - (B - A) * p * q) / C

    sensed_z, sensed_y = [], []
    omega, omega_rate = ca.vertcat(p, q, r), ca.vertcat(p_acc, q_acc, r_acc)
    at_cg = ca.mtimes(R.T, ca.vertcat(0, Y_acc, Z_acc))
    felt = (
        ca.mtimes(R.T, ca.vertcat(0, 0, GRAVITY)) - ca.vertcat(0, 0, GRAVITY) if extras.gravity_term else ca.SX.zeros(3)
    )
    for (x, y), side in zip(vehicle.positions, vehicle.sides, strict=True):
        arm = ca.vertcat(x, y, vehicle.depth)
        local = at_cg + ca.cross(omega_rate, arm) + ca.cross(omega, ca.cross(omega, arm)) - felt
        sensed_z.append(-local[2])
        sensed_y.append(side * local[1])
    return Motion(
        pose=pose, velocity=velocity, alpha=alpha, zeta=zeta, eta=eta, bank=bank, surface_rate=surface_rate,
        external=external,
        pose_rate=pose_rate, acceleration=ca.vertcat(Z_acc, q_acc, Y_acc, p_acc, r_acc),
        gap=gap, gap_lateral=gap_lateral, sensed_z=ca.vertcat(*sensed_z), sensed_y=ca.vertcat(*sensed_y),
    )  # fmt: skip


def _law_and_damping(vehicle: Vehicle) -> SetForces:
    law, extras = vehicle.force_law, vehicle.extras

    def answer(_: int, deviation, rates, alpha):
        lift, lateral, roll_moment = law.forces(deviation[0], deviation[1], deviation[2], alpha)
        return lift - extras.lift_damping * rates[0], lateral - extras.lateral_damping * rates[1], roll_moment

    return answer


def _local_stiffness(vehicle: Vehicle, gap, gap_lateral, roll, alpha):
    h, hp = ca.SX.sym("h"), ca.SX.sym("hp")
    lift, lateral, _ = vehicle.force_law.forces(h, hp, roll, alpha)
    stiffness = ca.vertcat(ca.gradient(lift, h), ca.gradient(lateral, hp))
    return ca.vertsplit(ca.substitute(stiffness, ca.vertcat(h, hp), ca.vertcat(gap, gap_lateral)))
