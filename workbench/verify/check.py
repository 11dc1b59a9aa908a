"""A whole table checked: its digest, its numbers against each other, and every promise proved again.

    document --digest_of--> digest    --Physics--> plant    --tie--> numbers against each other
      --Prover--> enclosures against the promises    --statement--> what else is stated --> Report

A promise holds if the proved enclosure keeps its limit and lies in the interval that the table claims; a claim marked
"floating point" must agree with the proved value to 1e-6 instead. What has no proof is listed with the reason, never
passed; what the budget did not suffice for is undecided, and does not pass either.
"""

import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from flint import fmpq

from workbench.verify.exact.deadline import OutOfTime, within
from workbench.verify.exact.failure import NotProved, TableError
from workbench.verify.exact.pole import boundary_kept
from workbench.verify.finding import Finding, Report, attempted, digest_faults, outward
from workbench.verify.plant.check import checked
from workbench.verify.reading import digest_of, read_document
from workbench.verify.vehicle import tie
from workbench.verify.vehicle.kind import KINDS, MOTOR_CURRENT, PEAK, kind_of, promised_names
from workbench.verify.vehicle.law import GROUPS
from workbench.verify.vehicle.loop import DIVIDING, FACTORS, left_out
from workbench.verify.vehicle.physics import differences
from workbench.verify.vehicle.prover import NO_CERTIFICATE, STURM, Prover
from workbench.verify.vehicle.scheduled import SPEED, polynomials_of
from workbench.verify.vehicle.statement import Statements
from workbench.verify.vehicle.table import Promise, Table, Undecided, table_of
from workbench.verify.vehicle.uncertain import interval_holds, method_of, worst_over_box

AGREES = 10**6  # one part in so many: a claim in floating point is right to about one in 1e9
FLOATING = "floating point"
BUDGET_SECONDS = 60.0
PLANTS = 2  # version of the tables of any plant; 1 are those of vehicles


def verify(
    path: Path, on_promise: Callable[[Finding], None] | None = None, *, budget_seconds: float = BUDGET_SECONDS
) -> Report:
    """Checks the gain table in a file; raises TableError where it is none."""
    return verify_document(read_document(Path(path)), on_promise, budget_seconds=budget_seconds)


def verify_document(
    document: Mapping[str, Any],
    on_promise: Callable[[Finding], None] | None = None,
    *,
    budget_seconds: float = BUDGET_SECONDS,
) -> Report:
    """Checks a gain table; on_promise is told each finding as it comes.

    budget_seconds : positive; what is not decided by then is undecided, and the table does not hold
    """
    if not 0 < budget_seconds < math.inf:
        raise TableError(
            f"budget_seconds must be a positive, finite number of seconds; got {budget_seconds}. Give more."
        )
    with within(budget_seconds):
        if document.get("version") == PLANTS:
            return checked(document, on_promise)
        return _checked(document, on_promise)


def _checked(document: Mapping[str, Any], on_promise: Callable[[Finding], None] | None) -> Report:
    digest = digest_of(dict(document))
    table = table_of(document)
    prover = Prover(table)
    findings = []
    for promise in table.promises:
        findings.append(_found(prover, promise))
        if on_promise:
            on_promise(findings[-1])
    faults = digest_faults(table.digest, digest)
    follows = _plant_follows(table, faults)
    coupling = math.nan
    statements = Statements(prover)
    if table.certificate is None:
        faults.append(NO_CERTIFICATE)
    else:
        faults += [f"{f.name!r} {f.reason}" for f in findings if not f.holds]
        faults += tie.faults_of(table)
        with suppress(NotProved):
            coupling = max((float(left_out(table, group)) for group in table.certificate.groups), default=0.0)
        _state(statements, findings, faults)
    faults += _doubled(table) + _misplaced(table) + _unpromised(table)
    return Report(
        table.problem, digest, digest == table.digest, follows, coupling, tuple(findings), tuple(faults),
        table.undecided, tuple(_not_promised(table)), tuple(statements.unproved),
    )  # fmt: skip


def _state(statements: Statements, findings: list[Finding], faults: list[str]) -> None:
    """What the table states besides its promises, held against what was proved and against a derivation of its own."""
    proved = {
        f.name: (fmpq(*f.proved[0].as_integer_ratio()), fmpq(*f.proved[1].as_integer_ratio()))
        for f in findings
        if f.proved is not None and not f.box
    }
    try:
        statements.promises({i: f.method for i, f in enumerate(findings)})
        statements.requirements(proved)
        statements.measured()
        statements.cases()
    except OutOfTime as error:
        faults.append(f"the table's other figures are undecided: {error}")
    except (ZeroDivisionError, ValueError, OverflowError) as error:
        if isinstance(error, TableError):
            raise
        faults.append(f"the table's other figures leave no room for a derivation ({error})")
    faults += statements.faults


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


def _doubled(table: Table) -> list[str]:
    """Each quantity is promised once for the plant and once for each box."""
    faults, seen = [], set()
    for p in table.promises:
        key = p.name, tuple(sorted(p.box.items()))
        if key in seen:
            faults.append(
                f"{p.name!r} is promised twice for the same plants; a promise must be the only one of its kind"
            )
        seen.add(key)
    return faults


def _misplaced(table: Table) -> list[str]:
    """Boxes rise and are of vehicles; a member named lies in its box in every factor.

    Asked of the table and not of the loops: a factor that reaches no group of a promise is as much a statement. What is
    left undecided may be so for a factor that the checker does not know, such as a shifted centre of gravity.
    """
    faults = []
    for entry in (*table.promises, *table.undecided):
        for name, (low, high) in entry.box.items():
            known = name in (SPEED, *FACTORS) or isinstance(entry, Undecided)
            if not (known and low < high and (low > 0 or name not in DIVIDING)):
                faults.append(
                    f"{entry.name!r} must speak of a box of known factors that rise, of mass and inertias above zero; "
                    f"{name[:40]!r} from {float(low):g} to {float(high):g} is none"
                )
    for p in table.promises:
        for name, value in p.at.items():
            low, high = p.box.get(name, (value + 1, value))
            if not low <= value <= high:
                faults.append(f"{p.name!r} names a member by {name[:40]!r} = {float(value):g}, outside its box")
    return faults


def _unpromised(table: Table) -> list[str]:
    """A promise left out is a fault as well: each requirement is promised, a peak sensitivity of every group."""
    if not table.promises:
        return ["the table promises nothing"]
    promised = {(p.name, p.sense, p.limit) for p in table.promises if not p.box}
    # what nobody can prove may be said to be undecided instead, where the report lists it
    promised |= {(u.name, u.sense, u.limit) for u in table.undecided if not u.box and kind_of(u.name) is None}
    groups = table.certificate.groups if table.certificate else ()
    faults = []
    for r in table.requirements:
        for name in promised_names(r.name, groups):
            fault = f"{name!r} {r.sense} {float(r.limit):g} is required and not promised"
            if (name, r.sense, r.limit) not in promised and fault not in faults:
                faults.append(fault)
    return faults


def _not_promised(table: Table) -> list[str]:
    """What a reader might take for promised, and is not."""
    groups = table.certificate.groups if table.certificate else ()
    given = {p.name for p in table.promises if not p.box}
    out = []
    for kind in KINDS:
        if kind == MOTOR_CURRENT and (table.certificate is None or table.certificate.motor is None):
            continue
        out += [name for name in promised_names(kind, groups or ("all",)) if name not in given]
    moved = {c for group in groups for c in GROUPS[group].coordinates}
    out += [f"any motion in {c}: no group of the table moves it" for c in GROUPS["all"].coordinates if c not in moved]
    boxes = [p.box for p in table.promises if p.box]
    if not any("speed" not in box for box in boxes):
        out.append("any other vehicle than the printed one: no box of factors")
    return out + _speeds_not_promised(table)


def _speeds_not_promised(table: Table) -> list[str]:
    """Speeds of the schedule that no promise reaches: its gains are used there as well."""
    ranges = [p.box[SPEED] for p in table.promises if SPEED in p.box]
    if not ranges or table.schedule is None:
        return ["any other speed than the table's"]
    gains, _ = polynomials_of(table.schedule)
    low, high = min(low for low, _ in ranges), max(high for _, high in ranges)
    if low <= gains.lower and gains.upper <= high:
        return []
    return [
        f"speeds of the schedule outside {float(low):g} to {float(high):g} m/s; it goes from {float(gains.lower):g} to "
        f"{float(gains.upper):g} m/s"
    ]


def _found(prover: Prover, promise: Promise) -> Finding:
    """One promise proved again."""
    proved: tuple[float, float] | None = None
    method = ""

    def prove() -> str:
        nonlocal proved, method
        low, high, method = _proved(prover, promise)
        proved = outward(low, high)
        return _fault(promise, low, high, lambda: _exactly_kept(prover, promise))

    outcome = attempted(prove)
    return Finding(
        name=promise.name, sense=promise.sense, limit=float(promise.limit),
        claimed=(float(promise.low), float(promise.high)), proved=proved, method=method,
        box={k: (float(a), float(b)) for k, (a, b) in promise.box.items()}, holds=not outcome.reason,
        reason=outcome.reason, seconds=outcome.seconds, decided=outcome.decided,
    )  # fmt: skip


def _proved(prover: Prover, promise: Promise) -> tuple[fmpq, fmpq, str]:
    """The enclosure that decides; for the peak sensitivity the claimed bracket itself, where it proves true."""
    if promise.box:
        return _proved_over_box(prover, promise)
    guess: fmpq | None = None
    if promise.name.startswith(f"{PEAK}, ") and promise.low > 0:
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


def _exactly_kept(prover: Prover, promise: Promise) -> bool:
    """Whether poles that no enclosure tells from the limit lie on it exactly."""
    if promise.box or promise.name not in ("damping ratio", "decay rate"):
        return False
    matrices = [prover.loop(group).A for group in prover.certificate.groups]
    return all(boundary_kept(A, promise.limit, ray=promise.name == "damping ratio") for A in matrices)


def _fault(promise: Promise, low: fmpq, high: fmpq, exactly_kept: Callable[[], bool]) -> str:
    """Why a promise does not hold; empty where it does."""
    kept = high <= promise.limit if promise.sense == "<=" else low >= promise.limit
    if not kept and low <= promise.limit <= high:
        kept = exactly_kept()
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
