"""`workbench compare`: designs side by side."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.problems import Json

Names = Annotated[
    list[str], typer.Argument(metavar="PROBLEM...", help="Shipped problems or folders, with approved gains.")
]


def compare(
    problems: Names,
    gains: Annotated[
        list[Path] | None,
        typer.Option(help="Gain table or mapping of names to numbers, several times: designs of one problem."),
    ] = None,
    json: Json = False,
) -> None:
    """Figures of several problems under their approved gains, or of one problem under each of several gains.

    Of vehicles cost, margins, strokes, currents and power; of other plants verdicts, margins and parameters.
    """
    from workbench.commands.output import emit_json, emit_table
    from workbench.design.comparison import compare as side_by_side
    from workbench.errors import InputError
    from workbench.files.gains import read_gains
    from workbench.files.own_plant import read_values
    from workbench.files.problem import load_problem

    if gains and len(problems) != 1:
        raise InputError(f"--gains are designs of one problem; got {len(problems)} problems. Name the one they are of.")
    loaded = [load_problem(name) for name in problems]
    if gains:
        (one,) = loaded
        read = [read_gains(path) if one.flies else read_values(path, one.structure) for path in gains]
        stems = [path.stem for path in gains]
        names = [str(path) if stems.count(path.stem) > 1 else path.stem for path in gains]
        result = side_by_side([(one, values) for values in read], names)
    else:
        result = side_by_side([(problem, None) for problem in loaded])
    if json:
        emit_json(result.to_dict())
        return
    emit_table("Side by side", result.columns(), result.table())
