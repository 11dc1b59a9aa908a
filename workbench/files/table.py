"""What the tables of a plant of one's own have in common: units in the keys, names checked, one sentence for a fault.

    dead_time_ms = 4 --keys of other units--> dead_time_s = 0.004 --schema--> a frozen record in SI units

A key that ends in a unit may be written in another one of the same quantity: _s, _ms, _min, _h; _rad_s, _hz.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from workbench.errors import InputError, nearest
from workbench.files.refusal import sentence

LARGEST = 1e60  # of a coefficient: beyond every polynomial here, and its square is still a number
MOST = 200  # signals, blocks, goals, states named in a file
UNITS: Mapping[str, Mapping[str, tuple[float, float]]] = {  # multiply, divide: decimals stay the nearest double
    "_rad_s": {"_hz": (2 * math.pi, 1.0)},
    "_s": {"_ms": (1.0, 1000.0), "_min": (60.0, 1.0), "_h": (3600.0, 1.0)},
}

Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST, allow_inf_nan=False)]
Above = Annotated[float, Field(strict=True, gt=0, le=LARGEST, allow_inf_nan=False)]
FromZero = Annotated[float, Field(strict=True, ge=0, le=LARGEST, allow_inf_nan=False)]
Name = Annotated[str, Field(min_length=1, max_length=60, pattern=r"^[^\x00-\x1f\x7f]*\S[^\x00-\x1f\x7f]*$")]
Names = Annotated[tuple[Name, ...], Field(max_length=MOST)]
Text = Annotated[str, Field(min_length=3, max_length=500)]


class Table(BaseModel):
    """A table of the file: strict types, finite numbers, no key that is not known."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_validator(mode="before")
    @classmethod
    def known(cls, given: Any) -> Any:
        """Keys in SI units; one that is not known is refused with the nearest."""
        return si_keys(given, cls.model_fields) if isinstance(given, Mapping) else given


def si_keys(given: Mapping[str, Any], known: Sequence[str] | Mapping[str, Any]) -> dict[str, Any]:
    """The mapping under the known keys, values in other units converted; raises ValueError for other keys."""
    found: dict[str, Any] = {}
    for key, value in given.items():
        name, (factor, divisor) = _in_si(str(key), known)
        if name not in known:
            raise ValueError(f"unknown key {str(key)[:60]!r}; {nearest(str(key), known)}")
        if name in found:
            raise ValueError(f"{name!r} is given twice, in two units")
        found[name] = _scaled(value, factor, divisor) if name != key else value
    return found


def _in_si(key: str, known) -> tuple[str, tuple[float, float]]:
    for base, others in UNITS.items():
        for ending, conversion in others.items():
            name = key.removesuffix(ending) + base
            if key not in known and key.endswith(ending) and name in known:
                return name, conversion
    return key, (1.0, 1.0)


def _scaled(value: Any, factor: float, divisor: float) -> Any:
    """Numbers in lists and mappings of them times a factor; anything else as it is, for the schema to refuse."""
    match value:
        case bool():
            return value
        case int() | float():
            try:
                return value * factor / divisor
            except OverflowError:
                return math.inf
        case list():
            return [_scaled(inner, factor, divisor) for inner in value]
        case dict():
            return {key: _scaled(inner, factor, divisor) for key, inner in value.items()}
    return value


T = TypeVar("T", bound=Table)


def read_table(cls: type[T], document: Mapping[str, Any], place: str) -> T:
    """The record of a document; raises InputError that names the first key at fault."""
    try:
        return cls.model_validate(document)
    except ValidationError as error:
        raise InputError(sentence(error, place, cls)) from error
