"""How a data file says what a goal asks: keys with units in their names, and the fields they stand for.

key of a data file, its value --read--> field of the goal, in SI units --written--> key and value again
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.errors import InputError

HERTZ = 2 * math.pi  # [rad/s]


@dataclass(frozen=True, slots=True)
class Key:
    """One key.

    name : as in a data file, with its unit;  field : of the goal
    factor : from the key's unit to the field's, of numbers
    read : the field's value from the file's
    written : the file's value from the field's, None if it is not of this form
    """

    name: str
    field: str = ""
    factor: float = 1.0
    read: Callable[[Any], Any] | None = None
    written: Callable[[Any], Any] | None = None

    @property
    def target(self) -> str:
        """The field: the key's own name where none is given."""
        return self.field or self.name

    def value(self, given: Any) -> Any:
        """The field's value; raises InputError where the file's cannot be one."""
        try:
            if self.read is not None:
                return self.read(given)
            return self.factor * given if self.factor != 1.0 else given
        except InputError:
            raise
        except (TypeError, ValueError, KeyError, IndexError) as error:
            raise InputError(
                f"{self.name} cannot be read; got {str(given)[:80]!r}. See the guide for its form."
            ) from error

    def data(self, value: Any) -> Any:
        """What a data file says for a field's value; None where this key has no words for it."""
        if self.written is not None:
            return self.written(value)
        if self.read is None:
            return value / self.factor if self.factor != 1.0 else _plain(value)
        return None


def magnitude(field: str, *, square: bool = False) -> tuple[Key, ...]:
    """The keys of a magnitude over frequency: a number, points [[f in Hz, magnitude], …], or {num, den} in s.

    square : of a power spectral density, whose points the goal takes over hertz as they are
    """
    turn = 1.0 if square else HERTZ
    return (
        Key(field, written=lambda v: float(v) if isinstance(v, int | float) else None),
        Key(
            f"{field}_at_hz", field, read=lambda rows: {turn * float(f): float(size) for f, size in rows},
            written=lambda v: [[w / turn, s] for w, s in v.items()] if isinstance(v, Mapping) else None,
        ),
        _fraction(field),
    )  # fmt: skip


def densities(field: str) -> tuple[Key, ...]:
    """The keys of power spectral densities: one for all inputs, or a list with a number or points for each."""

    def listed(value: Any) -> Any:
        if not isinstance(value, tuple) or _is_fraction(value):
            return None
        return [[list(point) for point in one.items()] if isinstance(one, Mapping) else one for one in value]

    def read(rows: Any) -> Any:
        return tuple(dict(one) if isinstance(one, list | tuple) else one for one in rows)

    return (*magnitude(field, square=True), Key(f"{field}_of_each", field, read=read, written=listed))


def weight(field: str) -> tuple[Key, ...]:
    """The keys of a filter: a number or matrix, or {num, den} in s."""

    def numbers(value: Any) -> Any:
        return None if _is_fraction(value) else _plain(value)

    return Key(field, written=numbers), _fraction(field)


def _fraction(field: str) -> Key:
    """num and den, highest power of s first."""
    return Key(
        f"{field}_transfer_function", field,
        read=lambda table: ([float(v) for v in table["num"]], [float(v) for v in table["den"]]),
        written=lambda v: {"num": _plain(v[0]), "den": _plain(v[1])} if _is_fraction(v) else None,
    )  # fmt: skip


def _is_fraction(value: Any) -> bool:
    """Whether a value is (numerator, denominator)."""
    return isinstance(value, tuple) and len(value) == 2 and all(np.ndim(part) == 1 for part in value)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    return list(value) if isinstance(value, tuple) else value
