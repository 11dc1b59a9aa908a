"""`workbench forces`: forces, moment and stiffness of one coil set at one pose and speed."""

from typing import Annotated

import typer

from workbench.commands.output import emit_json, emit_rows


def forces(
    h: Annotated[float, typer.Option("--h", help="Height of the main coil over the floor [m].")] = 0.3,
    h_prime: Annotated[float, typer.Option("--h-prime", help="Gap of the near winding to the wall [m].")] = 0.3,
    roll: Annotated[float, typer.Option("--roll", help="Roll angle, wall side down [rad].")] = 0.0,
    alpha: Annotated[float, typer.Option("--alpha", help="Control current over main-coil current [1].")] = 0.0,
    speed: Annotated[float, typer.Option("--speed", help="Speed [m/s].")] = 134.0,
    physics: Annotated[
        str, typer.Option("--physics", help="report (134 m/s, h 0.3 m only), scaled or slab.")
    ] = "report",
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Forces, roll moment, stiffness and drag of one coil set in the L-shaped guideway."""
    from workbench.physics.forces.pose import coil_set_forces

    result = coil_set_forces(h, h_prime, roll, alpha, speed, physics)
    if json:
        emit_json(result)
        return
    emit_rows(
        f"One coil set at h {h:g} m, h' {h_prime:g} m, roll {roll:g} rad, alpha {alpha:g}, {speed:g} m/s ({physics})",
        result.rows(),
    )
