"""A whole table checked: its digest, its plant against its vehicle, and every promise proved again.

    document --digest_of--> digest    --Physics--> plant    --Prover--> enclosures against the promises --> Report

A promise holds if the proved enclosure keeps its limit and lies in the interval that the table claims; a claim marked
"floating point" must agree with the proved value to 1e-6 instead. What has no proof is listed with the reason, never
passed.
"""

import math
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

from flint import fmpq

from workbench.verify.failure import NotProved, TableError
from workbench.verify.loop import left_out
from workbench.verify.physics import differences
from workbench.verify.prover import NO_CERTIFICATE, STURM, Prover
from workbench.verify.reading import digest_of, read_document
from workbench.verify.table import Promise, Table, Undecided, table_of
from workbench.verify.uncertain import interval_holds, method_of, worst_over_box

AGREES = 10**6  # one part in so many: a claim in floating point is right to about one in 1e9
FLOATING = "floating point"


@dataclass(frozen=True, slots=True)
class Finding:
    """One promise: what was claimed, what is proved, and whether it holds; `reason` says why not."""

    name: str
    sense: str
    limit: float
    claimed: tuple[float, float]
    proved: tuple[float, float] | None
    method: str
    box: Mapping[str, tuple[float, float]]
    holds: bool
    reason: str
    seconds: float

    @property
    def verdict(self) -> str:
        """ "proved", "fails" (proved to be otherwise) or "not proved"."""
        if self.holds:
            return "proved"
        return "not proved" if self.proved is None else "fails"


@dataclass(frozen=True, slots=True)
class Report:
    """What became of a table.

    faults : one sentence for each thing that does not hold
    plant_follows : whether the printed plant is that of the vehicle beside it; None if no vehicle stands there
    undecided : what the table itself says it does not promise over a box; nothing is proved of that
    coupling : largest part of the plant that the groups leave out, relative (rounding of a symmetric vehicle)
    """

    problem: str
    digest: str
    digest_ok: bool
    plant_follows: bool | None
    coupling: float
    findings: tuple[Finding, ...]
    faults: tuple[str, ...]
    undecided: tuple[Undecided, ...] = ()

    @property
    def proved(self) -> bool:
        """Whether everything holds: digest, plant, and every requirement promised and proved."""
        return not self.faults


def verify(path: Path, on_promise: Callable[[Finding], None] | None = None) -> Report:
    """Checks the gain table in a file; raises TableError where it is none."""
    return verify_document(read_document(Path(path)), on_promise)


def verify_document(document: Mapping[str, Any], on_promise: Callable[[Finding], None] | None = None) -> Report:
    """Checks a gain table; on_promise is told each finding as it comes."""
    digest = digest_of(dict(document))
    table = table_of(document)
    prover = Prover(table)
    findings = []
    for promise in table.promises:
        findings.append(_found(prover, promise))
        if on_promise:
            on_promise(findings[-1])
    faults = []
    if digest != table.digest:
        faults.append(
            f"the digest must be the SHA-256 of the content; the table says {table.digest[:12]}…, the content gives "
            f"{digest[:12]}…: it was changed after it was signed"
        )
    follows = _plant_follows(table, faults)
    if table.certificate is None:
        faults.append(NO_CERTIFICATE)
    else:
        faults += [f"{f.name!r} {f.reason}" for f in findings if not f.holds]
    faults += _unpromised(table)
    groups = table.certificate.groups if table.certificate else ()
    try:
        coupling = max((float(left_out(table, group)) for group in groups), default=0.0)
    except NotProved:
        coupling = math.nan
    return Report(
        table.problem,
        digest,
        digest == table.digest,
        follows,
        coupling,
        tuple(findings),
        tuple(faults),
        table.undecided,
    )


def outward(low: fmpq, high: fmpq) -> tuple[float, float]:
    """The narrowest two doubles with the interval between them."""
    below, above = float(low), float(high)
    while fmpq(*below.as_integer_ratio()) > low:
        below = math.nextafter(below, -math.inf)
    while fmpq(*above.as_integer_ratio()) < high:
        above = math.nextafter(above, math.inf)
    return below, above


def _plant_follows(table: Table, faults: list[str]) -> bool | None:
    physics = table.certificate.physics if table.certificate else None
    if physics is None:
        return None
    different = differences(table.plant, physics)
    if different:
        matrix, row, column, size = different[0]
        place = f"{matrix}({row}, {column})" if column else f"{row!r} among its {matrix}"
        faults.append(
            f"the plant must follow from the vehicle in the certificate to 1e-9; {place} differs by {size:.2g} of its "
            f"size, {len(different)} entries in all: this is the plant of another vehicle"
        )
    return not different


def _unpromised(table: Table) -> list[str]:
    """A promise left out is a fault as well."""
    if not table.promises:
        return ["the table promises nothing"]
    promised = [p for p in table.promises if not p.box]
    faults = []
    for (name, sense, limit), asked in Counter(table.requirements).items():  # a peak sensitivity once for each group
        given = [p for p in promised if p.name == name or p.name.startswith(f"{name}, ")]
        if sum((p.sense, p.limit) == (sense, limit) for p in given) < asked:
            faults.append(f"{name!r} {sense} {float(limit):g} is required and not promised")
    return faults


def _found(prover: Prover, promise: Promise) -> Finding:
    """One promise proved again."""
    start = perf_counter()
    proved: tuple[float, float] | None = None
    method = ""
    try:
        low, high, method = _proved(prover, promise)
        proved = outward(low, high)
        reason = _fault(promise, low, high)
    except NotProved as error:
        reason = f"is not proved: {error}"
    except (ZeroDivisionError, ValueError, OverflowError) as error:
        if isinstance(error, TableError):
            raise
        reason = f"is not proved: the numbers leave no room for a proof ({error})"
    return Finding(
        name=promise.name, sense=promise.sense, limit=float(promise.limit),
        claimed=(float(promise.low), float(promise.high)), proved=proved, method=method,
        box={k: (float(a), float(b)) for k, (a, b) in promise.box.items()}, holds=not reason, reason=reason,
        seconds=perf_counter() - start,
    )  # fmt: skip


def _proved(prover: Prover, promise: Promise) -> tuple[fmpq, fmpq, str]:
    """The enclosure that decides; for the peak sensitivity the claimed bracket itself, where it proves true."""
    if promise.box:
        return _proved_over_box(prover, promise)
    guess: fmpq | None = None
    if promise.name.startswith("peak sensitivity, ") and promise.low > 0:
        group = prover.group_named(promise.name)
        peak = prover.peak(group)
        if not peak.below(promise.low) and peak.below(promise.high):
            return promise.low, promise.high, STURM
        guess = promise.high
    return prover.enclosure(promise.name, guess)


def _proved_over_box(prover: Prover, promise: Promise) -> tuple[fmpq, fmpq, str]:
    """The claimed interval where it proves true, our own where it does not."""
    loops = prover.uncertain(promise.name, promise.box)
    if interval_holds(loops, promise.name, promise.low, promise.high, promise.at):
        return promise.low, promise.high, method_of(promise.name)
    worst = worst_over_box(loops, promise.name)
    return worst.low, worst.high, worst.method


def _fault(promise: Promise, low: fmpq, high: fmpq) -> str:
    """Why a promise does not hold; empty where it does."""
    kept = high <= promise.limit if promise.sense == "<=" else low >= promise.limit
    slack = fmpq(1, AGREES) * max(abs(low), abs(high)) if promise.method.startswith(FLOATING) else fmpq(0)
    inside = promise.low - slack <= low and high <= promise.high + slack
    interval = "[{:.9g}, {:.9g}]".format(*outward(low, high))
    if not kept:
        return f"must be {promise.sense} {float(promise.limit):.6g}; proved to lie in {interval}"
    if not inside:
        return (
            f"is claimed to lie in [{float(promise.low):.9g}, {float(promise.high):.9g}]; proved to lie in {interval}"
        )
    return ""
