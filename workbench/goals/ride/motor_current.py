"""What current the motor must bear where it guides as well as drives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.analysis import Analysis
from workbench.analysis.motor import current_at_3_sigma, slope_at_3_sigma
from workbench.analysis.setting import Setting
from workbench.errors import InputError
from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found, Requirement

MOTOR_SQUARES = ("motor d", "motor q")  # classes of mean squares, in rated currents


@dataclass(frozen=True, slots=True, kw_only=True)
class MotorCurrent(Requirement):
    """The motor's current [A] at its mean and three standard deviations on the guideway is at most this."""

    kind, sense, unit = "motor current at mean + 3σ", "<=", "A"
    keys = (Key("motor_current_at_most_a", "limit"),)
    in_analysis = True
    rests_on_squares = True

    def check(self, problem: str, setting: Setting) -> None:
        if setting.motor is None:
            raise InputError(
                f"{self.name!r} can be required only of a vehicle whose motor is part of its control; "
                f"problem {problem!r} has none. Describe the motor in a block [motor], or drop the requirement."
            )

    def steer(self, point: Evaluated) -> Rows:
        limit, motor = self.asked_at(point.back_off), point.setting.motor
        assert motor is not None  # checked when the problem was made
        both = [point.squares[n] for n in MOTOR_SQUARES]
        slope = sum(d * point.slopes[n] for d, n in zip(slope_at_3_sigma(motor, *both), MOTOR_SQUARES, strict=True))
        return [(self.name, np.array([1 - current_at_3_sigma(motor, *both) / limit]), -np.atleast_2d(slope) / limit)]

    def squares(self, analysis: Analysis) -> Mapping[str, float | None]:
        m = analysis.motor
        if m is None or m.rms_d is None or m.rms_q is None:
            return dict.fromkeys(MOTOR_SQUARES)
        rated = np.square(np.array([m.rms_d, m.rms_q]) / m.rated_current)
        return dict(zip(MOTOR_SQUARES, rated.tolist(), strict=True))

    def found(self, loop: Flown) -> Found:
        motor = loop.analysis.motor
        return [(None, "no motor") if motor is None else (motor.current_at_3_sigma, "worse side, guideway")]

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        return ("motor.current_at_3_sigma",)
