"""What control asks of the motor: its currents about the working point, and the work its control forces do.

    Driven, Stationary of each group --Lyapunov--> mean squares of i_d, i_q on each side --mean added--> largest current
    noise of each sensor --H2 norm--> the same from sensor noise alone

A side's current at mean + 3σ is √((3σ_d)² + (|i_q| + 3σ_q)²): both components at their worst at the same time.
"""

from dataclasses import dataclass

import numpy as np

from workbench.analysis.response import Driven
from workbench.analysis.setting import MotorPoint, Setting
from workbench.control.loop import Subject
from workbench.lti import Plant
from workbench.lti.norm import h2_norm
from workbench.lti.signals import COORDINATES
from workbench.lti.variance import Stationary
from workbench.result import Result, Row

SIDES = ("right", "left")
CURRENTS = tuple(f"current_motor_{axis}_{side}" for axis in "dq" for side in SIDES)  # as `vehicle.drive.DRIVEN`
SIGMAS = 3.0
SMALLEST_SQUARE = 1e-12  # of rated current squared; keeps the slope of √ finite where a current stands still


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MotorWork(Result):
    """Currents [A, peak] and powers [W] of the motor at its working point; None where the loop is unstable.

    working_current : mean i_q on each side;  rms_d, rms_q : about the mean, guideway, worse side
    sensor_noise_rms_d, sensor_noise_rms_q : the same from sensor noise alone
    current_at_3_sigma : √((3σ_d)² + (mean i_q + 3σ_q)²), guideway, worse side;  share_of_rated : over the rating
    bearable_roughness : factor on the guideway's spectra at which that current is the rated one, gains unchanged [1]
    propulsion_power : thrust times speed;  power_to_body : what the control currents' forces do to the body, mean
    """

    thrust: float
    working_current: float
    rated_current: float
    rms_d: float | None
    rms_q: float | None
    current_at_3_sigma: float | None
    share_of_rated: float | None
    bearable_roughness: float | None
    sensor_noise_rms_d: float | None
    sensor_noise_rms_q: float | None
    propulsion_power: float
    power_to_body: float | None

    def rows(self) -> list[Row]:
        return [
            ("motor thrust held", self.thrust, "N"),
            ("motor i_q at rest", self.working_current, "A"),
            ("motor i_d, rms", self.rms_d, "A"),
            ("motor i_q, rms about its mean", self.rms_q, "A"),
            ("motor current at mean + 3σ", self.current_at_3_sigma, "A"),
            ("motor current at mean + 3σ over rated", self.share_of_rated, "1"),
            ("roughness for which the rated current suffices", self.bearable_roughness, "1"),
            ("motor i_d from sensor noise, rms", self.sensor_noise_rms_d, "A"),
            ("motor i_q from sensor noise, rms", self.sensor_noise_rms_q, "A"),
            ("motor power, propulsion", self.propulsion_power, "W"),
            ("motor power, control forces to body", self.power_to_body, "W"),
        ]


def motor_squares(setting: Setting, driven: Driven, state: Stationary) -> tuple[np.ndarray, float]:
    """Of one group: mean squares (4,) of `CURRENTS` in rated currents, over all types; mean power to the body [W]."""
    if setting.motor is None:
        return np.zeros(len(CURRENTS)), 0.0
    currents = driven.rows(CURRENTS)
    rates = driven.rows([f"{name}_rate" for name in COORDINATES])
    squares = state.mean_squares(currents).sum(axis=0)
    return squares, float(state.power(currents, setting.motor.forces.T @ rates).sum())


def motor_work(
    setting: Setting, loops: list[tuple[Subject, Plant]], squares: np.ndarray | None, power: float | None
) -> MotorWork | None:
    """The motor's figures from mean squares (4,) and power over all groups; None without a motor."""
    point = setting.motor
    if point is None:
        return None
    rated, amperes, noise, largest, bearable = point.rated_current, None, None, None, None
    if squares is not None:
        amperes = rated * np.sqrt(np.maximum(squares, 0.0)).reshape(2, 2)  # axes × sides
        largest = max(float(current_at_3_sigma(point, *(amperes[:, k] / rated) ** 2)) for k in range(2))
        bearable = min(_bearable_roughness(point, *amperes[:, k]) for k in range(2))
        noise = _noise(setting, loops)
    worst = [None, None] if amperes is None else [float(a) for a in amperes.max(axis=1)]
    heard = [None, None] if noise is None else [float(rated * a) for a in noise]
    return MotorWork(
        thrust=point.thrust, working_current=point.working_current, rated_current=rated, rms_d=worst[0], rms_q=worst[1],
        current_at_3_sigma=largest, share_of_rated=None if largest is None else largest / rated,
        bearable_roughness=bearable, sensor_noise_rms_d=heard[0], sensor_noise_rms_q=heard[1],
        propulsion_power=point.thrust * setting.speed, power_to_body=power,
    )  # fmt: skip


def current_at_3_sigma(point: MotorPoint, square_d: float, square_q: float) -> float:
    """√((3σ_d)² + (|i_q| + 3σ_q)²) [A] from mean squares in rated currents."""
    d, q = _components(point, square_d, square_q)
    return float(np.hypot(d, q))


def slope_at_3_sigma(point: MotorPoint, square_d: float, square_q: float) -> tuple[float, float]:
    """Derivatives of `current_at_3_sigma` by the two mean squares [A]."""
    d, q = _components(point, square_d, square_q)
    size = np.hypot(d, q)
    by_square = point.rated_current * SIGMAS / (2 * np.sqrt(np.array([square_d, square_q]) + SMALLEST_SQUARE))
    return float(d / size * by_square[0]), float(q / size * by_square[1])


def _components(point: MotorPoint, square_d: float, square_q: float) -> tuple[float, float]:
    sigma = point.rated_current * SIGMAS * np.sqrt(np.maximum([square_d, square_q], 0.0))
    return sigma[0], abs(point.working_current) + sigma[1]


def _bearable_roughness(point: MotorPoint, sigma_d: float, sigma_q: float) -> float:
    """Square of the s > 0 that solves (3 s σ_d)² + (|i_q| + 3 s σ_q)² = rated²; infinity for currents at rest."""
    a, b = SIGMAS**2 * (sigma_d**2 + sigma_q**2), SIGMAS * abs(point.working_current) * sigma_q
    room = point.rated_current**2 - point.working_current**2
    return float(room / (b + np.sqrt(b**2 + a * room))) ** 2 if a > 0 and room > 0 else (np.inf if room > 0 else 0.0)


def _noise(setting: Setting, loops: list[tuple[Subject, Plant]]) -> np.ndarray | None:
    """Rms (2,) of i_d and i_q in rated currents from sensor noise, worse side; None where it is infinite (no lag)."""
    gap, acceleration = setting.sensor_noise
    density = np.repeat([gap, gap, acceleration, acceleration], setting.law.count)
    inputs = [f"error_{name}" for name in setting.law.sensors]
    squares = np.zeros(len(CURRENTS))
    for _, closed in loops:
        seen = closed.select(inputs=inputs, outputs=CURRENTS)
        if (seen.D * density).any():
            return None
        # a one-sided density S per hertz is white noise of two-sided intensity S²/2
        B = seen.B * density / np.sqrt(2.0)
        squares += [h2_norm(seen.A, B, row[None, :]) ** 2 if B.any() and row.any() else 0.0 for row in seen.C]
    return np.sqrt(squares.reshape(2, 2).max(axis=1))
