"""Linearisation at a checked trim: the matrices of Tables B-1 and B-2, and a Plant with named signals.

trim --compiled body (slopes of every set, Jacobians)--> A, B, C, D --> Linearisation --> Plant (with current loops)
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.lti import Plant
from workbench.lti.front import lagged
from workbench.lti.signals import COORDINATES
from workbench.physics.vehicle.body import held_by_moment, inertia, tangent_at
from workbench.physics.vehicle.equations import equations
from workbench.physics.vehicle.parameters import Vehicle
from workbench.physics.vehicle.trim import Trim
from workbench.result import Result, Row

EXTERNAL = ("force_z", "moment_pitch", "force_y", "moment_roll", "moment_yaw")
SYMMETRIC, ANTISYMMETRIC = (0, 1), (2, 3, 4)  # positions in COORDINATES


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Linearisation(Result):
    """I q̈ = stiffness q + damping q̇ + B α + C ζ + D η + bank φ_g + external, q = (Z, Θ, Y, Φ, Ψ) about the trim.

    inertia : (5,) m, B, m, A, C;  stiffness, damping : (5, 5);  current, zeta, eta, bank : (5, n)
    gap_rows : (2n, 5) displacement of the coil sets;  the sensors' matrices stay with the Plant.
    """

    trim: Trim
    inertia: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    current: np.ndarray
    zeta: np.ndarray
    eta: np.ndarray
    bank: np.ndarray
    plant: Plant

    def rows(self) -> list[Row]:
        named = {"a": self.stiffness, "d": self.damping}
        out: list[Row] = []
        for letter, matrix in named.items():
            if letter == "a" or matrix.any():
                for group in (SYMMETRIC, ANTISYMMETRIC):
                    out += [
                        (f"{letter}({COORDINATES[i]}, {COORDINATES[j]})", float(matrix[i, j]), "")
                        for i in group
                        for j in group
                    ]
        return out


def linearise(vehicle: Vehicle, at: Trim | None = None) -> Linearisation:
    """The linear vehicle about a trim; about the nominal pose, held by a constant moment, unless told otherwise.

    The Plant has inputs command_i (α before the current loop, or α itself without lag), zeta_i, eta_i, bank_i, the
    external loads and, where there is magnetic damping, the rates zeta_rate_i and eta_rate_i that it feels. Outputs are
    the coordinates, their rates and accelerations, and per coil set current, gap, gap_lateral, acceleration_z and
    acceleration_y (accelerometer readings, away from the guideway positive).
    """
    at = held_by_moment(vehicle) if at is None else at
    return assembled(at, _state_space(at))


def assembled(at: Trim, state_space) -> Linearisation:
    """The record of a linear vehicle whose A, B, C, D, of states pose and velocity, are known."""
    A, B, C, D = state_space
    vehicle, n = at.vehicle, at.vehicle.count
    own = inertia(vehicle)
    forces = own[:, None] * B[5:]
    return Linearisation(
        trim=at, inertia=own, stiffness=own[:, None] * A[5:, :5], damping=own[:, None] * A[5:, 5:],
        current=forces[:, :n], zeta=forces[:, n : 2 * n], eta=forces[:, 2 * n : 3 * n], bank=forces[:, 3 * n : 4 * n],
        plant=_plant(vehicle, A, B, C, D),
    )  # fmt: skip


def _state_space(at: Trim) -> tuple[np.ndarray, ...]:
    """A, B, C, D: by the compiled body, or by equations of the vehicle's own where a coil's stiffness varies."""
    vehicle = at.vehicle
    if not vehicle.extras.coil_length or not at.pose.any() or vehicle.force_law.affine:
        return tangent_at(vehicle, at.pose, at.currents, external=at.external).state_space
    m, n = equations(vehicle), vehicle.count
    state = ca.vertcat(m.pose, m.velocity)
    signals = ca.vertcat(m.alpha, m.zeta, m.eta, m.bank, m.external, m.surface_rate)
    rate = ca.vertcat(m.pose_rate, m.acceleration)
    output = ca.vertcat(m.pose, m.velocity, m.acceleration, m.gap, m.gap_lateral, m.sensed_z, m.sensed_y)
    jacobians = ca.Function(
        "linearised", [state, signals], [ca.jacobian(f, x) for f in (rate, output) for x in (state, signals)]
    )
    here = np.concatenate([at.pose, np.zeros(5)])
    inputs = np.concatenate([at.currents, np.zeros(3 * n), at.external, np.zeros(2 * n)])
    return tuple(np.array(ca.densify(J)) for J in jacobians(here, inputs))


def current_forces(at: Trim) -> tuple[float, float, float]:
    """Derivatives of one coil set's lift [N], lateral force [N] and roll moment [N m] by α, at the nominal pose."""
    _, slopes = at.vehicle.force_law.tangent(np.zeros((3, 1)), np.zeros(1))
    lift, lateral, moment = slopes[:, 3].tolist()
    return lift, lateral, moment


def _plant(vehicle: Vehicle, A, B, C, D) -> Plant:
    n, lag = vehicle.count, vehicle.extras.current_lag
    rates = tuple(f"{name}_rate" for name in COORDINATES)
    sets = range(1, n + 1)
    per_set = ("gap", "gap_lateral", "acceleration_z", "acceleration_y")
    states = (*COORDINATES, *rates)
    exogenous = tuple(f"{kind}_{i}" for kind in ("zeta", "eta", "bank") for i in sets) + EXTERNAL
    if vehicle.extras.lift_damping or vehicle.extras.lateral_damping:
        exogenous += tuple(f"{kind}_rate_{i}" for kind in ("zeta", "eta") for i in sets)
    B, D = (M[:, : n + len(exogenous)] for M in (B, D))
    outputs = (
        *states,
        *(f"{name}_acceleration" for name in COORDINATES),
        *(f"{kind}_{i}" for kind in per_set for i in sets),
    )
    currents = tuple(f"current_{i}" for i in sets)
    plant = Plant(A=A, B=B, C=C, D=D, states=states, inputs=currents + exogenous, outputs=outputs)
    return lagged(plant, currents, tuple(f"command_{i}" for i in sets), lag)
