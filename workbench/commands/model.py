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
    """Matrices, characteristic polynomials and transfer functions, beside the report's where it prints them.

    Of a plant of one's own the matrices, dead times and poles of its models, and those of the controller.
    """
    from workbench.errors import InputError
    from workbench.files.gains import read_gains
    from workbench.files.problem import load_problem
    from workbench.ledger.model import model_sheet
    from workbench.result import figure

    if latex and json:
        raise InputError("--latex and --json must not be given together; choose one.")
    loaded = load_problem(problem)
    if not loaded.flies:
        if latex:
            raise InputError(
                f"--latex writes a vehicle's formulas; {problem!r} controls a plant of its own. Leave it out."
            )
        _plant(loaded, gains, json)
        return
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


def _plant(loaded, gains: Path | None, json: bool) -> None:
    """The models of a plant of one's own, and its controller at given values, or approved ones, or its own."""
    from workbench.files.own_plant import read_values
    from workbench.result import figure, plain

    approved = loaded.approved if isinstance(loaded.approved, dict) else {}
    structure = loaded.structure.with_values(
        approved if gains is None else {**approved, **read_values(gains, loaded.structure)}
    )
    systems = [(m.name, m.plant, m.sample_time, m.lines, m.poles()) for m in loaded.systems]
    K = structure.controller()
    if json:
        models = [
            {"name": name, "sample_time_s": h, "states": p.states, "inputs": p.inputs, "outputs": p.outputs,
             **{k: getattr(p, k) for k in "ABCD"}, "lines": lines, "poles": poles}
            for name, p, h, lines, poles in systems
        ]  # fmt: skip
        controller = {"inputs": structure.inputs, "outputs": structure.outputs, "values": structure.values()}
        controller |= {k: getattr(K, k) for k in "ABCD"}
        emit_json(plain({"problem": loaded.name, "models": models, "controller": controller}))
        return
    for name, p, h, lines, poles in systems:
        time = "continuous" if h is None else f"sampled every {h:g} s"
        for k, rows, columns in (
            ("A", p.states, p.states), ("B", p.states, p.inputs), ("C", p.outputs, p.states), ("D", p.outputs, p.inputs)
        ):  # fmt: skip
            cells = [(row, *map(figure, line.tolist())) for row, line in zip(rows, getattr(p, k), strict=True)]
            emit_table(f"{name}, {time}" if k == "A" else "", (k, *columns), cells)
        if lines:
            emit_table("Dead times", ("from", "to", "s"), [(x.source, x.sink, f"{x.dead_time:g}") for x in lines])
        emit_table("Poles", ("Re", "Im"), [(figure(float(s.real)), figure(float(s.imag))) for s in poles])
    for k in "ABCD":
        if getattr(K, k).size:
            names = structure.outputs if k in "CD" else [f"state {i + 1}" for i in range(K.order)]
            heads = structure.inputs if k in "BD" else [f"state {i + 1}" for i in range(K.order)]
            cells = [(name, *map(figure, line.tolist())) for name, line in zip(names, getattr(K, k), strict=True)]
            emit_table("Controller" if k == "A" else "", (k, *heads), cells)
