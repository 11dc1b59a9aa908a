"""Drag of a repulsion vehicle against speed, and what it costs to run against it.

    two thrusts ──► DragLaw ──► drag, power, lift-to-drag ratio ──► DragCurves (numbers over many speeds)
                       └──────► constant acceleration ──► AccelerationRun (time, distance, peak power)

The magnetic part falls with speed (the images sink less power as the sheet looks more like a perfect conductor), the
aerodynamic part rises. Speeds in m/s, positive; forces in N. The schedule that needs the least peak power is in
`schedule.py`. Source: report, Appendix F, sections 3.1 and 3.2.
"""

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from workbench.constants import GRAVITY
from workbench.errors import InputError
from workbench.physics.propulsion.quantity import not_negative, positive
from workbench.result import Result, Row

AIR_DENSITY = 1.225  # dry air at 15 °C and 101 325 Pa [kg/m³], International Standard Atmosphere at sea level


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DragLaw(Result):
    """Drag C_m/√v + C_a v²: a magnetic part that falls with speed, an aerodynamic part that rises.

    Methods that take a speed are elementwise: scalar, DM or SX [m/s].

    Source: report, Appendix F, eq. (1).

    Examples
    --------
    >>> law = DragLaw(magnetic=2.0e5, aerodynamic=1.3)
    >>> print(f"{float(law.force(134.0)):.5g} N")
    40620 N
    """

    magnetic: float  # C_m [N (m/s)^½]
    aerodynamic: float  # C_a [N/(m/s)²]

    def __post_init__(self) -> None:
        for name, unit in (("magnetic", "N (m/s)^½"), ("aerodynamic", "N/(m/s)²")):
            object.__setattr__(self, name, not_negative(f"DragLaw.{name}", getattr(self, name), unit))
        if self.magnetic + self.aerodynamic == 0:
            raise InputError(
                "DragLaw must have some drag; got zero for both parts. Give magnetic, aerodynamic or both."
            )

    @classmethod
    def from_drags(cls, *, slow: tuple[float, float], fast: tuple[float, float]) -> "DragLaw":
        """The law through two points (speed [m/s], drag [N]).

        Raises InputError for equal speeds, and for drags that ask for a negative part.
        """
        v1, D1 = positive("slow speed", slow[0], "m/s"), positive("slow drag", slow[1], "N")
        v2, D2 = positive("fast speed", fast[0], "m/s"), positive("fast drag", fast[1], "N")
        if v1 >= v2:
            raise InputError(
                f"the slow point must be slower than the fast one; got {v1:g} and {v2:g} m/s. Exchange them."
            )
        # D √v = C_m + C_a v^(5/2): a straight line through two points
        C_a = (D2 * v2**0.5 - D1 * v1**0.5) / (v2**2.5 - v1**2.5)
        C_m = D1 * v1**0.5 - C_a * v1**2.5
        if C_a < 0 or C_m < 0:
            raise InputError(
                f"the fast drag must lie between {D1 * (v1 / v2) ** 0.5:.6g} N (all magnetic) and "
                f"{D1 * (v2 / v1) ** 2:.6g} N (all aerodynamic) "
                f"for {D1:.6g} N at {v1:g} m/s; got {D2:.6g} N at {v2:g} m/s. Check the two drags."
            )
        return cls(magnetic=C_m, aerodynamic=C_a)

    @classmethod
    def from_thrusts(
        cls, *, mass: float, slow: tuple[float, float], acceleration: float, fast: tuple[float, float]
    ) -> "DragLaw":
        """The law behind two thrusts: at the slow speed the vehicle still accelerates, at the fast one it cruises.

        Parameters
        ----------
        mass : float
            Mass of the vehicle [kg].
        slow, fast : (speed [m/s], thrust [N])
            Lift-off and cruise in the report: (30, 60e3) and (134, 41e3).
        acceleration : float
            What is left of the slow thrust for accelerating [m/s²]; 0.05 g in the report, whose 60 kN include it
            (read as drag alone they would give C_m = 3.25e5, not the printed 2e5).

        Source: report, Appendix F, 3.1 and 3.2.
        """
        inertia = positive("mass", mass, "kg") * not_negative("acceleration", acceleration, "m/s²")
        drag = positive("slow thrust", slow[1], "N") - inertia
        if drag <= 0:
            raise InputError(
                f"the slow thrust must exceed mass times acceleration, {inertia:.6g} N; got {slow[1]:.6g} N. "
                "Give the whole thrust, drag included, or lower the acceleration."
            )
        return cls.from_drags(slow=(slow[0], drag), fast=fast)

    def magnetic_drag(self, speed):
        """Magnetic drag [N] at a speed [m/s]."""
        return self.magnetic / ca.sqrt(speed)

    def aerodynamic_drag(self, speed):
        """Aerodynamic drag [N] at a speed [m/s]."""
        return self.aerodynamic * speed**2

    def force(self, speed):
        """Drag [N] at a speed [m/s]."""
        return self.magnetic_drag(speed) + self.aerodynamic_drag(speed)

    def power(self, speed):
        """Power [W] spent against drag at a steady speed [m/s]; it rises with speed throughout."""
        return self.force(speed) * speed

    def lift_to_drag(self, speed, weight):
        """Weight [N] over drag [1] at a speed [m/s]."""
        return weight / self.force(speed)

    @property
    def crossover_speed(self) -> float | None:
        """Speed [m/s] at which both parts are equal, (C_m/C_a)^(2/5); None if a part is missing."""
        return (self.magnetic / self.aerodynamic) ** 0.4 if self.magnetic and self.aerodynamic else None

    @property
    def least_drag_speed(self) -> float | None:
        """Speed [m/s] of the smallest drag and so of the best lift-to-drag ratio, (C_m/(4 C_a))^(2/5)."""
        return (self.magnetic / (4 * self.aerodynamic)) ** 0.4 if self.magnetic and self.aerodynamic else None

    def largest(self, slow: float, fast: float) -> tuple[float, float]:
        """(speed [m/s], drag [N]) where drag is largest between two speeds: at an end, because the law is convex."""
        return max(((v, float(self.force(v))) for v in (slow, fast)), key=lambda point: point[1])

    def drag_coefficient(self, frontal_area: float, air_density: float = AIR_DENSITY) -> float:
        """Drag coefficient [1] that the aerodynamic part stands for, 2 C_a/(ρ A), area in m², density in kg/m³."""
        return (
            2
            * self.aerodynamic
            / (positive("air_density", air_density, "kg/m³") * positive("frontal_area", frontal_area, "m²"))
        )

    def rows(self) -> list[Row]:
        return [
            ("magnetic drag constant C_m", self.magnetic, "N (m/s)^½"),
            ("aerodynamic drag constant C_a", self.aerodynamic, "N/(m/s)²"),
            ("magnetic and aerodynamic drag equal at", self.crossover_speed, "m/s"),
            ("least drag at", self.least_drag_speed, "m/s"),
        ]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DragCurves(Result):
    """Drag, power and lift-to-drag ratio over speed; every array : (n,)."""

    speed: np.ndarray  # [m/s]
    magnetic: np.ndarray  # [N]
    aerodynamic: np.ndarray  # [N]
    drag: np.ndarray  # [N]
    power: np.ndarray  # [W]
    lift_to_drag: np.ndarray  # [1]

    def rows(self) -> list[Row]:
        best = int(np.argmax(self.lift_to_drag))
        return [
            ("speeds", self.speed.size, ""),
            ("best lift-to-drag ratio", float(self.lift_to_drag[best]), ""),
            ("  at", float(self.speed[best]), "m/s"),
            ("lift-to-drag ratio at the first speed", float(self.lift_to_drag[0]), ""),
            ("lift-to-drag ratio at the last speed", float(self.lift_to_drag[-1]), ""),
            ("largest drag power", float(self.power.max()), "W"),
        ]


def drag_curves(law: DragLaw, speeds, *, mass: float) -> DragCurves:
    """The law over many speeds.

    Parameters
    ----------
    law : DragLaw
    speeds : (n,)
        Speeds [m/s], positive.
    mass : float
        Mass of the vehicle [kg]; its weight is the lift.

    Raises InputError for an empty or non-positive list of speeds.
    """
    v = np.atleast_1d(np.asarray(speeds, dtype=float))
    if v.ndim != 1 or v.size == 0 or not np.all(np.isfinite(v)) or np.any(v <= 0):
        raise InputError(
            f"speeds must be a list of positive numbers [m/s]; got {str(speeds)[:80]}. "
            "Leave standstill out: magnetic drag has no limit there."
        )
    columns = _curves(law)(v.reshape(1, -1), positive("mass", mass, "kg") * GRAVITY)
    return DragCurves(
        speed=v, **{name: np.array(column).ravel() for name, column in zip(_CURVES, columns, strict=True)}
    )


_CURVES = ("magnetic", "aerodynamic", "drag", "power", "lift_to_drag")


@lru_cache(maxsize=32)
def _curves(law: DragLaw) -> ca.Function:
    """(speed, weight) → the columns of `DragCurves`; a row of speeds maps over its entries."""
    v, weight = ca.SX.sym("v"), ca.SX.sym("weight")
    columns = [law.magnetic_drag(v), law.aerodynamic_drag(v), law.force(v), law.power(v), law.lift_to_drag(v, weight)]
    return ca.Function("drag_curves", [v, weight], columns)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class AccelerationRun(Result):
    """From one speed to another at constant acceleration."""

    time: float  # [s]
    distance: float  # [m]
    peak_thrust: float  # [N]
    peak_power: float  # [W], always at the final speed
    energy: float  # thrust times distance [J]

    def rows(self) -> list[Row]:
        return [
            ("time", self.time, "s"),
            ("distance", self.distance, "m"),
            ("peak thrust", self.peak_thrust, "N"),
            ("peak power", self.peak_power, "W"),
            ("energy", self.energy, "J"),
        ]


def constant_acceleration(
    law: DragLaw, *, mass: float, initial_speed: float, final_speed: float, acceleration: float
) -> AccelerationRun:
    """The run at constant acceleration a: Δt = Δv/a, Δx = Δ(v²)/2a, thrust m a + D(v), power thrust times v.

    Parameters
    ----------
    mass : float
        [kg]
    initial_speed, final_speed : float
        [m/s], increasing
    acceleration : float
        [m/s²]

    The energy is exact: ∫ (m a + C_m v^(-1/2) + C_a v²) v dv / a.
    Source: report, Appendix F, 3.2 (30 to 134 m/s at 0.05 g).

    Examples
    --------
    >>> law = DragLaw(magnetic=2.0e5, aerodynamic=1.3)
    >>> constant_acceleration(law, mass=45400.0, initial_speed=30.0, final_speed=134.0, acceleration=0.05 * 9.80665)
    <AccelerationRun: time 212.1 s, distance 1.739e+04 m, peak thrust 6.288e+04 N, peak power 8.426e+06 W, ...>
    """
    m, a = positive("mass", mass, "kg"), positive("acceleration", acceleration, "m/s²")
    v0, v1 = positive("initial_speed", initial_speed, "m/s"), positive("final_speed", final_speed, "m/s")
    if v0 >= v1:
        raise InputError(f"the final speed must exceed the initial one; got {v0:g} to {v1:g} m/s. Exchange them.")
    drag_work = (law.magnetic * (v1**1.5 - v0**1.5) / 1.5 + law.aerodynamic * (v1**4 - v0**4) / 4) / a
    return AccelerationRun(
        time=(v1 - v0) / a,
        distance=(v1**2 - v0**2) / (2 * a),
        peak_thrust=m * a + law.largest(v0, v1)[1],
        peak_power=v1 * (m * a + float(law.force(v1))),
        energy=m * (v1**2 - v0**2) / 2 + drag_work,
    )
