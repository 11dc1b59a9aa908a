"""What makes the models of a problem: given systems, a function of values, a vehicle.

    maker.systems --> the linear models that are controlled      maker.at({name: value}) --> the maker elsewhere

Values are whatever the maker knows by name: a vehicle its masses, forces and speed, a function its own arguments. So
variations, boxes, schedules and failures ask for other models in one way.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

from workbench.analysis.setting import Setting, group_model
from workbench.control import GAIN_NAMES, Gains, ModalLaw
from workbench.control.gains import GAIN_UNITS, TIME_CONSTANTS
from workbench.control.loop import GROUPS, subject
from workbench.control.structure.space import modal_law
from workbench.control.structure.structure import Structure
from workbench.errors import InputError, unknown_name
from workbench.lti.model import Model
from workbench.physics.vehicle import Vehicle


class Maker(Protocol):
    """What makes models."""

    @property
    def systems(self) -> tuple[Model, ...]:
        """The models, of distinct names."""
        ...

    def at(self, values: Mapping[str, float]) -> "Maker":
        """The maker under other values; refuses what it does not know."""
        ...


@dataclass(frozen=True, slots=True)
class Given:
    """Models as they are; nothing about them varies."""

    systems: tuple[Model, ...]

    def at(self, values: Mapping[str, float]) -> "Given":
        """Itself where nothing differs."""
        if values:
            raise InputError(
                f"these models are given as they are; {', '.join(map(repr, values))} cannot be varied. "
                "Give models=design.models.Made(function, values), or a vehicle."
            )
        return self


@dataclass(frozen=True, slots=True)
class Made:
    """Models that a function makes of values.

    function : mapping of name to value -> Model or several;  values : of the models that are designed for
    """

    function: Callable[[Mapping[str, float]], Model | Sequence[Model]]
    values: Mapping[str, float]
    systems: tuple[Model, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "systems", several(self.function(self.values)))

    def at(self, values: Mapping[str, float]) -> "Made":
        """The models of other values, those not named staying as they are."""
        for name in values:
            if name not in self.values:
                raise unknown_name("value of the models", name, self.values)
        return Made(self.function, {**self.values, **values})


@dataclass(frozen=True, kw_only=True)
class VehicleModels:
    """The motions of a levitated vehicle about its operating point.

    setting : plant, law and guideway at the operating point
    vehicle, rebuild : what the plant was linearised from, and the function that makes a Setting of such a vehicle
    elsewhere : values of `design.variation.PARAMETERS` -> (vehicle, Setting) under them
    """

    setting: Setting
    vehicle: Vehicle | None = None
    rebuild: Callable[[Vehicle], Setting] | None = None
    elsewhere: Callable[[Mapping[str, float]], tuple[Vehicle, Setting]] | None = None

    @property
    def systems(self) -> tuple[Model, ...]:
        """From the commands to the sensors: the whole vehicle where all its motions are looked at, else one model per
        group of motion, with the other motions held."""
        setting = self.setting
        if set(setting.groups) == set(GROUPS):
            return (group_model(subject(setting.plant, setting.law, "all"), setting.law),)
        return tuple(group_model(group, setting.law) for group in setting.subjects)

    def at(self, values: Mapping[str, float]) -> "VehicleModels":
        """The vehicle under other values of `design.variation.PARAMETERS`: speed, mass, forces and so on."""
        if self.elsewhere is None:
            raise InputError("this maker holds one plant alone; give a vehicle to vary, or plants.")
        vehicle, setting = self.elsewhere(values)
        return replace(self, vehicle=vehicle, setting=setting)

    def with_vehicle(self, vehicle: Vehicle) -> "VehicleModels":
        """Another vehicle or operating point."""
        if self.rebuild is None:
            raise InputError("this maker holds a plant without a vehicle behind it; give the plant itself.")
        return replace(self, vehicle=vehicle, setting=self.rebuild(vehicle))

    def alone(self) -> "VehicleModels":
        """The setting without what it came from, so that it travels to another process."""
        return VehicleModels(setting=self.setting)


def vehicle_structure(
    law: ModalLaw, bounds: Mapping[str, tuple[float, float]], fixed: Mapping[str, float], approved: Gains | None = None
) -> Structure:
    """The modal law as a structure: every gain bounded or fixed, free ones starting as approved where that is inside.

    Raises InputError for a gain that is neither or both, and for bounds that do not rise.
    """
    for name in (*bounds, *fixed):
        if name not in GAIN_UNITS:
            raise unknown_name("gain", name, GAIN_UNITS)
    both = sorted(set(bounds) & set(fixed))
    missing = [name for name in GAIN_NAMES if name not in bounds and name not in fixed]
    if both or missing:
        raise InputError(
            "every gain must be either bounded (free) or fixed; "
            f"both: {', '.join(both) or 'none'}, neither: {', '.join(missing) or 'none'}."
        )
    start = dict(fixed)
    for name, (low, high) in bounds.items():
        if not low < high or (name in TIME_CONSTANTS and not low > 0):
            raise InputError(
                f"the bounds of {name} must rise, from a positive value for a time constant; got [{low}, {high}]."
            )
        known = None if approved is None else getattr(approved, name)
        start[name] = known if known is not None and low <= known <= high else (low + high) / 2
    return Structure(modal_law(law, Gains(**start), bounds))


def several(given: Model | Sequence[Model]) -> tuple[Model, ...]:
    """Models as a tuple, of distinct names."""
    models = (given,) if isinstance(given, Model) else tuple(given)
    names = [model.name for model in models]
    if not models or len(set(names)) != len(names):
        raise InputError(f"models must be one or more of distinct names; got {names}. Rename the doubled one.")
    return models


def maker_of(given: Maker | Model | Sequence[Model]) -> Maker:
    """What is given as a problem's models, as a maker of them."""
    made = hasattr(type(given), "systems")  # asked of the type: a maker makes its systems when they are wanted
    return given if made else Given(several(given))  # pyright: ignore[reportReturnType]
