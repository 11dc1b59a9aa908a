"""`workbench problems`: what ships."""

from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document.")]


def problems(json: Json = False) -> None:
    """Lists the problems that ship, one line each."""
    from workbench.commands.output import emit_json, emit_table
    from workbench.export.problem import parse_problem, shipped_problems
    from workbench.export.reading import read_mapping

    files = {name: parse_problem(read_mapping(folder / "data.toml")) for name, folder in shipped_problems().items()}
    if json:
        emit_json([{"name": name, "title": f.problem.title, "groups": f.problem.groups} for name, f in files.items()])
    else:
        emit_table("Problems", ("name", "title"), [(name, f.problem.title) for name, f in files.items()])
