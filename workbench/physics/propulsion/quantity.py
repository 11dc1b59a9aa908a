"""Numbers from outside: what is not a finite number of the right sign is refused by name and unit."""

import math

from workbench.errors import InputError


def number(name: str, value: object, unit: str) -> float:
    """The value as a float. Raises InputError unless it is a finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(
            f"{name} must be a finite number [{unit}]; got {repr(value)[:60]}. Give a plain number in {unit}."
        )
    return float(value)


def positive(name: str, value: object, unit: str) -> float:
    """The value as a float. Raises InputError unless it is a finite number above zero."""
    given = number(name, value, unit)
    if given <= 0:
        raise InputError(f"{name} must be positive; got {given:g} {unit}. Give a value above zero.")
    return given


def not_negative(name: str, value: object, unit: str) -> float:
    """The value as a float. Raises InputError unless it is a finite number, zero or above."""
    given = number(name, value, unit)
    if given < 0:
        raise InputError(f"{name} must not be negative; got {given:g} {unit}. Give zero or more.")
    return given


def count(name: str, value: object) -> int:
    """The value as an int. Raises InputError unless it is a whole number, one or above."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 1:
        raise InputError(f"{name} must be a whole number of at least 1; got {repr(value)[:60]}. Count the units.")
    return value
