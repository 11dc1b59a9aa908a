"""The rigid body on coil sets whose forces are affine, compiled once for all vehicles of one structure.

    law, deviation of each set --tangents--> values and slopes ┐
    masses, arms, depth, damping … --numbers-->                ├─ compiled --> rates, readings, slopes (A, B, C, D)
    pose, currents, guideway, loads, strengths                 ┘

Building the equations of motion takes fifty times longer than evaluating them. They differ between vehicles by numbers
alone, except for what `Structure` names; so a thousand vehicles of one structure share one function.
"""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from workbench.physics.forces.law import FirstOrderLaw
from workbench.physics.vehicle.equations import equations
from workbench.physics.vehicle.parameters import Extras, Vehicle
from workbench.physics.vehicle.trim import Trim

STATES = 10  # pose and velocity
LOADS = 5


@dataclass(frozen=True, slots=True)
class Structure:
    """What vehicles with the same equations share; everything else about them is numbers.

    half_tracks : y of each coil set [m], whose sign says on which side its wall is
    """

    half_tracks: tuple[float, ...]
    gravity_term: bool
    bank_reading: str

    @classmethod
    def of(cls, vehicle: Vehicle) -> "Structure":
        """The structure of a vehicle."""
        extras = vehicle.extras
        return cls(tuple(float(y) for _, y in vehicle.positions), extras.gravity_term, extras.bank_reading)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tangent:
    """The vehicle at rest at a pose: what it does, reads, and how both change.

    rate : (10,) of pose and velocity
    slopes : (10 + 15 + 4n, 10 + 6n + 5) of rate, pose, velocity, acceleration, gaps, lateral gaps and accelerometer
        readings, by state and by α, ζ, η, bank, loads, rates of ζ and η
    """

    rate: np.ndarray
    slopes: np.ndarray

    @property
    def acceleration(self) -> np.ndarray:
        """(5,) what is left of an equilibrium [m/s², rad/s²]."""
        return self.rate[5:]

    @property
    def state_space(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """A, B, C, D."""
        top, bottom = self.slopes[:STATES], self.slopes[STATES:]
        return top[:, :STATES], top[:, STATES:], bottom[:, :STATES], bottom[:, STATES:]


def inertia(vehicle: Vehicle) -> np.ndarray:
    """(5,) mass, pitch inertia, mass, roll and yaw inertia: force or moment per acceleration of each coordinate."""
    return np.array(
        [vehicle.mass, vehicle.pitch_inertia, vehicle.mass, vehicle.roll_inertia, vehicle.yaw_inertia], float
    )


def deviations(vehicle: Vehicle, pose, irregularity=None) -> np.ndarray:
    """(3, n) deviations of the coil sets from the law's nominal pose, over an irregularity (3, n) if one is given."""
    return _deviations(vehicle, pose, np.zeros((3, vehicle.count)) if irregularity is None else irregularity)


def tangent_at(vehicle: Vehicle, pose, currents, irregularity=None, external=None, strength=None) -> Tangent:
    """The vehicle at rest at a pose (5,), every set with the slopes of its own deviation.

    irregularity : (3, n) ζ, η [m], bank [rad];  external : (5,) loads;  strength : (n,) share of its forces a set keeps

    The coils' own pitch and yaw moments take the local stiffness as constant.
    """
    n = vehicle.count
    irregularity = np.zeros((3, n)) if irregularity is None else irregularity
    external = np.zeros(LOADS) if external is None else external
    strength = np.ones(n) if strength is None else strength
    if vehicle.force_law.affine:  # one tangent is as good as another
        centre, current = np.zeros((3, n)), np.zeros(n)
    else:
        centre, current = _deviations(vehicle, pose, irregularity), currents
    values, slopes = vehicle.force_law.tangent(centre, current)
    given = np.concatenate([
        pose, np.zeros(5), currents, np.ravel(irregularity), external, np.zeros(2 * n), _numbers(vehicle),
        values.ravel("F"), slopes.ravel("F"), centre.ravel("F"), current, strength,
    ])  # fmt: skip
    out = _compiled(Structure.of(vehicle))[1](given).full()
    return Tangent(rate=out[:STATES, 0], slopes=out[:, 1:])


def held_by_moment(vehicle: Vehicle) -> Trim:
    """The nominal pose, held by constant loads: what `trim(vehicle, by="moment")` returns."""
    nothing = np.zeros(vehicle.count)
    residual = tangent_at(vehicle, np.zeros(5), nothing).acceleration * inertia(vehicle)
    return Trim(
        vehicle=vehicle, by="moment", pose=np.zeros(5), currents=nothing, external=-residual, residual=residual,
        cg_shift=0.0,
    )  # fmt: skip


# ---- the functions


def _deviations(vehicle: Vehicle, pose, irregularity) -> np.ndarray:
    along = [x for x, _ in vehicle.positions]
    given = np.concatenate([pose, np.ravel(irregularity), [vehicle.depth], along])
    return _compiled(Structure.of(vehicle))[0](given).full()


def _numbers(vehicle: Vehicle) -> list[float]:
    """In the order of `_symbolic`."""
    e = vehicle.extras
    return [
        vehicle.mass, vehicle.roll_inertia, vehicle.pitch_inertia, vehicle.yaw_inertia,
        e.thrust, e.lift_damping, e.lateral_damping, vehicle.force_law.drag_ratio, e.coil_length**2 / 12,
        vehicle.depth, *(x for x, _ in vehicle.positions),
    ]  # fmt: skip


@lru_cache(maxsize=32)
def _compiled(structure: Structure) -> tuple[ca.Function, ca.Function]:
    """(pose, irregularity, depth, places) -> deviations (3, n);  everything -> rate and slopes side by side."""
    n = len(structure.half_tracks)
    numbers = ca.SX.sym("numbers", 10 + n)
    mass, roll, pitch, yaw, thrust, lift_damping, lateral_damping, drag_ratio, share, depth = ca.vertsplit(numbers[:10])
    along = ca.vertsplit(numbers[10:])
    values, slopes, centre = ca.SX.sym("values", 3, n), ca.SX.sym("slopes", 3, 4 * n), ca.SX.sym("centre", 3, n)
    current, strength = ca.SX.sym("current", n), ca.SX.sym("strength", n)
    asked: list[ca.SX] = []

    def forces(i: int, deviation, rates, alpha):
        """Affine about `centre` and `current`, less the damping of the gap rates, times the set's strength."""
        asked.append(deviation)
        step = ca.vertcat(deviation - centre[:, i], alpha - current[i])
        damping = ca.vertcat(lift_damping * rates[0], lateral_damping * rates[1], 0)
        affine = values[:, i] + ca.mtimes(slopes[:, 4 * i : 4 * i + 4], step)
        return ca.vertsplit((affine - damping) * strength[i])

    m = equations(
        Vehicle(
            mass=mass, roll_inertia=roll, pitch_inertia=pitch, yaw_inertia=yaw, depth=depth, speed=1.0,
            positions=tuple(zip(along, structure.half_tracks, strict=True)),  # type: ignore[arg-type]
            force_law=FirstOrderLaw(lift=(0.0,) * 5, lateral=(0.0,) * 5, moment=(0.0,) * 5, drag_ratio=drag_ratio),  # type: ignore[arg-type]
            extras=Extras(
                thrust=thrust, gravity_term=structure.gravity_term, bank_reading=structure.bank_reading,  # type: ignore[arg-type]
            ),
        ),
        forces,
    )  # fmt: skip
    by_gap, by_lateral = (sum(strength[i] * slopes[k, 4 * i + k] for i in range(n)) for k in (0, 1))
    own = ca.vertcat(0, share * by_gap * m.pose[1], 0, 0, share * by_lateral * m.pose[4])
    answer = ca.vertcat(m.pose_rate, m.acceleration)
    readings = ca.vertcat(m.pose, m.velocity, m.acceleration, m.gap, m.gap_lateral, m.sensed_z, m.sensed_y)
    answer, readings = ca.substitute([answer, readings], [m.external], [m.external + own])
    everything = ca.vertcat(answer, readings)
    signals = ca.vertcat(m.pose, m.velocity, m.alpha, m.zeta, m.eta, m.bank, m.external, m.surface_rate)
    result = ca.horzcat(everything, ca.jacobian(everything, signals))
    given = [signals, numbers, *map(ca.vec, (values, slopes, centre)), current, strength]
    place = [m.pose, m.zeta, m.eta, m.bank, depth, *along]
    return (
        ca.Function("deviations", [ca.vertcat(*place)], [ca.densify(ca.horzcat(*asked))], {"cse": True}),
        ca.Function("tangent", [ca.vertcat(*given)], [ca.densify(result)], {"cse": True}),
    )
