"""`workbench export`: the gains of a table in another format."""

from pathlib import Path
from typing import Annotated

import typer

Table = Annotated[Path, typer.Argument(metavar="TABLE", help="Gain table that 'workbench design' wrote.")]


def export(
    table: Table,
    format: Annotated[str, typer.Option("--format", help="csv, json, mat or c.")],
    out: Annotated[
        str | None,
        typer.Option(
            help="A folder (there already, or a name that ends in / or has no ending) for a file named after the "
            "table; any other name is the file's. Standard output if left out."
        ),
    ] = None,
    sample_time_ms: Annotated[
        float | None,
        typer.Option(
            help="Sample time of the controller, for mat and c; the table's if left out, and where it has none the "
            "longest that keeps its promises."
        ),
    ] = None,
    computing_delay_ms: Annotated[
        float, typer.Option(help="From sampling the sensors to the new commands, in the check of mat and c.")
    ] = 0.0,
    accept: Annotated[
        bool, typer.Option("--accept", help="Export even if the sampled loop breaks a promise of the table.")
    ] = False,
    prefix: Annotated[
        str | None, typer.Option(help="In place of 'wb' in every name of the C header, for two in one program.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Writes the gains of a table as CSV, JSON, a MATLAB file or a C header with the discrete filters.

    For mat and c the sampled loop with the table's vehicle or models is checked first, and each promise is printed
    beside its sampled value. An unstable loop is not exported; one that breaks a promise only with --accept.
    """
    import sys
    from base64 import b64encode

    from workbench.commands.output import emit_json, emit_table, say
    from workbench.errors import InputError
    from workbench.handover.code.c_header import check_prefix
    from workbench.handover.code.formats import DIGITAL, check_of, render, suffix
    from workbench.handover.table.table import read_table
    from workbench.machine.writing import check_file, place_of, write_bytes

    ending = suffix(format)
    path = None if out is None else place_of(out, table.stem, ending)
    if path is not None:
        check_file(path)
    elif not json and format == "mat" and sys.stdout.isatty():
        raise InputError(
            "a MATLAB file is binary and must go to a file; got a terminal. Give --out FILE, or redirect the output."
        )
    loaded = read_table(table)
    digital = format in DIGITAL
    given = {"sample-time-ms": sample_time_ms is not None, "computing-delay-ms": computing_delay_ms, "accept": accept}
    unused = next((name for name, there in given.items() if there), None)
    if unused is not None and not digital:
        raise InputError(f"--{unused} is for the formats mat and c; got {format!r}. Leave it out.")
    if prefix is not None and format != "c":
        raise InputError(f"--prefix is for the format c; got {format!r}. Leave it out.")
    sample_time = None if sample_time_ms is None else 1e-3 * sample_time_ms
    prefix, delay = "wb" if prefix is None else check_prefix(prefix), 1e-3 * computing_delay_ms
    check = None
    if digital:
        check = check_of(loaded, sample_time=sample_time, computing_delay=delay, accept=accept)
    if check is not None and not json:
        rows = [
            (f"{p.name} {p.sense} {p.limit:g}", f"{p.value:.6g}", "kept" if p.kept else "not kept")
            for p in check.promises
        ]
        emit_table("Promises in the sampled loop", ("promise", "sampled", ""), rows, stderr=True)
    content = render(
        loaded, format, sample_time=sample_time, computing_delay=delay, accept=accept, prefix=prefix, check=check
    )
    if path is not None:
        write_bytes(path, content)
    if json:
        document = {"format": format, "problem": loaded.problem, "digest": loaded.digest, "bytes": len(content)}
        document |= {"check": None if check is None else check.to_dict()} if digital else {}
        if path is not None:
            emit_json(document | {"path": str(path)})
        elif format == "mat":
            emit_json(document | {"content_base64": b64encode(content).decode("ascii")})
        else:
            emit_json(document | {"content": content.decode("utf-8")})
    elif path is None and sys.stdout.isatty():
        say(content.decode("utf-8").removesuffix("\n"))
    elif path is None:
        sys.stdout.flush()
        sys.stdout.buffer.write(content)
