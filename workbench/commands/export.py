"""`workbench export`: the gains of a table in another format."""

from pathlib import Path
from typing import Annotated

import typer

Table = Annotated[Path, typer.Argument(metavar="TABLE", help="Gain table that 'workbench design' wrote.")]


def export(
    table: Table,
    format: Annotated[str, typer.Option("--format", help="csv, json, mat or c.")],
    out: Annotated[
        Path | None, typer.Option(help="File, or folder for a file named after the table; standard output if left out.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Writes the gains of a table as CSV, JSON, a MATLAB file or a C header with the discrete filters."""
    import sys
    from base64 import b64encode

    from workbench.commands.output import emit_json
    from workbench.errors import InputError
    from workbench.export.formats import render, suffix, write_bytes
    from workbench.export.table import read_table

    ending = suffix(format)
    loaded = read_table(table)
    content = render(loaded, format)
    if out is not None:
        path = out / f"{table.stem}{ending}" if out.is_dir() else out
        write_bytes(path, content)
    elif not json and format == "mat" and sys.stdout.isatty():
        raise InputError(
            "a MATLAB file is binary and must go to a file; got a terminal. Give --out FILE, or redirect the output."
        )
    if json:
        document = {"format": format, "problem": loaded.problem, "digest": loaded.digest, "bytes": len(content)}
        if out is not None:
            emit_json(document | {"path": str(path)})
        elif format == "mat":
            emit_json(document | {"content_base64": b64encode(content).decode("ascii")})
        else:
            emit_json(document | {"content": content.decode("utf-8")})
    elif out is None:
        sys.stdout.flush()
        sys.stdout.buffer.write(content)
