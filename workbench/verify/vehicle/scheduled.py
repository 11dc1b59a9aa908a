"""Promises over a range of speeds: gains and coil forces are polynomials of the speed, factors of a box beside them.

    schedule part --polynomials_of--> gains(v); forces(v) of one set, known to a stated error
    gains, forces, factors θ --Physics--> plant(v, θ) --closed loop--> family --> worst

The plant at each speed is rebuilt from the vehicle beside the plant with that speed's forces in level flight, so it is
a rational function of the speed. Multiplied by the time constants, and by the lift-to-drag ratio where the drag enters,
the polynomials of the loop are polynomials of the speed, of a degree that follows from the equations (`degree`). Steady
flight at each speed; how fast the speed changes is not looked at.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from flint import fmpq, fmpq_mat

from workbench.verify.exact.failure import NotProved, TableError
from workbench.verify.exact.system import matrix
from workbench.verify.family.polynomial import Family, ParameterBox, Point
from workbench.verify.family.schedule import GainSchedule, schedule_family
from workbench.verify.family.sensitivity import SensitivityFamily
from workbench.verify.reading import decimal, entries_of, keyed, mapping, number, text_of
from workbench.verify.vehicle.degree import FORCES, degrees_of, turns
from workbench.verify.vehicle.law import GAIN_NAMES, GROUPS
from workbench.verify.vehicle.loop import SCALED, closed_loop, factors
from workbench.verify.vehicle.model_error import ModelError
from workbench.verify.vehicle.physics import Physics
from workbench.verify.vehicle.table import Table
from workbench.verify.vehicle.uncertain import Factors, refused, require_lag

SPEED = "speed"
MOST_DEGREE = 200
MOST_COEFFICIENTS = 13  # of one polynomial
SHOWN = 33  # speeds at which a worst value is looked for
FORCE_NAMES = (*(f"{kind},{k}" for kind in FORCES for k in range(5)), "lift_to_drag")
FILTERED = ("K_hdot", "K_zdot", "K_hpdot", "K_ydot")
COMPARISON = fmpq(21, 20)  # times the stated error: a maximum met between the speeds at which it was stated


@dataclass(frozen=True, slots=True)
class SpeedForces:
    """Coil forces of one set over the speed, and how far the coils' own may lie from them, of the largest value."""

    polynomials: GainSchedule
    relative: Mapping[str, fmpq]

    def error(self, name: str) -> fmpq:
        """The largest error of a number, absolute, anywhere in the range."""
        return COMPARISON * self.relative[name] * self.polynomials.largest(name)


class ScheduledLoop:
    """One group's closed loop over the speeds of a schedule."""

    def __init__(self, table: Table, group: str, intervals: Mapping[str, tuple[fmpq, fmpq]]) -> None:
        certificate = table.certificate
        if certificate is None or certificate.physics is None or table.schedule is None:
            raise NotProved("a range of speeds needs a schedule in the table, and the vehicle in its certificate")
        self.schedule, forces = polynomials_of(table.schedule)
        if forces is None:
            raise NotProved("the table's schedule does not say how the coil forces change with the speed")
        self.forces = forces
        low, high = intervals[SPEED]
        for one in (self.schedule, forces.polynomials):
            if not (one.lower <= low < high <= one.upper):
                raise NotProved("the range of speeds must rise and lie within the schedule's and its forces' own")
        if not forces.polynomials.never_zero("lift_to_drag", low, high):
            raise NotProved("the lift-to-drag ratio is not proved to stay above zero over the range of speeds")
        for tau in ("tau_h", "tau_z", "tau_hp", "tau_y"):
            if not self.schedule.never_zero(tau, low, high):
                raise NotProved(f"the time constant {tau} is not proved to stay above zero over the range of speeds")
        require_lag(table, group)
        others = {name: interval for name, interval in intervals.items() if name != SPEED}
        self._factors = Factors(table, group, others)
        own = self._factors.box
        self.box = ParameterBox((SPEED, *own.names), (low, *own.lower), (high, *own.upper))
        self.table, self.group, self.physics = table, group, certificate.physics

    @cached_property
    def sensitivity(self) -> SensitivityFamily:
        """The loop at all speeds as one family."""
        schedule = replace(self.schedule, lower=self.box.lower[0], upper=self.box.upper[0])
        own = self._factors
        return refused(lambda: schedule_family(
            self.loop, schedule, self.degree, box=own.box if own.names else None, degrees=own.degrees,
            multiplier=self.multiplier, lengths=self.lengths,
        ))  # fmt: skip

    @property
    def lengths(self) -> list[fmpq]:
        """Squared lengths of the current patterns."""
        return self.table.law.patterns(self.group)[1]

    @property
    def degree(self) -> int:
        """In the speed, of the group's polynomials: from the equations."""
        return self._degree(loads=False)

    @property
    def degree_with_loads(self) -> int:
        """The same of what loads on the motions do."""
        return self._degree(loads=True)

    def _degree(self, *, loads: bool) -> int:
        degree = {name: _degree(c) for name, c in self.schedule.coefficients.items()}
        forces = self.forces.polynomials.coefficients
        for kind in FORCES:
            degree[kind] = max(_degree(forces[f"{kind},{k}"]) for k in range(5))
        degree["lift_to_drag"] = _degree(forces["lift_to_drag"])
        found = degrees_of(self.group, len(self.lengths), degree, loads=loads)[SPEED]
        if found > MOST_DEGREE:
            raise NotProved(f"the schedule and its forces are of too high a degree, {found} in the speed")
        return found

    @cached_property
    def error(self) -> ModelError | None:
        """What the stated error of the coil forces can change; None where none is stated."""
        return ModelError(self) if any(self.forces.relative.values()) else None

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

    def closed(self, speed: fmpq, gains: Mapping[str, fmpq], theta: Point = ()):
        """The closed loop at one speed; filters that any speed needs stay at all of them."""
        factor = factors(self._factors.named(theta))
        plant = self._physics(speed).varied(factor).plant()
        gains = dict(gains)
        for name, scaled in SCALED.items():
            gains |= {gain: factor[name] * gains[gain] for gain in scaled}
        kept = {name for name in FILTERED if any(self.schedule.coefficients[name])}
        return closed_loop(replace(self.table, gains=gains, plant=plant), self.group, kept=kept)

    def loop(self, speed: fmpq, gains: Mapping[str, fmpq], theta: Point) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat]:
        """(A, B, C) of the sensitivity at one speed, with S(∞) = I."""
        seen = self.closed(speed, gains, theta).sensitivity
        return seen.A, seen.B, seen.C

    def _physics(self, speed: fmpq) -> Physics:
        """The vehicle with the forces of a speed."""
        at = self.forces.polynomials.at(speed)
        rows = [[at[f"{kind},{k}"] for k in range(5)] for kind in FORCES]
        return replace(self.physics, forces=matrix(rows), drag_ratio=1 / at["lift_to_drag"])

    def multiplier(self, speed: fmpq, gains: Mapping[str, fmpq], theta: Point) -> fmpq:
        """Time constants once for each filter that has them, the lift-to-drag ratio once for each turn, the masses."""
        out = self.forces.polynomials.at(speed)["lift_to_drag"] ** turns(self.group)
        for channel in GROUPS[self.group].channels:
            vertical = channel in ("heave", "pitch", "roll")
            out *= gains["tau_h" if vertical else "tau_hp"] * gains["tau_z" if vertical else "tau_y"]
        return out * self._factors.multiplier(theta)


def polynomials_of(schedule: Mapping[str, Any]) -> tuple[GainSchedule, SpeedForces | None]:
    """Gains and coil forces over the speed from the schedule part of a table; None where it has no forces."""
    keyed(schedule, "schedule", (*_KEYS, "points"), ("forces",))
    for value in entries_of(schedule["points"], "schedule.points", 500):
        decimal(value, "schedule.points")
    gains = _polynomials(schedule, "schedule", GAIN_NAMES)
    if schedule.get("forces") is None:
        return gains, None
    place = "schedule.forces"
    part = keyed(schedule["forces"], place, (*_KEYS, "relative_error", "nodes"))
    for value in entries_of(part["nodes"], f"{place}.nodes", 500):
        decimal(value, f"{place}.nodes")
    at = f"{place}.relative_error"
    relative = {name: number(value, at) for name, value in keyed(part["relative_error"], at, FORCE_NAMES).items()}
    if min(relative.values()) < 0:
        raise TableError(f"{at} must hold no negative error; it does. Get the table again from its source.")
    return gains, SpeedForces(_polynomials(part, place, FORCE_NAMES), relative)


def _degree(coefficients: tuple[fmpq, ...]) -> int:
    """Of a polynomial, zeros at its end left out."""
    return max((k for k, c in enumerate(coefficients) if c != 0), default=0)


_KEYS = ("variable", "unit", "range", "centre", "scale", "coefficients")


def _polynomials(part: Mapping[str, Any], place: str, names: tuple[str, ...]) -> GainSchedule:
    """Polynomials of the speed from their decimals."""
    if part.get("variable") != SPEED or text_of(part.get("unit"), f"{place}.unit") != "m/s":
        raise TableError(f"{place}.variable must be {SPEED!r} in m/s; got {str(part.get('variable'))[:40]!r}. Mend it.")
    low, high = (decimal(v, f"{place}.range") for v in entries_of(part.get("range"), f"{place}.range", 2, 2))
    given = keyed(mapping(part.get("coefficients"), f"{place}.coefficients"), f"{place}.coefficients", (), names)
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
