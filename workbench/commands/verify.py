"""`workbench verify`: a gain table's promises, proved again from the file alone."""

from dataclasses import asdict
from pathlib import Path
from time import monotonic
from typing import Annotated, Any

import typer

from workbench.commands.analyse import Speed
from workbench.commands.problems import Json

Table = Annotated[Path, typer.Argument(metavar="TABLE", help="Gain table that 'workbench design' wrote.")]
SHARE = 0.95  # of the budget, after which the checker's own loops end; its process is ended at the whole


def verify(
    table: Table,
    problem: Annotated[
        str | None,
        typer.Option(
            metavar="PROBLEM",
            help="Also rebuild this problem: its plant and data, what it requires to be promised, the figures stated.",
        ),
    ] = None,
    speed: Speed = None,
    budget_seconds: Annotated[
        float,
        typer.Option(help="Seconds after which, from its start, what is not decided is undecided and does not hold."),
    ] = 60.0,
    json: Json = False,
) -> None:
    """Checks a gain table's digest and proves its promises again, in exact or ball arithmetic, from the file alone."""
    from workbench.commands.guard import guarded
    from workbench.commands.output import emit_json
    from workbench.errors import InfeasibleError, InputError
    from workbench.machine.budget import checked_budget
    from workbench.machine.supervision import begun

    end = begun() + checked_budget(budget_seconds, "--budget-seconds")
    if speed is not None and problem is None:
        raise InputError("--speed must come with --problem, whose operating point it moves; got no problem. Name one.")
    said: dict[str, Any] = {"promises": []}

    def hear(message: dict[str, Any]) -> None:
        if "promise" in message:
            said["promises"].append(message["promise"])
        else:
            said.update(message)

    over = not guarded(lambda say: _check(say, table, problem, speed, SHARE * (end - monotonic())), end, hear)
    document = _document(table, said, over and budget_seconds)
    if json:
        emit_json(document)
    else:
        _print(document)
    faults = document["faults"]
    if faults:
        more = f" ({len(faults) - 1} more)" if len(faults) > 1 else ""
        raise InfeasibleError(f"{table} does not hold: {faults[0]}{more}.")


def _check(say, table: Path, problem: str | None, speed: float | None, seconds: float) -> None:
    """The whole check, telling what it finds as it goes."""
    from workbench.errors import InputError
    from workbench.verify.check import PLANTS, verify_document
    from workbench.verify.exact.failure import TableError
    from workbench.verify.reading import read_document

    try:
        document = read_document(table)
        given = document.get("promises")
        listed = [p for p in given if isinstance(p, dict)][:500] if isinstance(given, list) else []
        names = [str(p.get("name", p.get("kind")))[:200] for p in listed]
        say({"listed": names, "own": document["version"] == PLANTS, "title": str(document.get("problem"))[:200]})
        report = verify_document(
            document, lambda finding: say({"promise": {**asdict(finding), "verdict": finding.verdict}}),
            budget_seconds=max(seconds, 1e-3),
        )  # fmt: skip
    except TableError as error:
        raise InputError(str(error)) from error
    say(
        {
            "digest": report.digest, "digest_ok": report.digest_ok, "plant_follows": report.plant_follows,
            "coupling": report.coupling if report.coupling == report.coupling else None,
            "undecided": [
                {"name": u.name, "sense": u.sense, "limit": float(u.limit), "share": float(u.share),
                 "reason": u.reason} for u in report.undecided
            ],
            "not_promised": report.not_promised, "stated": report.stated, "faults": report.faults,
        }
    )  # fmt: skip
    if problem is not None:
        from workbench.files.problem import load_problem
        from workbench.handover.table.agreement import agreement

        found = agreement(document, load_problem(problem, speed=speed), schedule=speed is None)
        say({"problem": {**found.to_dict(), "holds": found.holds}, "rows": found.rows(),
             "disagreements": found.disagreements})  # fmt: skip


def _document(table: Path, said: dict[str, Any], over: float | bool) -> dict[str, Any]:
    """What `--json` prints, whole or as far as the check came."""
    faults = [*said.get("faults", ()), *said.get("disagreements", ())]
    promises = [_entry(p) for p in said["promises"]]
    if over:
        left = said.get("listed", [])[len(promises) :]
        reason = f"is undecided: the budget of {over:.4g} s ended first"
        words = f" ({len(left)} promises are undecided)" if left else ""
        faults.insert(0, f"the check is undecided: its budget of {over:.4g} s ended first{words}; "
                         "give more with --budget-seconds")  # fmt: skip
        promises += [
            {"name": name, "sense": "", "limit": None, "claimed": None, "proved": None, "method": "", "box": {},
             "holds": False, "verdict": "undecided", "reason": reason, "seconds": None} for name in left
        ]  # fmt: skip
    document = {
        "table": str(table), "title": said.get("title", ""), "digest": said.get("digest"),
        "digest_ok": said.get("digest_ok"), "plant_follows": said.get("plant_follows"),
        "coupling": said.get("coupling"), "promises": promises, "undecided": said.get("undecided", []),
        "not_promised": said.get("not_promised", []), "stated": said.get("stated", []),
        "problem": said.get("problem"), "rows": said.get("rows", []), "faults": faults, "proved": not faults,
    }  # fmt: skip
    vehicles = ("plant_follows", "coupling") if said.get("own") else ()  # what a plant of one's own has not
    return {key: value for key, value in document.items() if key not in vehicles}


def _print(document: dict[str, Any]) -> None:
    """The same for a person."""
    from workbench.commands.output import emit_rows, emit_table

    boxes = any(p["box"] for p in document["promises"])
    emit_table(
        f"{document['title']}: promises",
        ("promise", *(["for"] if boxes else []), "promised", "proved again", "seconds", "verdict"),
        [
            (p["name"], *([_box(p["box"])] if boxes else []),
             "" if p["limit"] is None else f"{p['sense']} {p['limit']:g}", _interval(p["proved"]),
             "–" if p["seconds"] is None else f"{p['seconds']:.2f}", p["verdict"])
            for p in document["promises"]
        ],
    )  # fmt: skip
    if document["undecided"]:
        emit_table(
            f"Not promised{' over a box' if boxes else ''}, as the table says itself",
            ("limit", "open share", "because"),
            [(f"{u['name']} {u['sense']} {u['limit']:g}", f"{u['share']:.0%}", u["reason"])
             for u in document["undecided"]],
        )  # fmt: skip
    if document["not_promised"]:
        emit_table("Without a promise of its own", ("",), [(words,) for words in document["not_promised"]])
    if document["stated"]:
        emit_table(
            "Stated by the author, proved by nobody" + (
                "" if document["problem"] is None else " (what the problem's analysis has of it was derived again)"
            ),
            ("",), [(", ".join(document["stated"]),)],
        )  # fmt: skip
    words = {True: "yes", False: "NO", None: "no vehicle beside it; taken as printed"}
    vehicle = [] if "coupling" not in document else [
        ("plant follows from the vehicle", words[document["plant_follows"]], ""),
        ("coupling left out between the groups", document["coupling"], "of the largest entry"),
    ]  # fmt: skip
    emit_rows(
        "Table", [("digest holds", document["digest_ok"], ""), *vehicle, ("everything proved", document["proved"], "")]
    )
    if document["problem"] is not None:
        emit_rows("Against the problem", document["rows"])
    if document["faults"]:
        emit_table("What does not hold", ("",), [(fault,) for fault in document["faults"]])


def _entry(finding: dict[str, Any]) -> dict[str, Any]:
    """One promise as other programs read it."""
    keys = ("name", "sense", "limit", "claimed", "proved", "method", "box", "holds", "verdict", "reason", "seconds")
    return {key: finding[key] for key in keys}


def _box(box) -> str:
    """Which plants a promise speaks of."""
    if not box:
        return "the plant"
    if set(box) == {"speed"}:
        return "{:g} … {:g} m/s".format(*box["speed"])
    return f"a box of {len(box)} factors"


def _interval(ends) -> str:
    """The digits that both ends share, and no more; the interval where they share too few."""
    if ends is None:
        return "–"
    low, high = ends
    for digits in (6, 5, 4):
        if f"{low:.{digits}g}" == f"{high:.{digits}g}":
            return f"{low:.{digits}g}"
    return f"{low:.6g} … {high:.6g}"
