"""Appendix A, magnetic forces: our number for every number it prints (rows in appendix_a.toml).

The scale of all coefficients is the report's own: 0.8380 × 184635 (kA-turns)², both printed in A.3.
"""

import math

from workbench.ledger.baseline import report_vehicle
from workbench.physics.coils import REPORT_PLATE, WireLoop, mutual_inductance, plane_forces, plane_images
from workbench.physics.forces.corner import CornerLaw
from workbench.physics.forces.energy import REPORT_COILS
from workbench.physics.forces.flight import Levitation, drag_at
from workbench.physics.forces.law import REPORT_LIFT_RATIO, REPORT_LIFT_TO_DRAG
from workbench.physics.forces.operating import REPORT_GAP, REPORT_SETS, REPORT_SPEED, REPORT_WEIGHT, ampere_turns
from workbench.physics.forces.taylor import TaylorLaw

PRINTED_SQUARE = 184635e6  # (KNI)² [A²] (A.3)
POUND_FORCE = 4.4482216152605  # [N], exact
MILE_PER_HOUR = 0.44704  # [m/s], exact
ROWS = ("1", "alpha", "alpha2")
COLUMNS = (("0", "h", "hp", "phi", "alpha"), ("h", "hp", "phi", "alpha"), ("h", "hp", "phi"))


def computed() -> dict[str, float]:
    """Row id → our number, in the unit of the row."""
    law = CornerLaw(
        coils=REPORT_COILS,
        gap=REPORT_GAP,
        gap_lateral=REPORT_GAP,
        current=math.sqrt(PRINTED_SQUARE),
        lift_ratio=REPORT_LIFT_RATIO,
        drag_ratio=1 / REPORT_LIFT_TO_DRAG,
        order=12,
    )
    lift = law.forces(0.0, 0.0, 0.0, 0.0)[0] / law.scale * 1e6
    turns = ampere_turns(law, REPORT_WEIGHT)
    plane = plane_forces(REPORT_COILS.width, REPORT_COILS.length, REPORT_GAP, REPORT_SPEED, REPORT_PLATE)
    return {
        "A.1.infinite_speed_lift": plane.lift_infinite / _plane_lift(),
        "A.3.speed": 300 * MILE_PER_HOUR,
        "A.3.weight": 100_000 * POUND_FORCE / 1e3,
        "A.3.wheel_base": 9.00 + 7.65,
        "A.3.track": 2 * max(y for _, y in report_vehicle().positions),
        "A.3.lift_to_drag": plane.lift_to_drag,
        "A.3.lift_ratio": plane.lift_ratio,
        "A.3.lift_coefficient": lift,
        "A.3.lift_of_four": REPORT_SETS * REPORT_LIFT_RATIO * lift,
        "A.3.ampere_turns_squared": turns**2 / 1e6,
        "A.3.ampere_turns": turns / 1e3,
        "A.3.ampere_turns_rounded": turns,
        "A.3.figure_9.ampere_turns": turns,
        "A.derived.drag": drag_at(REPORT_SPEED, "report", Levitation(current=turns)),
        **_expansion(law),
    }


def _plane_lift() -> float:
    """Lift over an endless perfect conductor by the image [N/A²], the image held fixed."""
    import casadi as ca

    height = ca.SX.sym("h")
    coil = WireLoop.rectangle(REPORT_COILS.width, REPORT_COILS.length).placed((0.0, 0.0, height))
    ((sign, image),) = plane_images(coil)
    lift = ca.gradient(sign * mutual_inductance(coil, image) / 2, height)
    return float(ca.Function("lift", [height], [lift])(REPORT_GAP))


def _expansion(law: CornerLaw) -> dict[str, float]:
    extended = TaylorLaw.from_corner(law, 1).extended()
    values = {}
    for force, rows in (("F_L", extended.lift), ("F_G", extended.lateral), ("L", extended.moment)):
        for name, columns, row in zip(ROWS, COLUMNS, rows, strict=True):
            for column, value in zip(columns, row, strict=True):
                values[f"A.3.extended.{force}.{name}.{column}"] = value
                if name == "1":
                    values[f"A.3.first_order.{force}.{column}"] = value
    return values
