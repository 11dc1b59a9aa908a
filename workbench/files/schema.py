"""What a problem's data.toml may contain: every key with its unit, nothing else, nothing unfinite."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, JsonValue, model_validator

from workbench.control.gains import GAIN_NAMES
from workbench.design.variation import PARAMETERS
from workbench.errors import unknown_name
from workbench.files.block import Block, Finite, NotNegative, Positive, Source, Switch
from workbench.files.effort import EffortTable
from workbench.files.physics import CornerBlock, ForceLawBlock, OperatingPointBlock, VehicleBlock
from workbench.goals.ride.requirement import limit_keys, margin_kinds

Interval = tuple[Finite, Finite]


class ProblemBlock(Block):
    title: Annotated[str, Field(min_length=3, max_length=200)]
    groups: tuple[Literal["heave_pitch", "sway_roll_yaw", "heave", "all"], ...] = Field(min_length=1, max_length=2)
    ride: Literal["linear", "nonlinear"] = "linear"


class InertiaBlock(Block):
    roll_kg_m2: Positive
    pitch_kg_m2: Positive
    yaw_kg_m2: Positive
    roll_range_kg_m2: Interval | None = None
    pitch_range_kg_m2: Interval | None = None
    yaw_range_kg_m2: Interval | None = None

    @model_validator(mode="after")
    def rigid(self) -> "InertiaBlock":
        """No principal moment of a rigid body exceeds the sum of the other two."""
        a, b, c = self.roll_kg_m2, self.pitch_kg_m2, self.yaw_kg_m2
        if a > b + c or b > a + c or c > a + b:
            raise ValueError(f"no moment of inertia may exceed the sum of the other two; got {a:g}, {b:g}, {c:g} kg m²")
        for name in ("roll", "pitch", "yaw"):
            value, interval = getattr(self, f"{name}_kg_m2"), getattr(self, f"{name}_range_kg_m2")
            if interval is not None and not interval[0] <= value <= interval[1]:
                raise ValueError(
                    f"{name}_kg_m2 must lie in {name}_range_kg_m2, [{interval[0]:g}, {interval[1]:g}]; got {value:g}"
                )
        return self


class PhysicsBlock(Block):
    current_lag_s: NotNegative
    gravity_term: Switch
    coil_length_m: NotNegative = 0.0
    thrust_n: NotNegative = 0.0
    lift_damping_n_s_m: Finite = 0.0
    lateral_damping_n_s_m: Finite = 0.0
    bank_reading: Literal["twist", "section"] = "twist"


Types = Annotated[tuple[Literal["A1", "A2", "A3", "A4"], ...], Field(min_length=1, max_length=4)]
Row4 = tuple[Finite, Finite, Finite, Finite]
Correlation = tuple[Row4, Row4, Row4, Row4]


class PowerLawBlock(Block):
    kind: Literal["power_law"]
    roughness_m: Positive
    corner_frequency_hz: Positive
    types: Types
    correlation: Correlation | None = None


class AmericanBlock(Block):
    kind: Literal["fra"]
    track_class: Annotated[int, Field(ge=1, le=6)]
    extrapolate: Switch = False
    types: Types
    correlation: Correlation | None = None


class GermanBlock(Block):
    kind: Literal["german"]
    level: Literal["low", "high"]
    types: Types
    correlation: Correlation | None = None


class SensorsBlock(Block):
    accelerometer_bias_mg: NotNegative
    gap_noise_um_per_root_hz: NotNegative = 0.0
    acceleration_noise_mm_s2_per_root_hz: NotNegative = 0.0


class ControlCoilBlock(Block):
    turn_length_m: Positive
    conductor_area_cm2: Positive
    resistivity_ohm_m: Positive


class MotorBlock(Block):
    thrust_n: Finite
    drop_m: Finite
    coils_per_side: Annotated[int, Field(ge=1, le=1000)]
    rated_current_a: Positive
    magnet_a_turns: Positive
    pole_pitch_m: Positive
    coil_width_m: Positive
    coil_length_m: Positive
    magnet_offset_m: Positive
    winding_offset_m: Positive
    current_lag_s: NotNegative


class DiscretisationBlock(Block):
    sample_time_s: Positive


class PointsBlock(Block):
    places: dict[Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,30}$")], tuple[Finite, Finite, Finite]] = Field(
        max_length=20
    )


class RequirementsBlock(BaseModel):
    """Limits under the keys of registered requirements (`goals.ride.requirement.limit_keys`); each positive."""

    model_config = ConfigDict(extra="allow", frozen=True)
    source: Source
    __pydantic_extra__: dict[str, Positive]

    @model_validator(mode="after")
    def known(self) -> "RequirementsBlock":
        """Only quantities that can be judged."""
        for name in self.limits():
            if name not in limit_keys():
                raise ValueError(str(unknown_name("requirement", name, limit_keys())).rstrip("."))
        return self

    def limits(self) -> dict[str, float]:
        """Key to value, in the key's unit."""
        return dict(self.__pydantic_extra__ or {})


class GainsBlock(BaseModel):
    """Values or intervals under the seventeen names."""

    model_config = ConfigDict(extra="allow", frozen=True)
    source: Source

    @model_validator(mode="after")
    def known(self):
        """Only the seventeen names."""
        for name in self.entries():
            if name not in GAIN_NAMES:
                raise ValueError(str(unknown_name("gain", name, GAIN_NAMES)).rstrip("."))
        return self

    def entries(self) -> dict:
        """Name to value."""
        return dict(self.__pydantic_extra__ or {})


class BoundsBlock(GainsBlock):
    __pydantic_extra__: dict[str, Interval]


class FixedBlock(GainsBlock):
    __pydantic_extra__: dict[str, Finite]


Rising = tuple[Positive, Positive]
Limits = dict[str, Positive]


class ModelBlock(Block):
    """One vehicle that the gains must bear: factors on the nominal numbers, unless the key names a unit."""

    name: Annotated[str, Field(min_length=1, max_length=60)]
    mass: Positive = 1.0
    cg_forward_m: Finite = 0.0
    roll_inertia: Positive = 1.0
    pitch_inertia: Positive = 1.0
    yaw_inertia: Positive = 1.0
    current_force: Positive = 1.0
    gap_force: Positive = 1.0
    vertical_sensors: Positive = 1.0
    lateral_sensors: Positive = 1.0
    speed_m_s: Positive | None = None

    def values(self) -> dict[str, float]:
        """Parameter to value, of those given."""
        return {n: getattr(self, n) for n in PARAMETERS if n in self.model_fields_set and getattr(self, n) is not None}


class VariationBlock(Block):
    """Intervals in which the gains must keep their margins, worst case; limits of every model where they differ."""

    mass: Rising | None = None
    cg_forward_m: Interval | None = None
    roll_inertia: Rising | None = None
    pitch_inertia: Rising | None = None
    yaw_inertia: Rising | None = None
    current_force: Rising | None = None
    gap_force: Rising | None = None
    vertical_sensors: Rising | None = None
    lateral_sensors: Rising | None = None
    speed_m_s: Rising | None = None
    cost: Literal["nominal", "worst", "mean"] = "nominal"
    limits: Limits = Field(default={}, max_length=20)

    @model_validator(mode="after")
    def known(self) -> "VariationBlock":
        """Intervals that rise, of something, and limits of quantities that can be judged."""
        _check_limits(self.limits, set(limit_keys()))
        for name, (low, high) in self.intervals().items():
            if not low < high:
                raise ValueError(f"the interval of {name} must rise; got [{low:g}, {high:g}]")
        if not self.intervals():
            raise ValueError("a variation must name at least one interval, such as mass = [0.85, 1.15]")
        return self

    def intervals(self) -> dict[str, tuple[float, float]]:
        """Parameter to interval, of those given."""
        return {n: v for n in PARAMETERS if (v := getattr(self, n)) is not None}


class ScheduleBlock(Block):
    """Gains that are polynomials of the speed: over which range, of which degree, keeping which margins everywhere."""

    range_m_s: Rising
    degree: Annotated[int, Field(ge=0, le=6)] = 2
    points: Annotated[int, Field(ge=2, le=60)] = 5
    checked_speeds: Annotated[int, Field(ge=60, le=5000)] = 209
    limits: Limits = Field(default={}, max_length=20)

    @model_validator(mode="after")
    def known(self) -> "ScheduleBlock":
        """A range that rises and margins that every speed can be asked for."""
        low, high = self.range_m_s
        if not low < high:
            raise ValueError(f"range_m_s must rise; got [{low:g}, {high:g}]")
        _check_limits(self.limits, set(limit_keys(margin_kinds())))
        return self


def _check_limits(given: dict[str, float], keys: set[str]) -> None:
    for name in given:
        if name not in keys:
            raise ValueError(str(unknown_name("limit", name, keys)).rstrip("."))


class ProblemFile(BaseModel):
    """A whole data.toml."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    problem: ProblemBlock
    vehicle: VehicleBlock
    inertia: InertiaBlock
    force_law: ForceLawBlock
    physics: PhysicsBlock
    guideway: Annotated[PowerLawBlock | AmericanBlock | GermanBlock, Field(discriminator="kind")]
    sensors: SensorsBlock
    control_coil: ControlCoilBlock
    fixed: FixedBlock
    discretisation: DiscretisationBlock
    requirements: RequirementsBlock | None = None
    bounds: BoundsBlock | None = None
    points: PointsBlock | None = None
    operating_point: OperatingPointBlock | None = None
    motor: MotorBlock | None = None
    variation: VariationBlock | None = None
    model: Annotated[tuple[ModelBlock, ...], Field(max_length=60)] = ()
    schedule: ScheduleBlock | None = None
    design: EffortTable | None = None
    goal: Annotated[tuple[dict[str, JsonValue], ...], Field(max_length=100)] = ()

    @model_validator(mode="after")
    def apart(self) -> "ProblemFile":
        """Models with names of their own; a schedule that reaches the vehicle's speed and can go to others."""
        names = [m.name for m in self.model]
        if len(set(names)) != len(names):
            raise ValueError(f"models must have distinct names; got {', '.join(names)}"[:200])
        if "gap_minimum_m" in self.vehicle.model_fields_set and not isinstance(self.force_law, CornerBlock):
            raise ValueError(
                "vehicle.gap_minimum_m is of a force law from coils, kind 'corner' or 'taylor'; leave it out"
            )
        if self.schedule is not None:
            low, high = self.schedule.range_m_s
            if not isinstance(self.force_law, CornerBlock):
                raise ValueError("a schedule needs a force law from coils, kind 'corner' or 'taylor'")
            if not low <= self.vehicle.speed_m_s <= high:
                raise ValueError(f"schedule.range_m_s must hold the vehicle's speed of {self.vehicle.speed_m_s:g} m/s")
            if not self.requirements and not self.schedule.limits:
                raise ValueError("a schedule needs margins to keep: limits of its own, or requirements")
        return self
