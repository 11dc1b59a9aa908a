"""`workbench verify`: a gain table's promises, proved again from the file alone."""

from pathlib import Path
from typing import Annotated, Any

import typer

from workbench.commands.analyse import Speed
from workbench.commands.problems import Json

Table = Annotated[Path, typer.Argument(metavar="TABLE", help="Gain table that 'workbench design' wrote.")]


def verify(
    table: Table,
    problem: Annotated[
        str | None,
        typer.Option(metavar="PROBLEM", help="Also rebuild this problem's plant and compare it with the table's."),
    ] = None,
    speed: Speed = None,
    json: Json = False,
) -> None:
    """Checks a gain table's digest and proves its promises again, in exact or ball arithmetic, from the file alone."""
    from workbench.commands.output import emit_json, emit_rows, emit_table
    from workbench.errors import InfeasibleError, InputError
    from workbench.verify.check import verify as check
    from workbench.verify.failure import TableError

    if speed is not None and problem is None:
        raise InputError("--speed must come with --problem, whose operating point it moves; got no problem. Name one.")
    try:
        report = check(table)
    except TableError as error:
        raise InputError(str(error)) from error
    found = None if problem is None else _against(table, problem, speed)
    faults = [*report.faults, *(found.disagreements if found else ())]
    if json:
        emit_json(
            {
                "table": str(table), "digest": report.digest, "digest_ok": report.digest_ok,
                "plant_follows": report.plant_follows, "coupling": report.coupling,
                "promises": [_entry(f) for f in report.findings],
                "undecided": [
                    {"name": u.name, "sense": u.sense, "limit": float(u.limit), "share": float(u.share),
                     "reason": u.reason} for u in report.undecided
                ],
                "problem": None if found is None else {**found.to_dict(), "holds": found.holds},
                "faults": faults, "proved": not faults,
            }
        )  # fmt: skip
    else:
        boxes = any(f.box for f in report.findings)
        emit_table(
            f"{report.problem}: promises",
            ("promise", *(["for"] if boxes else []), "promised", "proved again", "seconds", "verdict"),
            [
                (f.name, *([_box(f.box)] if boxes else []), f"{f.sense} {f.limit:g}", _interval(f.proved),
                 f"{f.seconds:.2f}", f.verdict)
                for f in report.findings
            ],
        )  # fmt: skip
        if report.undecided:
            emit_table(
                "Not promised over a box, as the table says itself", ("limit", "open share", "because"),
                [(f"{u.name} {u.sense} {float(u.limit):g}", f"{float(u.share):.0%}", u.reason)
                 for u in report.undecided],
            )  # fmt: skip
        follows = {True: "yes", False: "NO", None: "no vehicle beside it; taken as printed"}[report.plant_follows]
        emit_rows(
            "Table",
            [
                ("digest holds", report.digest_ok, ""),
                ("plant follows from the vehicle", follows, ""),
                ("coupling left out between the groups", report.coupling, "of the largest entry"),
                ("everything proved", not faults, ""),
            ],
        )
        if found is not None:
            emit_rows("Against the problem", found.rows())
        if faults:
            emit_table("What does not hold", ("",), [(fault,) for fault in faults])
    if faults:
        more = f" ({len(faults) - 1} more)" if len(faults) > 1 else ""
        raise InfeasibleError(f"{table} does not hold: {faults[0]}{more}.")


def _against(table: Path, problem: str, speed: float | None):
    """The table held against the problem rebuilt from its data."""
    from workbench.export.certificate import agreement
    from workbench.export.problem import load_problem
    from workbench.verify.reading import read_document

    return agreement(read_document(table), load_problem(problem, speed=speed))


def _entry(finding) -> dict[str, Any]:
    """One promise as other programs read it."""
    return {
        "name": finding.name, "sense": finding.sense, "limit": finding.limit, "claimed": list(finding.claimed),
        "proved": None if finding.proved is None else list(finding.proved), "method": finding.method,
        "box": {name: list(interval) for name, interval in finding.box.items()},
        "holds": finding.holds, "verdict": finding.verdict, "reason": finding.reason, "seconds": finding.seconds,
    }  # fmt: skip


def _box(box) -> str:
    """Which plants a promise speaks of."""
    if not box:
        return "the plant"
    if set(box) == {"speed"}:
        return "{:g} … {:g} m/s".format(*box["speed"])
    return f"a box of {len(box)} factors"


def _interval(ends: tuple[float, float] | None) -> str:
    """The digits that both ends share, and no more; the interval where they share too few."""
    if ends is None:
        return "–"
    low, high = ends
    for digits in (6, 5, 4):
        if f"{low:.{digits}g}" == f"{high:.{digits}g}":
            return f"{low:.{digits}g}"
    return f"{low:.6g} … {high:.6g}"
