"""A gain schedule: every one of the seventeen parameters a polynomial of the speed, printed as decimals.

    speed --(v − centre)/scale--> t --Σ_k c_k t^k, for gains and time constants alike--> Gains

The coefficients are rounded to `DIGITS` significant digits when the schedule is made: what is verified is what is
printed. A parameter that does not change with speed has one coefficient, and zeros after it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from workbench.control.gains import GAIN_NAMES, GAIN_UNITS, TIME_CONSTANTS, Gains, checked_gain
from workbench.errors import InputError, unknown_name
from workbench.result import Result, Row

DIGITS = 6
OUTSIDE = 1e-9  # relative; a speed so little outside the range is at its end


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Schedule(Result):
    """The seventeen parameters over a range of speeds.

    Parameters
    ----------
    centre, scale : [m/s] of the variable t = (v − centre)/scale
    range : lowest and highest speed at which the schedule holds [m/s]
    coefficients : each of the seventeen names to (c_0, c_1, …), in the unit of the parameter; equal lengths
    points : speeds the schedule was tuned at [m/s]

    Raises
    ------
    InputError
        If names, lengths or numbers do not fit, or a time constant is not positive over the whole range.
    """

    centre: float
    scale: float
    range: tuple[float, float]
    coefficients: Mapping[str, tuple[float, ...]]
    points: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        low, high = self.range
        if not 0 < low < high < float("inf"):
            raise InputError(f"a schedule's range must rise from a positive speed; got {self.range!r} m/s.")
        if not (self.scale > 0 and np.isfinite(self.centre) and np.isfinite(self.scale)):
            raise InputError(
                f"a schedule needs a finite centre and a positive scale; got {self.centre!r} and {self.scale!r} m/s."
            )
        for name in self.coefficients:
            if name not in GAIN_UNITS:
                raise unknown_name("gain", str(name), GAIN_UNITS)
        missing = [name for name in GAIN_NAMES if name not in self.coefficients]
        lengths = {len(c) for c in self.coefficients.values()}
        if missing or len(lengths) != 1 or 0 in lengths:
            raise InputError(
                "a schedule needs coefficients of all seventeen parameters, equally many of each; "
                f"missing {', '.join(missing) or 'none'}, lengths {sorted(lengths)}."
            )
        rounded = {n: tuple(_printed(n, c) for c in self.coefficients[n]) for n in GAIN_NAMES}
        object.__setattr__(self, "coefficients", rounded)
        object.__setattr__(self, "points", tuple(float(v) for v in self.points))
        for name in TIME_CONSTANTS:
            least = self._least(name)
            if not least > 0:
                raise InputError(
                    f"{name} must stay positive over the whole range of a schedule; it falls to {least:.4g} s. "
                    "Lower the degree or raise its lower bound."
                )

    @classmethod
    def constant(cls, gains: Gains, range: tuple[float, float], degree: int = 0) -> "Schedule":
        """The same gains at every speed of a range, with room for coefficients up to a degree."""
        rest = (0.0,) * degree
        return cls(
            centre=(range[0] + range[1]) / 2, scale=(range[1] - range[0]) / 2, range=range,
            coefficients={name: (value, *rest) for name, value in gains.as_dict().items()},
        )  # fmt: skip

    @classmethod
    def from_dict(cls, mapping: Mapping[str, Any]) -> "Schedule":
        """From what `to_dict` gives, as it stands in a gain table."""
        try:
            coefficients = {name: tuple(map(float, c)) for name, c in mapping["coefficients"].items()}
            low, high = map(float, mapping["range"])
            return cls(
                centre=float(mapping["centre"]), scale=float(mapping["scale"]), range=(low, high),
                coefficients=coefficients, points=tuple(map(float, mapping.get("points", ()))),
            )  # fmt: skip
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise InputError(
                "a schedule must hold centre, scale, range of two speeds, and coefficients as lists of decimals; "
                f"got {str(mapping)[:60]}. Take it from a gain table."
            ) from error

    @property
    def degree(self) -> int:
        """Of the polynomials."""
        return len(self.coefficients["K_h"]) - 1

    def gains_at(self, speed: float) -> Gains:
        """The gains at a speed [m/s] of the range: the doubles next to the exact values of the printed decimals."""
        low, high = self.range
        if not low * (1 - OUTSIDE) <= speed <= high * (1 + OUTSIDE):
            raise InputError(
                f"the schedule holds from {low:g} to {high:g} m/s; got {speed!r} m/s. Ask for a speed between them."
            )
        t = (_exact(speed) - _exact(self.centre)) / _exact(self.scale)
        return Gains(**{name: _horner(c, t) for name, c in self.coefficients.items()})

    def grid(self, step: float) -> list[float]:
        """Speeds of the range, its ends and every multiple of a step [m/s] between them."""
        low, high = self.range
        inner = step * np.arange(np.floor(low / step) + 1, np.ceil(high / step))
        return [low, *(float(v) for v in inner if low < v < high), high]

    def speed_of(self, gains: Gains) -> float | None:
        """The tuned speed [m/s] at which the schedule gives just these gains; None if there is none."""
        return next((v for v in self.points if self.gains_at(v) == gains), None)

    def table(self, speeds: Sequence[float]) -> np.ndarray:
        """(k, 17) parameters at speeds [m/s], columns as `GAIN_NAMES`."""
        return np.array([list(self.gains_at(float(v)).as_dict().values()) for v in speeds])

    def to_dict(self) -> dict[str, Any]:
        """As it stands in a gain table: every number a decimal string that `float` reads back as the same double."""
        return {
            "variable": "speed", "unit": "m/s", "range": [repr(float(v)) for v in self.range],
            "centre": repr(float(self.centre)), "scale": repr(float(self.scale)),
            "coefficients": {name: [repr(c) for c in self.coefficients[name]] for name in GAIN_NAMES},
            "points": [repr(v) for v in self.points],
        }  # fmt: skip

    def rows(self) -> list[Row]:
        low, high = self.range
        ends = [(v, self.gains_at(v).as_dict()) for v in (low, high)]
        return [
            ("range", f"{low:g} … {high:g}", "m/s"),
            ("degree", self.degree, ""),
            ("tuned at", len(self.points), "speeds"),
            *((f"{n} at {v:g} m/s", values[n], GAIN_UNITS[n]) for n in GAIN_NAMES for v, values in ends),
        ]

    def extremes(self, name: str) -> list[float]:
        """Speeds [m/s] at which a parameter may be largest or smallest: the ends, and where its slope vanishes."""
        low, high = self.range
        slope = np.polynomial.Polynomial(self.coefficients[name]).deriv()
        turns = [self.centre + self.scale * r.real for r in slope.roots() if abs(r.imag) < 1e-9]
        return [low, *(float(v) for v in turns if low < v < high), high]

    def _least(self, name: str) -> float:
        """Smallest value over the range."""
        polynomial = np.polynomial.Polynomial(self.coefficients[name])
        return float(min(polynomial((v - self.centre) / self.scale) for v in self.extremes(name)))


def _printed(name: str, value: float) -> float:
    """A coefficient as printed; a time constant's may be negative from the second on, so only size is checked."""
    checked_gain("K_h", value) if name in TIME_CONSTANTS else checked_gain(name, value)
    return float(f"{value:.{DIGITS}g}")


def _exact(value: float) -> Fraction:
    """The decimal that a double is printed as."""
    return Fraction(repr(float(value)))


def _horner(coefficients: Sequence[float], t: Fraction) -> float:
    total = Fraction(0)
    for c in reversed(coefficients):
        total = total * t + _exact(c)
    return float(total)
