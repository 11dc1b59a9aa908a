"""What a problem's data.toml may contain: every key with its unit, nothing else, nothing unfinite."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from workbench.control.gains import GAIN_NAMES
from workbench.design.requirement import QUANTITIES
from workbench.export.block import Block, Finite, NotNegative, Positive, Source, Switch
from workbench.export.physics import ForceLawBlock, OperatingPointBlock, VehicleBlock

Interval = tuple[Finite, Finite]


class ProblemBlock(Block):
    title: Annotated[str, Field(min_length=3, max_length=200)]
    groups: tuple[Literal["heave_pitch", "sway_roll_yaw", "heave", "all"], ...] = Field(min_length=1, max_length=2)


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
    """Limits under the keys of `design.requirement.QUANTITIES`; each positive."""

    model_config = ConfigDict(extra="allow", frozen=True)
    source: Source
    __pydantic_extra__: dict[str, Positive]

    @model_validator(mode="after")
    def known(self) -> "RequirementsBlock":
        """Only quantities that can be judged."""
        keys = {key for _, _, key, _ in QUANTITIES.values()}
        for name in self.limits():
            if name not in keys:
                raise ValueError(_unknown("requirement", name, keys))
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
                raise ValueError(_unknown("gain", name, GAIN_NAMES))
        return self

    def entries(self) -> dict:
        """Name to value."""
        return dict(self.__pydantic_extra__ or {})


class BoundsBlock(GainsBlock):
    __pydantic_extra__: dict[str, Interval]


class FixedBlock(GainsBlock):
    __pydantic_extra__: dict[str, Finite]


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


def _unknown(kind: str, given: str, known) -> str:
    from difflib import get_close_matches

    near = get_close_matches(given, sorted(known), n=1, cutoff=0.5)
    return f"unknown {kind} {given!r}" + (f"; did you mean {near[0]!r}?" if near else "")
