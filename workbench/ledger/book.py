"""The ledger: every printed number with our own, and whether its verdict holds.

    appendix_<x>.toml (printed, tolerance, verdict) + appendix_<x>.computed() (ours) --check--> Ledger

A verdict is a claim that numbers decide:
    reproduced, consistent by fit                |ours − printed| ≤ tolerance
    misprint, scan, report's own inconsistency   |ours − corrected| ≤ tolerance < |printed − corrected|, where the right
                                                 value is known; else |ours − printed| > tolerance
    not reproducible                             |ours − printed| > tolerance
A printed range or statement is decided by bounds that the row states: the first line asks our number to lie within
them, the others outside. The print itself was never seen, only a scan: "scan" is said where the text around shows that
the reader of the scan went wrong, "misprint" where the text as scanned cannot be right whoever wrote it.

Rows count by what the report really prints: numbers, values of printed formulas, statements in words, and numbers that
we derived from printed ones.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from importlib import import_module
from importlib.resources import files

import numpy as np

from workbench.errors import InputError, unknown_name
from workbench.result import Result, Row

AGREEING = ("reproduced", "consistent by fit")
WRONG = ("misprint", "scan", "report's own inconsistency")
VERDICTS = (*AGREEING, *WRONG, "not reproducible")
KINDS = {
    "number": "numbers that the report prints",
    "formula": "values of formulas that the report prints",
    "words": "statements in words, each with its bounds",
    "derived": "numbers derived from printed ones",
}
EDGE = 1e-12  # relative: half a unit of a decimal digit is not a binary number


@dataclass(frozen=True, slots=True, kw_only=True)
class Printed:
    """One row of the report as data.

    printed : number, or words where the report prints a range or a statement;  kind : one of `KINDS`
    tolerance : absolute, with a number only;  at_least, at_most : what a range or a statement asks of our number
    corrected : the right value where the printed one is wrong and the right one known
    """

    id: str
    place: str
    quantity: str
    printed: float | str
    unit: str
    verdict: str
    kind: str = "number"
    note: str = ""
    tolerance: float | None = None
    corrected: float | None = None
    at_least: float | None = None
    at_most: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise unknown_name("kind of row", self.kind, KINDS)
        if self.verdict not in VERDICTS:
            raise unknown_name("verdict", self.verdict, VERDICTS)
        if isinstance(self.printed, str) != (self.tolerance is None):
            raise InputError(
                f"row {self.id} must have a tolerance exactly if it prints a number; "
                f"got {self.printed!r} with {self.tolerance!r}. Add or drop the tolerance."
            )
        bounds = [b for b in (self.at_least, self.at_most) if b is not None]
        if isinstance(self.printed, str) != bool(bounds) or bounds != sorted(bounds):
            raise InputError(
                f"row {self.id} must have bounds, in order, exactly if it prints words; got {self.printed!r} with "
                f"at_least {self.at_least!r}, at_most {self.at_most!r}. State what our number must be, or drop the row."
            )
        if self.kind == "words" and not isinstance(self.printed, str):
            raise InputError(f"row {self.id} must print words to be of the kind 'words'; got {self.printed!r}.")
        if self.tolerance is not None and not self.tolerance >= 0:
            raise InputError(f"the tolerance of row {self.id} must not be negative; got {self.tolerance!r}.")
        if self.corrected is not None and self.verdict not in WRONG:
            raise InputError(
                f"row {self.id} must not be corrected under the verdict {self.verdict!r}; "
                f"choose one of {', '.join(WRONG)}."
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A row with our number and what became of its verdict; `why` is a sentence where it does not hold."""

    row: Printed
    ours: float
    holds: bool
    why: str

    @property
    def difference(self) -> float | None:
        """Ours − printed, where a number is printed."""
        return None if isinstance(self.row.printed, str) else self.ours - self.row.printed

    def as_dict(self) -> dict:
        """One flat record, as `workbench reproduce --json` prints it."""
        own = {f.name: getattr(self.row, f.name) for f in fields(self.row)}
        return own | {"ours": self.ours, "difference": self.difference, "holds": self.holds}


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Ledger(Result):
    """All rows, in the order of the appendices."""

    entries: tuple[Entry, ...]

    @property
    def failing(self) -> tuple[Entry, ...]:
        """Rows whose verdict does not hold."""
        return tuple(entry for entry in self.entries if not entry.holds)

    def rows(self) -> list[Row]:
        kinds = [(words, self.count(kind), "rows") for kind, words in KINDS.items()]
        verdicts = [(verdict, self.count(verdict=verdict), "rows") for verdict in VERDICTS]
        return [*kinds, ("verdicts that do not hold", len(self.failing), "rows"), *verdicts]

    def count(self, kind: str | None = None, verdict: str | None = None) -> int:
        """Number of rows of a kind, with a verdict; of all where it is left out."""
        return sum(kind in (None, e.row.kind) and verdict in (None, e.row.verdict) for e in self.entries)


def appendices() -> tuple[str, ...]:
    """Names of the appendices that have a ledger: a, b, …"""
    here = files("workbench.ledger").iterdir()
    names = (path.name for path in here if path.name.startswith("appendix_") and path.name.endswith(".toml"))
    return tuple(sorted(name.removeprefix("appendix_").removesuffix(".toml") for name in names))


def printed_rows(appendix: str) -> tuple[Printed, ...]:
    """The rows of one appendix as data, without computing anything."""
    known = appendices()
    if appendix not in known:
        raise unknown_name("appendix", appendix, known)
    text = (files("workbench.ledger") / f"appendix_{appendix}.toml").read_text(encoding="utf-8")
    out = tuple(Printed(**item) for item in tomllib.loads(text)["row"])
    seen: set[str] = set()
    for row in out:
        if row.id in seen:
            raise InputError(f"row ids must be unique; {row.id!r} stands twice in appendix {appendix}. Rename one.")
        seen.add(row.id)
    return out


def ledger(appendix: str | None = None) -> Ledger:
    """The ledger of one appendix, or of all.

    Raises
    ------
    InputError
        For an unknown appendix, and where rows and computed numbers do not pair up.
    """
    chosen = appendices() if appendix is None else (appendix,)
    out: list[Entry] = []
    for name in chosen:
        rows = printed_rows(name)
        ours = import_module(f"workbench.ledger.appendix_{name}").computed()
        out += [_entry(row, ours) for row in rows]
        spare = sorted(set(ours) - {row.id for row in rows})
        if spare:
            raise InputError(
                f"appendix {name} computes {', '.join(spare)} without a row; add the rows or drop the numbers."
            )
    return Ledger(entries=tuple(out))


def check(row: Printed, ours: float) -> str:
    """Why the row's verdict does not hold for our number; empty if it does."""
    if not np.isfinite(ours):
        return f"our number is {ours}"
    if isinstance(row.printed, str):
        return _bounds_decide(row, ours)
    tolerance = float(row.tolerance or 0.0)
    margin = tolerance + EDGE * max(abs(row.printed), tolerance)
    off = abs(ours - row.printed)
    if row.verdict in AGREEING:
        return (
            ""
            if off <= margin
            else f"ours {ours:.6g} is {off:.3g} from the printed {row.printed:.6g}, more than {tolerance:.3g}"
        )
    if row.corrected is None:
        return (
            "" if off > margin else f"ours {ours:.6g} agrees with the printed {row.printed:.6g} within {tolerance:.3g}"
        )
    if abs(ours - row.corrected) > tolerance + EDGE * max(abs(row.corrected), tolerance):
        return f"ours {ours:.6g} is not the corrected {row.corrected:.6g} within {tolerance:.3g}"
    return (
        ""
        if abs(row.printed - row.corrected) > margin
        else f"printed {row.printed:.6g} and corrected {row.corrected:.6g} agree within {tolerance:.3g}"
    )


def _bounds_decide(row: Printed, ours: float) -> str:
    """As `check`, of a range or a statement."""
    low = -np.inf if row.at_least is None else row.at_least
    high = np.inf if row.at_most is None else row.at_most
    within = low <= ours <= high
    if within == (row.verdict in AGREEING):
        return ""
    return (
        f"ours {ours:.6g} is {'within' if within else 'outside'} {low:.6g} to {high:.6g} of {str(row.printed)[:60]!r}"
    )


def _entry(row: Printed, ours: Mapping[str, float]) -> Entry:
    if row.id not in ours:
        raise InputError(f"row {row.id!r} has no number of ours; let computed() of its appendix return one.")
    number = float(ours[row.id])
    why = check(row, number)
    return Entry(row=row, ours=number, holds=not why, why=why)
