"""`workbench compare`: designs side by side."""

from typing import Annotated

import typer

from workbench.commands.problems import Json

Names = Annotated[
    list[str], typer.Argument(metavar="PROBLEM...", help="Shipped problems or folders, with approved gains.")
]


def compare(problems: Names, json: Json = False) -> None:
    """Cost, margins, strokes, currents and power of several problems under their approved gains."""
    from workbench.commands.output import emit_json, emit_table
    from workbench.design.comparison import compare as side_by_side
    from workbench.files.problem import load_problem

    result = side_by_side([(load_problem(name), None) for name in problems])
    if json:
        emit_json(result.to_dict())
        return
    emit_table("Side by side", result.columns(), result.table())
