"""Time histories of the nonlinear vehicle under its control, one by one or many at random."""

from workbench.simulation.course import Scaled, ShapedGuideway
from workbench.simulation.ensemble import MonteCarlo, monte_carlo
from workbench.simulation.history import Contact, History
from workbench.simulation.load import Failure, Gust, LoadStep
from workbench.simulation.rig import Rig
from workbench.simulation.simulate import simulate

__all__ = [
    "Contact",
    "Failure",
    "Gust",
    "History",
    "LoadStep",
    "MonteCarlo",
    "Rig",
    "Scaled",
    "ShapedGuideway",
    "monte_carlo",
    "simulate",
]
