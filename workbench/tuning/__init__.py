"""Fixed-structure tuning: models, controller structures with tunable parameters, loops, goals, the tuner.

    Model ──┐                        ┌──► goals ──► tune
            ├──► Loop ──► channels ──┘
Structure ──┘
"""

from workbench.tuning.blocks import gain, lead_lag, low_pass, low_pass_second, notch, pid, pid_two_degrees, washout
from workbench.tuning.blocks_space import expression, modal_law, state_space, transfer_function
from workbench.tuning.channel import Channel
from workbench.tuning.goal import Goal, Value
from workbench.tuning.goal_gain import Gain, Tracking, WeightedGain
from workbench.tuning.goal_loop import LoopShape, MaxLoopGain, MinLoopGain, Rejection, Sensitivity
from workbench.tuning.goal_margin import DelayMargin, Margins
from workbench.tuning.goal_poles import ControllerPoles, Poles
from workbench.tuning.goal_sector import ConicSector, Passivity, WeightedPassivity
from workbench.tuning.goal_spectrum import RmsLimit, Spectrum
from workbench.tuning.goal_time import Overshoot, StepRejection
from workbench.tuning.goal_tracking import StepTracking, Transient
from workbench.tuning.goal_variance import Variance, WeightedVariance
from workbench.tuning.joined import Structure
from workbench.tuning.loop import Loop
from workbench.tuning.model import DelayLine, Model
from workbench.tuning.nonsmooth import Minimum, minimise
from workbench.tuning.stabilise import Stabilised, stabilise
from workbench.tuning.static_feedback import StaticFeedback, static_feedback
from workbench.tuning.structure import Block, Controller, Parameter
from workbench.tuning.transfer import transfer_model
from workbench.tuning.tune import Progress, tune
from workbench.tuning.tune_result import Tuning
from workbench.tuning.tune_robust import RobustTuning, tune_robust

__all__ = [
    "Block", "Channel", "ConicSector", "Controller", "ControllerPoles", "DelayLine", "DelayMargin", "Gain", "Goal",
    "Loop", "LoopShape", "Margins", "MaxLoopGain", "MinLoopGain", "Minimum", "Model", "Overshoot", "Parameter",
    "Passivity", "Poles", "Progress", "Rejection", "RmsLimit", "RobustTuning", "Sensitivity", "Spectrum", "Stabilised",
    "StaticFeedback", "StepRejection", "StepTracking", "Structure", "Tracking", "Transient", "Tuning", "Value",
    "Variance", "WeightedGain", "WeightedPassivity", "WeightedVariance", "expression", "gain", "lead_lag", "low_pass",
    "low_pass_second", "minimise", "modal_law", "notch", "pid", "pid_two_degrees", "stabilise", "state_space",
    "static_feedback", "transfer_function", "transfer_model", "tune", "tune_robust", "washout",
]  # fmt: skip
