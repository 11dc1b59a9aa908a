"""Level flight on magnets: the gap at which the weight is carried, the speed that takes, and the drag it costs.

    Levitation, speed, physics  -->  trim (current or gap held)  -->  LevelFlight with its force law
                                     lift_off_speed   drag_at   drag_peak

Forces are those of one coil set times the number of sets; sets do not feel each other (report, A.2).
"""

import math
from dataclasses import dataclass, replace

from workbench.errors import InfeasibleError, InputError, unknown_name
from workbench.physics.coils.conductor import REPORT_PLATE, Conductor
from workbench.physics.forces.corner import CornerLaw
from workbench.physics.forces.energy import REPORT_COILS, CoilSet
from workbench.physics.forces.law import REPORT_AMPERE_TURNS
from workbench.physics.forces.operating import REPORT_GAP, REPORT_SETS, REPORT_WEIGHT, ampere_turns, law_at
from workbench.result import Result, Row

HOLDS = ("current", "gap")
SLOWEST, FASTEST = 0.1, 1e4  # [m/s]; beyond the latter the lift changes by less than 1e-3
HIGHEST = 3.0  # [m]; a coil 3 m long keeps 1e-3 of its lift there
NO_LIFT = 1e-300  # of the weight; what a coil without lift counts for under a logarithm
NEAREST = 0.01  # distance of the lower coil from the floor at which the search for a trim ends [m]


@dataclass(frozen=True, slots=True, kw_only=True)
class Levitation:
    """What flies, and over what: weight [N] on `sets` equal coil sets, nominal gaps [m], ampere-turns [A], guideway
    plate.

    Source of the defaults: report, A.3.
    """

    weight: float = REPORT_WEIGHT
    sets: int = REPORT_SETS
    gap: float = REPORT_GAP
    gap_lateral: float = REPORT_GAP
    current: float = REPORT_AMPERE_TURNS
    coils: CoilSet = REPORT_COILS
    conductor: Conductor = REPORT_PLATE

    def __post_init__(self) -> None:
        for name, unit in (("weight", "N"), ("gap", "m"), ("gap_lateral", "m"), ("current", "A")):
            value = getattr(self, name)
            if not 0 < value < math.inf:
                raise InputError(f"Levitation.{name} must be positive and finite; got {value!r} {unit}. Give SI units.")
        if self.sets < 1:
            raise InputError(f"Levitation.sets must be at least 1; got {self.sets!r}. The report's vehicle has 4.")

    def law(self, speed: float, physics: str) -> CornerLaw:
        """The force law of one set at this gap and current."""
        return law_at(speed, self.gap, self.gap_lateral, physics, self.current, self.coils, self.conductor)

    def lift_share(self, speed: float, physics: str) -> float:
        """Lift of all sets over weight [1] at this gap and current."""
        return self.sets * self.law(speed, physics).forces(0.0, 0.0, 0.0, 0.0)[0] / self.weight


REPORT_LEVITATION = Levitation()


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LevelFlight(Result):
    """Straight level flight at one speed, no control current.

    speed [m/s], gap [m], current [A], drag of the vehicle [N], lift_to_drag of the vehicle [1], law of one coil set.
    """

    speed: float
    gap: float
    current: float
    drag: float
    lift_to_drag: float
    law: CornerLaw

    def rows(self) -> list[Row]:
        return [
            ("speed", self.speed, "m/s"),
            ("gap", self.gap, "m"),
            ("current", self.current, "A"),
            ("drag of the vehicle", self.drag, "N"),
            ("lift over drag of the vehicle", self.lift_to_drag, ""),
        ]


def trim(
    speed: float, physics: str = "scaled", hold: str = "current", levitation: Levitation = REPORT_LEVITATION
) -> LevelFlight:
    """Gap and current at which the vehicle flies at a speed.

    Parameters
    ----------
    speed : float
        [m/s].
    physics : "report", "scaled" or "slab"
        See `workbench.physics.forces.operating`.
    hold : "current" or "gap"
        With the current held, the gap is solved for (physics `report` knows one gap only and must hold the gap);
        with the gap held, the current.
    levitation : Levitation

    Raises
    ------
    InputError
        If an argument has no sense.
    InfeasibleError
        If no gap at which the coils are clear of the floor carries the weight.
    """
    if hold not in HOLDS:
        raise unknown_name("quantity to hold", str(hold), HOLDS)
    if hold == "gap":
        needed = ampere_turns(levitation.law(speed, physics), levitation.weight, levitation.sets)
        flying = replace(levitation, current=needed)
    elif physics == "report":
        raise InputError("physics 'report' must hold the gap, because its ratios hold at 0.3 m only. Use hold 'gap'.")
    else:
        flying = replace(levitation, gap=_trim_gap(speed, physics, levitation))
    law = flying.law(speed, physics)
    drag = flying.sets * law.drag(0.0, 0.0, 0.0, 0.0)
    return LevelFlight(
        speed=speed, gap=flying.gap, current=flying.current, drag=drag, lift_to_drag=flying.weight / drag, law=law
    )


def lift_off_speed(gap_minimum: float, physics: str = "scaled", levitation: Levitation = REPORT_LEVITATION) -> float:
    """The lowest speed [m/s] at which the vehicle trims at `gap_minimum` [m] or higher, its current held.

    Raises
    ------
    InputError
        If physics is "report", which knows one speed only, or the gap has no sense.
    InfeasibleError
        If the lift at `gap_minimum` stays below the weight at any speed.

    Examples
    --------
    >>> print(f"{lift_off_speed(0.15):.1f} m/s")
    4.9 m/s
    """
    from scipy.optimize import brentq

    at_minimum = replace(levitation, gap=gap_minimum)

    def excess(log_speed: float) -> float:
        return math.log(max(at_minimum.lift_share(math.exp(log_speed), physics), NO_LIFT))

    low, high = math.log(SLOWEST), math.log(FASTEST)
    most = excess(high)
    if most < 0:
        raise InfeasibleError(
            f"lift must reach the weight of {levitation.weight:g} N at a gap of {gap_minimum:g} m; at "
            "any speed it stays "
            f"below {math.exp(most):.3g} of it. Lower gap_minimum or raise the current of {levitation.current:g} A."
        )
    if excess(low) > 0:
        return SLOWEST
    return math.exp(float(brentq(excess, low, high, xtol=1e-8)))


def drag_at(speed: float, physics: str = "scaled", levitation: Levitation = REPORT_LEVITATION) -> float:
    """Magnetic drag [N] of the vehicle at a speed, gap and current held, as on its wheels below lift-off.

    Source: report, A.1 (e).
    """
    return levitation.sets * levitation.law(speed, physics).drag(0.0, 0.0, 0.0, 0.0)


def drag_peak(physics: str = "scaled", levitation: Levitation = REPORT_LEVITATION) -> tuple[float, float]:
    """Speed [m/s] and size [N] of the largest magnetic drag, gap and current held.

    Raises
    ------
    InputError
        If physics is "report", which knows one speed only.
    """
    from scipy.optimize import minimize_scalar

    characteristic = levitation.conductor.characteristic_speed  # of the thin sheet, whose drag peaks near it
    found = minimize_scalar(
        lambda log_speed: -drag_at(math.exp(log_speed), physics, levitation),
        bounds=(math.log(characteristic / 10), math.log(characteristic * 30)),
        method="bounded",
        options={"xatol": 1e-5},
    )
    return math.exp(found.x), -float(found.fun)


def _trim_gap(speed: float, physics: str, levitation: Levitation) -> float:
    from scipy.optimize import brentq

    lowest = max(-levitation.coils.control_offset[2], 0.0) + NEAREST

    def excess(gap: float) -> float:
        return math.log(max(replace(levitation, gap=gap).lift_share(speed, physics), NO_LIFT))

    most = excess(lowest)
    if most < 0:
        raise InfeasibleError(
            f"lift must reach the weight of {levitation.weight:g} N; at {speed:g} m/s it reaches "
            f"{math.exp(most):.3g} of it "
            f"at the lowest gap, {lowest:g} m. Fly faster or raise the current of {levitation.current:g} A."
        )
    if excess(HIGHEST) > 0:
        raise InfeasibleError(
            f"lift must balance the weight of {levitation.weight:g} N at some gap up to {HIGHEST:g} m; "
            f"at {speed:g} m/s it is larger at all of them. Lower the current of {levitation.current:g} A."
        )
    return float(brentq(excess, lowest, HIGHEST, xtol=1e-10, rtol=1e-12))
