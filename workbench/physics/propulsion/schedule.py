"""What a speed schedule is asked for and what it turned out to be.

    Demand (law, mass, speeds, limits, time or distance) ──► least_power_schedule (power_corner.py, by its shape)
                                                       └───► optimised_schedule   (optimal.py, IPOPT) ──► SpeedSchedule

The question: from one speed to a higher one within a time or a distance, with bounded acceleration and thrust; which
schedule needs the smallest peak power? Level track, no wind, a point mass: m dv/dt = thrust − drag(v).
The report only says that there is an optimum (Appendix F, 3.2); the numbers are ours.
"""

import math
from dataclasses import dataclass

import numpy as np

from workbench.errors import InfeasibleError, InputError
from workbench.physics.propulsion.drag import DragLaw
from workbench.physics.propulsion.quantity import positive
from workbench.result import Result, Row


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Demand(Result):
    """From one speed to another within a time or a distance, under an acceleration and a thrust limit.

    Raises InputError for numbers that make no sense and InfeasibleError if the thrust limit does not exceed the drag
    at every speed on the way. Whether time or distance suffice is checked by the solvers.
    """

    law: DragLaw
    mass: float  # [kg]
    initial_speed: float  # [m/s]
    final_speed: float  # [m/s]
    acceleration_limit: float  # [m/s²]
    thrust_limit: float = math.inf  # [N]; infinite: no limit
    time: float | None = None  # at most [s]
    distance: float | None = None  # at most [m]

    def __post_init__(self) -> None:
        for name, unit in (
            ("mass", "kg"),
            ("initial_speed", "m/s"),
            ("final_speed", "m/s"),
            ("acceleration_limit", "m/s²"),
        ):
            object.__setattr__(self, name, positive(name, getattr(self, name), unit))
        if self.thrust_limit != math.inf:
            object.__setattr__(self, "thrust_limit", positive("thrust_limit", self.thrust_limit, "N"))
        if self.initial_speed >= self.final_speed:
            raise InputError(
                f"the final speed must exceed the initial one; "
                f"got {self.initial_speed:g} to {self.final_speed:g} m/s. Exchange them."
            )
        if (self.time is None) == (self.distance is None):
            raise InputError(
                f"give a time or a distance, one of the two; got time {self.time!r} and distance {self.distance!r}."
            )
        for name, unit in (("time", "s"), ("distance", "m")):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, positive(name, getattr(self, name), unit))
        speed, drag = self.law.largest(self.initial_speed, self.final_speed)
        if self.thrust_limit <= drag:
            raise InfeasibleError(
                f"the thrust must exceed the drag at every speed on the way; the limit is {self.thrust_limit:.6g} N "
                f"and the drag at {speed:g} m/s is {drag:.6g} N. Raise the thrust limit or change that speed."
            )

    @property
    def measure(self) -> str:
        """ "time" or "distance": which of the two is limited."""
        return "distance" if self.time is None else "time"

    @property
    def allowed(self) -> float:
        """The limit of the measure [s or m]."""
        return float(self.time if self.time is not None else self.distance or 0.0)

    @property
    def least_power(self) -> float:
        """Power [W] below which the final speed cannot be held: drag times speed there, approached as time grows."""
        return float(self.law.power(self.final_speed))

    @property
    def largest_power(self) -> float:
        """Power [W] from which on it limits nothing: the other two limits at the final speed."""
        inertia_and_drag = self.mass * self.acceleration_limit + float(self.law.force(self.final_speed))
        return self.final_speed * min(self.thrust_limit, inertia_and_drag)

    def refuse_unless_reachable(self, least: float) -> None:
        """Raises InfeasibleError if less is allowed than the fastest schedule's time [s] or distance [m]."""
        if self.allowed < least * (1 - 1e-12):  # the fastest schedule itself is allowed, rounding included
            unit = "s" if self.measure == "time" else "m"
            raise InfeasibleError(
                f"the {self.measure} must be at least {least:.6g} {unit}, at the acceleration and thrust limits "
                f"throughout; got {self.allowed:.6g} {unit}. Allow more {self.measure} or raise a limit."
            )

    def rows(self) -> list[Row]:
        return [
            ("mass", self.mass, "kg"),
            ("initial speed", self.initial_speed, "m/s"),
            ("final speed", self.final_speed, "m/s"),
            ("acceleration limit", self.acceleration_limit, "m/s²"),
            ("thrust limit", None if self.thrust_limit == math.inf else self.thrust_limit, "N"),
            (f"{self.measure} at most", self.allowed, "s" if self.measure == "time" else "m"),
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """A range of speeds over which one limit holds the vehicle back."""

    limit: str  # "acceleration", "thrust" or "power"
    initial_speed: float  # [m/s]
    final_speed: float  # [m/s]
    time: float  # [s]
    distance: float  # [m]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class SpeedSchedule(Result):
    """A speed schedule, sampled; every array : (n,).

    `marginal_power` is the slope of the peak power against the allowed time [W/s] or distance [W/m]; negative.
    It is None where the schedule is the fastest one or stands at its lower bound, so that there is no slope.
    `stretches` is empty where the method does not tell which limit holds.
    """

    demand: Demand
    method: str
    peak_power: float  # [W]
    time: float  # [s]
    distance: float  # [m]
    peak_thrust: float  # [N]
    energy: float  # thrust times distance [J]
    marginal_power: float | None
    stretches: tuple[Stretch, ...]
    speeds: np.ndarray  # [m/s]
    times: np.ndarray  # [s]
    positions: np.ndarray  # [m]
    thrusts: np.ndarray  # [N]

    @property
    def powers(self) -> np.ndarray:
        """Thrust times speed [W] : (n,)."""
        return self.thrusts * self.speeds

    @property
    def corner_speed(self) -> float | None:
        """Speed [m/s] from which on the power is constant; None if no stretch is at constant power."""
        return next((stretch.initial_speed for stretch in self.stretches if stretch.limit == "power"), None)

    def rows(self) -> list[Row]:
        per = "W/s" if self.demand.measure == "time" else "W/m"
        summary: list[Row] = [
            ("peak power", self.peak_power, "W"),
            ("time", self.time, "s"),
            ("distance", self.distance, "m"),
            ("peak thrust", self.peak_thrust, "N"),
            ("energy", self.energy, "J"),
            (f"peak power per {self.demand.measure} allowed", self.marginal_power, per),
        ]
        for stretch in self.stretches:
            summary.append((f"{stretch.limit} limit up to", stretch.final_speed, "m/s"))
        return summary
