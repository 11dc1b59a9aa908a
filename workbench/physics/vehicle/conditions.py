"""What a vehicle meets besides level, straight, nominal flight: wind, a curve, another load, a coil set lost.

    SideWind, Curve  -->  constant external loads (5,) and constant guideway inputs at the coil sets
    Conditions       -->  all of them together, for `operating_point`

Loads are (force down, pitch moment, force right, roll moment, yaw moment) about the centre of gravity [N, N m].
"""

import math
from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np

from workbench.constants import GRAVITY
from workbench.errors import InputError, unknown_name
from workbench.physics.vehicle.equations import rotation
from workbench.physics.vehicle.parameters import Vehicle

CARRIERS = ("pose", "currents")


@dataclass(frozen=True, slots=True, kw_only=True)
class SideWind:
    """A steady force to the right [N] that acts above and ahead of the centre of gravity [m]."""

    force: float
    above: float = 0.0
    ahead: float = 0.0

    def __post_init__(self) -> None:
        _finite(self, "force", "above", "ahead")

    def loads(self) -> np.ndarray:
        """(5,) of the force and its moments: pressed above the centre of gravity it rolls the vehicle to the right."""
        return np.array([0.0, 0.0, self.force, self.above * self.force, self.ahead * self.force])


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """A curve to the right, or the transition into it, seen from axes that move with the guideway.

    Parameters
    ----------
    lateral : float
        V²/R [m/s²]; negative in a curve to the left.
    cant : float
        Guideway turned right side down [rad].
    roll_rate, roll_acceleration : float
        Of the guideway at the vehicle, while the cant grows [rad/s, rad/s²].
    lateral_jerk : float
        Growth of V²/R [m/s³], while the curve sharpens.

    The track turns about a line in the coil plane, so that its walls stay where they were.
    """

    lateral: float
    cant: float = 0.0
    roll_rate: float = 0.0
    roll_acceleration: float = 0.0
    lateral_jerk: float = 0.0

    def __post_init__(self) -> None:
        _finite(self, "lateral", "cant", "roll_rate", "roll_acceleration", "lateral_jerk")
        if not abs(self.cant) < math.pi / 4:
            raise InputError(
                f"cant must stay within ±{math.pi / 4:.3f} rad; got {self.cant!r} rad. Give radians, not degrees."
            )

    @property
    def unbalanced(self) -> float:
        """Lateral acceleration that the cant leaves to the walls [m/s²], positive in a right-hand curve."""
        return self.lateral * math.cos(self.cant) - GRAVITY * math.sin(self.cant)

    def loads(self, vehicle: Vehicle) -> np.ndarray:
        """(5,) inertial and gravity loads in the guideway's axes, level track taken off.

        What a rigid body that moves with the guideway in its nominal pose lacks of equilibrium (d'Alembert).
        """
        body = [vehicle.mass, vehicle.roll_inertia, vehicle.pitch_inertia, vehicle.yaw_inertia, vehicle.depth]
        return _inertial()([*body, vehicle.speed, *_path(self)]).full().ravel()

    def irregularity(self, vehicle: Vehicle) -> np.ndarray:
        """(3, n) constant ζ, η [m], bank [rad] of the coil sets: twist of the transition, arc of the curve.

        The arc is horizontal: seen from canted axes it bends upwards as well as sideways.
        """
        x, y = np.array(vehicle.positions, float).T
        t = x / vehicle.speed
        bank = self.roll_rate * t + self.roll_acceleration * t**2 / 2
        arc = self.lateral * t**2 / 2 + self.lateral_jerk * t**3 / 6
        across, up = math.cos(self.cant) * arc, math.sin(self.cant) * arc
        return np.array([up - y * bank, np.array(vehicle.sides) * across, bank])


def _path(curve: Curve) -> list[float]:
    return [curve.lateral, curve.cant, curve.roll_rate, curve.roll_acceleration, curve.lateral_jerk]


@cache
def _inertial() -> ca.Function:
    """(mass, A, B, C, depth, speed, the curve's five numbers) -> loads (5,), from the motion of the axes themselves.

    position = way along the track + R ρ, R = yaw by the heading, then roll by the cant; ρ = centre of gravity above the
    line the track turns about.  force = −m d²position/dt² + weight, moment = −R' d(R I ω)/dt.
    """
    given = ca.SX.sym("given", 11)
    mass, A, B, C, depth, speed, lateral, cant, roll_rate, roll_acceleration, jerk = ca.vertsplit(given)
    t = ca.SX.sym("t")
    heading = (lateral * t + jerk * t**2 / 2) / speed
    R = rotation(cant + roll_rate * t + roll_acceleration * t**2 / 2, 0, heading)
    along = speed * ca.vertcat(ca.cos(heading), ca.sin(heading), 0)
    turn = ca.mtimes(R.T, ca.reshape(ca.jacobian(ca.vec(R), t), 3, 3))
    omega = ca.vertcat(turn[2, 1], turn[0, 2], turn[1, 0])
    spin = ca.mtimes([R, ca.diag(ca.vertcat(A, B, C)), omega])
    swing = ca.mtimes(R, ca.vertcat(0, 0, -depth))
    acceleration = ca.jacobian(along + ca.jacobian(swing, t), t)
    weight = ca.vertcat(0, 0, mass * GRAVITY)
    force = ca.mtimes(R.T, weight - mass * acceleration) - weight
    moment = -ca.mtimes(R.T, ca.jacobian(spin, t))
    loads = ca.vertcat(force[2], moment[1], force[1], moment[0], moment[2])
    return ca.Function("inertial_loads", [given], [ca.substitute(loads, t, 0)])


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """Where and how a vehicle flies; the defaults are nominal.

    Parameters
    ----------
    mass : float or None
        [kg]; the vehicle's own if left out. Inertias stay.
    cg_forward : float
        How far the centre of gravity lies ahead of its nominal place [m].
    wind, curve : SideWind, Curve or None
    lost_set : int or None
        Coil set that fails, counted from 1 as in the signals' names.
    lost_share : float
        Share of its forces that the failing set loses, 0 … 1.
    carried_by : "pose" or "currents"
        What carries the difference to the nominal flight: gaps alone, or control currents that hold heave, pitch and
        roll (sway and yaw still give way).
    """

    mass: float | None = None
    cg_forward: float = 0.0
    wind: SideWind | None = None
    curve: Curve | None = None
    lost_set: int | None = None
    lost_share: float = 1.0
    carried_by: str = "pose"

    def __post_init__(self) -> None:
        _finite(self, "cg_forward")
        if not 0 <= self.lost_share <= 1:
            raise InputError(
                f"lost_share must lie between 0 and 1; got {self.lost_share!r}. 1 is a set without any force."
            )
        if self.mass is not None and not 0 < self.mass < math.inf:
            raise InputError(
                f"mass must be positive and finite; got {self.mass!r} kg. Leave it out for the nominal one."
            )
        if self.carried_by not in CARRIERS:
            raise unknown_name("carrier", str(self.carried_by), CARRIERS)

    @property
    def nominal(self) -> bool:
        """Whether nothing differs from level, straight flight of the nominal vehicle."""
        plain = (self.mass, self.cg_forward, self.wind, self.curve, self.lost_set)
        return plain == (None, 0.0, None, None, None)

    def loaded(self, vehicle: Vehicle) -> Vehicle:
        """The vehicle with this mass and centre of gravity; coil places are measured from the new one."""
        moved = tuple((x - self.cg_forward, y) for x, y in vehicle.positions) if self.cg_forward else vehicle.positions
        return vehicle.with_values(mass=vehicle.mass if self.mass is None else self.mass, positions=moved)

    def strength(self, count: int) -> np.ndarray:
        """(n,) share of its forces that each coil set keeps."""
        out = np.ones(count)
        if self.lost_set is not None:
            if self.lost_set not in range(1, count + 1):
                raise InputError(f"lost_set must be 1 … {count}, as the coil sets are named; got {self.lost_set!r}.")
            out[self.lost_set - 1] = 1.0 - self.lost_share
        return out


def _finite(record, *names: str) -> None:
    for name in names:
        if not math.isfinite(getattr(record, name)):
            raise InputError(f"{type(record).__name__}.{name} must be a finite number; got {getattr(record, name)!r}.")
