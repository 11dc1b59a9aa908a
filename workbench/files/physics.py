"""The physical half of a data file: vehicle, force law, operating point; and what the workbench makes of them.

[force_law] kind   first_order   coefficients as given            ┐
                   extended      the report's printed table        ├─ one speed: that of [vehicle]
                   corner        exact law of coils in a corner    ┐
                   taylor        its expansion to an order 1 … 5   ├─ any speed from lift-off on
[operating_point]  speed, load, wind, curve, a lost coil set; nominal flight where it is left out
"""

from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from workbench.errors import InfeasibleError, InputError
from workbench.files.block import Block, Finite, Positive, Share, Switch
from workbench.physics.coils.conductor import Conductor
from workbench.physics.forces.energy import REPORT_COILS, CoilSet
from workbench.physics.forces.flight import Levitation
from workbench.physics.forces.law import ExtendedLaw, FirstOrderLaw, report_extended
from workbench.physics.forces.operating import ampere_turns
from workbench.physics.vehicle.conditions import Conditions, Curve, SideWind
from workbench.physics.vehicle.flight import Flight, FlyingCoils, flight
from workbench.physics.vehicle.operating import OperatingPoint

Coefficients = tuple[Finite, Finite, Finite, Finite, Finite]


class VehicleBlock(Block):
    weight_n: Positive
    front_arm_m: Positive
    rear_arm_m: Positive
    half_track_m: Positive
    coil_depth_m: Finite
    gap_m: Positive
    gap_lateral_m: Positive
    gap_minimum_m: Positive = 0.15
    speed_m_s: Positive
    coil_sets_m: tuple[tuple[Finite, Finite], ...] | None = Field(default=None, max_length=64)
    joined_sets: tuple[tuple[Annotated[int, Field(ge=1)], ...], ...] = Field(default=(), max_length=64)

    def positions(self) -> tuple[tuple[float, float], ...]:
        """x forward, y right of every coil set [m]: as listed, or one at each corner."""
        if self.coil_sets_m is not None:
            return self.coil_sets_m
        a, r, b = self.front_arm_m, self.rear_arm_m, self.half_track_m
        return ((a, b), (a, -b), (-r, b), (-r, -b))

    def joined(self) -> tuple[tuple[int, ...], ...]:
        """Sets that share a command, counted from 0."""
        return tuple(tuple(i - 1 for i in group) for group in self.joined_sets)


class FirstOrderBlock(Block):
    kind: Literal["first_order"]
    lift: Coefficients
    lateral: Coefficients
    moment: Coefficients
    order: str = ""
    lift_to_drag: Positive
    main_current_a_turns: Positive
    control_below_m: Positive = -REPORT_COILS.control_offset[2]

    def coils(self) -> CoilSet:
        """Coils to keep clear of the guideway: the report's, the control coil this far below."""
        return replace(REPORT_COILS, control_offset=(0.0, 0.0, -self.control_below_m))


class ExtendedBlock(Block):
    kind: Literal["extended"]
    corrected: Switch
    main_current_a_turns: Positive

    def coils(self) -> CoilSet:
        """The report's, as its coefficients are."""
        return REPORT_COILS


class CornerBlock(Block):
    kind: Literal["corner"]
    physics: Literal["report", "scaled", "slab"]
    hold: Literal["current", "gap"] = "current"
    coil_width_m: Positive
    coil_length_m: Positive
    control_width_m: Positive
    control_length_m: Positive
    control_below_m: Positive
    main_current_a_turns: Positive | None = None
    plate_thickness_m: Positive
    plate_conductivity_s_m: Positive

    def coils(self) -> CoilSet:
        """Main and control coil of a set."""
        return CoilSet(
            width=self.coil_width_m, length=self.coil_length_m, control_width=self.control_width_m,
            control_length=self.control_length_m, control_offset=(0.0, 0.0, -self.control_below_m),
        )  # fmt: skip


class TaylorBlock(CornerBlock):
    kind: Literal["taylor"]  # type: ignore[assignment]
    expansion_order: Annotated[int, Field(ge=1, le=5)]


ForceLawBlock = Annotated[FirstOrderBlock | ExtendedBlock | CornerBlock | TaylorBlock, Field(discriminator="kind")]


class OperatingPointBlock(Block):
    speed_m_s: Positive | None = None
    balance: Literal["moment", "currents", "cg", "pose"] = "moment"
    carried_by: Literal["pose", "currents"] = "pose"
    weight_n: Positive | None = None
    cg_forward_m: Finite = 0.0
    side_force_n: Finite = 0.0
    side_force_above_cg_m: Finite = 0.0
    side_force_ahead_of_cg_m: Finite = 0.0
    curve_lateral_m_s2: Finite = 0.0
    curve_cant_rad: Finite = 0.0
    curve_roll_rate_rad_s: Finite = 0.0
    curve_roll_acceleration_rad_s2: Finite = 0.0
    curve_lateral_jerk_m_s3: Finite = 0.0
    lost_set: Annotated[int, Field(ge=1)] | None = None
    lost_share: Share = 1.0

    @model_validator(mode="after")
    def whole(self) -> "OperatingPointBlock":
        """A share is of a set, a lever of a force."""
        if self.lost_set is None and self.lost_share != 1.0:
            raise ValueError("lost_share needs lost_set, the number of the coil set that fails")
        if not self.side_force_n and (self.side_force_above_cg_m or self.side_force_ahead_of_cg_m):
            raise ValueError("side_force_above_cg_m and side_force_ahead_of_cg_m need side_force_n, the force itself")
        return self

    def conditions(self, mass: float, flown: float) -> Conditions:
        """The same as the vehicle takes them.

        mass : of the vehicle they are for [kg];  flown : weight at which its level flight was found [N]; where it is
            not the point's own, what is between them is for pose or currents to carry
        """
        wind = SideWind(force=self.side_force_n, above=self.side_force_above_cg_m, ahead=self.side_force_ahead_of_cg_m)
        curve = Curve(
            lateral=self.curve_lateral_m_s2, cant=self.curve_cant_rad, roll_rate=self.curve_roll_rate_rad_s,
            roll_acceleration=self.curve_roll_acceleration_rad_s2, lateral_jerk=self.curve_lateral_jerk_m_s3,
        )  # fmt: skip
        loaded = self.weight_n is not None and self.weight_n != flown
        return Conditions(
            mass=mass * (self.weight_n or flown) / flown if loaded else None, cg_forward=self.cg_forward_m,
            wind=wind if self.side_force_n else None, curve=None if curve == Curve(lateral=0.0) else curve,
            lost_set=self.lost_set, lost_share=self.lost_share, carried_by=self.carried_by,
        )  # fmt: skip


def flown_weight(law: Block, vehicle: VehicleBlock, point: OperatingPointBlock | None) -> float:
    """What level flight carries [N].

    The operating point's weight where the gap or the current of the coils is found for it; the vehicle's own where the
    law belongs to one gap and current, or control currents are to carry the difference.
    """
    settles = isinstance(law, CornerBlock) and not (law.physics == "report" and law.hold == "current")
    if point is None or point.weight_n is None or not settles or point.carried_by == "currents":
        return vehicle.weight_n
    return point.weight_n


def flying_coils(law: CornerBlock, vehicle: VehicleBlock) -> FlyingCoils:
    """Coils, plate and current of a law that comes from geometry; a current left out is what carries the weight.

    The ampere-turns of `gap_m` at the vehicle's own speed: an operating point at another speed keeps them.
    """
    sets = len(vehicle.positions())
    plate = Conductor(conductivity=law.plate_conductivity_s_m, thickness=law.plate_thickness_m)
    given = {"weight": vehicle.weight_n, "sets": sets, "gap": vehicle.gap_m, "gap_lateral": vehicle.gap_lateral_m,
             "coils": law.coils(), "conductor": plate}  # fmt: skip
    current = law.main_current_a_turns
    if current is None:
        one = Levitation(**given).law(vehicle.speed_m_s, law.physics)
        current = ampere_turns(one, vehicle.weight_n, sets)
    order = law.expansion_order if isinstance(law, TaylorBlock) else None
    return FlyingCoils(
        levitation=Levitation(**given, current=current), physics=law.physics, hold=law.hold, order=order,
        gap_minimum=vehicle.gap_minimum_m,
    )  # fmt: skip


def level_flight(law: CornerBlock, vehicle: VehicleBlock, point: OperatingPointBlock | None) -> Flight:
    """Gap, current and force law at the operating point's speed and weight."""
    speed = point.speed_m_s if point and point.speed_m_s is not None else vehicle.speed_m_s
    return flight(flying_coils(law, vehicle), speed, flown_weight(law, vehicle, point))


def least_distance(
    law: FirstOrderBlock | ExtendedBlock | CornerBlock,
    vehicle: VehicleBlock,
    flown: Flight | None,
    point: OperatingPoint,
) -> tuple[float, float]:
    """Least distance of any coil from floor and wall where the vehicle rests [m].

    Raises InfeasibleError where a coil touches, or where coefficients are asked farther out than the gap is wide.
    """
    gaps = (flown.gap, flown.gap_lateral) if flown else (vehicle.gap_m, vehicle.gap_lateral_m)
    least = point.clearance(law.coils(), *gaps)
    farthest = float(np.max(np.abs(point.deviation[:2]) / np.array(gaps)[:, None]))
    if min(least) <= 0 or (flown is None and farthest >= 1):
        raise InfeasibleError(
            "the vehicle must rest clear of the guideway and less than a gap away from its nominal pose; at "
            f"this point its nearest part is {least[0]:.4g} m from the floor and {least[1]:.4g} m from a wall, and a "
            f"gap changes by {farthest:.3g} of itself. Mend the forces or the weight, or reduce the loads."
        )
    return least


def printed_law(
    law: FirstOrderBlock | ExtendedBlock, vehicle: VehicleBlock, point: OperatingPointBlock | None
) -> FirstOrderLaw | ExtendedLaw:
    """The law of given coefficients, which hold at the vehicle's own speed only."""
    if point and point.speed_m_s is not None and point.speed_m_s != vehicle.speed_m_s:
        raise InputError(
            f"a force law of kind {law.kind!r} must stay at the speed of its coefficients, {vehicle.speed_m_s:g} m/s; "
            f"got {point.speed_m_s:g} m/s. Give the coils instead: kind 'corner' or 'taylor'."
        )
    if isinstance(law, ExtendedBlock):
        return report_extended(corrected=law.corrected)
    return FirstOrderLaw(lift=law.lift, lateral=law.lateral, moment=law.moment, drag_ratio=1 / law.lift_to_drag)
