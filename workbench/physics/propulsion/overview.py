"""The propulsion of one vehicle in one record: drag law, runs, motor rating, magnet masses.

Every part has its own module; here they stand in the order of the report (Appendix F, sections 3, 6.2 and 7).
"""

from dataclasses import dataclass

from workbench.constants import GRAVITY
from workbench.physics.propulsion.drag import AccelerationRun, DragCurves, DragLaw, constant_acceleration, drag_curves
from workbench.physics.propulsion.magnet import ATHERTON, IWASA, MagnetMass, magnet_mass
from workbench.physics.propulsion.optimal import optimised_schedule
from workbench.physics.propulsion.power_corner import least_power_schedule
from workbench.physics.propulsion.rating import REPORT_MOTOR, MotorRating
from workbench.physics.propulsion.schedule import Demand, SpeedSchedule
from workbench.result import Result, Row

MASS = 45_400.0  # [kg]; this and the next five: report, Appendix F, 3.1 and 3.2
LIFT_OFF = (30.0, 60e3)  # speed [m/s], thrust [N] including the acceleration
CRUISE = (134.0, 41e3)  # speed [m/s], thrust [N]
ACCELERATION = 0.05 * GRAVITY  # [m/s²]
ACCELERATION_LIMIT = 0.15 * GRAVITY  # [m/s²]
FRONTAL_AREA = 8.5  # [m²]
AMPERE_TURNS, COIL_LENGTH, COIL_WIDTH = 500e3, 1.1, 1.0  # motor magnet [A], [m], [m] (report, 6.2)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PropulsionOverview(Result):
    """What it takes to propel one vehicle."""

    law: DragLaw
    drag_coefficient: float  # of the aerodynamic part [1]
    crossover_speed: float | None  # magnetic drag = aerodynamic drag [m/s]
    curves: DragCurves  # over lift-off to cruise, 1 m/s apart or closer
    cruise_power: float  # [W]
    constant: AccelerationRun  # lift-off to cruise at constant acceleration
    schedule: SpeedSchedule  # lift-off to cruise with the least peak power
    optimised_peak_power: float | None  # the same by IPOPT [W], if asked for
    motor: MotorRating
    cruise_current: float  # [A-turns]
    magnets: tuple[MagnetMass, ...]

    def rows(self) -> list[Row]:
        best = int(self.curves.lift_to_drag.argmax())
        rows = [
            *self.law.rows(),
            ("drag coefficient", self.drag_coefficient, "1"),
            ("lift-to-drag ratio at lift-off", float(self.curves.lift_to_drag[0]), "1"),
            (f"  best, at {self.curves.speed[best]:.0f} m/s", float(self.curves.lift_to_drag[best]), "1"),
            ("  at cruise", float(self.curves.lift_to_drag[-1]), "1"),
            ("power at cruise", self.cruise_power, "W"),
            *((f"constant run: {name}", value, unit) for name, value, unit in self.constant.rows()),
            *((f"schedule: {name}", value, unit) for name, value, unit in self.schedule.rows()),
        ]
        if self.optimised_peak_power is not None:
            rows.append(("schedule: peak power by optimisation", self.optimised_peak_power, "W"))
        rows += [
            ("motor, short-term thrust", self.motor.thrust, "N"),
            ("motor, long-term (cruise) current", self.cruise_current, "A"),
            ("  over the short-term current", self.cruise_current / self.motor.current, "1"),
        ]
        for mass in self.magnets:
            rows.append((f"magnet, {mass.conductor.name}", mass.mass, "kg"))
            rows.append(
                (
                    f"  all {mass.magnets} over the vehicle's mass",
                    mass.all_magnets_mass / self.schedule.demand.mass,
                    "1",
                )
            )
        return rows


def propulsion_overview(
    *,
    mass: float = MASS,
    lift_off: tuple[float, float] = LIFT_OFF,
    cruise: tuple[float, float] = CRUISE,
    acceleration: float = ACCELERATION,
    acceleration_limit: float = ACCELERATION_LIMIT,
    thrust_limit: float | None = None,
    time: float | None = None,
    distance: float | None = None,
    frontal_area: float = FRONTAL_AREA,
    motor: MotorRating = REPORT_MOTOR,
    optimise: bool = False,
) -> PropulsionOverview:
    """Everything about the propulsion of one vehicle; the defaults are the report's.

    Parameters
    ----------
    mass : float
        [kg]
    lift_off, cruise : (speed [m/s], thrust [N])
        The lift-off thrust includes `acceleration`.
    acceleration, acceleration_limit : float
        Of the constant run, and of the schedule [m/s²].
    thrust_limit : float, optional
        Of the schedule [N]; by default the motor's short-term thrust, math.inf for none.
    time, distance : float, optional
        What the schedule may take, one of the two [s], [m]; by default the constant run's time.
    frontal_area : float
        [m²]
    motor : MotorRating
    optimise : bool
        Also solve the schedule by IPOPT.

    Raises InputError for numbers that make no sense, InfeasibleError for limits that the vehicle cannot meet.
    """
    law = DragLaw.from_thrusts(mass=mass, slow=lift_off, acceleration=acceleration, fast=cruise)
    v0, v1 = lift_off[0], cruise[0]
    constant = constant_acceleration(law, mass=mass, initial_speed=v0, final_speed=v1, acceleration=acceleration)
    demand = Demand(
        law=law,
        mass=mass,
        initial_speed=v0,
        final_speed=v1,
        acceleration_limit=acceleration_limit,
        thrust_limit=motor.thrust if thrust_limit is None else thrust_limit,
        time=constant.time if time is None and distance is None else time,
        distance=distance,
    )
    points = max(2, int(v1 - v0) + 1)
    iwasa = magnet_mass(IWASA, ampere_turns=AMPERE_TURNS, length=COIL_LENGTH, width=COIL_WIDTH, magnets=motor.coils)
    atherton = magnet_mass(  # in the same dewar, as in the report
        ATHERTON, ampere_turns=AMPERE_TURNS, length=COIL_LENGTH, width=COIL_WIDTH, magnets=motor.coils, bore=iwasa.bore
    )
    return PropulsionOverview(
        law=law,
        drag_coefficient=law.drag_coefficient(frontal_area),
        crossover_speed=law.crossover_speed,
        curves=drag_curves(law, [v0 + (v1 - v0) * i / (points - 1) for i in range(points)], mass=mass),
        cruise_power=float(law.power(v1)),
        constant=constant,
        schedule=least_power_schedule(demand),
        optimised_peak_power=optimised_schedule(demand).peak_power if optimise else None,
        motor=motor,
        cruise_current=motor.current_for(cruise[1]),
        magnets=(iwasa, atherton),
    )
