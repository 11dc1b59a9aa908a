"""Fixed-structure tuning: models, controller structures with tunable parameters, loops, goals, the tuner.

    Model ──┐                        ┌──► goals ──► tune
            ├──► Loop ──► channels ──┘
Structure ──┘
"""

from workbench.control.structure.block import Block, Controller, Parameter
from workbench.control.structure.blocks import (
    gain,
    lead_lag,
    low_pass,
    low_pass_second,
    notch,
    pid,
    pid_matrix,
    pid_two_degrees,
    washout,
)
from workbench.control.structure.channel import Channel
from workbench.control.structure.loop import Loop
from workbench.control.structure.space import expression, modal_law, state_space, transfer_function
from workbench.control.structure.structure import Structure
from workbench.design.static.feedback import StaticFeedback, static_feedback
from workbench.design.tuner.result import Tuning
from workbench.design.tuner.robust import RobustTuning, tune_robust
from workbench.design.tuner.stabilise import Stabilised, stabilise
from workbench.design.tuner.tune import Progress, tune
from workbench.goals.gain import Gain, Tracking, WeightedGain
from workbench.goals.goal import Goal, Value
from workbench.goals.loop_shape import LoopShape, MaxLoopGain, MinLoopGain, Rejection, Sensitivity
from workbench.goals.margin import DelayMargin, Margins
from workbench.goals.poles import ControllerPoles, Poles
from workbench.goals.sector import ConicSector, Passivity, WeightedPassivity
from workbench.goals.spectrum import RmsLimit, Spectrum
from workbench.goals.time import Overshoot, StepRejection
from workbench.goals.tracking import StepTracking, Transient
from workbench.goals.variance import Variance, WeightedVariance
from workbench.lti.make import tf
from workbench.lti.model import DelayLine, Model
from workbench.solve.nonsmooth import Minimum, minimise

__all__ = [
    "Block", "Channel", "ConicSector", "Controller", "ControllerPoles", "DelayLine", "DelayMargin", "Gain", "Goal",
    "Loop", "LoopShape", "Margins", "MaxLoopGain", "MinLoopGain", "Minimum", "Model", "Overshoot", "Parameter",
    "Passivity", "Poles", "Progress", "Rejection", "RmsLimit", "RobustTuning", "Sensitivity", "Spectrum", "Stabilised",
    "StaticFeedback", "StepRejection", "StepTracking", "Structure", "Tracking", "Transient", "Tuning", "Value",
    "Variance", "WeightedGain", "WeightedPassivity", "WeightedVariance", "expression", "gain", "lead_lag", "low_pass",
    "low_pass_second", "minimise", "modal_law", "notch", "pid", "pid_matrix", "pid_two_degrees", "stabilise",
    "state_space", "static_feedback", "tf", "transfer_function", "tune", "tune_robust", "washout",
]  # fmt: skip
