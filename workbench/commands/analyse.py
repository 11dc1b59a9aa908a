"""`workbench analyse`: what given gains do."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.problems import Json, problem_names

Name = Annotated[
    str,
    typer.Argument(
        metavar="PROBLEM", help="A shipped problem, or a folder with data.toml.", autocompletion=problem_names
    ),
]


Speed = Annotated[
    float | None,
    typer.Option(
        help="Speed of the operating point [m/s]; the data's if left out. Needs a force law from coils. Gains that are "
        "scheduled over speed are taken there."
    ),
]

Budget = Annotated[
    float | None,
    typer.Option(
        help="Seconds of the clock that the command may take, from its start; exit code 1 where they do not suffice."
    ),
]


def analyse(
    problem: Name,
    gains: Annotated[
        Path | None,
        typer.Option(help="Gain table, or TOML/JSON mapping of names to numbers; the approved gains if left out."),
    ] = None,
    speed: Speed = None,
    report: Annotated[Path | None, typer.Option(help="File for a report in HTML.")] = None,
    budget_seconds: Budget = None,
    json: Json = False,
) -> None:
    """Poles, damping, margins, ride, stroke, current and power for given gains; of any plant its verdicts and margins.

    For a plant of one's own, values left out of --gains are the approved ones, or else those that the data start from.
    """
    from workbench.machine.supervision import finishing, supervised

    supervised(budget_seconds, "the analysis")

    from workbench.analysis.first_tables import first_rows, first_tables
    from workbench.analysis.full import full_analysis
    from workbench.commands.output import emit_first, emit_json, emit_rows, emit_table, say
    from workbench.design.verdict import nominal_limits
    from workbench.errors import InputError
    from workbench.files.gains import read_gains
    from workbench.files.problem import load_problem
    from workbench.machine.writing import check_file, write_text
    from workbench.result import figure

    if report is not None:
        check_file(report)
    loaded = load_problem(problem, speed=speed)
    if not loaded.flies:
        _plant(loaded, gains, report, json)
        return
    chosen = read_gains(gains, speed=loaded.setting.speed) if gains else loaded.approved
    if chosen is None:
        raise InputError(
            f"problem {problem!r} has no approved gains; give some with --gains FILE, "
            f"or run 'workbench design {problem}'."
        )
    result = full_analysis(loaded.setting, chosen, loaded.name, sampled=loaded.own_sampling)
    kept, written = result.reserves, {} if report is None else {"report": str(report)}
    if report is not None:
        from workbench.design.design import given
        from workbench.handover.report.report import report_html

        page = report_html(given(loaded, chosen, analysis=result.analysis), reserves=kept)
    document = result.to_dict() | kept.to_dict() | written if json else {}
    modes = [(m.name, figure(m.frequency_hz), figure(m.damping)) for m in result.analysis.modes]
    first = first_tables(kept, result.analysis.nonlinear, nominal_limits(loaded))
    tables = [] if json else [("Modes", ("mode", "frequency [Hz]", "damping"), modes), *result.tables()]
    finishing()
    if report is not None:
        write_text(report, page)
    if json:
        emit_json(document)
        return
    emit_rows(loaded.title, first_rows(kept, result.analysis.nonlinear))
    emit_first(first)
    emit_rows("The loop and its ride", result.analysis.rows())
    for title, columns, rows in tables:
        emit_table(title, columns, rows)
    if report is not None:
        say(f"report  {report}")


def _plant(loaded, gains: Path | None, report: Path | None, json: bool) -> None:
    """The same of a plant of one's own."""
    from workbench.analysis.first_tables import first_rows, first_tables
    from workbench.commands.output import emit_first, emit_json, emit_rows, emit_table, say
    from workbench.design.plant_analysis import plant_analysis
    from workbench.files.own_plant import read_values
    from workbench.handover.report.plant import plant_report
    from workbench.machine.supervision import finishing
    from workbench.machine.writing import write_text

    result = plant_analysis(loaded, None if gains is None else read_values(gains, loaded.structure))
    kept = result.reserves
    page = None if report is None else plant_report(result)
    first = () if kept is None else first_tables(kept)
    finishing()
    if report is not None and page is not None:
        write_text(report, page)
    if json:
        emit_json(result.to_dict() | ({} if report is None else {"report": str(report)}))
        return
    emit_rows(loaded.title or loaded.name, result.rows() if kept is None else first_rows(kept))
    emit_first(first)
    if kept is not None:
        emit_rows("The loop and its goals", result.rows())
    for title, columns, rows in result.tables():
        emit_table(title, columns, rows)
    if report is not None:
        say(f"report  {report}")
