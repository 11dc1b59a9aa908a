"""`workbench motor`: forces, torques and stiffness of one motor coil and one phase."""

from typing import Annotated

import typer


def motor(
    x: Annotated[float, typer.Option(help="Lateral displacement [m].")] = 0.0,
    y: Annotated[float, typer.Option(help="Gap, normal to the winding [m].")] = 0.30,
    z: Annotated[float, typer.Option(help="Longitudinal, from the centre of a positive winding coil [m].")] = 0.0,
    pitch: Annotated[float, typer.Option(help="About x [rad].")] = 0.0,
    yaw: Annotated[float, typer.Option(help="About y [rad].")] = 0.0,
    roll: Annotated[float, typer.Option(help="About z [rad]; the coil rolls first, then pitches, then yaws.")] = 0.0,
    coils: Annotated[int, typer.Option(help="Vehicle coils that thrust_n and normal_n count.")] = 1,
    json: Annotated[bool, typer.Option("--json", help="One JSON document on stdout.")] = False,
) -> int:
    """Forces and torques of one motor coil: 500 kA-turns above one phase of 1.5 kA."""
    from workbench.commands.output import emit_json, emit_rows
    from workbench.errors import InputError
    from workbench.physics.motor.pose import pose_forces

    if coils < 1:
        raise InputError(f"--coils must be at least 1; got {coils}. The report's vehicle has 32.")
    found = pose_forces((x, y, z, pitch, yaw, roll))
    if not json:
        emit_rows("Motor coil, one phase", found.rows())
        return 0
    emit_json(
        {
            "pose": {"x": x, "y": y, "z": z, "pitch": pitch, "yaw": yaw, "roll": roll},
            "force_n": found.force,
            "torque_n_m": found.torque,
            "inductance_h": found.inductance,
            "stiffness": found.stiffness_d,
            "thrust_n": found.thrust(coils),
            "normal_n": found.normal(coils),
            "coils": coils,
            "ampere_turns": 500e3,
            "current_a": 1500.0,
        }
    )
    return 0
