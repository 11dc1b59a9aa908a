"""The motor as part of the vehicle: the thrust it holds, the stiffness that comes with it, its currents as inputs.

    HybridMotor, thrust --working point--> i_q on each side, i_d = 0 --> stiffness, force per current
    Plant of the vehicle --those forces enter as loads--> Plant with commands and currents of the motor

Motor commands count in rated currents: 1 asks for the rated peak current. Currents d and q are in the axes of the
synchronous pattern, i_d > 0 draws a side's magnets inwards, i_q > 0 drives forward (`forces.motor.hybrid`).
Source: report, Appendix F, 6.
"""

from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.lti import Plant
from workbench.lti.front import lagged, matrices
from workbench.lti.join import wired
from workbench.lti.signals import COORDINATES, set_signals
from workbench.physics.motor.hybrid import HybridForces, HybridMotor
from workbench.result import Result, Row

AXES = ("motor_d", "motor_q")
DRIVEN = tuple(f"{axis}_{side}" for axis in AXES for side in ("right", "left"))  # of command_… and current_…
LOADS = (
    "force_z",
    "moment_pitch",
    "force_y",
    "moment_roll",
    "moment_yaw",
)  # a plant's inputs, in the order of COORDINATES
_ORDER = [0, 2, 1, 3]  # DRIVEN among the currents of `forces.motor.hybrid`: i_dR, i_qR, i_dL, i_qL


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MotorDrive(Result):
    """A hybrid motor that holds a thrust with equal i_q on both sides, about which its currents may be varied.

    Parameters
    ----------
    motor : HybridMotor
    thrust : float
        Of both sides together [N].
    current_lag : float
        Time constant of each current loop, 1/(1 + T s) [s].
    """

    motor: HybridMotor
    thrust: float
    current_lag: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.current_lag < np.inf:
            raise InputError(
                f"the motor's current_lag must not be negative; got {self.current_lag!r} s. Zero leaves it out."
            )
        if not abs(self.thrust) < np.inf:
            raise InputError(f"the motor's thrust must be finite; got {self.thrust!r} N. Give the drag at cruise.")
        if not abs(self.working_current) <= self.rated_current:
            raise InputError(
                f"the thrust must not exceed what the rated current of {self.rated_current:g} A gives; "
                f"{self.thrust:g} N needs {self.working_current:.4g} A on each side. "
                "Lower it, raise the rated current or add coils."
            )

    @property
    def rated_current(self) -> float:
        """Peak phase current that a command of 1 asks for [A]."""
        return self.motor.winding.current

    @property
    def working_current(self) -> float:
        """i_q on each side that holds the thrust [A], peak."""
        row = self.motor.forces().thrust_row
        return float(self.thrust / (row[1] + row[3]))

    @property
    def working_point(self) -> HybridForces:
        """Forces, stiffness and input matrix where the thrust is held, vehicle in its nominal pose."""
        i_q = self.working_current
        return self.motor.forces((0.0, i_q, 0.0, i_q))

    @property
    def stiffness(self) -> np.ndarray:
        """(5, 5) derivative of force and moment by the pose at the working point, order of COORDINATES."""
        return self.working_point.stiffness

    @property
    def input_matrix(self) -> np.ndarray:
        """(5, 4) force and moment per unit of each of DRIVEN [N, N m]."""
        return self.rated_current * self.working_point.input_matrix[:, _ORDER]

    def rows(self) -> list[Row]:
        B = self.input_matrix
        return [
            ("thrust", self.thrust, "N"),
            ("i_q on each side", self.working_current, "A"),
            ("rated current", self.rated_current, "A"),
            ("current lag", self.current_lag, "s"),
            ("side force at rated antisymmetric i_d", float(abs(B[2, 0] - B[2, 1])), "N"),
            ("yaw moment at rated antisymmetric i_q", float(abs(B[4, 2] - B[4, 3])), "N m"),
        ]


def with_motor(plant: Plant, drive: MotorDrive) -> Plant:
    """The vehicle's plant with a motor on it: inputs command_… and outputs (with lag, states) current_… of `DRIVEN`.

    The motor's forces act as the plant's own loads do: forces along the axes of the guideway, moments about those of
    the body. What the mean thrust does at rest is balanced by the trim.

    Raises
    ------
    InputError
        If only one of motor and coils has a current lag.
    """
    n = len(plant.states)
    commands, currents = tuple(f"command_{d}" for d in DRIVEN), tuple(f"current_{d}" for d in DRIVEN)
    coils_lag = not set(plant.states).isdisjoint(set_signals(n))
    if coils_lag != (drive.current_lag > 0):
        raise InputError(
            "either both or neither of motor and control coils must have a current lag; got "
            f"{drive.current_lag:g} s for the motor and {'one' if coils_lag else 'none'} for the coils. "
            "Set both current lags."
        )
    m, p, k = len(plant.inputs), len(plant.outputs), len(DRIVEN)
    loads = np.eye(m)[:, plant.index("inputs", LOADS)]
    spring = loads @ drive.stiffness @ np.eye(p)[plant.index("outputs", COORDINATES)]
    into = np.column_stack([loads @ drive.input_matrix, np.eye(m)])
    A, B, C, D = wired(matrices(plant), spring, into, np.eye(p), np.zeros((p, k + m)))
    driven = Plant(A=A, B=B, C=C, D=D, states=plant.states, inputs=currents + plant.inputs, outputs=plant.outputs)
    return lagged(driven, currents, commands, drive.current_lag)
