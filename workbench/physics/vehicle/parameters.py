"""What a vehicle is: masses, coil places, a force law, and the physics switched on beyond the report's.

Axes: X forward, Y right, Z down; roll Φ > 0 right side down, pitch Θ > 0 nose up, yaw Ψ > 0 nose right.
Every number may be an SX symbol where a derivative is wanted; checks then wait for numbers.
"""

from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from workbench.errors import InputError
from workbench.physics.forces.law import ForceLaw
from workbench.physics.vehicle.drive import MotorDrive
from workbench.result import Result, Row

BANK_READINGS = ("twist", "section")


@dataclass(frozen=True, slots=True, kw_only=True)
class Extras:
    """Physics that the report neglects or leaves open; the defaults are the report's own model.

    Parameters
    ----------
    current_lag : float
        Time constant of each current loop, 1/(1 + T s) [s]; 0 leaves it out.
    gravity_term : bool
        The strap-down lateral accelerometers read ÿ − gΦ at their coil set (report, B.5; missing in Table B-3).
    coil_length : float
        Length of a coil [m] whose pitch and yaw moments about its own centre act (L²/12 times the local stiffness);
        0 leaves them out, as the report does.
    thrust : float
        Thrust fixed to the body [N]: its side force T·Ψ and lift T·Θ act; 0 leaves them out.
    lift_damping, lateral_damping : float
        Magnetic damping of one coil set [N s/m], force opposing the gap rates; may be negative in repulsion.
    bank_reading : "twist" or "section"
        A guideway bank either only tilts the coil against its image (e_y = F_Gφ), or turns the whole section and
        its forces with it (e_y = F_Gφ + F_L0).
    """

    current_lag: float = 0.0
    gravity_term: bool = False
    coil_length: float = 0.0
    thrust: float = 0.0
    lift_damping: float = 0.0
    lateral_damping: float = 0.0
    bank_reading: str = "twist"

    def __post_init__(self) -> None:
        for name in ("current_lag", "coil_length"):
            _at_least_zero(name, getattr(self, name))
        if self.bank_reading not in BANK_READINGS:
            raise InputError(f"bank_reading must be one of {', '.join(BANK_READINGS)}; got {self.bank_reading!r}.")


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Vehicle(Result):
    """A rigid vehicle on coil sets, at one speed.

    Parameters
    ----------
    mass : float
        [kg]
    roll_inertia, pitch_inertia, yaw_inertia : float
        A, B, C about the centre of gravity [kg m²].
    positions : (n, 2) nested tuples
        x (forward) and y (right) of the coil sets from the centre of gravity [m]; y > 0 is a right-hand set.
    depth : float
        Coil plane below the centre of gravity, c [m].
    speed : float
        V [m/s].
    force_law : ForceLaw
        Lift, lateral force and roll moment of one coil set.
    joined : tuple of tuples of int
        Coil sets (counted from 0) that share one command and one group of sensors, such as the coils of a corner; empty
        where every set has its own.
    drive : MotorDrive or None
        A motor whose currents steer as well; its forces at the nominal pose, but for the thrust, count as balanced.
    """

    mass: float
    roll_inertia: float
    pitch_inertia: float
    yaw_inertia: float
    positions: tuple[tuple[float, float], ...]
    depth: float
    speed: float
    force_law: ForceLaw
    extras: Extras = field(default_factory=Extras)
    joined: tuple[tuple[int, ...], ...] = ()
    drive: MotorDrive | None = None

    def __post_init__(self) -> None:
        for name in ("mass", "roll_inertia", "pitch_inertia", "yaw_inertia", "speed"):
            value = getattr(self, name)
            if not isinstance(value, ca.SX) and not value > 0:
                raise InputError(f"{name} must be positive; got {value!r}. Check the sign and the unit.")
        if any(not isinstance(y, ca.SX) and y == 0 for _, y in self.positions):
            raise InputError(
                "every coil set must sit on one side (y ≠ 0), since its wall is on that side; "
                "move it off the centre line."
            )
        if self.joined:
            self._check_joined()

    def _check_joined(self) -> None:
        if sorted(i for group in self.joined for i in group) != list(range(self.count)):
            raise InputError(
                f"joined must name each of the {self.count} coil sets once, counted from 0; got {self.joined}. "
                "Leave it empty where every set has its own command."
            )
        for group in self.joined:
            if len({self.sides[i] for i in group}) > 1:
                raise InputError(
                    f"coil sets that share a command must sit on one side; got sets {group}. "
                    "Their lateral forces would cancel."
                )

    @classmethod
    def four_corners(cls, *, front: float, rear: float, half_track: float, **fields) -> "Vehicle":
        """Sets 1 front right, 2 front left, 3 rear right, 4 rear left, at a_F, a_R and b (report, Figure B-1)."""
        b = half_track
        return cls(positions=((front, b), (front, -b), (-rear, b), (-rear, -b)), **fields)

    @property
    def count(self) -> int:
        """Number of coil sets."""
        return len(self.positions)

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Which coil sets each command reaches: `joined`, or every set alone."""
        return self.joined or tuple((i,) for i in range(self.count))

    @property
    def spread(self) -> np.ndarray:
        """(n, commands) of 0 and 1: which coil sets each command reaches."""
        out = np.zeros((self.count, len(self.groups)))
        for column, group in enumerate(self.groups):
            out[list(group), column] = 1.0
        return out

    @property
    def command_positions(self) -> tuple[tuple[float, float], ...]:
        """Middle of the coil sets that share a command, x and y [m]: the places a control law works with."""
        if not self.joined:
            return self.positions
        places = ([self.positions[i] for i in group] for group in self.joined)
        return tuple((sum(x for x, _ in p) / len(p), sum(y for _, y in p) / len(p)) for p in places)

    @property
    def front(self) -> float:
        """Distance of the foremost sets ahead of the centre of gravity, a_F [m]."""
        return max(x for x, _ in self.positions)

    @property
    def rear(self) -> float:
        """Distance of the hindmost sets behind the centre of gravity, a_R [m]."""
        return -min(x for x, _ in self.positions)

    @property
    def sides(self) -> tuple[int, ...]:
        """+1 for right-hand sets, −1 for left-hand ones."""
        return tuple(1 if y > 0 else -1 for _, y in self.positions)

    def with_values(self, **changed) -> "Vehicle":
        """The same vehicle with some fields replaced."""
        return replace(self, **changed)

    def with_extras(self, **changed) -> "Vehicle":
        """The same vehicle with some of its extra physics replaced."""
        return replace(self, extras=replace(self.extras, **changed))

    def rows(self) -> list[Row]:
        return [
            ("mass", self.mass, "kg"),
            ("roll inertia A", self.roll_inertia, "kg m²"),
            ("pitch inertia B", self.pitch_inertia, "kg m²"),
            ("yaw inertia C", self.yaw_inertia, "kg m²"),
            ("front arm a_F", self.front, "m"),
            ("rear arm a_R", self.rear, "m"),
            ("depth c", self.depth, "m"),
            ("speed", self.speed, "m/s"),
            ("current lag", self.extras.current_lag, "s"),
            ("gravity term", self.extras.gravity_term, ""),
        ]


def _at_least_zero(name: str, value) -> None:
    if not value >= 0:
        raise InputError(f"{name} must not be negative; got {value!r}. Zero leaves the effect out.")
