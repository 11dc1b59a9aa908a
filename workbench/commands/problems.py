"""`workbench problems`: what ships."""

from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document.")]


def problem_names(incomplete: str) -> list[str]:
    """Shipped problems that begin so, for the shell's completion."""
    from workbench.files.problem import shipped_problems

    return [name for name in shipped_problems() if name.startswith(incomplete)]


def problems(json: Json = False) -> None:
    """Lists the problems that ship, one line each."""
    from workbench.commands.output import emit_json, emit_table
    from workbench.files.problem import shipped_problems
    from workbench.machine.reading import read_mapping

    heads = {name: read_mapping(path / "data.toml")["problem"] for name, path in shipped_problems().items()}
    found = [{"name": n, "title": head["title"], "groups": head.get("groups", [])} for n, head in heads.items()]
    if json:
        emit_json(found)
    else:
        emit_table("Problems", ("name", "title"), [(entry["name"], entry["title"]) for entry in found])
