"""Operating points: the equilibrium under given conditions, and the linear vehicle about it.

    vehicle --trim of the nominal flight--> constant help --mass, cg, wind, curve, lost set--> pose, currents
            --slopes of every coil set at its own gap--> Linearisation --sets of one corner joined--> Plant

The help (constant moment, currents, …) that the nominal geometry needs is found first and kept; what the conditions add
is carried by the pose or by the control currents. The control's set-points move along, so that it rests there.
"""

from dataclasses import dataclass, replace
from functools import lru_cache

import casadi as ca
import numpy as np

from workbench.errors import InfeasibleError, InputError
from workbench.forces.law import FirstOrderLaw, ForceLaw
from workbench.lti import Plant
from workbench.lti.signals import COORDINATES, numbered
from workbench.result import Result, Row
from workbench.vehicle.assembly import assembly, coil_moments, set_forces, tangent
from workbench.vehicle.conditions import Conditions
from workbench.vehicle.linear import EXTERNAL, Linearisation, linearise
from workbench.vehicle.parameters import Vehicle
from workbench.vehicle.trim import ACCELERATION_LEFT, Trim, trim

SHARES = (0.25, 0.5, 0.75, 1.0)  # of the disturbance, brought on step by step: a lost set is a long way for one search
FROM_SET = ("command", "current", "zeta", "eta", "bank", "gap", "gap_lateral", "acceleration_z", "acceleration_y")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class OperatingPoint(Result):
    """An equilibrium under given conditions.

    nominal : trim of the nominal flight, whose help is kept;  trim : the equilibrium, of the loaded vehicle
    irregularity : (3, n) constant ζ, η [m] and bank [rad] of the coil sets
    strength : (n,) share of its forces that a set keeps
    deviation : (3, n) gap change, lateral gap change [m] and roll [rad] of the coil sets from the law's nominal pose
    """

    conditions: Conditions
    nominal: Trim
    trim: Trim
    irregularity: np.ndarray
    strength: np.ndarray
    deviation: np.ndarray

    @property
    def vehicle(self) -> Vehicle:
        """The loaded vehicle."""
        return self.trim.vehicle

    def linearise(self) -> Linearisation:
        """The linear vehicle about it, every coil set with the slopes of its own pose; sets not yet joined."""
        return _linearised(self)

    def plant(self) -> Plant:
        """The same as a Plant with one command and one group of sensors per command position."""
        return joined(self.linearise().plant, self.vehicle)

    def rows(self) -> list[Row]:
        out: list[Row] = [("speed", self.vehicle.speed, "m/s"), ("mass", self.vehicle.mass, "kg")]
        for i, current in enumerate(self.trim.currents):
            out.append((f"gap change, set {i + 1}", float(self.deviation[0, i]), "m"))
            out.append((f"lateral gap change, set {i + 1}", float(self.deviation[1, i]), "m"))
            out.append((f"current, set {i + 1}", float(current), "of main coil"))
        return out


def operating_point(
    vehicle: Vehicle, conditions: Conditions | None = None, *, balance: str = "moment"
) -> OperatingPoint:
    """The equilibrium of a vehicle under given conditions.

    Parameters
    ----------
    vehicle : Vehicle
        With the force law of its speed (`vehicle.flight` gives it).
    conditions : Conditions
        Nominal flight if left out.
    balance : "moment", "currents", "cg" or "pose"
        Who balances what the nominal geometry leaves over; see `trim`.

    Raises
    ------
    InfeasibleError
        If no equilibrium with all coils clear of the guideway is found near the nominal pose.
    """
    conditions = conditions or Conditions()
    nominal = trim(vehicle, by=balance)
    n = vehicle.count
    strength = conditions.strength(n)
    if conditions.nominal:
        still = np.zeros((3, n))
        at, irregularity = nominal, still
    else:
        loaded = conditions.loaded(nominal.vehicle)
        irregularity = conditions.curve.irregularity(loaded) if conditions.curve else np.zeros((3, n))
        at = _solved(conditions, nominal, loaded, irregularity, strength)
    return OperatingPoint(
        conditions=conditions, nominal=nominal, trim=at, irregularity=irregularity, strength=strength,
        deviation=_deviation(at.vehicle, at.pose, irregularity),
    )  # fmt: skip


def joined(plant: Plant, vehicle: Vehicle) -> Plant:
    """The plant with one command, one current and one group of sensors per command position.

    A command goes to every coil set of its group; the group's sensors read the mean of its sets, as sensors in the
    middle would; the guideway under the group is that under its middle, as for one coil of the group's length. Forces
    keep their own places. A vehicle whose sets are not joined is returned as it is.
    """
    if not vehicle.joined:
        return plant
    groups, n = vehicle.joined, vehicle.count
    spread = np.zeros((n, len(groups)))
    for column, group in enumerate(groups):
        spread[list(group), column] = 1.0
    mean = spread.T / spread.sum(axis=0)[:, None]

    def regrouped(names: tuple[str, ...], matrix: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
        """Names with one signal per group for one per set, and `matrix` (groups by sets) for each kind."""
        rows, out, done = [], [], set()
        for position, name in enumerate(names):
            kind, _, number = name.rpartition("_")
            if kind not in FROM_SET or not number.isdigit():
                rows.append(np.eye(len(names))[position])
                out.append(name)
            elif kind not in done:
                done.add(kind)
                block = np.zeros((len(groups), len(names)))
                block[:, [names.index(one) for one in numbered(kind, n)]] = matrix
                rows.extend(block)
                out.extend(numbered(kind, len(groups)))
        return tuple(out), np.array(rows)

    states, into = regrouped(plant.states, spread.T)
    _, out_of = regrouped(plant.states, mean)
    inputs, sources = regrouped(plant.inputs, spread.T)
    outputs, seen = regrouped(plant.outputs, mean)
    return Plant(
        A=out_of @ plant.A @ into.T, B=out_of @ plant.B @ sources.T,
        C=seen @ plant.C @ into.T, D=seen @ plant.D @ sources.T,
        states=states, inputs=inputs, outputs=outputs,
    )  # fmt: skip


def _deviation(vehicle: Vehicle, pose, irregularity) -> np.ndarray:
    return assembly(vehicle).kinematics(pose, np.zeros(5), *irregularity)[0].full()


# ---- equilibrium


def _solved(conditions: Conditions, nominal: Trim, loaded: Vehicle, irregularity, strength) -> Trim:
    """The pose and currents at which the loaded vehicle is at rest."""
    from scipy.optimize import root

    loads = nominal.external.copy()
    loads += conditions.wind.loads() if conditions.wind else 0.0
    loads += conditions.curve.loads(loaded) if conditions.curve else 0.0
    pose_moves, current_moves = _directions(conditions, loaded, strength)

    def place(z, share):
        return nominal.pose + pose_moves @ z, nominal.currents * (1 - share + share * strength) + current_moves @ z

    def residual(z, share):
        pose, currents = place(z, share)
        acting = nominal.external + share * (loads - nominal.external)
        rate, by_state, by_signal = _at(
            loaded, pose, currents, share * irregularity, acting, 1 - share + share * strength
        )
        return rate[5:], by_state[5:, :5] @ pose_moves + by_signal[5:, : loaded.count] @ current_moves

    z = np.zeros(pose_moves.shape[1])
    for share in SHARES:
        try:
            z = root(residual, z, args=(share,), jac=True, tol=1e-13).x
        except InputError as error:  # the search would take a coil through the guideway
            raise _no_equilibrium(conditions) from error
        if not np.all(np.isfinite(z)) or np.abs(residual(z, share)[0]).max() > ACCELERATION_LEFT:
            raise _no_equilibrium(conditions)
    pose, currents = place(z, 1.0)
    return replace(nominal, vehicle=loaded, pose=pose, currents=currents, external=loads)


def _no_equilibrium(conditions: Conditions) -> InfeasibleError:
    other = "currents" if conditions.carried_by == "pose" else "pose"
    return InfeasibleError(
        f"no equilibrium carried by {conditions.carried_by} with the coils clear of the guideway was found near the "
        f"nominal pose under {conditions}; reduce the loads, or let carried_by be {other!r}."
    )


def _directions(conditions: Conditions, vehicle: Vehicle, strength: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What the unknowns move: (5, k) pose and (n, k) currents."""
    if conditions.carried_by == "pose":
        return np.eye(5), np.zeros((vehicle.count, 5))
    x, y = np.array(vehicle.positions, float).T
    patterns = (strength > 0)[:, None] * np.column_stack([np.ones_like(x), x, y])  # hold heave, pitch and roll
    free = np.eye(5)[:, [COORDINATES.index("Y"), COORDINATES.index("Psi")]]
    return np.hstack([np.zeros((5, 3)), free]), np.hstack([patterns, np.zeros((vehicle.count, 2))])


# ---- slopes


def _at(
    vehicle: Vehicle, pose, currents, irregularity, external, strength
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rates (10,) at rest at a pose, their slopes by the state (10, 10) and by α, ζ, η, bank, loads (10, 4n + 5)."""
    deviation = _deviation(vehicle, pose, irregularity)
    tangents = [tangent(vehicle.force_law, d, float(a)) for d, a in zip(deviation.T, currents, strict=True)]
    values = np.column_stack([value for value, _ in tangents])
    slopes = np.hstack([slope for _, slope in tangents])
    state = np.concatenate([pose, np.zeros(5)])
    signals = np.concatenate([currents, *irregularity, external])
    out = _affine(vehicle)(state, signals, values, slopes, deviation, currents, strength)
    rate, by_state, by_signal = (part.full() for part in out)
    return rate.ravel(), by_state, by_signal


@lru_cache(maxsize=32)
def _affine(vehicle: Vehicle) -> ca.Function:
    """Rates of the state and their slopes when every set has affine forces about a deviation and a current."""
    n, open_motion = vehicle.count, assembly(vehicle)
    state, signals = ca.SX.sym("state", 10), ca.SX.sym("signals", 4 * n + 5)
    values, slopes, centre = ca.SX.sym("values", 3, n), ca.SX.sym("slopes", 3, 4 * n), ca.SX.sym("centre", 3, n)
    current, strength = ca.SX.sym("current", n), ca.SX.sym("strength", n)
    pose, velocity = state[:5], state[5:]
    alpha, zeta, eta, bank = (signals[k * n : (k + 1) * n] for k in range(4))
    deviation, rates = open_motion.kinematics(pose, velocity, zeta, eta, bank)
    steps = ca.vertcat(deviation - centre, ca.reshape(alpha - current, 1, n))
    forces = ca.horzcat(*(values[:, i] + ca.mtimes(slopes[:, 4 * i : 4 * i + 4], steps[:, i]) for i in range(n)))
    forces = set_forces(vehicle, forces, rates, strength)
    by_gap, by_lateral = (ca.vertcat(*(slopes[k, 4 * i + k] for i in range(n))) for k in (0, 1))
    loads = signals[4 * n :] + coil_moments(vehicle, pose, by_gap, by_lateral, strength)
    rate, _ = open_motion.dynamics(pose, velocity, forces, zeta, eta, bank, loads)
    outputs = [rate, *(ca.densify(ca.jacobian(rate, x)) for x in (state, signals))]
    return ca.Function("affine", [state, signals, values, slopes, centre, current, strength], outputs, {"cse": True})


def _linearised(point: OperatingPoint) -> Linearisation:
    """One first-order law for all sets, then what each set's own slopes add, as external loads."""
    at, law = point.trim, point.vehicle.force_law
    undisturbed = not point.irregularity.any() and point.strength.all()
    if isinstance(law, FirstOrderLaw) and undisturbed:
        return linearise(at.vehicle, at)
    alike = replace(at, vehicle=at.vehicle.with_values(force_law=_first_order(law)))
    if undisturbed and not at.pose.any() and not at.currents.any():
        return replace(linearise(alike.vehicle, alike), trim=at)
    n = at.vehicle.count
    left, _, _ = _at(alike.vehicle, at.pose, at.currents, np.zeros((3, n)), at.external, np.ones(n))
    inertia = np.array(
        [at.vehicle.mass, at.vehicle.pitch_inertia, at.vehicle.mass, at.vehicle.roll_inertia, at.vehicle.yaw_inertia]
    )
    resting = replace(
        alike, external=at.external - inertia * left[5:]
    )  # a first-order law is not at rest in the same pose
    base = replace(linearise(alike.vehicle, resting), trim=at)
    _, by_state, by_signal = _at(at.vehicle, at.pose, at.currents, point.irregularity, at.external, point.strength)
    wanted = base.inertia[:, None] * np.hstack([by_state[5:], by_signal[5:, : 4 * at.vehicle.count]])
    given = np.hstack([base.stiffness, base.damping, base.current, base.zeta, base.eta, base.bank])
    parts = np.split(wanted, np.cumsum([5, 5, *[at.vehicle.count] * 3]), axis=1)
    names = ("stiffness", "damping", "current", "zeta", "eta", "bank")
    return replace(
        base, **dict(zip(names, parts, strict=True)), plant=_with_loads(base.plant, at.vehicle.count, wanted - given)
    )


def _first_order(law: ForceLaw) -> FirstOrderLaw:
    values, slopes = tangent(law, np.zeros(3), 0.0)
    lift, lateral, moment = ((float(v), *map(float, row)) for v, row in zip(values, slopes, strict=True))
    return FirstOrderLaw(lift=lift, lateral=lateral, moment=moment, drag_ratio=law.drag_ratio)


def _with_loads(plant: Plant, n: int, loads: np.ndarray) -> Plant:
    """The plant on which loads (5, 10 + 4n), proportional to pose, velocity, currents and guideway, act besides."""
    lagged = "current_1" in plant.states
    currents = ("states", numbered("current", n)) if lagged else ("inputs", numbered("command", n))
    sources = [("states", [*COORDINATES, *(f"{c}_rate" for c in COORDINATES)]), currents]
    sources += [("inputs", numbered(kind, n)) for kind in ("zeta", "eta", "bank")]
    feed = {"states": np.zeros((5, len(plant.states))), "inputs": np.zeros((5, len(plant.inputs)))}
    start = 0
    for kind, names in sources:
        feed[kind][:, plant.index(kind, names)] = loads[:, start : start + len(names)]
        start += len(names)
    e = plant.index("inputs", EXTERNAL)
    push, felt = plant.B[:, e], plant.D[:, e]
    return Plant(
        A=plant.A + push @ feed["states"], B=plant.B + push @ feed["inputs"],
        C=plant.C + felt @ feed["states"], D=plant.D + felt @ feed["inputs"],
        states=plant.states, inputs=plant.inputs, outputs=plant.outputs,
    )  # fmt: skip
