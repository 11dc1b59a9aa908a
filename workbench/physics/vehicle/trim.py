"""Equilibrium: where the vehicle rests, and by what means.

The printed preliminary geometry is not in equilibrium: at the nominal pose a pitch moment of about 2.9e5 N m is left
over. A trim says who carries it.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.errors import InfeasibleError, unknown_name
from workbench.lti.signals import COORDINATES
from workbench.physics.vehicle.equations import equations
from workbench.physics.vehicle.parameters import Vehicle
from workbench.result import Result, Row

MEANS = ("moment", "currents", "cg", "pose")
ACCELERATION_LEFT = 1e-9  # [m/s², rad/s²] a trim may leave: a ten-billionth of gravity moves nothing by a micrometre


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Trim(Result):
    """An equilibrium of a vehicle.

    vehicle : the vehicle, its coil places measured from the shifted centre of gravity if that is what was shifted
    pose : (5,) Z, Θ, Y, Φ, Ψ [m, rad];  currents : (n,) α [1]
    external : (5,) constant force down, pitch moment, force right, roll and yaw moment that hold it [N, N m]
    residual : (5,) the same at the nominal pose without currents or help: what had to be balanced [N, N m]
    cg_shift : how far forward the centre of gravity moved [m]
    """

    vehicle: Vehicle
    by: str
    pose: np.ndarray
    currents: np.ndarray
    external: np.ndarray
    residual: np.ndarray
    cg_shift: float

    def rows(self) -> list[Row]:
        named = zip(COORDINATES, self.pose, ("m", "rad", "m", "rad", "rad"), strict=True)
        return [
            ("residual force down at the nominal pose", float(self.residual[0]), "N"),
            ("residual pitch moment at the nominal pose", float(self.residual[1]), "N m"),
            ("balanced by", self.by, ""),
            *((f"pose {name}", float(value), unit) for name, value, unit in named),
            ("current, front", float(self.currents[0]), "of main coil"),
            ("current, rear", float(self.currents[-1]), "of main coil"),
            ("constant pitch moment", float(self.external[1]), "N m"),
            ("centre of gravity moved forward", self.cg_shift, "m"),
        ]


def trim(vehicle: Vehicle, by: str = "moment", external=(0.0, 0.0, 0.0, 0.0, 0.0)) -> Trim:
    """The equilibrium of a vehicle under constant external loads.

    Parameters
    ----------
    by : "moment", "currents", "cg" or "pose"
        Who balances what the nominal pose leaves over: constant force and moment from outside (thrust line, ballast),
        front and rear control currents, a shift of the centre of gravity with height, or the passive pose alone.
    external : (5,)
        Given loads: force down [N], pitch moment [N m], force right [N], roll moment, yaw moment [N m].

    Raises
    ------
    InfeasibleError
        If no equilibrium is found near the nominal pose.
    """
    if by not in MEANS:
        raise unknown_name("trim", by, MEANS)
    shift = ca.SX.sym("shift")
    behind = tuple((x - shift, y) for x, y in vehicle.positions)
    moved = vehicle.with_values(positions=behind) if by == "cg" else vehicle
    motion = _Forces(moved)
    m, A, B, C = vehicle.mass, vehicle.roll_inertia, vehicle.pitch_inertia, vehicle.yaw_inertia
    inertia = np.array([m, B, m, A, C], float)
    given = ca.DM(external)
    front = vehicle.spread @ np.array([x > 0 for x, _ in vehicle.command_positions], float)

    pose, current = ca.SX.sym("pose", 5), ca.SX.sym("current", 2)
    spread = ca.DM(front) * current[0] + ca.DM(1 - front) * current[1]
    unknowns = {
        "moment": ca.SX(0, 1),
        "currents": ca.vertcat(current, pose[2], pose[3], pose[4]),
        "cg": ca.vertcat(pose[0], shift, pose[2], pose[3], pose[4]),
        "pose": pose,
    }[by]
    left = motion.acceleration(pose, spread, given)
    everything = ca.vertcat(pose, current, shift)
    solution = np.zeros(8)
    rest = ca.Function("rest", [everything], [left])
    if by != "moment":
        zero = _at_zero(everything, unknowns)
        problem = {"x": unknowns, "g": ca.substitute(left, *zero)}
        solve = ca.rootfinder("trim", "newton", problem, {"error_on_fail": False})
        found = np.array(solve(np.zeros(5), [])).ravel()
        place = ca.Function("place", [unknowns], [ca.substitute(everything, *zero)])
        solution = np.array(place(found)).ravel()
        if not np.all(np.isfinite(solution)) or np.max(np.abs(rest(solution).full())) > ACCELERATION_LEFT:
            raise InfeasibleError(
                f"no equilibrium by {by} was found near the nominal pose under external loads {list(external)}; "
                "reduce the loads or let another means carry them."
            )
    residual = np.array(rest(np.zeros(8))).ravel() * inertia
    balance = -residual if by == "moment" else np.zeros(5)
    currents = np.array(ca.DM(front) * solution[5] + ca.DM(1 - front) * solution[6]).ravel()
    at_rest = vehicle
    if by == "cg":
        at_rest = vehicle.with_values(positions=tuple((x - solution[7], y) for x, y in vehicle.positions))
    return Trim(
        vehicle=at_rest, by=by, pose=solution[:5], currents=currents,
        external=np.array(given).ravel() + balance, residual=residual, cg_shift=float(solution[7]),
    )  # fmt: skip


class _Forces:
    """Accelerations at rest as a function of pose, currents and loads."""

    def __init__(self, vehicle: Vehicle) -> None:
        self.motion = equations(vehicle)
        self.spring = ca.DM.zeros(5, 5) if vehicle.drive is None else ca.DM(vehicle.drive.stiffness)

    def acceleration(self, pose, alpha, external):
        m = self.motion
        external = external + ca.mtimes(self.spring, pose)
        still = ca.vertcat(m.velocity, m.zeta, m.eta, m.bank, m.surface_rate)
        old = ca.vertcat(m.pose, m.alpha, m.external, still)
        return ca.substitute(m.acceleration, old, ca.vertcat(pose, alpha, ca.SX(external), ca.DM.zeros(still.shape)))


def _at_zero(everything, unknowns):
    """Substitution pair that sets to zero what is not unknown."""
    names = {str(s) for s in ca.vertsplit(unknowns)}
    fixed = ca.vertcat(*(s for s in ca.vertsplit(everything) if str(s) not in names))
    return fixed, ca.DM.zeros(fixed.shape)
