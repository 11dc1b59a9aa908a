"""`workbench study`: many analyses or designs over sampled parameters."""

import os
from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.analyse import Budget
from workbench.commands.problems import Json

SHOWN = 3  # indices of each quantity on the screen


def study(
    file: Annotated[Path, typer.Argument(metavar="STUDY.toml", help="What to vary, how, and what to record.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the study; results/<name of the file> if left out.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(help="Processes of this machine; all its processors if left out.", min=1, max=1024)
    ] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a Dask scheduler to use instead.")] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Throw away what the folder holds and begin anew.")] = False,
    trust: Annotated[
        bool,
        typer.Option(
            "--trust", help="Run the problem.py of a folder that the study names; it may do whatever you may."
        ),
    ] = False,
    budget_seconds: Budget = None,
    json: Json = False,
) -> None:
    """Runs or resumes a parameter study: table, summary, report.

    A study may name any folder as its problem; if that holds a problem.py, a program, it is run with --trust only.
    """
    from workbench.machine.supervision import finishing, supervised

    deadline = supervised(budget_seconds, "the study, whose finished rows are kept")

    from workbench.commands.output import emit_json, emit_table, progress, say
    from workbench.errors import BudgetEnded, InputError
    from workbench.machine.interrupts import word
    from workbench.machine.terminal import printable
    from workbench.machine.writing import check_file
    from workbench.result import figure
    from workbench.study.file import read_study
    from workbench.study.report import write_study_report
    from workbench.study.run import run_study

    if workers is not None and scheduler is not None:
        raise InputError("--workers are of this machine, --scheduler has workers of its own; give one of them.")
    asked = read_study(file)
    folder = out or Path("results") / file.stem
    report = folder / "report.html"
    check_file(report)
    finished = [0]
    try:
        with progress(json) as show:
            step = show("rows", asked.rows_planned)

            def on_rows(done: int, total: int) -> None:
                for _ in range(done - finished[0]):
                    step("")
                finished[0] = done

            result = run_study(
                asked, folder, workers=workers or os.cpu_count() or 1, scheduler=scheduler, fresh=fresh, trust=trust,
                on_rows=on_rows, deadline=deadline,
            )  # fmt: skip
            write_study_report(result, report)
    except KeyboardInterrupt:
        typer.echo(printable(f"{word()} with {kept(finished[0], asked, file, folder)}"), err=True)
        raise typer.Exit(130) from None
    except BudgetEnded:
        words = kept(finished[0], asked, file, folder)
        raise BudgetEnded(f"the budget of {deadline.budget:.4g} s ended with {words}") from None
    finishing()
    if json:
        emit_json({**result.to_dict(), "report": str(report)})
        return
    f = result.failing
    interval = "" if f.low is None else f" ({100 * f.low:.3g} to {100 * (f.high or 0):.3g} %)"
    emit_table(
        f"{f.count} of {f.rows_in_all} rows fail: {100 * f.share:.3g} %{interval}",
        ("reason", "rows"), [(reason, str(count)) for reason, count in f.by.items() if count],
    )  # fmt: skip
    emit_table(
        "Quantities", ("quantity", "rows", "5 %", "median", "95 %"),
        [(s.quantity, str(s.count), *(figure(q) for q in (s.quantiles[1:6:2] or (None,) * 3))) for s in result.spreads],
    )  # fmt: skip
    strongest = _strongest(result.indices)
    if strongest:
        emit_table(
            f"{strongest[0].kind.capitalize()}, the strongest of each quantity (all of them are in summary.json)",
            ("quantity", "parameter", "value", "from", "to"),
            [(i.quantity, i.parameter, *map(figure, (i.value, i.low, i.high))) for i in strongest],
        )  # fmt: skip
    say(f"table   {result.table}\nreport  {report}")


def kept(finished: int, asked, file: Path, folder: Path) -> str:
    """What a run that did not end leaves, and how to go on."""
    return (
        f"{finished} of {asked.rows_planned} rows finished and kept; "
        f"the same command goes on from there: workbench study {file} --out {folder}"
    )


def _strongest(indices) -> list:
    """The few largest indices of each quantity, of the kind that says most."""
    out = []
    for quantity in dict.fromkeys(i.quantity for i in indices):
        own = [i for i in indices if i.quantity == quantity and i.kind in ("total order", "rank correlation")]
        out += sorted(own, key=lambda i: -abs(i.value))[:SHOWN]
    return out
