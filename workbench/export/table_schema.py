"""The parts of a gain table: what a file must have, nothing else, nothing unfinite.

    Decimal   a number as the digits printed; `float` reads back the same double
    Part      strict types, no other keys: Versions, LawPart, PlantPart, RequirementRecord, Promise

Their Python side is the record of the same name elsewhere: `control.ModalLaw`, `lti.Plant`, `design.requirement`.
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
    """

    name: Name
    sense: Sense
    limit: Number
    enclosure: Interval
    method: Text
    box: Annotated[dict[Name, Interval], Field(max_length=50)]

    @model_validator(mode="after")
    def ordered(self) -> "Promise":
        """Intervals from low to high."""
        for low, high in (self.enclosure, *self.box.values()):
            if low > high:
                raise ValueError(f"an interval must go from low to high; got [{low}, {high}] for {self.name!r}")
        return self
