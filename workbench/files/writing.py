"""A problem as the text of a data file: what is read back is the same problem.

design.Problem --problem_toml--> data.toml --files.load--> the same models, structure, goals
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from workbench.design.effort import Effort
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.files.effort import effort_data
from workbench.files.structure import structure_data
from workbench.goals.registry import data_of
from workbench.lti.model import Model

WIDTH = 110


def problem_toml(problem: Problem, source: str = "") -> str:
    """The data.toml of a problem of one's own plant.

    source : where its numbers come from; the problem's own if left out

    Raises
    ------
    InputError
        For a vehicle, an expression among the blocks, a goal with a system given as an object.
    """
    if problem.flies:
        raise InputError(
            f"problem {problem.name!r} controls a vehicle, whose numbers lie in its own data file; copy its folder."
        )
    head = {
        "title": problem.title or problem.name,
        "source": source or problem.sources.get("problem", "") or "stated in a program",
    }
    lines = ["[problem]", *_pairs(head)]
    for model in problem.systems:
        lines += ["", "[[model]]", *_pairs(_model_data(model, problem.sources.get(model.name)))]
    structure = structure_data(problem.structure)
    told = {"source": problem.sources["structure"]} if "structure" in problem.sources else {}
    lines += ["", "[structure]", *_pairs({"references": structure["references"], **told})]
    for block in structure["block"]:
        lines += ["", "[[structure.block]]", *_pairs({k: v for k, v in block.items() if k != "parameters"})]
        if block["parameters"]:
            lines += ["[structure.block.parameters]", *_pairs(block["parameters"])]
    for goal in problem.goals:
        lines += ["", "[[goal]]", *_pairs(data_of(goal))]
    if problem.sample_time is not None:
        lines += ["", "[discretisation]", *_pairs({"sample_time_s": problem.sample_time})]
    if problem.effort != Effort():
        lines += ["", "[design]", *_pairs(effort_data(problem.effort))]
    return "\n".join(lines) + "\n"


def _model_data(model: Model, source: str | None) -> dict[str, Any]:
    """The table of kind "matrices" of a model, with all its dead times as lines."""
    sinks, sources = [line.sink for line in model.lines], [line.source for line in model.lines]
    u = model.plant.index("inputs", [*model.inputs, *sinks])
    y = model.plant.index("outputs", [*model.outputs, *sources])
    plant = model.plant
    found: dict[str, Any] = {
        "name": model.name, "kind": "matrices", "inputs": model.inputs, "outputs": model.outputs,
        "states": plant.states, "A": plant.A.tolist(), "B": plant.B[:, u].tolist(), "C": plant.C[y].tolist(),
        "D": plant.D[y][:, u].tolist(),
    }  # fmt: skip
    if model.lines:
        found["line"] = [
            {"output": line.source, "input": line.sink, "dead_time_s": line.dead_time} for line in model.lines
        ]
    if model.sample_time is not None:
        found["sample_time_s"] = model.sample_time
    if model.pade_order != 4:
        found["pade_order"] = model.pade_order
    return found | ({"source": source} if source else {})


def _pairs(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(key)} = {_written(value)}" for key, value in table.items()]


def _written(value: Any) -> str:
    """A value in TOML; a list that is long, row by row."""
    match value:
        case bool():
            return "true" if value else "false"
        case int():
            return str(value)
        case float():
            if math.isfinite(value):
                return repr(value)
            return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
        case str():
            return _quoted(value)
        case Mapping():
            return "{ " + ", ".join(f"{_key(key)} = {_written(inner)}" for key, inner in value.items()) + " }"
        case Sequence():
            parts = [_written(inner) for inner in value]
            short = ", ".join(parts)
            if len(short) <= WIDTH or not any(isinstance(inner, Sequence | Mapping) for inner in value):
                return f"[{short}]"
            return "[\n    " + ",\n    ".join(parts) + ",\n]"
    raise InputError(f"a data file must hold numbers, texts, lists and tables; got {type(value).__name__}.")


def _quoted(text: str) -> str:
    """A basic string: quotes, backslashes and control characters escaped."""
    short = {'"': '\\"', "\\": "\\\\"}
    return '"' + "".join(short.get(c, c if c >= " " and c != "\x7f" else f"\\u{ord(c):04x}") for c in text) + '"'


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else _quoted(key)
