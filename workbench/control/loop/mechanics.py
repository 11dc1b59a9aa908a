"""A vehicle's second-order form, read back from its Plant by the names of the signals.

    Plant (first order, accelerations)  -->  I q̈ = stiffness q + damping q̇ + current α + exogenous w   (forces)
                                             sensors of the modal channels: gap, acceleration, tilt

The unit loads among the plant's inputs carry the inertia: a force of 1 N accelerates by 1/m. So the polynomial form
of a loop needs the Plant alone, whoever made it.
"""

from dataclasses import dataclass

import numpy as np

from workbench.control.law import ModalLaw
from workbench.errors import InputError
from workbench.lti import Plant
from workbench.lti.signals import COORDINATES, numbered

EXTERNAL = (
    "force_z",
    "moment_pitch",
    "force_y",
    "moment_roll",
    "moment_yaw",
)  # unit loads, in the order of COORDINATES
ROUNDING = 1e-12  # of the largest entry of its kind: what pseudo-inverse and Jacobian leave where a zero belongs


@dataclass(frozen=True, slots=True, kw_only=True)
class Mechanics:
    """Forces of a vehicle and what its sensors make of its motion; coordinates as `lti.signals.COORDINATES`.

    inertia : (5,) [kg, kg m²];  stiffness, damping : (5, 5);  current : (5, n) force per α
    exogenous : (5, m) force per input;  inputs : m names;  lag : time constant of the current loops [s]
    gap, acceleration, tilt : (5, 5) modal gap signal from q, modal acceleration signal from q̈ and from q (gravity)
    guideway : (5, m) modal gap signal from the inputs;  rows as `control.law.CHANNELS`
    """

    inertia: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    current: np.ndarray
    exogenous: np.ndarray
    inputs: tuple[str, ...]
    lag: float
    gap: np.ndarray
    acceleration: np.ndarray
    tilt: np.ndarray
    guideway: np.ndarray

    def by_set(self, kind: str) -> np.ndarray:
        """(5, n): columns of `exogenous` that belong to zeta, eta or bank of sets 1 … n."""
        own = [name for name in numbered(kind, len(self.inputs)) if name in self.inputs]
        return self.exogenous[:, [self.inputs.index(name) for name in own]]


def mechanics(plant: Plant, law: ModalLaw) -> Mechanics:
    """The second-order form of a vehicle's plant, for the sensors and commands of a law.

    Raises
    ------
    InputError
        If the plant lacks a signal that a vehicle's plant has; the sentence names it.
    """
    inputs = tuple(name for name in plant.inputs if name not in law.commands)
    q, rates = plant.index("states", COORDINATES), plant.index("states", [f"{c}_rate" for c in COORDINATES])
    loads, w = plant.index("inputs", EXTERNAL), plant.index("inputs", inputs)
    inertia = 1 / np.diag(plant.B[np.ix_(rates, loads)])
    if not np.all(np.isfinite(inertia)):
        raise InputError(
            f"each of {', '.join(EXTERNAL)} must accelerate its coordinate; one of them does not. "
            "Check the plant's input matrix."
        )
    force = inertia[:, None] * plant.A[rates]
    names = law.currents
    lagged = set(names) <= set(plant.states)
    if lagged:
        states = plant.index("states", names)
        lag, current = -1 / plant.A[states[0], states[0]], force[:, states]
    else:
        lag, current = 0.0, inertia[:, None] * plant.B[np.ix_(rates, plant.index("inputs", law.commands))]
    sensors = plant.index("outputs", law.sensors)
    gaps, accelerations = np.vsplit(law.measurement_matrix(), 2)
    C, D = plant.C[sensors], plant.D[sensors]
    acceleration = accelerations @ D[:, loads] * inertia
    by_motion = plant.A[np.ix_(rates, q)]
    tilt = accelerations @ C[:, q] - acceleration @ by_motion
    left = ROUNDING * np.abs(acceleration).max() * np.abs(by_motion).max()
    return Mechanics(
        inertia=inertia, stiffness=force[:, q], damping=force[:, rates], current=current,
        exogenous=inertia[:, None] * plant.B[np.ix_(rates, w)], inputs=inputs, lag=float(lag),
        gap=cleaned(gaps @ C[:, q]), acceleration=cleaned(acceleration), tilt=np.where(np.abs(tilt) > left, tilt, 0.0),
        guideway=cleaned(gaps @ D[:, w]),
    )  # fmt: skip


def cleaned(matrix: np.ndarray) -> np.ndarray:
    """The matrix with zeros where rounding left something."""
    largest = np.abs(matrix).max() if matrix.size else 0.0
    return np.where(np.abs(matrix) > ROUNDING * largest, matrix, 0.0)
