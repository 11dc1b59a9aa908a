"""What an analysis looks at: a vehicle's plant and law on a guideway, seen at given points by given sensors."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.control import ModalLaw
from workbench.control.loop import Subject, subject
from workbench.lti import Plant
from workbench.lti.model import Model
from workbench.physics.guideway.roughness import Roughness
from workbench.physics.vehicle.curvature import Bend
from workbench.physics.vehicle.offset import GapOffsets


@dataclass(frozen=True, kw_only=True)
class MotorPoint:
    """A motor about the working point that holds the thrust; its commands count in rated currents.

    rated_current, working_current : peak phase current, and i_q on each side at rest [A];  thrust : held [N]
    forces : (5, 4) force and moment on (Z, Θ, Y, Φ, Ψ) per unit of i_d right, left, i_q right, left [N, N m]
    """

    rated_current: float
    working_current: float
    thrust: float
    forces: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A plant and everything around it that responses depend on.

    plant, law : the vehicle without control, and the structure of its control
    groups : which groups of motion are looked at ("heave_pitch", "sway_roll_yaw", "heave", or "all")
    speed : [m/s];  guideway : roughness of each irregularity type that acts, of A1 … A4
    points : name to (x, y, z) from the centre of gravity [m], where the ride is judged
    accelerometer_bias : constant error of each accelerometer [m/s²]
    sensor_noise : one-sided densities of gap sensors [m/√Hz] and accelerometers [m/s²/√Hz], white and uncorrelated
    current_forces : derivatives of one coil set's lift [N], lateral force [N] and roll moment [N m] by α
    coil_resistance : of one control coil per turn squared [Ω];  main_current : ampere-turns of a main coil [A]
    clearance : least distance of any coil from floor and wall at rest [m]
    motor : a motor whose currents the law may command; None without one
    places : (x, y) of every coil set [m], where the guideway reaches the vehicle;  joined : sets that share a command;
        both empty where every set has a command of its own
    elsewhere : the setting of another vehicle, by values as `analysis.change.KINDS` names them
    offsets : the vehicle at other gaps; None where its coils are not known
    bend : how its forces bend at rest; None where that is not known
    """

    plant: Plant
    law: ModalLaw
    groups: tuple[str, ...]
    speed: float
    guideway: Roughness
    points: Mapping[str, tuple[float, float, float]]
    accelerometer_bias: float
    sensor_noise: tuple[float, float]
    current_forces: tuple[float, float, float]
    coil_resistance: float
    main_current: float
    clearance: tuple[float, float]
    motor: MotorPoint | None = None
    joined: tuple[tuple[int, ...], ...] = ()
    places: tuple[tuple[float, float], ...] = ()
    elsewhere: Callable[[Mapping[str, float]], "Setting"] | None = None
    offsets: GapOffsets | None = None
    bend: Bend | None = None

    @cached_property
    def subjects(self) -> tuple[Subject, ...]:
        """One linear model per group of motion."""
        return tuple(subject(self.plant, self.law, name) for name in self.groups)

    @property
    def sets(self) -> tuple[tuple[float, float], ...]:
        """Places at which the guideway reaches the vehicle."""
        return self.places or self.law.positions

    @property
    def under(self) -> np.ndarray:
        """(commands, sets): mean of the coil sets of each command."""
        if not self.joined:
            return np.eye(self.law.count)
        return np.array([[(i in group) / len(group) for i in range(len(self.sets))] for group in self.joined])

    @property
    def types(self) -> tuple[str, ...]:
        """The irregularity types that act."""
        return self.guideway.types

    @property
    def ends(self) -> tuple[int, int]:
        """Positions of a foremost and a hindmost right-hand coil set."""
        right = [(x, i) for i, (x, y) in enumerate(self.law.positions) if y > 0]
        return max(right)[1], min(right)[1]

    @property
    def delay(self) -> float:
        """Time from the foremost to the hindmost coil set, (a_F + a_R)/V [s]."""
        x = [p[0] for p in self.sets]
        return (max(x) - min(x)) / self.speed


def group_model(group: Subject, law: ModalLaw) -> Model:
    """A group of motion from the law's commands to its sensors, other motions held."""
    seen = group.plant.select(inputs=group.commands, outputs=law.sensors)
    patterns = group.patterns.T
    plant = Plant(
        A=seen.A, B=seen.B @ patterns, C=seen.C, D=seen.D @ patterns,
        states=seen.states, inputs=law.commands, outputs=law.sensors,
    )  # fmt: skip
    return Model(group.name, plant)
