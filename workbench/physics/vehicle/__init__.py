"""The vehicle: parameters, equations of motion, operating points, trim, linearisation to a Plant."""

from workbench.physics.vehicle.conditions import Conditions, Curve, SideWind
from workbench.physics.vehicle.flight import flight
from workbench.physics.vehicle.linear import Linearisation, current_forces, linearise
from workbench.physics.vehicle.operating import OperatingPoint, operating_point
from workbench.physics.vehicle.parameters import Extras, Vehicle
from workbench.physics.vehicle.trim import Trim, trim
from workbench.physics.vehicle.variation import varied

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
