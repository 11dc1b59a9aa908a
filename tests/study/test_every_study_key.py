"""Every key of a study file does what it says: two files that differ in it alone, and what must change.

The keys come from the schema of study files; one without a statement here fails.
"""

import copy
import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any, get_args

import pytest
from pydantic import BaseModel

import workbench.study.designs
from workbench.errors import InfeasibleError, InputError
from workbench.files.problem import load_problem, shipped_problems
from workbench.study.file import StudyFile, read_study
from workbench.study.pareto import plan
from workbench.study.run import run_study
from workbench.study.sampling import sample

BASE = {
    "study": {"problem": "heave", "count": 16, "output": "csv", "quantities": ["damping"]},
    "parameter": [{"name": "K_h", "range": [1.0, 4.0]}],
    "limit": [{"quantity": "damping", "at_least": 0.1}],
}
GRID = {"study.sampling": "grid", "study.count": 0, "parameter.levels": 3}
BELL = {"parameter.distribution": "normal", "parameter.mean": 2.0, "parameter.deviation": 0.3, "parameter.range": None}
ONE_DESIGN = {
    "study.task": "design", "study.sampling": "list", "study.count": 0, "parameter.name": "mass",
    "parameter.range": None, "parameter.values": [1.0], "study.starts": 1,
}  # fmt: skip
PLAIN = {"study.task": None, "study.starts": None}
SWEPT = {
    "study.task": "pareto", "study.count": None, "parameter": None, "limit": None,
    "pareto": [{"requirement": "rms_gap_front_at_most_mm", "limits": [18.0, 16.0]}],
}  # fmt: skip


def samples(study, result) -> Any:
    """Of the parameters, known before any row is computed."""
    return (study.names, sample(study).tolist())


def column(name: str) -> Callable:
    return lambda study, result: result().columns.get(name)


@dataclass(frozen=True)
class Pair:
    """Two study files: the other's value of the key, what is seen of a study and its result, and what both have."""

    value: Any
    seen: Callable[[Any, Callable], Any]
    also: dict[str, Any] = field(default_factory=dict)


STATEMENTS = {
    "study.problem": Pair("heave_pitch", column("damping")),
    "study.task": Pair("design", lambda study, result: starts_of(study, result), {**ONE_DESIGN, **PLAIN}),
    "study.sampling": Pair("monte_carlo", samples),
    "study.count": Pair(8, samples),
    "study.seed": Pair(1, samples),
    "study.gains": Pair(str(shipped_problems()["heave_pitch"] / "approved.json"), column("damping")),
    "study.quantities": Pair(["damping", "cost"], column("cost")),
    "study.starts": Pair(2, lambda study, result: starts_of(study, result), ONE_DESIGN),
    "study.output": Pair("parquet", lambda study, result: result().table.suffix),
    "study.confidence": Pair(0.5, lambda study, result: (result().failing.low, result().failing.high)),
    "parameter.name": Pair("K_zdot", samples),
    "parameter.range": Pair([1.0, 5.0], samples),
    "parameter.values": Pair([1.0, 2.0, 3.0], samples, {"parameter.range": None, "parameter.values": [1.0, 2.0]}),
    "parameter.distribution": Pair("log_uniform", samples),
    "parameter.mean": Pair(2.1, samples, BELL),
    "parameter.deviation": Pair(0.4, samples, BELL),
    "parameter.levels": Pair(4, samples, GRID),
    "limit.quantity": Pair(
        "cost", lambda study, result: result().failing.by, {"study.quantities": ["damping", "cost"]}
    ),
    "limit.at_least": Pair(0.99, lambda study, result: result().failing.count),
    "limit.at_most": Pair(
        0.0, lambda study, result: result().failing.count, {"limit.at_least": None, "limit.at_most": 2.0}
    ),
    "pareto.requirement": Pair("peak_sensitivity_at_most", lambda study, result: plan(study), SWEPT),
    "pareto.limits": Pair([18.0, 17.0], lambda study, result: plan(study), SWEPT),
}


def starts_of(study, result) -> list[int]:
    """How many random starts its designs make."""
    asked: list[int] = []

    def design(problem, *, starts, seed):
        asked.append(starts)
        raise InfeasibleError("not now")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(workbench.study.designs, "design", design)
        result()
    return asked


def every_key(model: type[BaseModel] = StudyFile, path: str = "") -> Iterator[str]:
    for name, one in model.model_fields.items():
        tables = [t for t in (one.annotation, *get_args(one.annotation)) if isinstance(t, type)]
        table = next((t for t in tables if issubclass(t, BaseModel)), None) or _inner(one.annotation)
        if table is None:
            yield f"{path}{name}"
        else:
            yield from every_key(table, f"{path}{name}.")


def _inner(annotation) -> type[BaseModel] | None:
    parts = [part for outer in get_args(annotation) for part in (outer, *get_args(outer))]
    return next((t for t in parts if isinstance(t, type) and issubclass(t, BaseModel)), None)


def changed(mapping: dict, key: str, value: Any) -> dict:
    out = copy.deepcopy(mapping)
    table, _, name = key.partition(".")
    at = out if not name else out[table][0] if isinstance(out[table], list) else out[table]
    if value is None:
        at.pop(name or table, None)
    else:
        at[name or table] = value
    return out


def test_every_key_has_a_statement_and_every_statement_a_key():
    assert set(every_key()) == set(STATEMENTS)


@pytest.mark.parametrize("key", sorted(STATEMENTS))
def test_a_key_changes_what_it_is_for(tmp_path, key):
    pair = STATEMENTS[key]
    first = BASE
    for name, value in pair.also.items():
        first = changed(first, name, value)
    seen = []
    for number, mapping in enumerate((first, changed(first, key, pair.value))):
        path = tmp_path / f"{number}.json"
        path.write_text(json.dumps(mapping))
        study = read_study(path)
        seen.append(pair.seen(study, lambda study=study, n=number: run_study(study, tmp_path / f"out{n}")))
    assert seen[0] != seen[1]


@pytest.mark.parametrize(
    ("key", "value", "also", "sentence"),
    [
        ("parameter.mean", 2.0, {}, "mean and deviation belong to"),
        ("parameter.levels", 3, {}, "levels must stand in a grid"),
        ("study.starts", 3, {}, "starts belong to designs"),
        ("study.count", 3, {**GRID}, "must follow from its parameters; got count = 3"),
        (
            "study.gains",
            str(shipped_problems()["heave"] / "approved.json"),
            ONE_DESIGN,
            "set starts = 0, or drop gains",
        ),
    ],
)
def test_a_key_that_nothing_would_be_done_with_is_refused(tmp_path, key, value, also, sentence):
    mapping = BASE
    for name, other in {**also, key: value}.items():
        mapping = changed(mapping, name, other)
    (tmp_path / "s.json").write_text(json.dumps(mapping))
    with pytest.raises(InputError, match=sentence):
        read_study(tmp_path / "s.json")


def test_the_study_of_the_family_has_gains_to_vary():
    assert load_problem("heave").approved is not None
