"""The vehicle: parameters, equations of motion, operating points, trim, linearisation to a Plant."""

from workbench.vehicle.conditions import Conditions, Curve, SideWind
from workbench.vehicle.flight import flight
from workbench.vehicle.linear import Linearisation, current_forces, linearise
from workbench.vehicle.operating import OperatingPoint, operating_point
from workbench.vehicle.parameters import Extras, Vehicle
from workbench.vehicle.trim import Trim, trim
from workbench.vehicle.variation import varied

__all__ = [
    "Conditions",
    "Curve",
    "Extras",
    "Linearisation",
    "OperatingPoint",
    "SideWind",
    "Trim",
    "Vehicle",
    "current_forces",
    "flight",
    "linearise",
    "operating_point",
    "trim",
    "varied",
]
