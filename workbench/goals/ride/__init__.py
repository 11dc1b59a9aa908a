"""What is asked of a vehicle's ride: each kind in its own file, in the order in which results list them.

data key, limit --> Requirement --steer(Evaluated)--> rows --judge(Flown)--> Verdicts
"""

from workbench.goals.registry import register
from workbench.goals.ride.break_point import DelayBorne, DiskMargin, GainMargin, PhaseMargin
from workbench.goals.ride.corner import CornerDecay
from workbench.goals.ride.cost import RideCost
from workbench.goals.ride.currents import MeanSquareCurrents
from workbench.goals.ride.damping_ratio import DampingRatio
from workbench.goals.ride.decay_rate import DecayRate
from workbench.goals.ride.delay_margin import PatternDelayMargin
from workbench.goals.ride.motor_current import MotorCurrent
from workbench.goals.ride.nonlinear import ContactsPerHour, NonlinearRideCost
from workbench.goals.ride.other_loop import (
    FrozenDamping,
    SampledDamping,
    SampledDecay,
    SampledPeak,
    VariedDamping,
    VariedDecay,
    VariedPeak,
    VariedRms,
)
from workbench.goals.ride.peak_change import PeakGapChange
from workbench.goals.ride.peak_sensitivity import PeakSensitivity
from workbench.goals.ride.ride_mask import RideMask
from workbench.goals.ride.rms_gap import RmsGap
from workbench.goals.ride.static_error import StaticGapError

for cls in (
    DampingRatio, DecayRate, PeakSensitivity, PatternDelayMargin, RmsGap, MeanSquareCurrents, StaticGapError,
    PeakGapChange, RideMask, MotorCurrent, RideCost, DiskMargin, GainMargin, PhaseMargin, DelayBorne, VariedDamping,
    VariedDecay, VariedPeak, SampledDamping, SampledDecay, SampledPeak, FrozenDamping,
    CornerDecay, VariedRms, NonlinearRideCost, ContactsPerHour,
):  # fmt: skip
    register(cls)
