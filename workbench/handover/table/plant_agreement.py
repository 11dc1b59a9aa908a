"""Whether a table of any plant is one of a problem: models, structure, and what its goals ask, derived again.

problem --models, structure--> parts of a table to 1e-9    values --given--> verdicts, promises against those stated
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from workbench.handover.table.agreement import AGREES, SAME, Agreement, alike
from workbench.handover.table.plant import model_part, structure_part
from workbench.lti.model import Model

LETTERS = (("A", "states", "states"), ("B", "states", "inputs"), ("C", "outputs", "states"), ("D", "outputs", "inputs"))


def plant_agreement(document: dict[str, Any], problem) -> Agreement:
    """A table's content of version 2 held against a problem rebuilt from its data.

    problem : workbench.design.problem.Problem
    """
    sentences = []
    same = document["data_sha256"] == problem.data_sha256
    if not same:
        sentences.append(
            f"the data of {problem.name!r} must be those the table was made from; their SHA-256 is "
            f"{problem.data_sha256[:12]}…, the table's {document['data_sha256'][:12]}…"
        )
    if document["title"] != problem.title:
        sentences.append(f"the title must be that of {problem.name!r}, {problem.title!r}; got {document['title']!r}")
    difference, wrong = _models(document["models"], problem.systems)
    sentences += wrong + list(_structure(document["structure"], problem.structure))
    if not sentences:
        sentences += _goals(document, problem)
    return Agreement(
        problem=problem.name, data_sha256_ok=same, plant_difference=difference, disagreements=tuple(sentences)
    )


def _models(printed: list[dict[str, Any]], models: tuple[Model, ...]) -> tuple[float | None, list[str]]:
    """Largest difference of an entry of its row, None where names differ; a sentence for each model that differs."""
    if [m["name"] for m in printed] != [m.name for m in models]:
        return None, [f"the models must be {', '.join(m.name for m in models)[:200]}; the table has others"]
    worst, sentences = 0.0, []
    for part, model in zip(printed, models, strict=True):
        ours = model_part(model)
        names = ("states", "inputs", "outputs", "lines", "sample_time_s")
        other = [key for key in names if not alike(part[key], ours[key])]
        if other:
            sentences.append(f"model {model.name!r} must have the problem's {', '.join(other)}; they differ")
            continue
        for letter, rows, columns in LETTERS:
            shape = len(ours[rows]), len(ours[columns])
            a, b = (np.array(m[letter], float).reshape(shape) for m in (part, ours))
            size = np.maximum(np.abs(a), np.abs(b)).max(axis=1, keepdims=True, initial=0.0)
            off = float((np.abs(a - b) / np.where(size > 0, size, 1.0)).max(initial=0.0))
            worst = max(worst, off)
            if off > SAME:
                sentences.append(
                    f"{letter} of model {model.name!r} must be the problem's to 1e-9; off by {off:.2g} of its row"
                )
    return worst, sentences


def _structure(printed: dict[str, Any], structure) -> Iterator[str]:
    """A sentence for each thing of the structure that is not the problem's."""
    ours = structure_part(structure)
    if printed["references"] != ours["references"] or len(printed["blocks"]) != len(ours["blocks"]):
        yield "the structure must have the problem's references and blocks; they differ"
        return
    for k, (block, own) in enumerate(zip(printed["blocks"], ours["blocks"], strict=True)):
        for key in ("kind", "inputs", "outputs", "options"):
            if not alike(block[key], own[key]):
                yield f"{key} of block {k} must be {str(own[key])[:80]}; the table has {str(block[key])[:80]}"
        if {s: p["name"] for s, p in block["parameters"].items()} != {
            s: p["name"] for s, p in own["parameters"].items()
        }:
            yield f"block {k} must have the problem's parameters; the table has others"
            continue
        for part in block["parameters"].values():
            parameter, value = structure.parameter(part["name"]), float(part["value"])
            slack = SAME * max(abs(value), abs(parameter.value))
            if not parameter.free and abs(value - parameter.value) > slack:
                yield f"{parameter.name!r} must be held at {parameter.value:g}; the table has {value:g}"
            if parameter.free and not parameter.low - slack <= value <= parameter.high + slack:
                yield (
                    f"{parameter.name!r} must lie from {parameter.low:g} to {parameter.high:g}; the table has {value:g}"
                )


def _goals(document: dict[str, Any], problem) -> list[str]:
    """What the goals find and promise at the table's values, against what the table says."""
    from workbench.design.record import given

    values = {p["name"]: float(p["value"]) for b in document["structure"]["blocks"] for p in b["parameters"].values()}
    verdicts = {v.name: v for v in given(problem, values).verdicts}
    stated = {r["name"]: r for r in document["requirements"]}
    said = [(p["kind"], p["subject"], p["sense"], p["limit"]) for p in document["promises"]]
    undecided = [(u["name"], None, u["sense"], u["limit"]) for u in document["undecided"]]
    sentences = [f"{name!r} must be a goal of {problem.name!r}; it is none" for name in stated if name not in verdicts]
    if len(stated) < len(document["requirements"]):
        sentences.append("every requirement must stand once in the table; one stands twice")
    for goal in problem.goals:
        found, there = verdicts[goal.name], stated.get(goal.name)
        if there is None:
            sentences.append(f"every goal of {problem.name!r} must stand in the table; {goal.name!r} does not")
            continue
        if (there["hard"], there["sense"], there["met"]) != (goal.hard, found.sense, found.met):
            sentences.append(f"{goal.name!r} must be stated as the problem has it, met or not; it is not")
        for key in ("limit", "value"):
            if not _close(there[key], getattr(found, key)):
                sentences.append(
                    f"{key} of {goal.name!r} is stated as {there[key]}, found {getattr(found, key):.9g}"
                    if getattr(found, key) is not None
                    else f"{goal.name!r} has no value; {there[key]} is stated"
                )
        held, whole = [], True
        for promise in goal.promises_on(problem.loops[0], found):
            here = _places(said, (promise.kind, promise.to_dict()["subject"], promise.sense), promise.limit)
            held, whole = held + here[:1], whole and bool(here)
            if not here and not _places(undecided, (promise.name[:500], None, promise.sense), promise.limit):
                sentences.append(
                    f"{goal.name!r} must be promised as {promise.name!r} {promise.sense} {promise.limit:.6g}, or said "
                    "to be undecided; it is neither"
                )
        held = held if whole else []
        if sorted(there["promises"]) != sorted(held):
            sentences.append(f"{goal.name!r} must name the promises that hold it, {held}; got {there['promises']}")
    return sentences


def _places(stated: list[tuple], asked: tuple, limit: float) -> list[int]:
    """Where a promise stands: in the same words, to the same limit."""
    return [k for k, (*words, given) in enumerate(stated) if tuple(words) == asked and _close(given, limit)]


def _close(one: float | None, other: float | None) -> bool:
    """Figures to 1e-6, which is what another machine may change."""
    if one is None or other is None:
        return one is other
    return abs(one - other) <= AGREES * max(abs(one), abs(other), 1e-9)
