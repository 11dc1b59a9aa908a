"""The force law that comes from coils, at any speed: what a vehicle flies on, and at which height.

    FlyingCoils, speed, weight  --level flight: current or gap held-->  Flight: law, gap, current  -->  vehicle there

Below the lift-off speed the vehicle rolls on wheels: the lowest speed whose trim gap is at least `gap_minimum`.
"""

from dataclasses import dataclass, replace

from workbench.errors import InfeasibleError, InputError, unknown_name
from workbench.physics.forces.corner import CornerLaw
from workbench.physics.forces.flight import HOLDS, NO_LIFT, Levitation, lift_off_speed
from workbench.physics.forces.flight import trim as level_flight
from workbench.physics.forces.operating import PHYSICS
from workbench.physics.forces.taylor import HIGHEST_ORDER, TaylorLaw
from workbench.physics.vehicle.parameters import Vehicle
from workbench.result import Result, Row


@dataclass(frozen=True, slots=True, kw_only=True)
class FlyingCoils:
    """Coil sets over a conducting guideway, with the physics that gives their forces at a speed.

    levitation : weight, sets, coils, plate, nominal gaps and ampere-turns
    physics : "report", "scaled" or "slab" (`forces.operating`)
    hold : "current" (gap solved) or "gap" (current solved)
    order : of the expansion that stands for the exact law, 1 … 5; None for the exact law
    gap_minimum : smallest trim gap at which the vehicle flies [m]
    """

    levitation: Levitation
    physics: str = "scaled"
    hold: str = "current"
    order: int | None = None
    gap_minimum: float = 0.15

    def __post_init__(self) -> None:
        if self.physics not in PHYSICS:
            raise unknown_name("physics", str(self.physics), PHYSICS)
        if self.hold not in HOLDS:
            raise unknown_name("quantity to hold", str(self.hold), HOLDS)
        if self.order is not None and self.order not in range(1, HIGHEST_ORDER + 1):
            raise InputError(
                f"the order of an expansion must be 1 … {HIGHEST_ORDER}; got {self.order!r}. "
                "Leave it out for the exact law."
            )
        lowest = max(0.0, -self.levitation.coils.control_offset[2])
        if not self.levitation.gap > lowest:
            raise InputError(
                f"the nominal gap must be more than {lowest:g} m, for the control coil to stay clear of the guideway; "
                f"got {self.levitation.gap:g} m. Fly higher or mount the control coil closer."
            )
        if not self.gap_minimum > lowest:
            raise InputError(
                f"gap_minimum must be more than {lowest:g} m, where the lower coil would touch the floor; "
                f"got {self.gap_minimum!r} m. Leave it out for 0.15 m."
            )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Flight(Result):
    """Level flight at one speed: gap and lateral gap [m], ampere-turns [A], exact law of a coil set, law in use."""

    speed: float
    gap: float
    gap_lateral: float
    current: float
    exact: CornerLaw
    law: CornerLaw | TaylorLaw

    def rows(self) -> list[Row]:
        return [
            ("speed", self.speed, "m/s"),
            ("gap", self.gap, "m"),
            ("main current", self.current, "A"),
            ("lift over drag of a coil set", 1 / self.exact.drag_ratio, ""),
        ]

    def vehicle(self, vehicle: Vehicle) -> Vehicle:
        """The vehicle on this law, at this speed."""
        return vehicle.with_values(speed=self.speed, force_law=self.law)


def flight(coils: FlyingCoils, speed: float, weight: float | None = None) -> Flight:
    """Level flight of a weight [N] (that of the levitation if left out) at a speed [m/s].

    Raises
    ------
    InputError
        Below the lift-off speed, or if the physics does not know this speed.
    InfeasibleError
        If the coils cannot carry the weight at any gap clear of the floor.
    """
    levitation = coils.levitation if weight is None else replace(coils.levitation, weight=weight)
    if coils.physics == "report" and coils.hold == "current":
        # the printed ratios belong to one gap: gap and current are both held, and the vehicle's own trim takes the rest
        exact, gap, current = levitation.law(speed, coils.physics), levitation.gap, levitation.current
    else:
        if coils.hold == "gap" and not levitation.lift_share(speed, coils.physics) > NO_LIFT:
            raise _below_lift_off(coils, levitation, speed)  # no current makes up for a coil without lift
        try:
            found = level_flight(speed, coils.physics, coils.hold, levitation)
        except InfeasibleError as error:
            if replace(levitation, gap=coils.gap_minimum).lift_share(speed, coils.physics) < 1:
                raise _below_lift_off(coils, levitation, speed) from error
            raise InputError(str(error)) from error  # too much lift at every gap; the sentence says so
        exact, gap, current = found.law, found.gap, found.current
    if gap < coils.gap_minimum:
        raise _below_lift_off(coils, levitation, speed)
    law = exact if coils.order is None else TaylorLaw.from_corner(exact, coils.order)
    return Flight(speed=speed, gap=gap, gap_lateral=levitation.gap_lateral, current=current, exact=exact, law=law)


def lift_off(coils: FlyingCoils) -> float:
    """Lowest speed [m/s] whose trim gap is at least `gap_minimum`, the current held."""
    return lift_off_speed(coils.gap_minimum, coils.physics, coils.levitation)


def _below_lift_off(coils: FlyingCoils, levitation: Levitation, speed: float) -> InputError:
    try:
        needed = f"{lift_off_speed(coils.gap_minimum, coils.physics, levitation):.3g} m/s"
    except InfeasibleError:
        needed = "never reached with this current"
    return InputError(
        f"the speed must not be below lift-off ({needed} for {levitation.weight:.6g} N at a gap of "
        f"{coils.gap_minimum:g} m); got {speed:g} m/s. Fly faster, raise the ampere-turns or lower gap_minimum_m."
    )
