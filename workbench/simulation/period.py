"""One period of a rig as one function: sensors, control law, limits, current loops, nonlinear motion.

    state, exogenous at start, middle, end, noise, strength  --ca.integrator-->  state a period later, readings at start

The state is pose, velocity, currents, filters. The guideway and the loads run through the period as the parabola
through their three values; noise stays as drawn.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from workbench.compiled import compile_function
from workbench.forces.energy import clearance
from workbench.simulation.rig import Rig
from workbench.vehicle import Vehicle
from workbench.vehicle.assembly import assembly, coil_moments, law_function, set_forces

CHUNK = 200  # periods in a call: between two looks at the clearances
SHORT_LAW = 3000  # operations of a force law below which a period is written out: the exact law has ten thousand
READINGS = ("pose", "velocity", "acceleration", "current", "command", "gap", "gap_lateral", "floor", "wall", "limited")


@dataclass(frozen=True, slots=True)
class Period:
    """A rig's period, CHUNK times over.

    advance : Function (state, exogenous (3 (3n + 5)), noise (4m), strength (n)) -> (state, readings), a column each
    rest : state at the operating point;  exogenous : (3n + 5,) ζ, η, bank and loads there
    rows : slice of each of READINGS
    """

    advance: ca.Function
    rest: np.ndarray
    exogenous: np.ndarray
    rows: dict[str, slice]


def period(rig: Rig) -> Period:
    """CHUNK periods of a rig in a row, as machine code where a compiler is at hand."""
    vehicle, point, n, m = rig.vehicle, rig.point, rig.vehicle.count, rig.law.count
    groups = _groups(vehicle)
    resting = np.linalg.lstsq(groups, point.trim.currents, rcond=None)[0]
    exogenous = np.concatenate([point.irregularity.ravel(), point.trim.external])
    memories = len(rig.control[0])
    rest = np.concatenate([point.trim.pose, np.zeros(5), resting, np.zeros(memories)])

    x, e = ca.MX.sym("state", len(rest)), ca.MX.sym("exogenous", 3 * n + 5)
    noise, strength = ca.MX.sym("noise", 4 * m), ca.MX.sym("strength", n)
    plant = _plant(vehicle, groups)
    still = plant(rest[:10], resting, exogenous, point.strength)[1].full().ravel()
    error = -still + (np.zeros(4 * m) if rig.bias is None else np.asarray(rig.bias, float))
    law = _Law(rig, resting, error)

    alpha, wish, measured, rate, deviation = law.now(plant, x, e, noise, strength)
    floor, wall = _clearances(rig, n)(deviation)
    cut = ca.if_else(ca.mmax(ca.fabs(wish)) > rig.current_limit, 1, 0)
    listed = (
        x[:5],
        x[5:10],
        rate[5:],
        alpha,
        law.limited(wish),
        deviation[0, :].T,
        deviation[1, :].T,
        floor.T,
        wall.T,
        cut,
    )
    ends = np.cumsum([0, *(part.shape[0] for part in listed)])
    rows = {name: slice(int(a), int(b)) for name, a, b in zip(READINGS, ends[:-1], ends[1:], strict=True)}

    nodes = ca.MX.sym("nodes", 3 * (3 * n + 5))
    begin = law.at_sample(x, wish, measured)
    integrate = _integrator(rig, law, plant, len(rest), nodes, noise, strength)
    held = law.limited(wish)
    following = integrate(x0=begin, p=ca.vertcat(nodes, noise, strength, held))["xf"]
    first = nodes[: 3 * n + 5]
    outputs = ca.graph_substitute([following, ca.vertcat(*listed)], [e], [first])
    advance = ca.Function("period", [x, nodes, noise, strength], outputs)
    if rig.integrator == "rk" and law_function(vehicle.force_law).n_instructions() < SHORT_LAW:
        advance = advance.expand(
            "period", {"cse": True}
        )  # straight-line code; a long law is better called than repeated
    many = advance.mapaccum("periods", CHUNK)
    return Period(
        advance=compile_function(many) if rig.integrator == "rk" else many, rest=rest, exogenous=exogenous, rows=rows
    )


@dataclass(frozen=True, slots=True)
class _Law:
    """The control law and the current loops of a rig, in symbols."""

    rig: Rig
    resting: np.ndarray
    error: np.ndarray  # of the sensors: bias less set-point

    @property
    def lag(self) -> float:
        return self.rig.vehicle.extras.current_lag

    @property
    def sampled(self) -> bool:
        return self.rig.sample_time is not None

    def limited(self, command):
        return ca.fmin(ca.fmax(command, -self.rig.current_limit), self.rig.current_limit)

    def wish(self, memory, measured):
        _, _, C, D = self.rig.control
        return self.resting + ca.mtimes(ca.DM(C), memory) + ca.mtimes(ca.DM(D), measured)

    def now(self, plant: ca.Function, x, e, noise, strength) -> tuple[Any, ...]:
        """Current in the coils, command before its limit, measurement, rates and deviations, at one instant.

        Without current loops a continuous law's currents follow from the gaps (Rig allows no direct acceleration gain
        there), which do not depend on the current; a sampled law's are those held since the last sample.
        """
        m = len(self.resting)
        current, memory = x[10 : 10 + m], x[10 + m :]
        rate, readings, deviation = plant(x[:10], current, e, strength)
        measured = readings + self.error + noise
        wish = self.wish(memory, measured)
        if self.lag or self.sampled:
            return current, wish, measured, rate, deviation
        alpha = self.limited(wish)
        rate, readings, deviation = plant(x[:10], alpha, e, strength)
        return alpha, wish, readings + self.error + noise, rate, deviation

    def at_sample(self, x, wish, measured):
        """The state after a sample is taken; a continuous law takes none."""
        if not self.sampled:
            return x
        A, B, _, _ = self.rig.control
        m = len(self.resting)
        memory = ca.mtimes(ca.DM(A), x[10 + m :]) + ca.mtimes(ca.DM(B), measured)
        return ca.vertcat(x[:10], x[10 : 10 + m] if self.lag else self.limited(wish), memory)

    def flow(self, plant: ca.Function, x, e, noise, strength, held):
        """Rate of the whole state between samples."""
        m = len(self.resting)
        current, memory = x[10 : 10 + m], x[10 + m :]
        if self.sampled:
            rate, filters, command = plant(x[:10], current, e, strength)[0], ca.MX.zeros(memory.shape[0]), held
        else:
            A, B, _, _ = self.rig.control
            _, wish, measured, rate, _ = self.now(plant, x, e, noise, strength)
            filters, command = ca.mtimes(ca.DM(A), memory) + ca.mtimes(ca.DM(B), measured), self.limited(wish)
        loops = (command - current) / self.lag if self.lag else ca.MX.zeros(m)
        return ca.vertcat(rate, ca.fmin(ca.fmax(loops, -self.rig.rate_limit), self.rig.rate_limit), filters)


def _integrator(rig: Rig, law: _Law, plant: ca.Function, size: int, nodes, noise, strength) -> ca.Function:
    n, m = rig.vehicle.count, rig.law.count
    x, time, held = ca.MX.sym("x", size), ca.MX.sym("time"), ca.MX.sym("held", m)
    width, s = 3 * n + 5, time / rig.period
    start, middle, end = (nodes[k * width : (k + 1) * width] for k in range(3))
    e = start * (1 - s) * (1 - 2 * s) + middle * 4 * s * (1 - s) + end * s * (2 * s - 1)
    dae = {
        "x": x,
        "t": time,
        "p": ca.vertcat(nodes, noise, strength, held),
        "ode": law.flow(plant, x, e, noise, strength, held),
    }
    if rig.integrator == "rk":
        options: dict[str, Any] = {"number_of_finite_elements": rig.substeps, "simplify": True}
    else:
        options = {"reltol": 1e-9, "abstol": 1e-12}
    return ca.integrator("integrate", rig.integrator, dae, 0.0, rig.period, options)


def _groups(vehicle: Vehicle) -> np.ndarray:
    """(n, m): which command reaches which coil set."""
    out = np.zeros((vehicle.count, len(vehicle.groups)))
    for column, group in enumerate(vehicle.groups):
        out[list(group), column] = 1.0
    return out


def _plant(vehicle: Vehicle, groups: np.ndarray) -> ca.Function:
    """Function (state (10), currents (m), exogenous, strength) -> rates (10), readings (4m) and deviations (3, n)."""
    n, m, open_motion = vehicle.count, groups.shape[1], assembly(vehicle)
    state, current = ca.MX.sym("state", 10), ca.MX.sym("current", m)
    exogenous, strength = ca.MX.sym("exogenous", 3 * n + 5), ca.MX.sym("strength", n)
    zeta, eta, bank = (exogenous[k * n : (k + 1) * n] for k in range(3))
    pose, velocity = state[:5], state[5:]
    deviation, rates = open_motion.kinematics(pose, velocity, zeta, eta, bank)
    alpha = ca.mtimes(ca.DM(groups), current)
    arguments = (deviation[0, :], deviation[1, :], deviation[2, :], alpha.T)
    forces = set_forces(vehicle, law_function(vehicle.force_law).map(n)(*arguments), rates, strength)
    loads = exogenous[3 * n :]
    if vehicle.extras.coil_length:
        by_gap, by_lateral = _local_stiffness(vehicle).map(n)(*arguments)
        loads = loads + coil_moments(vehicle, pose, by_gap.T, by_lateral.T, strength)
    rate, sensed = open_motion.dynamics(pose, velocity, forces, zeta, eta, bank, loads)
    per_set = ca.horzcat(deviation[0, :].T, deviation[1, :].T, sensed[:n], sensed[n:])
    readings = ca.vec(ca.mtimes(ca.DM(groups.T / groups.sum(axis=0)[:, None]), per_set))
    return ca.Function("plant", [state, current, exogenous, strength], [rate, readings, deviation])


def _local_stiffness(vehicle: Vehicle) -> ca.Function:
    """Function (Δh, Δh', φ, α) -> ∂F_L/∂h, ∂F_G/∂h' of one set."""
    symbols = [ca.SX.sym(name) for name in ("gap", "gap_lateral", "roll", "alpha")]
    lift, lateral, _ = vehicle.force_law.forces(*symbols)
    return ca.Function(
        "stiffness", symbols, [ca.gradient(lift, symbols[0]), ca.gradient(lateral, symbols[1])], {"cse": True}
    )


def _clearances(rig: Rig, n: int) -> Callable:
    """(3, n) deviations -> two (1, n) rows: smallest distance of each set's filaments from floor and wall [m]."""
    symbols = [ca.SX.sym(name) for name in ("gap", "gap_lateral", "roll")]
    one = ca.Function("clearance", symbols, list(clearance(rig.coils, *symbols)))
    return lambda d: one.map(n)(rig.gap + d[0, :], rig.gap_lateral + d[1, :], d[2, :])
