"""Promises over a range of speeds: gains and coil forces are polynomials of the speed, the rest stays.

    schedule part: gains(v); forces(v) of one set --Physics--> plant(v) --closed loop--> family in v --> worst value

The plant at each speed is rebuilt from the vehicle beside the plant with that speed's forces in level flight, so it is
a rational function of the speed. Multiplied by the time constants, and by the lift-to-drag ratio where the drag enters,
the polynomials of the loop are polynomials of the speed; their degree is found by trying, and a point off the grid
checks it. Steady flight at each speed; how fast the speed changes is not looked at.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

from flint import fmpq, fmpq_mat

from workbench.verify.box_sensitivity import SensitivityFamily
from workbench.verify.failure import NotProved, TableError
from workbench.verify.law import GAIN_NAMES, GROUPS
from workbench.verify.loop import closed_loop
from workbench.verify.polynomial_family import Box, Family, Point
from workbench.verify.reading import decimal, entries_of, mapping
from workbench.verify.schedule_proof import GainSchedule, schedule_family
from workbench.verify.system import System, identity, matrix
from workbench.verify.table import Table

SPEED = "speed"
DEGREES = (12, 28, 44, 72, 100)  # bounds tried in turn; a quadratic schedule on forces of degree 4 needs 26 and 40
MOST_COEFFICIENTS = 13  # of one polynomial
SHOWN = 33  # speeds at which a worst value is looked for
FORCES = ("lift", "lateral", "moment")


class ScheduledLoop:
    """One group's closed loop over the speeds of a schedule."""

    def __init__(self, table: Table, group: str, interval: tuple[fmpq, fmpq]) -> None:
        certificate = table.certificate
        if certificate is None or certificate.physics is None or table.schedule is None:
            raise NotProved("a range of speeds needs a schedule in the table, and the vehicle in its certificate")
        if table.schedule.get("forces") is None:
            raise NotProved("the table's schedule does not say how the coil forces change with the speed")
        self._schedule = _polynomials(table.schedule, "schedule", GAIN_NAMES)
        names = (*(f"{kind},{k}" for kind in FORCES for k in range(5)), "lift_to_drag")
        self._forces = _polynomials(mapping(table.schedule["forces"], "schedule.forces"), "schedule.forces", names)
        low, high = interval
        for one in (self._schedule, self._forces):
            if not (one.lower <= low < high <= one.upper):
                raise NotProved("the range of speeds must rise and lie within the schedule's and its forces' own")
        self.box = Box((SPEED,), (low,), (high,))
        self._table, self._group = table, group

    @cached_property
    def sensitivity(self) -> SensitivityFamily:
        """The loop at all speeds as one family."""
        schedule = replace(self._schedule, lower=self.box.lower[0], upper=self.box.upper[0])
        lengths = self._table.law.patterns(self._group)[1]
        for degree in DEGREES:
            try:
                return schedule_family(self._loop, schedule, degree, multiplier=self._multiplier, lengths=lengths)
            except ValueError as error:
                if degree == DEGREES[-1]:
                    raise NotProved(str(error)) from error
        raise NotProved("no degree in the speed was tried")

    @property
    def poles(self) -> Family:
        """Its characteristic polynomial."""
        return self.sensitivity.p

    @property
    def corners(self) -> list[Point]:
        """Speeds at which members are looked at."""
        low, high = self.box.lower[0], self.box.upper[0]
        return [(low + (high - low) * fmpq(k, SHOWN - 1),) for k in range(SHOWN)]

    def _loop(self, speed: fmpq, gains: Mapping[str, fmpq], _: Point) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat]:
        seen = closed_loop(replace(self._table, gains=dict(gains), plant=self._plant(speed)), self._group).sensitivity
        if identity(seen.D.nrows()) != seen.D:
            raise NotProved("without a lag of the currents the loop is not a polynomial of the speed")
        return seen.A, seen.B, seen.C

    def _plant(self, speed: fmpq) -> System:
        certificate = self._table.certificate
        physics = certificate.physics if certificate else None
        if physics is None:
            raise NotProved("the vehicle is missing in the certificate")
        at = self._forces.at(speed)
        rows = [[at[f"{kind},{k}"] for k in range(5)] for kind in FORCES]
        if at["lift_to_drag"] == 0:
            raise NotProved("the lift-to-drag ratio vanishes at a speed of the range")
        return replace(physics, forces=matrix(rows), drag_ratio=1 / at["lift_to_drag"]).plant()

    def _multiplier(self, speed: fmpq, gains: Mapping[str, fmpq], _: Point) -> fmpq:
        """Every time constant once for each filter that has it, the lift-to-drag ratio once for each turn."""
        out = self._forces.at(speed)["lift_to_drag"] ** (1 if self._group in ("heave_pitch", "heave") else 2)
        for channel in GROUPS[self._group].channels:
            vertical = channel in ("heave", "pitch", "roll")
            out *= gains["tau_h" if vertical else "tau_hp"] * gains["tau_z" if vertical else "tau_y"]
        return out


def _polynomials(part: Mapping[str, Any], place: str, names: tuple[str, ...]) -> GainSchedule:
    """Polynomials of the speed from their decimals."""
    if part.get("variable") != SPEED:
        raise TableError(f"{place}.variable must be {SPEED!r}; got {str(part.get('variable'))[:40]!r}. Mend it there.")
    low, high = (decimal(v, f"{place}.range") for v in entries_of(part.get("range"), f"{place}.range", 2, 2))
    given = mapping(part.get("coefficients"), f"{place}.coefficients")
    read = {
        name: tuple(
            decimal(c, f"{place}.coefficients.{name}")
            for c in entries_of(given.get(name), f"{place}.coefficients.{name}", MOST_COEFFICIENTS, 1)
        )
        for name in names
    }
    centre, scale = (decimal(part.get(key), f"{place}.{key}") for key in ("centre", "scale"))
    try:
        return GainSchedule(SPEED, low, high, centre, scale, read)
    except ValueError as error:
        raise TableError(f"{place} is not usable: {error}") from error
