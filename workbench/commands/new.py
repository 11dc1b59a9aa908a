"""`workbench new`: a folder to begin with."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.problems import Json, problem_names


def new(
    folder: Annotated[Path, typer.Argument(help="The folder to make.")],
    like: Annotated[
        str, typer.Option(help="A shipped problem or a folder to take after.", autocompletion=problem_names)
    ] = "dc_motor",
    json: Json = False,
) -> None:
    """Makes a folder with a commented problem that can be designed at once, after one that ships."""
    from workbench.commands.output import emit_json, emit_rows, say
    from workbench.files.new import new as begin

    made = begin(folder, like)
    if json:
        emit_json(made)
        return
    emit_rows(made.title, made.rows())
    say(f"next  workbench design {made.folder}")
