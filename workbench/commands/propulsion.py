"""`workbench propulsion` and `workbench noise`: drag, thrust, speed schedule and masses; noise against a limit."""

from typing import Annotated

import typer

from workbench.commands.output import emit_json, emit_rows, emit_table
from workbench.constants import GRAVITY

JSON = Annotated[bool, typer.Option("--json", help="Print one JSON document.")]


def propulsion(
    mass: Annotated[float, typer.Option("--mass", help="Mass of the vehicle [kg].")] = 45_400.0,
    lift_off_speed: Annotated[float, typer.Option("--lift-off-speed", help="[m/s]")] = 30.0,
    lift_off_thrust: Annotated[
        float, typer.Option("--lift-off-thrust", help="Thrust at lift-off, acceleration included [N].")
    ] = 60e3,
    cruise_speed: Annotated[float, typer.Option("--cruise-speed", help="[m/s]")] = 134.0,
    cruise_thrust: Annotated[float, typer.Option("--cruise-thrust", help="Thrust at cruise [N].")] = 41e3,
    acceleration_g: Annotated[
        float, typer.Option("--acceleration-g", help="Acceleration at lift-off and of the constant run [g].")
    ] = 0.05,
    acceleration_limit_g: Annotated[
        float, typer.Option("--acceleration-limit-g", help="Largest acceleration of the schedule [g].")
    ] = 0.15,
    thrust_limit: Annotated[
        float | None,
        typer.Option(
            "--thrust-limit", help="Largest thrust of the schedule [N]; the motor's rating unless given, inf for none."
        ),
    ] = None,
    time: Annotated[
        float | None, typer.Option("--time", help="Time from lift-off to cruise [s]; the constant run's unless given.")
    ] = None,
    distance: Annotated[
        float | None, typer.Option("--distance", help="Distance from lift-off to cruise instead of a time [m].")
    ] = None,
    frontal_area: Annotated[float, typer.Option("--frontal-area", help="[m²]")] = 8.5,
    coils: Annotated[int, typer.Option("--coils", help="Motor coils on the vehicle.")] = 32,
    coil_force: Annotated[float, typer.Option("--coil-force", help="Thrust of one coil and phase [N].")] = 1340.0,
    current: Annotated[float, typer.Option("--current", help="Largest winding current, peak [A].")] = 1500.0,
    optimise: Annotated[
        bool, typer.Option("--optimise", help="Also solve the schedule by numerical optimal control.")
    ] = False,
    json: JSON = False,
) -> None:
    """Drag law, power, acceleration, schedule of least peak power, motor rating and magnet masses."""
    from workbench.physics.propulsion import MotorRating, propulsion_overview

    result = propulsion_overview(
        mass=mass,
        lift_off=(lift_off_speed, lift_off_thrust),
        cruise=(cruise_speed, cruise_thrust),
        acceleration=acceleration_g * GRAVITY,
        acceleration_limit=acceleration_limit_g * GRAVITY,
        thrust_limit=thrust_limit,
        time=time,
        distance=distance,
        frontal_area=frontal_area,
        motor=MotorRating(coil_force=coil_force, current=current, coils=coils),
        optimise=optimise,
    )
    if json:
        emit_json(result)
        return
    emit_rows(f"Propulsion of {mass:g} kg from {lift_off_speed:g} to {cruise_speed:g} m/s", result.rows())


def noise(
    fans: Annotated[int, typer.Option("--fans", help="Number of fans.")] = 2,
    engines: Annotated[int, typer.Option("--engines", help="Number of core engines.")] = 2,
    fan_level: Annotated[
        float,
        typer.Option("--fan-level", help="One fan at 50 feet [dB(A)]; the report has 80 at cruise, 86 at full power."),
    ] = 80.0,
    engine_level: Annotated[
        float, typer.Option("--engine-level", help="One engine at 50 feet [dB(A)]; 80 and 86 as well.")
    ] = 80.0,
    distance: Annotated[
        float, typer.Option("--distance", help="Distance from the vehicle [m]; 15.24 is 50 feet.")
    ] = 15.24,
    limit: Annotated[
        float | None, typer.Option("--limit", help="Largest overall level at that distance [dB(A)].")
    ] = None,
    technology: Annotated[
        str,
        typer.Option(
            "--technology", help="Last step taken: today, 'quieter source', 'better treatment' or 'cleaner inlet'."
        ),
    ] = "today",
    json: JSON = False,
) -> int:
    """Noise of fans and engines after each step of technology; exit code 1 if a limit is given and not met."""
    from workbench.physics.propulsion import noise_budget, report_sources

    sources = report_sources(fan_level=fan_level, engine_level=engine_level, fans=fans, engines=engines)
    result = noise_budget(sources, distance=distance, limit=limit, technology=technology)
    if json:
        emit_json(result)
    else:
        _print_budget(result)
    return 0 if result.met else 1


def _print_budget(result) -> None:
    columns = ["up to and including", *(source.name for source in result.sources), "overall"]
    rows = [
        [row.technology, *(f"{level:.1f}" for level in row.levels), f"{row.overall:.1f}"] for row in result.projections
    ]
    if result.limit is not None:
        columns.append("margin")
        for cells, row in zip(rows, result.projections, strict=True):
            cells.append(f"{row.margin:+.1f}")
    emit_table(f"Noise at {result.distance:g} m, dB(A)", columns, rows)
    if result.limit is not None:
        emit_rows(f"Verdict for '{result.technology}'", result.rows()[-4:])
