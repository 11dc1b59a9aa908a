"""`workbench simulate`: what happens over time."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.analyse import Budget, Name, Speed
from workbench.commands.problems import Json

SHOWN = 12  # rows of a history on the screen


def simulate(
    problem: Name,
    gains: Annotated[
        Path | None,
        typer.Option(
            "--gains",
            "--table",
            help="Gain table, or TOML/JSON mapping of names to numbers; the approved values if left out.",
        ),
    ] = None,
    step: Annotated[
        list[str] | None,
        typer.Option(
            help="SIGNAL=SIZE, or SIGNAL=SIZE@SECONDS: a step there, as often as wanted; at a signal between model and "
            "structure a disturbance. A unit step of the first reference, or else of the first signal from outside, "
            "if left out."
        ),
    ] = None,
    output: Annotated[
        list[str] | None,
        typer.Option(
            help='A signal to record, or a signed sum such as "r - y"; all measured and commanded if left out.'
        ),
    ] = None,
    duration_s: Annotated[
        float | None, typer.Option(help="Seconds of the history; until it rests if left out.")
    ] = None,
    sample_time_ms: Annotated[
        float | None, typer.Option(help="Of a computer that runs the structure; as it was designed if left out.")
    ] = None,
    computing_delay_ms: Annotated[
        float | None, typer.Option(help="From sampling the sensors to the new commands; none if left out.")
    ] = None,
    instants: Annotated[
        int | None, typer.Option(help="Of a history in continuous time; 801 if left out.", min=2, max=200_000)
    ] = None,
    out: Annotated[
        str | None,
        typer.Option(
            help="A folder (there already, or a name that ends in / or has no ending) for history.csv and history.png; "
            "any other name is the CSV file's. Of a vehicle, the folder that keeps its flights, a picture and a report."
        ),
    ] = None,
    hours: Annotated[
        float | None, typer.Option(help="Of a vehicle: hours of flight, all guideways together; 1 if left out.")
    ] = None,
    seeds: Annotated[
        int | None, typer.Option(help="Of a vehicle: guideways that share the hours; 16 if left out.", min=2)
    ] = None,
    seed: Annotated[int | None, typer.Option(help="Of a vehicle: of the guideways; 0 if left out.", min=0)] = None,
    law: Annotated[
        str | None,
        typer.Option(help="Of a vehicle: order of the force law's expansion, 1 … 5, or exact; 5 if left out."),
    ] = None,
    integration_step_ms: Annotated[
        float | None, typer.Option(help="Of a vehicle, at most 4; from the loop's fastest pole if left out.")
    ] = None,
    factor: Annotated[
        float | None, typer.Option(help="Of a vehicle: on all heights of the guideway; 1 if left out.")
    ] = None,
    speed: Speed = None,
    workers: Annotated[
        int | None,
        typer.Option(help="Of a vehicle: processes of this machine; all processors if left out.", min=1, max=1024),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Of a vehicle: address of a Dask scheduler to use instead.")
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Of a vehicle: throw away what the folder holds and begin anew.")
    ] = False,
    budget_seconds: Budget = None,
    json: Json = False,
) -> None:
    """Time histories of the closed loops of any plant of one's own after steps: exact, sampled and late too.

    Of a vehicle, hours of nonlinear flight over guideways drawn at random: contacts per hour, and every figure of the
    ride over that of the linear vehicle on the same guideways.
    """
    from workbench.machine.supervision import finishing, supervised

    deadline = supervised(budget_seconds, "the simulation")

    from workbench.commands.flights import Asked, simulate_flights
    from workbench.commands.output import emit_json, emit_rows, emit_table, say
    from workbench.design.asked import simulate as simulated
    from workbench.files.own_plant import read_values
    from workbench.files.problem import load_problem
    from workbench.machine.writing import check_file, place_of, write_bytes, write_text
    from workbench.simulation.response import INSTANTS

    loaded = load_problem(problem, speed=speed)
    asked = Asked(
        hours=hours, seeds=seeds, seed=seed, law=law, integration_step_ms=integration_step_ms, factor=factor,
        workers=workers, scheduler=scheduler, fresh=fresh,
    )  # fmt: skip
    if loaded.flies:
        loops = {"step": step, "output": output, "duration-s": duration_s, "sample-time-ms": sample_time_ms,
                 "computing-delay-ms": computing_delay_ms, "instants": instants}  # fmt: skip
        _refuse([name for name, value in loops.items() if value is not None], loaded.name, "flies; give --hours")
        simulate_flights(loaded, gains, asked, out, deadline, json)
        return
    _refuse(asked.given, loaded.name, "does not fly; give --step")
    table = None if out is None else place_of(out, "history", ".csv")
    picture = None if table is None or out is None or str(table) == out else table.with_suffix(".png")
    for path in (table, picture):
        if path is not None:
            check_file(path)
    values = None if gains is None else read_values(gains, loaded.structure)
    found = simulated(
        loaded, duration_s, values=values, steps=parse_steps(step) if step else None, outputs=output or None,
        sample_time=None if sample_time_ms is None else 1e-3 * sample_time_ms,
        computing_delay=1e-3 * (computing_delay_ms or 0.0), instants=INSTANTS if instants is None else instants,
    )  # fmt: skip
    drawn = None if picture is None else picture_of(found)
    finishing()
    written = {}
    if table is not None:
        write_text(table, csv_of(found))
        written["table"] = str(table)
    if picture is not None and drawn is not None:
        write_bytes(picture, drawn)
        written["picture"] = str(picture)
    if json:
        emit_json(found.to_dict() | written)
        return
    for response in found.responses:
        emit_rows(f"{loaded.title or loaded.name}: {response.model}", response.rows()[1:])
        chosen = range(0, len(response.time), max(1, (len(response.time) - 1) // (SHOWN - 1)))
        rows = [[f"{response.time[k]:.4g}", *(f"{v:.4g}" for v in response.values[k])] for k in chosen]
        emit_table("History", ("time [s]", *response.outputs), rows)
    for what, place in written.items():
        say(f"{what:<8}{place}")


def _refuse(names: list[str], problem: str, instead: str) -> None:
    """Refuses options that are of the other kind of problem."""
    from workbench.errors import InputError

    if names:
        raise InputError(f"--{names[0]} must be left out: {problem!r} {instead} instead.")


def parse_steps(given: list[str]):
    """Signal to its steps, from SIGNAL=SIZE or SIGNAL=SIZE@SECONDS."""
    from workbench.errors import InputError
    from workbench.simulation.response import Step

    found: dict[str, list[Step]] = {}
    for text in given:
        name, equals, rest = text.rpartition("=")
        size, _, start = rest.partition("@")
        try:
            step = Step(size=float(size), start=float(start or 0.0))
        except ValueError as error:
            if isinstance(error, InputError):
                raise
            raise InputError(f"--step takes SIGNAL=SIZE or SIGNAL=SIZE@SECONDS; got {text[:80]!r}.") from error
        if not equals or not name.strip():
            raise InputError(f"--step takes SIGNAL=SIZE or SIGNAL=SIZE@SECONDS; got {text[:80]!r}.")
        found.setdefault(name.strip(), []).append(step)
    return found


def csv_of(found) -> str:
    """Time and outputs of every model, one row an instant, to the last digit."""
    import csv
    from io import StringIO

    stream = StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["model", "time [s]", *found.responses[0].outputs])
    for response in found.responses:
        rows = zip(response.time.tolist(), response.values.tolist(), strict=True)
        writer.writerows([response.model, repr(t), *map(repr, row)] for t, row in rows)
    return stream.getvalue()


def picture_of(found) -> bytes:
    """The histories as PNG."""
    from io import BytesIO

    import matplotlib

    matplotlib.use("Agg")
    stream = BytesIO()
    found.plot().savefig(stream, format="png", dpi=120)
    return stream.getvalue()
