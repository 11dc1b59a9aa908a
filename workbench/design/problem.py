"""A design problem: a vehicle on a guideway, what may be changed, and what must hold."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from workbench.analysis.setting import Setting
from workbench.control import GAIN_NAMES, Gains, ModalLaw
from workbench.control.gains import GAIN_UNITS, TIME_CONSTANTS
from workbench.control.loop import Subject
from workbench.design.requirement import MOTOR_CURRENT, RIDE_MASKS, Requirement
from workbench.errors import InputError, unknown_name
from workbench.result import Result, Row


@dataclass(frozen=True, kw_only=True, repr=False)
class Problem(Result):
    """Everything a design or an analysis starts from.

    name, title : for people
    setting : plant, law and guideway at the operating point
    vehicle, rebuild : what the plant was linearised from, and the function that makes a Setting of such a vehicle
    elsewhere : values of `design.model.PARAMETERS` -> (vehicle, Setting) under them
    requirements : limits
    bounds : allowed interval of each free parameter;  fixed : value of each other parameter
    approved : gains last approved, if any
    sample_time : of the discrete filters [s]
    data_sha256 : of the data file;  sources : block name to source
    variation : `design.model.Variation` that the gains must bear;  plan : `design.scheduled.Plan` of a gain schedule
    """

    name: str
    title: str
    setting: Setting
    vehicle: Any
    rebuild: Callable[[Any], Setting] | None
    requirements: tuple[Requirement, ...]
    bounds: Mapping[str, tuple[float, float]]
    fixed: Mapping[str, float]
    approved: Gains | None
    sample_time: float
    data_sha256: str
    sources: Mapping[str, str]
    elsewhere: Callable[[Mapping[str, float]], tuple[Any, Setting]] | None = None
    variation: Any = None
    plan: Any = None

    def __post_init__(self) -> None:
        for name in (*self.bounds, *self.fixed):
            if name not in GAIN_UNITS:
                raise unknown_name("gain", name, GAIN_UNITS)
        both = sorted(set(self.bounds) & set(self.fixed))
        missing = [name for name in GAIN_NAMES if name not in self.bounds and name not in self.fixed]
        if both or missing:
            raise InputError(
                "every gain must be either bounded (free) or fixed; "
                f"both: {', '.join(both) or 'none'}, neither: {', '.join(missing) or 'none'}."
            )
        for name, (low, high) in self.bounds.items():
            if not low < high or (name in TIME_CONSTANTS and not low > 0):
                raise InputError(
                    f"the bounds of {name} must rise, from a positive value for a time constant; got [{low}, {high}]."
                )
        for r in self.requirements:
            self._check_required(r.name)

    def _check_required(self, name: str) -> None:
        """Refuses a requirement on what the vehicle or its groups do not have: it could only be met by not looking."""
        if name == MOTOR_CURRENT and self.setting.motor is None:
            raise InputError(
                f"{name!r} can be required only of a vehicle whose motor is part of its control; "
                f"problem {self.name!r} has none. Describe the motor in a block [motor], or drop the requirement."
            )
        lateral, groups = "lateral" in name, ", ".join(self.setting.groups)
        if lateral and not {"sway_roll_yaw", "all"} & set(self.setting.groups):
            raise InputError(
                f"{name!r} can be required only where the vehicle moves sideways; problem {self.name!r} looks at "
                f"{groups}. Add the group sway_roll_yaw, or drop the requirement."
            )
        aside = any(y != 0 for _, y, _ in self.setting.points.values())
        rolls_alone = set(self.setting.groups) == {"sway_roll_yaw"}
        if name in RIDE_MASKS and not lateral and rolls_alone and not aside:
            raise InputError(
                f"{name!r} can be required only where a point of the ride moves up and down; problem {self.name!r} "
                f"looks at {groups}. Add the group heave_pitch or a point beside the middle, or drop the requirement."
            )

    def check_one_way(self, cure: str) -> None:
        """Refuses a variation and a schedule together: a schedule is not designed for a variation.

        cure : what its caller may do to choose one
        """
        if self.variation is not None and self.plan is not None:
            raise InputError(
                f"a design takes a [variation] or a [schedule]; problem {self.name!r} describes both: {cure}."
            )

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the free parameters, in the order of `GAIN_NAMES`."""
        return tuple(name for name in GAIN_NAMES if name in self.bounds)

    @property
    def law(self) -> ModalLaw:
        """The control law on the vehicle's coil places."""
        return self.setting.law

    @property
    def gains(self) -> Gains | None:
        """The gains last approved."""
        return self.approved

    @property
    def subjects(self) -> tuple[Subject, ...]:
        """One linear model per group of motion."""
        return self.setting.subjects

    def with_fixed(self, values: Mapping[str, float]) -> "Problem":
        """The same problem with some parameters fixed."""
        for name in values:
            if name not in GAIN_UNITS:
                raise unknown_name("gain", name, GAIN_UNITS)
        bounds = {name: interval for name, interval in self.bounds.items() if name not in values}
        return replace(self, fixed={**self.fixed, **values}, bounds=bounds)

    def with_vehicle(self, vehicle: Any) -> "Problem":
        """The same problem for another vehicle or operating point."""
        if self.rebuild is None:
            raise InputError(f"problem {self.name!r} holds a plant without a vehicle behind it; give the plant itself.")
        return replace(self, vehicle=vehicle, setting=self.rebuild(vehicle))

    def at(self, values: Mapping[str, float]) -> "Problem":
        """The same problem with other values of `design.model.PARAMETERS`: speed, mass, forces and so on."""
        if self.elsewhere is None:
            raise InputError(f"problem {self.name!r} holds one plant alone; give a vehicle to vary, or plants.")
        vehicle, setting = self.elsewhere(values)
        return replace(self, vehicle=vehicle, setting=setting)

    def with_requirements(self, requirements) -> "Problem":
        """The same problem with other limits."""
        return replace(self, requirements=tuple(requirements))

    def rows(self) -> list[Row]:
        return [
            ("problem", self.name, ""),
            ("title", self.title, ""),
            ("groups", ", ".join(self.setting.groups), ""),
            ("free parameters", len(self.free), ""),
            *((f"{r.name} {r.sense}", r.limit, r.unit) for r in self.requirements),
        ]
