"""A gain table of any plant checked: its digest, and every promise proved on every model it speaks of.

document --table_of--> models, blocks --Loop--> closed loops --promises/<kind>--> answers --> findings, Report

What the table states besides (measured figures, the verdicts' values, who made it) is listed as stated, proved by
nobody; a requirement without a promise is listed as not promised.
"""

import math
from collections.abc import Callable, Mapping
from typing import Any

from flint import fmpq

from workbench.verify.exact.deadline import within
from workbench.verify.exact.failure import NotProved, TableError
from workbench.verify.finding import Finding, Report, Undecided, attempted, digest_faults, outward
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.table import MOST_PROMISES, Model, Promise, Scaled, Table, table_of
from workbench.verify.promises import proofs
from workbench.verify.promises.answer import Answer
from workbench.verify.reading import as_printed, digest_of, entries_of, keyed, mapping, optional, text_of

REQUIREMENT = ("name", "sense", "limit", "value", "unit", "met", "where", "hard", "promises")
MORE = ("model", "method", "upper")
AUTHORS = ("problem", "title", "data_sha256", "created", "versions", "seed", "solver", "starts")


def checked(document: Mapping[str, Any], on_promise: Callable[[Finding], None] | None) -> Report:
    """The report on a table of version 2; on_promise is told each finding as it comes."""
    digest, table = digest_of(dict(document)), table_of(document)
    findings = _findings(table, on_promise)
    faults = digest_faults(table.digest, digest) + [f"{f.name!r} {f.reason}" for f in findings if not f.holds]
    if not table.promises:
        faults.append("the table promises nothing")
    if not any(
        p.kind == "stability" and not p.subject.openings and not p.subject.scaled and _covers(p, table)
        for p in table.promises
    ):
        faults.append("the table must promise the stability of every model's loop; it does not")
    seen = set()
    for p in table.promises:
        if p in seen:
            faults.append(f"{p.name!r} is promised twice; a promise must be the only one of its kind")
        seen.add(p)
    unpromised = _requirements(table, faults)
    return Report(
        text_of(document["problem"], "problem"), digest, digest == table.digest, None, 0.0, tuple(findings),
        tuple(faults), _undecided(table), tuple(unpromised), tuple(_stated(table)),
    )  # fmt: skip


def findings_of(document: Mapping[str, Any], seconds: float) -> list[Finding]:
    """A finding for each promise of a document that need not be signed, within a budget."""
    with within(seconds):
        return _findings(table_of(document), None)


def _findings(table: Table, on_promise: Callable[[Finding], None] | None) -> list[Finding]:
    loops: dict[tuple[str, Scaled], Loop | str] = {}
    findings: list[Finding] = []
    for promise in table.promises:
        findings.append(_found(table, loops, promise))
        if on_promise:
            on_promise(findings[-1])
    return findings


def _covers(promise: Promise, table: Table) -> bool:
    return not promise.subject.models or set(promise.subject.models) == {m.name for m in table.models}


def _found(table: Table, loops: dict[tuple[str, Scaled], Loop | str], promise: Promise) -> Finding:
    """One promise on every model it speaks of."""
    answers: list[Answer] = []
    spoken = [m for m in table.models if not promise.subject.models or m.name in promise.subject.models]

    def on_every_model() -> str:
        prove = proofs().get(promise.kind)
        if prove is None:
            raise NotProved(f"the checker has no proof of the kind {promise.kind[:60]!r}")
        for model in spoken:
            key = model.name, promise.subject.scaled
            if key not in loops:
                loops[key] = _loop(table, model, promise.subject.scaled)
            loop = loops[key]
            if isinstance(loop, str):
                raise NotProved(loop)
            answers.append(prove(loop, promise))
            if not answers[-1].kept:
                return f"must be {promise.sense} {float(promise.limit):.6g}; it is not on model {model.name[:40]!r}"
        return ""

    outcome = attempted(on_every_model)
    shown = not outcome.reason or (answers and not answers[-1].kept)
    return Finding(
        name=promise.name, sense=promise.sense, limit=float(promise.limit), claimed=None,
        proved=_enclosure(promise, answers, whole=len(answers) == len(spoken)) if shown else None,
        method="; ".join(dict.fromkeys(a.method for a in answers)), box={}, holds=not outcome.reason,
        reason=outcome.reason, seconds=outcome.seconds, decided=outcome.decided,
    )  # fmt: skip


def _loop(table: Table, model: Model, scaled: Scaled) -> Loop | str:
    """The loop of a model with factors on its signals, or why there is none."""
    try:
        return Loop(table, model.changed(scaled))
    except NotProved as error:
        return str(error)


def _enclosure(promise: Promise, answers: list[Answer], *, whole: bool) -> tuple[float, float] | None:
    """What holds the worst value of all models, ends that nobody looked for infinite; whole: no model left out."""
    lows, highs = [a.low for a in answers], [a.high for a in answers]
    pick = max if promise.sense == "<=" else min
    low = pick((x for x in lows if x is not None), default=None)
    high = pick((x for x in highs if x is not None), default=None)
    if promise.sense == "<=" and (None in highs or not whole):
        high = None
    if promise.sense == ">=" and (None in lows or not whole):
        low = None
    below = -math.inf if low is None else outward(low, low)[0]
    above = math.inf if high is None else outward(high, high)[1]
    return (below, above) if not answers[-1].kept or low is not None or high is not None else None


def _requirements(table: Table, faults: list[str]) -> list[str]:
    """What is required without a promise; faults of those that contradict themselves."""
    out = []
    for i, entry in enumerate(table.document["requirements"]):
        place = f"requirements.{i}"
        keyed(entry, place, REQUIREMENT, MORE)
        name = text_of(entry["name"], f"{place}.name")[:80]
        for key in ("unit", "where", "model", "method"):
            text_of(entry.get(key, ""), f"{place}.{key}")
        if not (isinstance(entry["hard"], bool) and isinstance(entry["met"], bool)):
            raise TableError(f"{place} must say hard and met as true or false; it does not. Mend it there.")
        optional(entry.get("upper"), lambda x, place=place: as_printed(x, f"{place}.upper"))
        if entry["sense"] not in ("<=", ">="):
            raise TableError(f"{place}.sense must be '<=' or '>='; got {str(entry['sense'])[:20]!r}. Mend it there.")
        limit = optional(entry["limit"], lambda x, place=place: as_printed(x, f"{place}.limit"))
        value = optional(entry["value"], lambda x, place=place: as_printed(x, f"{place}.value"))
        met = value is not None and (limit is None or (value <= limit if entry["sense"] == "<=" else value >= limit))
        if entry["met"] and not met:
            faults.append(f"{name!r} is stated to be met; its stated value does not keep its stated limit")
        if entry["hard"] and not entry["met"]:
            faults.append(f"{name!r} must be met; the table itself says that it is not")
        held = entries_of(entry["promises"], f"{place}.promises", MOST_PROMISES)
        for k in held:
            if isinstance(k, bool) or not isinstance(k, int) or not 0 <= k < len(table.promises):
                raise TableError(f"{place}.promises must count promises of the table; got {str(k)[:20]!r}. Mend it.")
        said = f"{name} {entry['sense']} {entry['limit']}"
        if not held:
            out.append(f"{said}: no promise of the table holds it")
        elif not any((table.promises[k].sense, table.promises[k].limit) == (entry["sense"], limit) for k in held):
            p = table.promises[held[0]]
            out.append(f"{said}: stated to follow from {p.name[:200]!r} {p.sense} {float(p.limit):g}")
    return out


def _undecided(table: Table) -> tuple[Undecided, ...]:
    """What the table itself says nobody proved."""
    out = []
    for i, entry in enumerate(table.document["undecided"]):
        keyed(entry, f"undecided.{i}", ("name", "sense", "limit", "reason"))
        out.append(
            Undecided(
                text_of(entry["name"], f"undecided.{i}.name"),
                text_of(entry["sense"], f"undecided.{i}.sense"),
                as_printed(entry["limit"], f"undecided.{i}.limit"),
                {},
                fmpq(1),
                text_of(entry["reason"], f"undecided.{i}.reason"),
            )
        )
    return tuple(out)


def _stated(table: Table) -> list[str]:
    """Places of what the author states and nobody proved."""
    document = table.document
    out = [*AUTHORS, *(f"measured.{key[:60]}" for key in mapping(document["measured"], "measured"))]
    return out + [f"requirements.{i}" for i in range(len(document["requirements"]))]
