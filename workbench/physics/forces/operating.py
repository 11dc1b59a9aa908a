"""The force law at a speed and height: what finite speed leaves of lift, and what it costs in drag.

    speed, height, physics  -->  speed_ratios  -->  law_at  -->  CornerLaw  -->  ampere_turns that carry a weight

physics:  report   the printed ratios 0.8380 and 61.505; only at 134 m/s and h = 0.3 m
          scaled   report × slab(v, h)/slab(134 m/s, 0.3 m)
          slab     the endless plate of the guideway's thickness and conductivity
"""

import math
from dataclasses import dataclass

from workbench.errors import InputError, unknown_name
from workbench.physics.coils.conductor import REPORT_PLATE, Conductor
from workbench.physics.coils.sheet import plane_forces
from workbench.physics.forces.corner import CornerLaw
from workbench.physics.forces.energy import REPORT_COILS, CoilSet
from workbench.physics.forces.law import REPORT_AMPERE_TURNS, REPORT_LIFT_RATIO, REPORT_LIFT_TO_DRAG

PHYSICS = ("report", "scaled", "slab")
REPORT_SPEED = 134.0  # [m/s] (report, A.3)
REPORT_GAP = 0.3  # h = h' [m] (report, A.3)
REPORT_WEIGHT = 444.8e3  # [N] (report, A.3)
REPORT_SETS = 4  # coil sets of the vehicle (report, A.2)


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedRatios:
    """Finite speed in two numbers.

    lift_ratio : f_L/f_L∞ [1].    lift_to_drag : f_L/f_D [1].
    lift_ratio_by_height : derivative of the first [1/m]; None where the physics gives none. It is not part of the force
    law's stiffness, which holds the ratio, as the report does.
    """

    lift_ratio: float
    lift_to_drag: float
    lift_ratio_by_height: float | None


def speed_ratios(
    speed: float, gap: float, physics: str, coils: CoilSet = REPORT_COILS, conductor: Conductor = REPORT_PLATE
) -> SpeedRatios:
    """Lift and drag ratios of the main coil at a speed [m/s] and height [m].

    Raises
    ------
    InputError
        If physics is unknown, `report` is asked away from 134 m/s and 0.3 m, or a number has no sense.

    Source: report, A.1 (c), (d).
    """
    if physics not in PHYSICS:
        raise unknown_name("physics", str(physics), PHYSICS)
    _check_flying(speed, gap)
    if physics == "report":
        if abs(speed - REPORT_SPEED) > 1e-9 or abs(gap - REPORT_GAP) > 1e-9:
            raise InputError(
                f"physics 'report' must stay at {REPORT_SPEED:g} m/s and h = {REPORT_GAP:g} m, where "
                "the report prints its "
                f"ratios; got {speed:g} m/s and {gap:g} m. Use physics 'scaled' or 'slab'."
            )
        return SpeedRatios(lift_ratio=REPORT_LIFT_RATIO, lift_to_drag=REPORT_LIFT_TO_DRAG, lift_ratio_by_height=None)
    here = plane_forces(coils.width, coils.length, gap, speed, conductor)
    if physics == "slab":
        return SpeedRatios(
            lift_ratio=here.lift_ratio, lift_to_drag=here.lift_to_drag, lift_ratio_by_height=here.lift_ratio_by_height
        )
    there = plane_forces(coils.width, coils.length, REPORT_GAP, REPORT_SPEED, conductor)
    factor = REPORT_LIFT_RATIO / there.lift_ratio
    return SpeedRatios(
        lift_ratio=factor * here.lift_ratio,
        lift_to_drag=REPORT_LIFT_TO_DRAG * here.lift_to_drag / there.lift_to_drag,
        lift_ratio_by_height=factor * here.lift_ratio_by_height,
    )


def law_at(
    speed: float = REPORT_SPEED,
    height: float = REPORT_GAP,
    height_lateral: float = REPORT_GAP,
    physics: str = "report",
    current: float = REPORT_AMPERE_TURNS,
    coils: CoilSet = REPORT_COILS,
    conductor: Conductor = REPORT_PLATE,
) -> CornerLaw:
    """The exact force law of one coil set at a speed and nominal pose.

    Parameters
    ----------
    speed : float
        [m/s].
    height, height_lateral : float
        Nominal h and h' [m].
    physics : "report", "scaled" or "slab"
    current : float
        Main-coil ampere-turns [A].
    coils, conductor
        Geometry and guideway plate; the report's when left out. `report` and `scaled` belong to the report's.

    Raises
    ------
    InputError
        As `speed_ratios`, and if a coil would not be clear of the guideway.
    """
    ratios = speed_ratios(speed, height, physics, coils, conductor)
    return CornerLaw(
        coils=coils,
        gap=height,
        gap_lateral=height_lateral,
        current=current,
        lift_ratio=ratios.lift_ratio,
        drag_ratio=1 / ratios.lift_to_drag,
    )


def ampere_turns(law: CornerLaw, weight: float, sets: int = REPORT_SETS) -> float:
    """Main-coil ampere-turns [A] with which `sets` coil sets carry `weight` [N] at the law's nominal pose, no control
    current.

    Source: report, A.3: weight = 4 (f_L/f_L∞) f_L (KNI)².
    """
    if not 0 < weight < math.inf or sets < 1:
        raise InputError(
            f"weight and number of coil sets must be positive; got {weight!r} N and {sets!r}. The "
            "report has 444800 N on 4."
        )
    lift, _, _ = law.forces(0.0, 0.0, 0.0, 0.0)
    return law.current * math.sqrt(weight / (sets * lift))


def _check_flying(speed: float, gap: float) -> None:
    if not 0 < speed < math.inf:
        raise InputError(
            f"the speed must be positive and finite; got {speed!r} m/s. At rest the guideway does not lift."
        )
    if not 0 < gap < math.inf:
        raise InputError(f"the height must be positive and finite; got {gap!r} m. The coil flies above the guideway.")
