"""Every kind of goal that comes with the workbench; importing this registers them all."""

from workbench.goals.gain import Gain, Tracking, WeightedGain
from workbench.goals.goal import Goal
from workbench.goals.integrated_error import IntegratedError
from workbench.goals.loop_shape import LoopShape, MaxLoopGain, MinLoopGain, Rejection, Sensitivity
from workbench.goals.margin import DelayMargin, Margins
from workbench.goals.measure import Bound, Value
from workbench.goals.poles import ControllerPoles, Poles
from workbench.goals.sector import ConicSector, Passivity, WeightedPassivity
from workbench.goals.spectrum import RmsLimit, Spectrum
from workbench.goals.time import Overshoot, StepRejection
from workbench.goals.tracking import StepTracking, Transient
from workbench.goals.variance import Variance, WeightedVariance

__all__ = [
    "Bound", "ConicSector", "ControllerPoles", "DelayMargin", "Gain", "Goal", "IntegratedError", "LoopShape",
    "Margins", "MaxLoopGain", "MinLoopGain", "Overshoot", "Passivity", "Poles", "Rejection", "RmsLimit", "Sensitivity",
    "Spectrum", "StepRejection", "StepTracking", "Tracking", "Transient", "Value", "Variance", "WeightedGain",
    "WeightedPassivity", "WeightedVariance",
]  # fmt: skip
