"""One period of a rig as one function: sensors, control law, limits, current loops, nonlinear motion.

    state --sensors, law--> commands --step by step: Runge–Kutta or CVODES--> state a period later
    exogenous at start, middle, end of every step; noise, strength            readings at the start, nearest clearances

The state is pose, velocity, currents (coils, then motors), filters. The guideway and the loads run through a step as
the parabola through their three values; noise stays as drawn. Clearances are looked at in the start and the middle of
every step, between two samples as well.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from workbench.compiled import compile_function
from workbench.physics.forces.energy import clearance
from workbench.physics.vehicle import Vehicle
from workbench.physics.vehicle.assembly import assembly, coil_moments, law_function, set_forces
from workbench.simulation.rig import Rig

CHUNK = 200  # periods in a call: between two looks at the clearances
SHORT_LAW = 3000  # operations of a force law below which a period is written out: the exact law has ten thousand
HISTORY = (
    "pose", "velocity", "acceleration", "current", "command", "motor", "motor_command", "gap", "gap_lateral"
)  # fmt: skip
READINGS = (*HISTORY, "floor", "wall", "touch", "limited")


@dataclass(frozen=True, slots=True)
class Period:
    """A rig's period, CHUNK times over.

    advance : Function (state, exogenous (3 (3n + 5) · substeps), noise (4m), strength (n)) -> (state, readings), a
        column each;  an exogenous column holds start, middle and end of each step in turn
    rest : state at the operating point;  exogenous : (3n + 5,) ζ, η, bank and loads there
    rows : slice of each of READINGS; floor, wall are the smallest within the period, touch the time in it of the first
        look that is not clear (the period where all are)
    """

    advance: ca.Function
    rest: np.ndarray
    exogenous: np.ndarray
    rows: dict[str, slice]


def period(rig: Rig) -> Period:
    """CHUNK periods of a rig in a row, as machine code where a compiler is at hand."""
    vehicle, n, m = rig.vehicle, rig.vehicle.count, rig.law.count
    groups = vehicle.spread
    plant, rest, exogenous = _plant(rig, groups), resting_state(rig), _still(rig)
    law = _Law(rig, _error(rig, plant))

    width = 3 * n + 5
    x, nodes = ca.MX.sym("state", len(rest)), ca.MX.sym("nodes", 3 * width * rig.substeps)
    noise, strength = ca.MX.sym("noise", 4 * m), ca.MX.sym("strength", n)
    first = _Parabola(*(nodes[k * width : (k + 1) * width] for k in range(3)), rig.step_used, n)  # pyright: ignore[reportCallIssue]
    alpha, wish, measured, rate, deviation = law.now(plant, x, *first.at_start, noise, strength)
    held = law.limited(wish)
    here, distances = law.at_sample(x, wish, measured), []
    step = _step(rig, law, plant, len(rest))
    for k in range(rig.substeps):
        here, start, middle = step(here, nodes[3 * width * k : 3 * width * (k + 1)], noise, strength, held)
        distances += [start, middle]
    floor, wall, touch = _nearest(distances, rig.step_used / 2, rig.period)
    coils = len(groups[0])
    cut = ca.if_else(ca.mmax(ca.fabs(wish[:coils])) > rig.current_limit, 1, 0)
    listed = (
        x[:5], x[5:10], rate[5:], alpha[:coils], held[:coils], alpha[coils:], held[coils:],
        deviation[0, :].T, deviation[1, :].T, floor, wall, touch, cut,
    )  # fmt: skip
    ends = np.cumsum([0, *(part.shape[0] for part in listed)])
    rows = {name: slice(int(a), int(b)) for name, a, b in zip(READINGS, ends[:-1], ends[1:], strict=True)}
    advance = ca.Function("period", [x, nodes, noise, strength], [here, ca.vertcat(*listed)])
    if rig.integrator == "rk" and rig.substeps * law_function(vehicle.force_law).n_instructions() < SHORT_LAW:
        advance = advance.expand(
            "period", {"cse": True}
        )  # straight-line code; a long law is better called than repeated
    many = advance.mapaccum("periods", CHUNK)
    return Period(
        advance=compile_function(many) if rig.integrator == "rk" else many, rest=rest, exogenous=exogenous, rows=rows
    )


def motion(rig: Rig) -> ca.Function:
    """Function (state, ζ and η (2n), their rates (2n), loads (5)) -> rate of the state, deviations (3, n), distances
    (2, n) of the filaments of each set from floor and wall [m]; of a continuous law, without noise, nothing failed.
    """
    n, m = rig.vehicle.count, rig.law.count
    plant, resting, exogenous = _plant(rig, rig.vehicle.spread), resting_state(rig), _still(rig)
    law = _Law(rig, _error(rig, plant))
    x, surface, surface_rate = ca.MX.sym("state", len(resting)), ca.MX.sym("surface", 2 * n), ca.MX.sym("rate", 2 * n)
    loads = ca.MX.sym("loads", 5)
    outside = ca.vertcat(ca.DM(exogenous[: 2 * n]) + surface, ca.DM(exogenous[2 * n : 3 * n]),
                         ca.DM(exogenous[3 * n :]) + loads)  # fmt: skip
    noise, strength = ca.MX.zeros(4 * m), ca.MX(ca.DM(rig.point.strength))
    rate, deviation = law.flow(plant, x, outside, surface_rate, noise, strength, None)
    return ca.Function("motion", [x, surface, surface_rate, loads], [rate, deviation, _clearances(rig, n)(deviation)])


def resting_state(rig: Rig) -> np.ndarray:
    """State at the operating point."""
    return np.concatenate([rig.point.trim.pose, np.zeros(5), rig.resting, np.zeros(len(rig.control[0]))])


def _still(rig: Rig) -> np.ndarray:
    """(3n + 5,) ζ, η, bank and loads at the operating point."""
    return np.concatenate([rig.point.irregularity.ravel(), rig.point.trim.external])


def _error(rig: Rig, plant: ca.Function) -> np.ndarray:
    """(4m,) of the sensors: their bias less the set-points, which are what they read at rest."""
    zero = np.zeros(2 * rig.vehicle.count)
    still = plant(resting_state(rig)[:10], rig.resting, _still(rig), zero, rig.point.strength)[1].full().ravel()
    return -still + (np.zeros(4 * rig.law.count) if rig.bias is None else np.asarray(rig.bias, float))


@dataclass(frozen=True, slots=True)
class _Parabola:
    """What comes from outside during a step, by its values at start, middle and end, and how fast ζ and η change."""

    start: Any
    middle: Any
    end: Any
    step: float
    count: int

    def at(self, s):
        """Values (3n + 5) and rates of ζ, η (2n) at a share s of the step."""
        a, b, c = self.start, self.middle, self.end
        value = a * (1 - s) * (1 - 2 * s) + b * 4 * s * (1 - s) + c * s * (2 * s - 1)
        rate = (a * (4 * s - 3) + b * (4 - 8 * s) + c * (4 * s - 1)) / self.step
        return value, rate[: 2 * self.count]

    @property
    def at_start(self):
        """The same at s = 0."""
        return self.at(0.0)


@dataclass(frozen=True, slots=True)
class _Law:
    """The control law and the current loops of a rig, in symbols; commands of the coils, then of the motors."""

    rig: Rig
    error: np.ndarray  # of the sensors: bias less set-point

    @property
    def sampled(self) -> bool:
        return self.rig.sample_time is not None

    def limited(self, command):
        most = self.rig.most
        return ca.fmin(ca.fmax(command, -most), most)

    def wish(self, memory, measured):
        _, _, C, D = self.rig.control
        return self.rig.resting + ca.mtimes(ca.DM(C), memory) + ca.mtimes(ca.DM(D), measured)

    def now(self, plant: ca.Function, x, e, e_rate, noise, strength) -> tuple[Any, ...]:
        """Currents, commands before their limit, measurement, rates and deviations, at one instant.

        Without current loops a continuous law's currents follow from the gaps (Rig allows no direct acceleration gain
        there), which do not depend on the current; a sampled law's are those held since the last sample.
        """
        m = len(self.rig.resting)
        current, memory = x[10 : 10 + m], x[10 + m :]
        rate, readings, deviation = plant(x[:10], current, e, e_rate, strength)
        measured = readings + self.error + noise
        wish = self.wish(memory, measured)
        if self.rig.lagged or self.sampled:
            return current, wish, measured, rate, deviation
        alpha = self.limited(wish)
        rate, readings, deviation = plant(x[:10], alpha, e, e_rate, strength)
        return alpha, wish, readings + self.error + noise, rate, deviation

    def at_sample(self, x, wish, measured):
        """The state after a sample is taken; a continuous law takes none."""
        if not self.sampled:
            return x
        A, B, _, _ = self.rig.control
        m = len(self.rig.resting)
        memory = ca.mtimes(ca.DM(A), x[10 + m :]) + ca.mtimes(ca.DM(B), measured)
        return ca.vertcat(x[:10], x[10 : 10 + m] if self.rig.lagged else self.limited(wish), memory)

    def flow(self, plant: ca.Function, x, e, e_rate, noise, strength, held) -> tuple[Any, Any]:
        """Rate of the whole state between samples, and the deviations of the sets."""
        m = len(self.rig.resting)
        current, memory = x[10 : 10 + m], x[10 + m :]
        if self.sampled:
            rate, _, deviation = plant(x[:10], current, e, e_rate, strength)
            filters, command = ca.MX.zeros(memory.shape[0]), held
        else:
            A, B, _, _ = self.rig.control
            _, wish, measured, rate, deviation = self.now(plant, x, e, e_rate, noise, strength)
            filters, command = ca.mtimes(ca.DM(A), memory) + ca.mtimes(ca.DM(B), measured), self.limited(wish)
        loops = (command - current) / self.rig.lags if self.rig.lagged else ca.MX.zeros(m)
        fastest = self.rig.fastest
        return ca.vertcat(rate, ca.fmin(ca.fmax(loops, -fastest), fastest), filters), deviation


def _step(rig: Rig, law: _Law, plant: ca.Function, size: int) -> ca.Function:
    """Function (state, nodes, noise, strength, held) -> state a step later, distances (2, n) at start and middle."""
    n, h = rig.vehicle.count, rig.step_used
    width = 3 * n + 5
    x, nodes = ca.MX.sym("x", size), ca.MX.sym("nodes", 3 * width)
    noise, strength = ca.MX.sym("noise", 4 * rig.law.count), ca.MX.sym("strength", n)
    held = ca.MX.sym("held", len(rig.resting))
    path = _Parabola(*(nodes[k * width : (k + 1) * width] for k in range(3)), h, n)  # pyright: ignore[reportCallIssue]
    clear = _clearances(rig, n)

    def flow(state, s):
        return law.flow(plant, state, *path.at(s), noise, strength, held)

    k1, at_start = flow(x, 0.0)
    if rig.integrator == "rk":
        k2, _ = flow(x + h / 2 * k1, 0.5)
        k3, at_middle = flow(x + h / 2 * k2, 0.5)
        k4, _ = flow(x + h * k3, 1.0)
        after = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    else:
        y, time = ca.MX.sym("y", size), ca.MX.sym("time")
        parameters = ca.vertcat(nodes, noise, strength, held)
        dae = {"x": y, "t": time, "p": parameters, "ode": flow(y, time / h)[0]}
        options = {"reltol": 1e-9, "abstol": 1e-13}
        through = ca.integrator("integrate", rig.integrator, dae, 0.0, [h / 2, h], options)(x0=x, p=parameters)["xf"]
        after, at_middle = through[:, 1], flow(through[:, 0], 0.5)[1]
    return ca.Function("step", [x, nodes, noise, strength, held], [after, clear(at_start), clear(at_middle)])


def _plant(rig: Rig, groups: np.ndarray) -> ca.Function:
    """Function (state (10), currents, exogenous, rates of ζ and η (2n), strength) -> rates (10), readings (4m),
    deviations (3, n)."""
    vehicle, n, m = rig.vehicle, rig.vehicle.count, groups.shape[1]
    open_motion = assembly(vehicle)
    state, current = ca.MX.sym("state", 10), ca.MX.sym("current", len(rig.resting))
    exogenous, strength = ca.MX.sym("exogenous", 3 * n + 5), ca.MX.sym("strength", n)
    surface_rate = ca.MX.sym("surface_rate", 2 * n)
    zeta, eta, bank = (exogenous[k * n : (k + 1) * n] for k in range(3))
    pose, velocity = state[:5], state[5:]
    deviation, rates = open_motion.kinematics(pose, velocity, zeta, eta, bank)
    rates = rates - ca.reshape(surface_rate, n, 2).T
    alpha = ca.mtimes(ca.DM(groups), current[:m])
    arguments = (deviation[0, :], deviation[1, :], deviation[2, :], alpha.T)
    forces = set_forces(vehicle, law_function(vehicle.force_law).map(n)(*arguments), rates, strength)
    loads = exogenous[3 * n :]
    if vehicle.drive is not None:
        loads = loads + ca.mtimes(ca.DM(vehicle.drive.stiffness), pose)
        loads = loads + ca.mtimes(ca.DM(vehicle.drive.input_matrix), current[m:])
    if vehicle.extras.coil_length:
        by_gap, by_lateral = _local_stiffness(vehicle).map(n)(*arguments)
        loads = loads + coil_moments(vehicle, pose, by_gap.T, by_lateral.T, strength)
    rate, sensed = open_motion.dynamics(pose, velocity, forces, zeta, eta, bank, loads)
    per_set = ca.horzcat(deviation[0, :].T, deviation[1, :].T, sensed[:n], sensed[n:])
    readings = ca.vec(ca.mtimes(ca.DM(groups.T / groups.sum(axis=0)[:, None]), per_set))
    return ca.Function("plant", [state, current, exogenous, surface_rate, strength], [rate, readings, deviation])


def _local_stiffness(vehicle: Vehicle) -> ca.Function:
    """Function (Δh, Δh', φ, α) -> ∂F_L/∂h, ∂F_G/∂h' of one set."""
    symbols = [ca.SX.sym(name) for name in ("gap", "gap_lateral", "roll", "alpha")]
    lift, lateral, _ = vehicle.force_law.forces(*symbols)
    return ca.Function(
        "stiffness", symbols, [ca.gradient(lift, symbols[0]), ca.gradient(lateral, symbols[1])], {"cse": True}
    )


def _clearances(rig: Rig, n: int) -> Callable:
    """(3, n) deviations -> (2, n): smallest distance of each set's filaments from floor and wall [m]."""
    symbols = [ca.SX.sym(name) for name in ("gap", "gap_lateral", "roll")]
    one = ca.Function("clearance", symbols, [ca.vertcat(*clearance(rig.coils, *symbols))])
    return lambda d: one.map(n)(rig.gap + d[0, :], rig.gap_lateral + d[1, :], d[2, :])


def _nearest(distances: list, spacing: float, whole: float) -> tuple[Any, Any, Any]:
    """Smallest distances (n,) from floor and wall over the looks, and the time of the first that is not clear."""
    nearest, touch = distances[0], ca.MX(whole)
    for k, distance in reversed(list(enumerate(distances))):
        touch = ca.if_else(ca.mmin(ca.vec(distance)) > 0, touch, k * spacing)
    for distance in distances[1:]:
        nearest = ca.fmin(nearest, distance)
    return nearest[0, :].T, nearest[1, :].T, touch
