"""The parts of a gain table: what a file must have, nothing else, nothing unfinite.

    Decimal   a number as the digits printed; `float` reads back the same double
    Part      strict types, no other keys: Versions, LawPart, PlantPart, RequirementRecord, Promise, Undecided, …

Their Python side is the record of the same name elsewhere: `control.ModalLaw`, `lti.Plant`, `goals.verdict`;
`export.certificate` writes the certificate, `workbench.verify` reads it.
"""

import math
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator


def _finite(text: str) -> str:
    if not math.isfinite(float(text)):
        raise ValueError("a decimal must be a finite double")
    return text


Decimal = Annotated[
    str, Field(pattern=r"^-?[0-9]{1,400}(\.[0-9]{1,400})?([eE][-+]?[0-9]{1,3})?$"), AfterValidator(_finite)
]
Text = Annotated[str, Field(max_length=500)]
Name = Annotated[str, Field(min_length=1, max_length=100)]
Sha256 = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
Number = Annotated[float, Field(allow_inf_nan=False)]
Interval = Annotated[list[Number], Field(min_length=2, max_length=2)]
Matrix = Annotated[list[Annotated[list[Decimal], Field(max_length=500)]], Field(max_length=500)]
Names = Annotated[list[Name], Field(max_length=500)]
Sense = Literal["<=", ">="]


class Part(BaseModel):
    """A part of the table: strict types, no other keys."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class Versions(Part):
    """What the table was computed with."""

    workbench: Text
    casadi: Text
    numpy: Text
    scipy: Text
    python: Text


class ActuatorPart(Part):
    """Who takes sway or yaw instead of the coils; see `control.law.Actuator`."""

    name: Name
    signal: Literal["sway", "yaw"]
    lever: Decimal


class LawPart(Part):
    """All that commands = law(sensors) needs besides the gains; `control.law` says how."""

    positions_m: Annotated[list[Annotated[list[Decimal], Field(min_length=2, max_length=2)]], Field(max_length=100)]
    depth_m: Decimal
    actuators: Annotated[list[ActuatorPart], Field(max_length=2)]
    sample_time_s: Decimal


class PlantPart(Part):
    """The vehicle without control, dx/dt = A x + B u, y = C x + D u, row by row."""

    states: Names
    inputs: Names
    outputs: Names
    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix


class SpectrumPart(Part):
    """S(Ω) = strength · Ω^(2·zeros) / ∏ (Ω² + corner²) of one type of irregularity, one-sided [m²/(rad/m)]."""

    strength: Decimal
    corners_rad_m: Annotated[list[Decimal], Field(min_length=1, max_length=3)]
    zeros: Annotated[int, Field(ge=0, le=2)]


class GuidewayPart(Part):
    """Spectra of the types that act, as a vehicle at this speed meets them, and their correlation (A1 … A4)."""

    speed_m_s: Decimal
    spectra: Annotated[dict[Literal["A1", "A2", "A3", "A4"], SpectrumPart], Field(min_length=1)]
    correlation: Matrix | None


class SensorsPart(Part):
    """Constant error of each accelerometer; one-sided noise densities of every sensor."""

    accelerometer_bias_m_s2: Decimal
    gap_noise_m_per_root_hz: Decimal
    acceleration_noise_m_s2_per_root_hz: Decimal


class MotorPart(Part):
    """Currents of a motor whose commands count in rated currents, peak."""

    rated_current_a: Decimal
    working_current_a: Decimal


Slopes = Annotated[list[Decimal], Field(min_length=5, max_length=5)]


class PhysicsPart(Part):
    """The vehicle at rest in its nominal pose, from which the plant follows.

    lift, lateral, moment : of one coil set, value at rest and slopes by gap, lateral gap, roll and current ratio
    joined : sets that share a command, counted from 0
    """

    mass_kg: Decimal
    roll_inertia_kg_m2: Decimal
    pitch_inertia_kg_m2: Decimal
    yaw_inertia_kg_m2: Decimal
    positions_m: Annotated[list[Annotated[list[Decimal], Field(min_length=2, max_length=2)]], Field(max_length=100)]
    depth_m: Decimal
    joined: Annotated[list[Annotated[list[int], Field(max_length=100)]], Field(max_length=100)]
    lift: Slopes
    lateral: Slopes
    moment: Slopes
    drag_ratio: Decimal
    gravity_m_s2: Decimal
    gravity_term: bool
    current_lag_s: Decimal
    coil_length_m: Decimal
    thrust_n: Decimal
    lift_damping_n_s_m: Decimal
    lateral_damping_n_s_m: Decimal
    bank_reading: Literal["twist", "section"]


class CertificatePart(Part):
    """What the proofs rest on besides gains, law and plant; `export.certificate` says what null means."""

    groups: Annotated[list[Literal["heave_pitch", "sway_roll_yaw", "heave", "all"]], Field(min_length=1, max_length=4)]
    guideway: GuidewayPart | None
    sensors: SensorsPart
    motor: MotorPart | None
    physics: PhysicsPart | None


Coefficients = Annotated[list[Decimal], Field(min_length=1, max_length=50)]


class SpeedForcesPart(Part):
    """Forces of one coil set in level flight, as polynomials of the speed like a schedule's.

    coefficients : "lift,k", "lateral,k", "moment,k", k = 0 at rest, 1 … 4 slopes by gap, lateral gap, roll, current
        ratio; "lift_to_drag";  relative_error : of the fit, between the nodes
    """

    variable: Name
    unit: Text
    range: Annotated[list[Decimal], Field(min_length=2, max_length=2)]
    centre: Decimal
    scale: Decimal
    coefficients: Annotated[dict[Name, Coefficients], Field(min_length=16, max_length=20)]
    relative_error: Annotated[dict[Name, Number], Field(max_length=20)]
    nodes: Annotated[list[Decimal], Field(max_length=500)]


class SchedulePart(Part):
    """Gains as polynomials in (variable − centre)/scale over a range, lowest power first; points: where tuned.

    forces : of a coil set over the same speeds; null: nothing is proved over the range
    """

    variable: Name
    unit: Text
    range: Annotated[list[Decimal], Field(min_length=2, max_length=2)]
    centre: Decimal
    scale: Decimal
    coefficients: Annotated[dict[Name, Coefficients], Field(min_length=17, max_length=17)]
    points: Annotated[list[Decimal], Field(max_length=500)]
    forces: SpeedForcesPart | None = None


class RequirementRecord(Part):
    """One requirement and the exact value held against it; null for an unstable loop."""

    name: Name
    sense: Sense
    limit: Number
    value: Number | None
    unit: Text
    met: bool
    where: Text


class Promise(Part):
    """One quantity, its limit, the interval that holds its value, how that was found, and for which plants.

    box : name of a varied quantity to its [lowest, highest] factor; empty for the nominal plant alone
    at : of a box, the member that attains the end of the enclosure which is not a bound; a corner if left out
    """

    name: Name
    sense: Sense
    limit: Number
    enclosure: Interval
    method: Text
    box: Annotated[dict[Name, Interval], Field(max_length=50)]
    at: Annotated[dict[Name, Number], Field(max_length=50, default_factory=dict)]

    @model_validator(mode="after")
    def ordered(self) -> "Promise":
        """Intervals from low to high."""
        for low, high in (self.enclosure, *self.box.values()):
            if low > high:
                raise ValueError(f"an interval must go from low to high; got [{low}, {high}] for {self.name!r}")
        return self


class Undecided(Part):
    """A requirement that was asked of a whole box and is not promised there, with the share of it that stays open.

    share : of the box on which the limit is not proved, never too small;  reason : what stands against it
    """

    name: Name
    sense: Sense
    limit: Number
    box: Annotated[dict[Name, Interval], Field(max_length=50)]
    share: Annotated[float, Field(ge=0, le=1)]
    reason: Text


def versions() -> dict[str, str]:
    """Versions of what computes, as they are installed."""
    import platform
    from importlib.metadata import version

    packages = {"workbench": "maglev-workbench", "casadi": "casadi", "numpy": "numpy", "scipy": "scipy"}
    return {name: version(package) for name, package in packages.items()} | {"python": platform.python_version()}
