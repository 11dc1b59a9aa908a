"""`workbench problems`: what ships."""

from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="Print one JSON document.")]


def problem_names(incomplete: str) -> list[str]:
    """Shipped problems that begin so, for the shell's completion."""
    from workbench.files.problem import shipped_problems

    return [name for kind in ("vehicle", "tuning") for name in shipped_problems(kind) if name.startswith(incomplete)]


def problems(json: Json = False) -> None:
    """Lists the problems that ship, one line each."""
    from workbench.commands.output import emit_json, emit_table
    from workbench.files.problem import parse_problem, shipped_problems
    from workbench.machine.reading import read_mapping

    heads = {n: parse_problem(read_mapping(f / "data.toml")).problem for n, f in shipped_problems().items()}
    found = [{"name": name, "title": head.title, "groups": head.groups} for name, head in heads.items()]
    for name, folder in shipped_problems("tuning").items():
        found.append({"name": name, "title": read_mapping(folder / "data.toml")["problem"]["title"], "groups": []})
    if json:
        emit_json(found)
    else:
        emit_table("Problems", ("name", "title"), [(entry["name"], entry["title"]) for entry in found])
