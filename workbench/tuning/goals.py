"""Every kind of goal by one import: poles, gains, loop shapes, margins, sectors, noise, time responses."""

from workbench.tuning.goal import Bound, Goal, Value
from workbench.tuning.goal_gain import Gain, Tracking, WeightedGain
from workbench.tuning.goal_loop import LoopShape, MaxLoopGain, MinLoopGain, Rejection, Sensitivity
from workbench.tuning.goal_margin import DelayMargin, Margins
from workbench.tuning.goal_poles import ControllerPoles, Poles
from workbench.tuning.goal_sector import ConicSector, Passivity, WeightedPassivity
from workbench.tuning.goal_spectrum import RmsLimit, Spectrum
from workbench.tuning.goal_time import Overshoot, StepRejection
from workbench.tuning.goal_tracking import StepTracking, Transient
from workbench.tuning.goal_variance import Variance, WeightedVariance

__all__ = [
    "Bound", "ConicSector", "ControllerPoles", "DelayMargin", "Gain", "Goal", "LoopShape", "Margins", "MaxLoopGain",
    "MinLoopGain", "Overshoot", "Passivity", "Poles", "Rejection", "RmsLimit", "Sensitivity", "Spectrum",
    "StepRejection", "StepTracking", "Tracking", "Transient", "Value", "Variance", "WeightedGain", "WeightedPassivity",
    "WeightedVariance",
]  # fmt: skip
