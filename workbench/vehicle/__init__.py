"""The vehicle: parameters, equations of motion, trim, linearisation to a Plant."""

from workbench.vehicle.parameters import Extras, Vehicle
from workbench.vehicle.linear import Linearisation, linearise
from workbench.vehicle.trim import Trim, trim

__all__ = ["Extras", "Linearisation", "Trim", "Vehicle", "linearise", "trim"]
