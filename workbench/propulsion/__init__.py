"""Drag and thrust, speed schedules, motor rating, magnet mass, propulsion noise (report, Appendices E and F)."""

from workbench.propulsion.drag import AccelerationRun, DragCurves, DragLaw, constant_acceleration, drag_curves
from workbench.propulsion.magnet import ATHERTON, IWASA, Conductor, MagnetMass, magnet_mass
from workbench.propulsion.noise import (
    NoiseBudget,
    Source,
    Step,
    at_distance,
    energy_sum,
    noise_budget,
    of_units,
    report_sources,
)
from workbench.propulsion.optimal import optimised_schedule
from workbench.propulsion.overview import PropulsionOverview, propulsion_overview
from workbench.propulsion.power_corner import least_power_schedule
from workbench.propulsion.rating import MotorRating, coils_for, fuel_fraction
from workbench.propulsion.schedule import Demand, Schedule, Stretch

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
    "Schedule",
    "Source",
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
