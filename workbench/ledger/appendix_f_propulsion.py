"""Appendix F, sections 3, 4, 7.2 and 7.3: our number for every number on thrust, power, fuel and magnet mass.

Rows in appendix_f_propulsion.toml. The motor's forces (sections 5, 6, 7.1) have a ledger of their own.
"""

import numpy as np

from workbench.constants import GRAVITY
from workbench.ledger.baseline import report_vehicle
from workbench.physics.coils import REPORT_PLATE, plane_forces
from workbench.physics.forces.corner import CornerLaw
from workbench.physics.forces.energy import CoilSet
from workbench.physics.forces.operating import REPORT_GAP, REPORT_SETS, REPORT_SPEED, REPORT_WEIGHT
from workbench.physics.propulsion.drag import DragLaw, constant_acceleration
from workbench.physics.propulsion.magnet import ATHERTON, IWASA, magnet_mass
from workbench.physics.propulsion.overview import (
    ACCELERATION,
    AMPERE_TURNS,
    COIL_LENGTH,
    COIL_WIDTH,
    CRUISE,
    LIFT_OFF,
    MASS,
)
from workbench.physics.propulsion.power_corner import least_power_schedule
from workbench.physics.propulsion.rating import fuel_fraction
from workbench.physics.propulsion.schedule import Demand

ROUNDED_G = 9.807  # [m/s²], with which 3.1 prints the weight in kN
TONNE, HOUR = 1000.0, 3600.0
CRUISE_DRAG = 41.37e3  # a cruise thrust that prints as 41 kN and reproduces every figure of 3.2 [N]
PRINTED_BORE = 0.106  # [m] (7.3)
CC, SQUARE_CM = 1e-6, 1e-4  # [m³], [m²]


def computed() -> dict[str, float]:
    """Row id → our number, in the unit of the row."""
    return _requirements() | _masses()


def _requirements() -> dict[str, float]:
    from scipy.constants import mph, pound

    v0, v1 = LIFT_OFF[0], CRUISE[0]
    law = DragLaw.from_thrusts(mass=MASS, slow=LIFT_OFF, acceleration=ACCELERATION, fast=CRUISE)
    unrounded = DragLaw.from_thrusts(mass=MASS, slow=LIFT_OFF, acceleration=ACCELERATION, fast=(v1, CRUISE_DRAG))
    printed = DragLaw(magnetic=2e5, aerodynamic=1.3)
    run = constant_acceleration(law, mass=MASS, initial_speed=v0, final_speed=v1, acceleration=ACCELERATION)
    weight = MASS * GRAVITY
    fastest = 3 * ACCELERATION  # 0.15 g, the limit of 3.2
    demand = Demand(
        law=law, mass=MASS, initial_speed=v0, final_speed=v1, acceleration_limit=fastest, distance=run.distance
    )  # fmt: skip
    acceleration = _accelerations(least_power_schedule(demand))
    fuel = fuel_fraction(rate=2.6 * TONNE / HOUR, duration=2 * HOUR, mass=MASS)
    fuel_with_reserve = fuel_fraction(rate=2.6 * TONNE / HOUR, duration=2 * HOUR, mass=MASS, reserve=0.15)
    return {
        "F.3.1.mass": 100_000 * pound,
        "F.3.1.weight": 100_000 * pound * ROUNDED_G / 1e3,
        "F.3.1.acceleration_at_lift_off": (LIFT_OFF[1] - float(printed.force(v0))) / weight,
        "F.3.1.coil_current": _coil_current() / 1e3,
        "F.3.1.coils_per_corner": float(report_vehicle().count / 4),
        "F.3.2.falling_acceleration": acceleration[0] / acceleration[-1],
        "F.3.1.thrust_lift_off": (float(printed.force(v0)) + MASS * ACCELERATION) / 1e3,
        "F.3.1.thrust_cruise": float(printed.force(v1)) / 1e3,
        "F.3.2.C_m": law.magnetic,
        "F.3.2.C_a": law.aerodynamic,
        "F.3.2.crossover": _speed(law.crossover_speed),
        "F.3.2.crossover_unrounded": _speed(unrounded.crossover_speed),
        "F.3.2.crossover_mph": 117 / mph,
        "F.3.2.lift_to_drag": float(law.lift_to_drag(_speed(law.least_drag_speed), weight)),
        "F.3.2.power_cruise": float(law.power(v1)) / 1e6,
        "F.3.2.power_ratio": float(law.power(v1)) / float(law.power(v0)),
        "F.3.2.time": run.time,
        "F.3.2.distance": run.distance / 1e3,
        "F.3.2.power_peak": run.peak_power / 1e6,
        "F.4.3.1.fuel": 100 * fuel,
        "F.4.3.1.fuel_with_reserve": 100 * fuel_with_reserve,
    }


def _accelerations(schedule) -> np.ndarray:
    """Over the schedule's samples [m/s²]."""
    return np.diff(schedule.speeds) / np.diff(schedule.times)


def _coil_current() -> float:
    """Ampere-turns of each of eight coils of 0.5 m × 1.5 m at 30 cm, two at each corner, neighbours left out [A]."""
    coils = CoilSet(width=0.5, length=1.5, control_width=0.5, control_length=1.5, control_offset=(0.0, 0.0, -0.1))
    law = CornerLaw(coils=coils, gap=REPORT_GAP, gap_lateral=REPORT_GAP, current=1e3, lift_ratio=1.0, drag_ratio=0.0)
    plane = plane_forces(coils.width, coils.length, REPORT_GAP, REPORT_SPEED, REPORT_PLATE)
    lift = 2 * REPORT_SETS * plane.lift_ratio * law.forces(0.0, 0.0, 0.0, 0.0)[0]
    return 1e3 * float(np.sqrt(REPORT_WEIGHT / lift))


def _speed(speed: float | None) -> float:
    return float("nan") if speed is None else speed


def _masses() -> dict[str, float]:
    iwasa = magnet_mass(IWASA, ampere_turns=AMPERE_TURNS, length=COIL_LENGTH, width=COIL_WIDTH, bore=PRINTED_BORE)
    bundle = magnet_mass(IWASA, ampere_turns=AMPERE_TURNS, length=COIL_LENGTH, width=COIL_WIDTH)
    atherton = magnet_mass(ATHERTON, ampere_turns=AMPERE_TURNS, length=COIL_LENGTH, width=COIL_WIDTH, bore=PRINTED_BORE)
    return {
        "F.7.2.iwasa_section": iwasa.section / SQUARE_CM,
        "F.7.2.length": iwasa.length,
        "F.7.2.iwasa_volume": iwasa.conductor_volume / CC,
        "F.7.2.iwasa_volume_used": iwasa.conductor_volume / CC,
        "F.7.2.iwasa_nbti_volume": iwasa.superconductor_volume / CC,
        "F.7.2.iwasa_aluminium_volume": iwasa.stabiliser_volume / CC,
        "F.7.2.iwasa_aluminium_volume_used": iwasa.stabiliser_volume / CC,
        "F.7.2.iwasa_nbti_mass": iwasa.superconductor_mass,
        "F.7.2.iwasa_aluminium_mass": iwasa.stabiliser_mass,
        "F.7.2.iwasa_conductor_mass": iwasa.conductor_mass,
        "F.7.2.atherton_section": atherton.section / SQUARE_CM,
        "F.7.2.atherton_volume": atherton.conductor_volume / CC,
        "F.7.2.atherton_nbti_volume": atherton.superconductor_volume / CC,
        "F.7.2.atherton_copper_volume": atherton.stabiliser_volume / CC,
        "F.7.2.atherton_nbti_mass": atherton.superconductor_mass,
        "F.7.2.atherton_copper_mass": atherton.stabiliser_mass,
        "F.7.2.atherton_conductor_mass": atherton.conductor_mass,
        "F.7.3.bore": bundle.bore * 100,
        "F.7.3.wall_area": iwasa.wall_area / SQUARE_CM,
        "F.7.3.dewar_volume": iwasa.dewar_volume / CC,
        "F.7.3.dewar_mass_report": iwasa.dewar_mass_report,
        "F.7.3.dewar_mass": iwasa.dewar_mass,
        "F.7.3.iwasa_total_report": iwasa.mass_report,
        "F.7.3.iwasa_total": iwasa.mass,
        "F.7.3.atherton_total_report": atherton.mass_report,
        "F.7.3.atherton_total": atherton.mass,
    }
