"""The vehicle: parameters, equations of motion, trim, linearisation to a Plant."""

from workbench.vehicle.parameters import Extras, Vehicle
from workbench.vehicle.linear import Linearisation, current_forces, linearise
from workbench.vehicle.trim import Trim, trim
from workbench.vehicle.variation import varied

__all__ = ["Extras", "Linearisation", "Trim", "Vehicle", "current_forces", "linearise", "trim", "varied"]
