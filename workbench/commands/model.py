"""`workbench model`: the model written out, beside the report's formulas and their errata."""

from pathlib import Path
from typing import Annotated

import typer

from workbench.commands.analyse import Name
from workbench.commands.output import emit_json, emit_rows, emit_table, say


def model(
    problem: Name,
    gains: Annotated[
        Path | None,
        typer.Option(help="Gain table, or TOML/JSON mapping of the seventeen names; the approved gains if left out."),
    ] = None,
    latex: Annotated[bool, typer.Option("--latex", help="Print LaTeX instead of tables.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> None:
    """Matrices, characteristic polynomials and transfer functions, beside the report's where it prints them."""
    from workbench.errors import InputError
    from workbench.files.problem import load_problem, read_gains
    from workbench.ledger.model import model_sheet
    from workbench.result import figure

    if latex and json:
        raise InputError("--latex and --json must not be given together; choose one.")
    loaded = load_problem(problem)
    chosen = read_gains(gains) if gains else loaded.gains
    sheet = model_sheet(loaded.vehicle, loaded.law, chosen, loaded.name, loaded.setting.plant)
    if json:
        emit_json(sheet.to_dict())
        return
    if latex:
        say(sheet.latex())
        return
    emit_rows(f"{loaded.title}{'' if chosen else ' (without control: no gains approved or given)'}", sheet.rows())
    for m in sheet.matrices:
        columns = (
            f"{m.name}, {m.group}",
            *(m.rows if m.entries.shape[1] == len(m.rows) else [f"set {i + 1}" for i in range(m.entries.shape[1])]),
        )
        emit_table(
            "", columns, [(name, *(figure(float(v)) for v in row)) for name, row in zip(m.rows, m.entries, strict=True)]
        )
    for p in sheet.polynomials:
        emit_table(
            f"Characteristic polynomial, {p.part}", ("power of s", "coefficient"),
            [(str(k), f"{c:.6g}") for k, c in reversed(list(enumerate(p.coefficients)))],
        )  # fmt: skip
    for t in sheet.transfers:
        terms = [
            (str(k), *(f"{side[k]:.6g}" if k < len(side) else "" for side in (t.numerator, t.denominator)))
            for k in range(len(t.denominator))
        ]
        emit_table(f"{t.output}/{t.input}, {t.part} alone", ("power of s", "numerator", "denominator"), reversed(terms))
    rows = []
    for c in sheet.comparisons:
        slip = f"{c.entry.kind}: {c.entry.erratum}" if c.entry.erratum else ""
        rows.append((f"{c.entry.table} {c.entry.symbol}", c.entry.formula, figure(c.corrected), figure(c.ours), slip))
    emit_table("Formulas of the report", ("place, symbol", "formula, mended", "value", "ours", "erratum"), rows)
    emit_table(
        "Other errata",
        ("place", "as found", "correct", "kind"),
        [(e.place, e.as_found, e.correct, e.kind) for e in sheet.errata],
    )
