"""Promises over a range of speeds: gains and coil forces are polynomials of the speed, factors of a box beside them.

    schedule part: gains(v); forces(v) of one set, factors θ --Physics--> plant(v, θ) --closed loop--> family --> worst

The plant at each speed is rebuilt from the vehicle beside the plant with that speed's forces in level flight, so it is
a rational function of the speed. Multiplied by the time constants, and by the lift-to-drag ratio where the drag enters,
the polynomials of the loop are polynomials of the speed; their degree is found by trying, and a point off the grid
checks it. Steady flight at each speed; how fast the speed changes is not looked at.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

from flint import fmpq, fmpq_mat

from workbench.verify.box_sensitivity import SensitivityFamily
from workbench.verify.failure import NotProved, TableError
from workbench.verify.law import GAIN_NAMES, GROUPS
from workbench.verify.loop import closed_loop, factors
from workbench.verify.physics import Physics
from workbench.verify.polynomial_family import Box, Family, Point
from workbench.verify.reading import decimal, entries_of, mapping
from workbench.verify.schedule_proof import GainSchedule, schedule_family
from workbench.verify.system import identity, matrix
from workbench.verify.table import Table
from workbench.verify.uncertain import Factors

SPEED = "speed"
GROWTH = (1.0, 1.5, 2.5)  # multiples of the expected degree in the speed that are tried in turn
MOST_DEGREE = 200
MOST_COEFFICIENTS = 13  # of one polynomial
SHOWN = 33  # speeds at which a worst value is looked for
FORCES = ("lift", "lateral", "moment")


class ScheduledLoop:
    """One group's closed loop over the speeds of a schedule."""

    def __init__(self, table: Table, group: str, intervals: Mapping[str, tuple[fmpq, fmpq]]) -> None:
        certificate = table.certificate
        if certificate is None or certificate.physics is None or table.schedule is None:
            raise NotProved("a range of speeds needs a schedule in the table, and the vehicle in its certificate")
        if table.schedule.get("forces") is None:
            raise NotProved("the table's schedule does not say how the coil forces change with the speed")
        self._schedule = _polynomials(table.schedule, "schedule", GAIN_NAMES)
        names = (*(f"{kind},{k}" for kind in FORCES for k in range(5)), "lift_to_drag")
        self._forces = _polynomials(mapping(table.schedule["forces"], "schedule.forces"), "schedule.forces", names)
        low, high = intervals[SPEED]
        for one in (self._schedule, self._forces):
            if not (one.lower <= low < high <= one.upper):
                raise NotProved("the range of speeds must rise and lie within the schedule's and its forces' own")
        others = {name: interval for name, interval in intervals.items() if name != SPEED}
        self._factors = Factors(table, group, others)
        own = self._factors.box
        self.box = Box((SPEED, *own.names), (low, *own.lower), (high, *own.upper))
        self._table, self._group = table, group

    @cached_property
    def sensitivity(self) -> SensitivityFamily:
        """The loop at all speeds as one family."""
        schedule = replace(self._schedule, lower=self.box.lower[0], upper=self.box.upper[0])
        lengths, own = self._table.law.patterns(self._group)[1], self._factors
        tried = [math.ceil(self._expected * growth) for growth in GROWTH]
        if own.names:  # the degree in the speed is that without factors, found at a fraction of the cost
            alone = ScheduledLoop(self._table, self._group, {SPEED: (self.box.lower[0], self.box.upper[0])})
            found = alone.sensitivity.p.degrees[0]
            tried = [found, *(degree for degree in tried if degree > found)]
        fault = "the schedule and its forces are of too high a degree"
        for degree in tried:
            if degree > MOST_DEGREE:
                break
            try:
                return schedule_family(
                    self._loop, schedule, degree, box=own.box if own.names else None, degrees=own.degrees,
                    multiplier=self._multiplier, lengths=lengths,
                )  # fmt: skip
            except ValueError as error:
                fault = str(error)
        raise NotProved(fault)

    @property
    def _expected(self) -> int:
        """Degree in the speed: forces once for each coordinate and turn, gains once for each filter and modal gain."""
        group = GROUPS[self._group]
        forces, gains = (max(len(c) for c in one.coefficients.values()) - 1 for one in (self._forces, self._schedule))
        return max(forces * (len(group.coordinates) + self._turns) + gains * (3 * len(group.channels) + 1), 1)

    @property
    def _turns(self) -> int:
        """How often the drag enters: once where pitch turns the vehicle, twice with roll and yaw."""
        return 1 if self._group in ("heave_pitch", "heave") else 2

    @property
    def poles(self) -> Family:
        """Its characteristic polynomial."""
        return self.sensitivity.p

    @property
    def corners(self) -> list[Point]:
        """Members at which a worst value is looked for: some speeds, each at the centre and the corners of the rest."""
        low, high = self.box.lower[0], self.box.upper[0]
        speeds = [low + (high - low) * fmpq(k, SHOWN - 1) for k in range(SHOWN)]
        rest = self._factors.box
        return [(v, *place) for v in speeds for place in dict.fromkeys([rest.centre, *rest.vertices()])]

    def _loop(self, speed: fmpq, gains: Mapping[str, fmpq], theta: Point) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat]:
        plant = self._physics(speed).varied(factors(self._factors.named(theta))).plant()
        seen = closed_loop(replace(self._table, gains=dict(gains), plant=plant), self._group).sensitivity
        if identity(seen.D.nrows()) != seen.D:
            raise NotProved("without a lag of the currents the loop is not a polynomial of the speed")
        return seen.A, seen.B, seen.C

    def _physics(self, speed: fmpq) -> Physics:
        """The vehicle with the forces of a speed."""
        certificate = self._table.certificate
        physics = certificate.physics if certificate else None
        if physics is None:
            raise NotProved("the vehicle is missing in the certificate")
        at = self._forces.at(speed)
        rows = [[at[f"{kind},{k}"] for k in range(5)] for kind in FORCES]
        if at["lift_to_drag"] == 0:
            raise NotProved("the lift-to-drag ratio vanishes at a speed of the range")
        return replace(physics, forces=matrix(rows), drag_ratio=1 / at["lift_to_drag"])

    def _multiplier(self, speed: fmpq, gains: Mapping[str, fmpq], theta: Point) -> fmpq:
        """Time constants once for each filter that has them, the lift-to-drag ratio once for each turn, the masses."""
        out = self._forces.at(speed)["lift_to_drag"] ** self._turns
        for channel in GROUPS[self._group].channels:
            vertical = channel in ("heave", "pitch", "roll")
            out *= gains["tau_h" if vertical else "tau_hp"] * gains["tau_z" if vertical else "tau_y"]
        return out * self._factors.multiplier(theta)


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
