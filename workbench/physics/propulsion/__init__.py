"""Drag and thrust, speed schedules, motor rating, magnet mass, propulsion noise (report, Appendices E and F)."""

from workbench.physics.propulsion.drag import AccelerationRun, DragCurves, DragLaw, constant_acceleration, drag_curves
from workbench.physics.propulsion.magnet import ATHERTON, IWASA, Conductor, MagnetMass, magnet_mass
from workbench.physics.propulsion.noise import (
    NoiseBudget,
    Source,
    Step,
    at_distance,
    energy_sum,
    noise_budget,
    of_units,
    report_sources,
)
from workbench.physics.propulsion.optimal import optimised_schedule
from workbench.physics.propulsion.overview import PropulsionOverview, propulsion_overview
from workbench.physics.propulsion.power_corner import least_power_schedule
from workbench.physics.propulsion.rating import MotorRating, coils_for, fuel_fraction
from workbench.physics.propulsion.schedule import Demand, SpeedSchedule, Stretch

__all__ = [
    "ATHERTON",
    "IWASA",
    "AccelerationRun",
    "Conductor",
    "Demand",
    "DragCurves",
    "DragLaw",
    "MagnetMass",
    "MotorRating",
    "NoiseBudget",
    "PropulsionOverview",
    "Source",
    "SpeedSchedule",
    "Step",
    "Stretch",
    "at_distance",
    "coils_for",
    "constant_acceleration",
    "drag_curves",
    "energy_sum",
    "fuel_fraction",
    "least_power_schedule",
    "magnet_mass",
    "noise_budget",
    "of_units",
    "optimised_schedule",
    "propulsion_overview",
    "report_sources",
]
