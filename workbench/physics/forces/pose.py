"""Everything about one coil set at one pose and speed, in one record."""

import math
from dataclasses import dataclass, replace

from workbench.errors import InfeasibleError, InputError
from workbench.physics.forces.flight import REPORT_LEVITATION, Levitation, lift_off_speed
from workbench.physics.forces.operating import REPORT_GAP, REPORT_SPEED, law_at, speed_ratios
from workbench.result import Result, Row

LIFT_OFF_GAP = 0.15  # [m]; lowest flying height assumed when no vehicle's data say otherwise: control coil at 5 cm


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class CoilSetForces(Result):
    """Forces, stiffness and drag of one coil set; the names are those of the JSON document.

    h, h_prime [m], roll [rad], alpha [1], speed [m/s], physics: where.
    lift_n, lateral_n, roll_moment_n_m, drag_n: forces [N] and moment about the main coil's centre line [N m].
    stiffness: (3, 3) derivatives of lift, lateral force and roll moment by h, h', roll; symmetric; lift_ratio held.
    current: (3,) derivatives of the same by alpha.
    lift_ratio, lift_to_drag: f_L/f_L∞ and f_L/f_D at this speed and height.
    lift_ratio_by_height: what `stiffness` leaves out, ∂(f_L/f_L∞)/∂h [1/m]; None for physics `report`.
    ampere_turns: of the main coil [A].
    """

    h: float
    h_prime: float
    roll: float
    alpha: float
    speed: float
    physics: str
    ampere_turns: float
    lift_n: float
    lateral_n: float
    roll_moment_n_m: float
    drag_n: float
    stiffness: tuple[tuple[float, ...], ...]
    current: tuple[float, ...]
    lift_ratio: float
    lift_to_drag: float
    lift_ratio_by_height: float | None

    def rows(self) -> list[Row]:
        (lift_h, lift_hp, lift_roll), (_, lateral_hp, lateral_roll), (_, _, moment_roll) = self.stiffness
        return [
            ("lift F_L", self.lift_n, "N"),
            ("lateral force F_G", self.lateral_n, "N"),
            ("roll moment L", self.roll_moment_n_m, "N m"),
            ("drag", self.drag_n, "N"),
            ("f_L/f_L∞", self.lift_ratio, ""),
            ("f_L/f_D", self.lift_to_drag, ""),
            ("∂F_L/∂h", lift_h, "N/m"),
            ("∂F_L/∂h' = ∂F_G/∂h", lift_hp, "N/m"),
            ("∂F_L/∂φ = ∂L/∂h", lift_roll, "N"),
            ("∂F_G/∂h'", lateral_hp, "N/m"),
            ("∂F_G/∂φ = ∂L/∂h'", lateral_roll, "N"),
            ("∂L/∂φ", moment_roll, "N m"),
            ("∂F_L/∂α", self.current[0], "N"),
            ("∂F_G/∂α", self.current[1], "N"),
            ("∂L/∂α", self.current[2], "N m"),
        ]


def coil_set_forces(
    h: float = REPORT_GAP,
    h_prime: float = REPORT_GAP,
    roll: float = 0.0,
    alpha: float = 0.0,
    speed: float = REPORT_SPEED,
    physics: str = "report",
    levitation: Levitation = REPORT_LEVITATION,
    gap_minimum: float = LIFT_OFF_GAP,
) -> CoilSetForces:
    """Forces, stiffness and drag of one coil set at one pose and speed.

    Parameters
    ----------
    h, h_prime : float
        Main coil's centre over the floor, and near long side (level coil) from the wall [m].
    roll, alpha : float
        [rad], [1].
    speed : float
        [m/s], not below the lift-off speed at `gap_minimum` [m].
    physics : "report", "scaled" or "slab"
        See `workbench.physics.forces.operating`.
    levitation : Levitation
        Its coils, plate, current and weight; its gaps are not used.

    Raises
    ------
    InputError
        If a number is not finite, a coil would pass through the guideway, the wall would stand on the wrong side, or
        the speed is below lift-off.

    Examples
    --------
    >>> found = coil_set_forces(0.3, 0.3, 0.0, 0.0, 134.0, "report")
    >>> found.rows()[0][0], round(found.rows()[0][1], -2)
    ('lift F_L', 111200.0)
    """
    given = {"h": h, "h'": h_prime, "roll": roll, "alpha": alpha, "speed": speed}
    for name, value in given.items():
        if not math.isfinite(value):
            raise InputError(f"{name} must be a finite number; got {value!r}. Give SI units and radians.")
    if h <= 0:
        raise InputError(
            f"h must be positive, the coil flies above the floor; got {h!r} m. The nominal height is 0.3 m."
        )
    if h_prime <= 0:
        raise InputError(
            f"h' must be positive, the wall stands on the side of the near winding and gaps count away from it; "
            f"got {h_prime!r} m. The nominal gap is 0.3 m; a wall on the other side is the mirror image."
        )
    ratios = speed_ratios(speed, h, physics, levitation.coils, levitation.conductor)
    if physics != "report":
        _check_lift_off(speed, physics, levitation, gap_minimum)
    law = law_at(speed, h, h_prime, physics, levitation.current, levitation.coils, levitation.conductor)
    lift, lateral, moment = law.forces(0.0, 0.0, roll, alpha)
    stiffness = law.stiffness(roll=roll, alpha=alpha)
    return CoilSetForces(
        h=h,
        h_prime=h_prime,
        roll=roll,
        alpha=alpha,
        speed=speed,
        physics=physics,
        ampere_turns=levitation.current,
        lift_n=lift,
        lateral_n=lateral,
        roll_moment_n_m=moment,
        drag_n=law.drag_ratio * (lift + lateral),
        stiffness=tuple(tuple(row) for row in stiffness.tolist()),
        current=tuple(law.current_action(roll=roll, alpha=alpha).tolist()),
        lift_ratio=ratios.lift_ratio,
        lift_to_drag=ratios.lift_to_drag,
        lift_ratio_by_height=ratios.lift_ratio_by_height,
    )


def _check_lift_off(speed: float, physics: str, levitation: Levitation, gap_minimum: float) -> None:
    at_minimum = replace(levitation, gap=gap_minimum)
    if at_minimum.lift_share(speed, physics) >= 1:
        return
    try:
        needed = f"{lift_off_speed(gap_minimum, physics, levitation):.3g} m/s"
    except InfeasibleError:
        needed = "never reached with this current"
    raise InputError(
        f"the speed must not be below lift-off ({needed} for {levitation.weight:g} N at a gap of {gap_minimum:g} m); "
        f"got {speed:g} m/s. Below it the vehicle rolls on wheels; drag_at gives its magnetic drag."
    )
