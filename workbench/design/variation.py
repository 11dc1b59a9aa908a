"""Many models of one vehicle: what may differ from the nominal one, and what must hold for each.

    Problem, {parameter: value}  --variant_of-->  Variant: the problem of that vehicle, and how its sensors read
    Box: {parameter: [low, high]} --vertices, points inside--> values

Parameters: factors on masses, inertias, forces and sensor scales (1 is nominal), the centre of gravity's way forward
[m], and the speed [m/s] where the force law comes from coils.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np

from workbench.control import GAIN_NAMES, Gains
from workbench.control.gains import LATERAL, VERTICAL
from workbench.design.problem import Problem
from workbench.errors import InputError, unknown_name
from workbench.goals.ride.decay_rate import STABLE_DECAY, DecayRate
from workbench.goals.ride.requirement import Requirement
from workbench.result import Result, Row, figure

# parameter to (unit, nominal value; None for that of the problem)
PARAMETERS: dict[str, tuple[str, float | None]] = {
    "mass": ("1", 1.0), "cg_forward_m": ("m", 0.0), "roll_inertia": ("1", 1.0), "pitch_inertia": ("1", 1.0),
    "yaw_inertia": ("1", 1.0), "current_force": ("1", 1.0), "gap_force": ("1", 1.0),
    "vertical_sensors": ("1", 1.0), "lateral_sensors": ("1", 1.0), "speed_m_s": ("m/s", None),
}  # fmt: skip
# Of all sensors of one direction reading too much; the same as their filter gains being as much too large.
SENSORS = {"vertical_sensors": VERTICAL, "lateral_sensors": LATERAL}
COSTS = ("nominal", "worst", "mean")
ALL_VERTICES = 9  # up to so many parameters every vertex is looked at, 512 of them
DRAWN = 128  # vertices of a larger box that are looked at besides the middle of every face


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Variant(Result):
    """One vehicle of many.

    name : for people;  values : what differs from the nominal vehicle
    problem : the design problem of this vehicle, with what is asked of every model as its requirements
    """

    name: str
    values: Mapping[str, float]
    problem: Problem

    @property
    def scale(self) -> np.ndarray:
        """(17,) factor that the sensors' scale puts on each of the seventeen parameters."""
        return np.array([self._factor(name) for name in GAIN_NAMES])

    def gains(self, gains: Gains) -> Gains:
        """The gains that this vehicle's sensors make of given ones."""
        changed = {n: self._factor(n) * getattr(gains, n) for n in GAIN_NAMES if self._factor(n) != 1.0}
        return gains.with_values(**changed) if changed else gains

    def _factor(self, name: str) -> float:
        return next((self.values[s] for s, names in SENSORS.items() if s in self.values and name in names), 1.0)

    def rows(self) -> list[Row]:
        return [(name, value, PARAMETERS[name][0]) for name, value in self.values.items()]


@dataclass(frozen=True, slots=True)
class Box:
    """Intervals of parameters; those not named stay nominal."""

    intervals: Mapping[str, tuple[float, float]]

    def __post_init__(self) -> None:
        for name, (low, high) in self.intervals.items():
            if name not in PARAMETERS:
                raise unknown_name("varied parameter", str(name), PARAMETERS)
            positive = PARAMETERS[name][0] != "m"
            if not (np.isfinite([low, high]).all() and low < high and (low > 0 or not positive)):
                raise InputError(
                    f"the interval of {name} must rise{' from a positive value' if positive else ''}; "
                    f"got [{low}, {high}]. Leave the parameter out to keep it nominal."
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Of the parameters that vary."""
        return tuple(self.intervals)

    def at(self, unit: np.ndarray) -> dict[str, float]:
        """Values at a point of the unit cube, clipped to it."""
        share = np.clip(unit, 0.0, 1.0)
        return {
            name: float(low + u * (high - low))
            for (name, (low, high)), u in zip(self.intervals.items(), share, strict=True)
        }

    def corners(self, generator: np.random.Generator) -> np.ndarray:
        """(k, parameters) vertices of the unit cube: all of a small box; of a large one some, and face centres."""
        size = len(self.intervals)
        if size <= ALL_VERTICES:
            return np.array(list(product((0.0, 1.0), repeat=size)), float)
        single = np.vstack([np.where(np.eye(size, dtype=bool)[i], end, 0.5) for i in range(size) for end in (0.0, 1.0)])
        return np.vstack([single, generator.integers(0, 2, size=(DRAWN, size)).astype(float)])


# What a vehicle in service may differ by when nothing else is said (certification: boxes of the proofs).
STANDARD_BOX = Box({
    "mass": (0.85, 1.15), "cg_forward_m": (-0.5, 0.5), "roll_inertia": (0.9, 1.1), "pitch_inertia": (0.9, 1.1),
    "yaw_inertia": (0.9, 1.1), "current_force": (0.9, 1.1), "gap_force": (0.92, 1.08),
})  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Variation:
    """What varies, and what must hold wherever.

    box : intervals, None for named models alone;  models : name to values, always looked at
    requirements : what every model must keep; the problem's own margins if left out
    cost : whose J is made small: the "nominal" vehicle's, the "worst" of the models looked at, or their "mean"
    """

    box: Box | None = None
    models: Mapping[str, Mapping[str, float]] = ()  # type: ignore[assignment]
    requirements: tuple[Requirement, ...] | None = None
    cost: str = "nominal"

    def __post_init__(self) -> None:
        object.__setattr__(self, "models", dict(self.models))
        if self.cost not in COSTS:
            raise unknown_name("cost", str(self.cost), COSTS)
        if self.box is None and not self.models:
            raise InputError("a variation needs a box or at least one model; got neither. Name what varies.")
        for name, values in self.models.items():
            for key, value in values.items():
                if key not in PARAMETERS:
                    raise unknown_name("varied parameter", str(key), PARAMETERS)
                if not np.isfinite(value) or (value <= 0 and PARAMETERS[key][0] != "m"):
                    raise InputError(f"{key} of model {name!r} must be positive and finite; got {value!r}.")

    def asked(self, problem: Problem) -> tuple[Requirement, ...]:
        """What every model must keep; its stability, where nothing else that an unstable loop lacks is asked."""
        own = self.requirements
        asked = tuple(r for r in problem.requirements if r.margin_alone) if own is None else own
        return asked or (DecayRate(STABLE_DECAY),)


def variant_of(
    problem: Problem, values: Mapping[str, float], requirements: tuple[Requirement, ...] | None = None, name: str = ""
) -> Variant:
    """The model with given values of `PARAMETERS`; requirements as the problem's unless given."""
    moved = {k: v for k, v in values.items() if k not in SENSORS and v != PARAMETERS[k][1]}
    one = problem.at(moved) if moved else problem
    if requirements is not None:
        one = one.with_requirements(requirements)
    return Variant(name=name or sentence(values), values=dict(values), problem=one)


def sentence(values: Mapping[str, float]) -> str:
    """What differs from the nominal vehicle, in words: "mass 0.85, speed 40 m/s"."""
    words = []
    for name, value in values.items():
        unit, nominal = PARAMETERS[name]
        if value != nominal:
            plain = name.removesuffix("_m_s").removesuffix("_m").replace("_", " ")
            words.append(f"{plain} {figure(value)} {unit}".removesuffix(" 1"))
    return ", ".join(words) or "nominal"
