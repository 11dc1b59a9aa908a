"""`workbench reproduce`: every printed number of the report beside ours, with a verdict that is checked."""

from typing import Annotated

import typer

from workbench.commands.output import emit_json, emit_table


def reproduce(
    appendix: Annotated[str, typer.Option("--appendix", help="One appendix (a, b, …); all unless given.")] = "",
    json: Annotated[bool, typer.Option("--json", help="Print one JSON document.")] = False,
) -> int:
    """Every printed number of the report beside ours; leaves with 1 if a verdict does not hold."""
    from workbench.ledger.book import ledger
    from workbench.result import figure

    found = ledger(appendix or None)
    if json:
        emit_json([entry.as_dict() for entry in found.entries])
        return 1 if found.failing else 0
    emit_table(
        f"{found.count('number')} printed numbers, {len(found.entries)} rows",
        ("place", "quantity", "printed", "ours", "difference", "verdict"),
        [
            (
                e.row.place,
                e.row.quantity,
                _digits(e.row.printed) + ("" if e.row.unit in ("1", "") else f" {e.row.unit}"),
                _digits(e.ours),
                "–" if e.difference is None else figure(e.difference),
                e.row.verdict + ("" if e.holds else f" — DOES NOT HOLD: {e.why}"),
            )
            for e in found.entries
        ],
    )
    emit_table("counts", ("what", "rows"), [(name, str(count)) for name, count, _ in found.rows()])
    return 1 if found.failing else 0


def _digits(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.6g}"
