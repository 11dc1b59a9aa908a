"""Operating points: the equilibrium under given conditions, and the linear vehicle about it.

    vehicle --trim of the nominal flight--> constant help --mass, cg, wind, curve, lost set--> pose, currents
            --slopes of every coil set at its own gap--> Linearisation --sets of one corner joined--> Plant

The help (constant moment, currents, …) that the nominal geometry needs is found first and kept; what the conditions add
is carried by the pose or by the control currents. The control's set-points move along, so that it rests there.
"""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from workbench.errors import InfeasibleError, InputError
from workbench.lti import Plant
from workbench.lti.signals import COORDINATES, Quantity, numbered, set_signals
from workbench.physics.forces.energy import CoilSet, clearance
from workbench.physics.vehicle.body import STATES, deviations, held_by_moment, inertia, tangent_at
from workbench.physics.vehicle.carried import check_carried
from workbench.physics.vehicle.conditions import Conditions
from workbench.physics.vehicle.drive import with_motor
from workbench.physics.vehicle.linear import Linearisation, assembled, linearise
from workbench.physics.vehicle.parameters import Vehicle
from workbench.physics.vehicle.trim import ACCELERATION_LEFT, Trim, trim
from workbench.result import Result, Row

SHARES = (0.25, 0.5, 0.75, 1.0)  # of the disturbance, brought on step by step: a lost set is a long way for one search
STEPS = 10  # of Newton's method before the disturbance is brought on in shares
NEAR = 0.05  # [m, rad, of main coil] how far from the nominal pose a full step may lead
SETTLED = 1e-9  # [m, rad, of main coil] of a step; the next one would be its square
UNDER_SET = (Quantity.ZETA, Quantity.ETA, Quantity.BANK)  # of the guideway: not of a set's command or sensors


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
        """The same as a Plant with one command and one group of sensors per command position, and its motor if any."""
        plant = joined(self.linearise().plant, self.vehicle)
        return plant if self.vehicle.drive is None else with_motor(plant, self.vehicle.drive)

    def clearance(self, coils: CoilSet, gap: float, gap_lateral: float) -> tuple[float, float]:
        """Least distance of any coil from floor and from wall [m], where the law counts from these nominal gaps [m]."""
        vertical, lateral, roll = self.deviation
        floor, wall = clearance(coils, ca.DM(gap + vertical), ca.DM(gap_lateral + lateral), ca.DM(roll))
        return float(ca.mmin(floor)), float(ca.mmin(wall))

    def rows(self) -> list[Row]:
        out: list[Row] = [("speed", self.vehicle.speed, "m/s"), ("mass", self.vehicle.mass, "kg")]
        for i, current in enumerate(self.trim.currents):
            out.append((f"gap change, set {i + 1}", float(self.deviation[0, i]), "m"))
            out.append((f"lateral gap change, set {i + 1}", float(self.deviation[1, i]), "m"))
            out.append((f"current, set {i + 1}", float(current), "of main coil"))
        return out


def operating_point(
    vehicle: Vehicle, conditions: Conditions | None = None, *, balance: str = "moment", carried: bool = True
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
    carried : bool
        Whether a help by "moment" must not hide that the forces do not carry the vehicle. False for a `varied` one,
        whose help holds it in the pose of the vehicle that it varies.

    Raises
    ------
    InputError
        If the forces at the nominal pose leave more than ballast can balance; see `check_carried`.
    InfeasibleError
        If no equilibrium with all coils clear of the guideway is found near the nominal pose.
    """
    conditions = conditions or Conditions()
    nominal = held_by_moment(vehicle) if balance == "moment" else trim(vehicle, by=balance)
    if carried and balance == "moment":
        check_carried(vehicle, nominal)
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
        deviation=deviations(at.vehicle, at.pose, irregularity),
    )  # fmt: skip


def joined(plant: Plant, vehicle: Vehicle) -> Plant:
    """The plant with one command, one current and one group of sensors per command position.

    A command goes to every coil set of its group; the group's sensors read the mean of its sets. Forces keep their own
    places, and the guideway reaches every set at its own. A vehicle whose sets are not joined is returned as it is.
    """
    if not vehicle.joined:
        return plant
    groups, n, spread = vehicle.joined, vehicle.count, vehicle.spread
    known = set_signals(n)
    mean = spread.T / spread.sum(axis=0)[:, None]

    def regrouped(names: tuple[str, ...], matrix: np.ndarray) -> tuple[tuple[str, ...], np.ndarray]:
        """Names with one signal per group for one per set, and `matrix` (groups by sets) for each kind."""
        rows, out, done = [], [], set()
        for position, name in enumerate(names):
            signal = known.get(name)
            if signal is None or signal.quantity in UNDER_SET:
                rows.append(np.eye(len(names))[position])
                out.append(name)
            elif signal.quantity not in done:
                done.add(signal.quantity)
                block = np.zeros((len(groups), len(names)))
                block[:, [names.index(one) for one in numbered(signal.quantity, n)]] = matrix
                rows.extend(block)
                out.extend(numbered(signal.quantity, len(groups)))
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


# ---- equilibrium


def _solved(conditions: Conditions, nominal: Trim, loaded: Vehicle, irregularity, strength) -> Trim:
    """The pose and currents at which the loaded vehicle is at rest."""
    loads = nominal.external.copy()
    loads += conditions.wind.loads() if conditions.wind else 0.0
    loads += conditions.curve.loads(loaded) if conditions.curve else 0.0
    pose_moves, current_moves = _directions(conditions, loaded, strength)
    spring = np.zeros((5, 5)) if loaded.drive is None else loaded.drive.stiffness

    def place(z):
        return nominal.pose + pose_moves @ z, nominal.currents + current_moves @ z

    def residual(z, share):
        pose, currents = place(z)
        acting = nominal.external + share * (loads - nominal.external) + spring @ pose
        here = tangent_at(loaded, pose, currents, share * irregularity, acting, 1 - share + share * strength)
        by_pose = here.slopes[5:STATES, :5] + spring / inertia(loaded)[:, None]
        by_current = here.slopes[5:STATES, STATES : STATES + loaded.count]
        return here.acceleration, by_pose @ pose_moves + by_current @ current_moves

    try:
        z = _newton(residual, pose_moves.shape[1]) if strength.all() else None
        z = _homotopy(residual, pose_moves.shape[1]) if z is None else z
    except InputError as error:  # the search would take a coil through the guideway
        raise _no_equilibrium(conditions) from error
    if z is None:
        raise _no_equilibrium(conditions)
    pose, currents = place(z)
    return replace(nominal, vehicle=loaded, pose=pose, currents=currents, external=loads)


def _newton(residual, size: int) -> np.ndarray | None:
    """A root a few full steps from the nominal pose; None where there is none so near."""
    z = np.zeros(size)
    for _ in range(STEPS):
        left, slope = residual(z, 1.0)
        try:
            step = np.linalg.solve(slope, left)
        except np.linalg.LinAlgError:
            return None
        z = z - step
        if not np.all(np.isfinite(z)) or np.abs(z).max() > NEAR:
            return None
        if np.abs(step).max() < SETTLED:
            return z if np.abs(residual(z, 1.0)[0]).max() <= ACCELERATION_LEFT else None
    return None


def _homotopy(residual, size: int) -> np.ndarray | None:
    """A root reached by bringing the disturbance on in shares; None where one of them has none."""
    from scipy.optimize import root

    z = np.zeros(size)
    for share in SHARES:
        z = root(residual, z, args=(share,), jac=True, tol=1e-13).x
        if not np.all(np.isfinite(z)) or np.abs(residual(z, share)[0]).max() > ACCELERATION_LEFT:
            return None
    return z


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
    x, y = np.array(vehicle.command_positions, float).T
    alive = np.asarray((vehicle.spread * strength[:, None]).any(axis=0))  # commands that reach a set with forces
    patterns = vehicle.spread @ (alive[:, None] * np.column_stack([np.ones_like(x), x, y]))  # hold heave, pitch, roll
    free = np.eye(5)[:, [COORDINATES.index("Y"), COORDINATES.index("Psi")]]
    return np.hstack([np.zeros((5, 3)), free]), np.hstack([patterns, np.zeros((vehicle.count, 2))])


# ---- slopes


def _linearised(point: OperatingPoint) -> Linearisation:
    """Every set with the slopes of its own pose and strength; an affine law as `linearise` takes it."""
    at = point.trim
    if at.vehicle.force_law.affine and not point.irregularity.any() and point.strength.all():
        return linearise(at.vehicle, at)
    here = tangent_at(at.vehicle, at.pose, at.currents, point.irregularity, at.external, point.strength)
    return assembled(at, here.state_space)
