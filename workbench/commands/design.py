"""`workbench design`: gains that meet a problem's requirements, verified, with table and report."""

import os
from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.analyse import Name, Speed
from workbench.commands.problems import Json

TRADE_OFF = (1.4, 1.2, 1.0, 0.95, 0.9)  # multiples of the wanted peak sensitivity


def design(
    problem: Name,
    out: Annotated[Path, typer.Option(help="Folder for gain table and report.")] = Path("results"),
    starts: Annotated[int, typer.Option(help="Seeded starts of the optimiser.")] = 16,
    seed: Annotated[int, typer.Option(help="Seed of the random starts.", min=0)] = 0,
    fix: Annotated[str, typer.Option(help="Parameters held at given values: tau_h=0.637,K_zddot=0")] = "",
    solver: Annotated[str, typer.Option(help="slsqp or ipopt.")] = "slsqp",
    trade_off: Annotated[
        bool, typer.Option(help="Sweep the cost against the allowed peak sensitivity for the report.")
    ] = True,
    speed: Speed = None,
    json: Json = False,
) -> None:
    """Optimises, verifies, writes the gain table and the report."""
    from workbench.commands.output import emit_json, emit_rows, emit_table, progress
    from workbench.design.design import design as solve
    from workbench.design.robustness import robustness
    from workbench.export.problem import load_problem
    from workbench.export.reading import check_writable, write_text
    from workbench.export.report import report_html
    from workbench.export.table import signed, table_from_design, table_json
    from workbench.result import figure
    from workbench.vehicle import varied

    loaded = load_problem(problem, speed=speed).with_fixed(parse_fixed(fix))
    check_writable(out)
    with progress(json) as show:
        start = show("starts", starts)
        result = solve(
            loaded,
            starts=starts,
            seed=seed,
            solver=solver,
            workers=os.cpu_count() or 1,
            on_start=lambda s: start(f"cost {s.cost:.4g}"),
        )
        cases = robustness(loaded, result.gains, varied)
        curve = _curve(loaded, result.gains, show) if trade_off else None
    kept = {c.name: c.to_dict() for c in cases}
    table = signed(table_from_design(result, robustness=kept))
    page = report_html(result, trade_off=curve, robustness=kept, table=table)
    path, report = out / "gains.json", out / "report.html"
    write_text(report, page)  # both are complete before either is written
    write_text(path, table_json(table))
    if json:
        emit_json(
            {**result.to_dict(), "robustness": [c.to_dict() for c in cases], "table": str(path), "report": str(report)}
        )
        return
    emit_rows(loaded.title, result.gains.rows())
    emit_table(
        f"Requirements: cost J = {result.analysis.cost:.4g}", ("requirement", "limit", "value", "met", "where"),
        [
            (v.name, f"{v.sense} {v.limit:g} {v.unit}", figure(v.value), figure(v.met), v.where)
            for v in result.requirements
        ],
    )  # fmt: skip
    emit_table(
        "Robustness", ("case", "stable", "damping", *(f"peak sensitivity, {g}" for g in cases[0].peak_sensitivity)),
        [(c.name, figure(c.stable), figure(c.damping), *map(figure, c.peak_sensitivity.values())) for c in cases],
    )  # fmt: skip
    typer.echo(f"gain table  {path}\nreport      {report}")


def _curve(problem, gains, show):
    """Cost against allowed peak sensitivity, where one is asked for."""
    from workbench.design.tradeoff import trade_off

    wanted = {r.name: r.limit for r in problem.requirements}.get("peak sensitivity")
    if wanted is None:
        return None
    step = show("trade-off", len(TRADE_OFF))
    return trade_off(
        problem,
        "peak sensitivity",
        [wanted * f for f in TRADE_OFF],
        start=gains,
        on_limit=lambda limit, cost: step(f"at {limit:.3g}"),
    )


def parse_fixed(text: str) -> dict[str, float]:
    """'tau_h=0.637,K_zddot=0' as a mapping of checked values."""
    from workbench.control.gains import TIME_CONSTANTS, checked_gain
    from workbench.errors import InputError

    out: dict[str, float] = {}
    for part in filter(None, (p.strip() for p in text.split(","))):
        name, _, value = (side.strip() for side in part.partition("="))
        try:
            number = float(value)
        except ValueError as error:
            pairs = "name=number pairs such as tau_h=0.637,K_zddot=0"
            raise InputError(f"--fix takes {pairs}; got {part[:60]!r}.") from error
        if name in out:
            raise InputError(f"--fix must name a parameter once; got {name} twice. Drop one of them.")
        out[name] = checked_gain(name, number)
        if name in TIME_CONSTANTS and out[name] == 0:
            raise InputError(
                f"{name} must be positive in a design; got 0. To do without the filter, fix its rate gain at 0."
            )
    return out
