"""The gain table of any plant (format version 2): models, blocks by kind with their parameters, typed promises.

    Design --plant_table--> PlantTable --write--> JSON
    JSON --read_table--> PlantTable --> models, structure

Every number a proof starts from is a decimal string that `float` reads back as the same double. A goal promises what
it asks (`goals.promise`); what `workbench.verify` proves of it from these decimals stays a promise, the rest the table
says is undecided, and why. Published schema: plant_table.schema.json, beside this file.
"""

import json
import math
from collections.abc import Sequence
from datetime import UTC, datetime
from decimal import Decimal as Digits
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, JsonValue, model_validator

from workbench.control.structure.block import Block, Parameter
from workbench.control.structure.registry import BLOCKS, make_block
from workbench.control.structure.structure import Structure
from workbench.errors import InputError
from workbench.goals.goal import Closed
from workbench.goals.loop_shape import Sensitivity
from workbench.goals.promise import Promise
from workbench.handover.table.schema import Decimal, Matrix, Name, Names, Number, Part, Sense, Text, Versions, versions
from workbench.handover.table.signed import SignedTable
from workbench.lti import Plant
from workbench.lti.model import DelayLine, Model
from workbench.result import Row, plain

if TYPE_CHECKING:
    from workbench.design.record import Design

VERSION = 2
TINY = 1e-9  # a limit that nothing keeps, so that what is reached is promised
MOST_SIGNALS, MOST_PROMISED = 60, 300  # with factors on them; promises of one requirement
MOST_SECONDS = 60.0  # of proofs while a table is made
Signals = Annotated[list[Annotated[str, Field(min_length=1, max_length=500)]], Field(max_length=500)]


class LinePart(Part):
    """A dead time from an output of the matrices to an input of them."""

    source: Text
    sink: Text
    dead_time_s: Decimal


class ModelPart(Part):
    """dx/dt = A x + B u, y = C x + D u (x[k+1] with a sample time), ends of the dead times among inputs and outputs."""

    name: Name
    sample_time_s: Decimal | None
    states: Signals
    inputs: Signals
    outputs: Signals
    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    lines: Annotated[list[LinePart], Field(max_length=100)]


class ParameterPart(Part):
    """A parameter's own name, shared by the blocks that share it, and its value."""

    name: Name
    value: Decimal


class BlockPart(Part):
    """A block: `control.structure.registry.make_block` makes it again; parameters by slot."""

    kind: Name
    inputs: Signals
    outputs: Signals
    options: Annotated[dict[Name, JsonValue], Field(max_length=20)]
    parameters: Annotated[dict[Name, ParameterPart], Field(max_length=1000)]


class StructurePart(Part):
    """What closes the loop: blocks, and the references they read."""

    references: Names
    blocks: Annotated[list[BlockPart], Field(min_length=1, max_length=100)]


class SubjectPart(Part):
    """Which part of which loops a promise speaks of; what is left out says nothing."""

    inputs: Signals = Field(default_factory=list)
    outputs: Signals = Field(default_factory=list)
    openings: Signals = Field(default_factory=list)
    points: Signals = Field(default_factory=list)
    models: Names = Field(default_factory=list)
    band: Annotated[list[Number | None], Field(min_length=2, max_length=2)] | None = None
    scaled: Annotated[dict[Name, Number], Field(max_length=MOST_SIGNALS)] = Field(default_factory=dict)


class PromisePart(Part):
    """One typed promise; see `goals.promise`."""

    kind: Name
    sense: Sense
    limit: Number
    subject: SubjectPart


class VerdictPart(Part):
    """A goal with the exact value held against it, and which promises say the same (counted from 0)."""

    name: Text
    hard: bool
    sense: Sense
    limit: Number
    value: Number | None
    unit: Text
    met: bool
    where: Text
    model: Text = ""
    method: Text = ""
    upper: Number | None = None
    promises: Annotated[list[int], Field(max_length=MOST_PROMISED)]


class UndecidedPart(Part):
    """What a goal would promise and nobody has proved."""

    name: Text
    sense: Sense
    limit: Number
    reason: Text


class PlantTable(SignedTable):
    """The parameters of a design with the loops they close and what is promised of them; see the module's map."""

    format: Literal["maglev-workbench gain table"]
    version: Literal[2]
    problem: Name
    title: Text
    data_sha256: Annotated[str, Field(pattern=r"^([0-9a-f]{64})?$")]
    created: Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}T\d{2}:\d{2}:\d{2}Z$")]
    versions: Versions
    seed: int
    solver: Text
    starts: Annotated[int, Field(ge=0)]
    models: Annotated[list[ModelPart], Field(min_length=1, max_length=50)]
    structure: StructurePart
    measured: Annotated[dict[Name, JsonValue], Field(max_length=200)]
    requirements: Annotated[list[VerdictPart], Field(max_length=200)]
    promises: Annotated[list[PromisePart], Field(max_length=300)]
    undecided: Annotated[list[UndecidedPart], Field(max_length=300)]
    digest: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]

    @model_validator(mode="after")
    def whole(self) -> "PlantTable":
        """Models and blocks that can be made again."""
        for part in (self.to_models, self.to_structure):
            part()  # refuses what makes no sense
        return self

    @property
    def sample_time(self) -> float | None:
        """[s] of the models; None for continuous time."""
        text = self.models[0].sample_time_s
        return None if text is None else float(text)

    def values(self) -> dict[str, float]:
        """Every parameter by name."""
        return {p.name: float(p.value) for block in self.structure.blocks for p in block.parameters.values()}

    def to_models(self) -> tuple[Model, ...]:
        """The models as doubles."""
        return tuple(map(_model, self.models))

    def to_structure(self) -> Structure:
        """The structure with the table's values, every parameter held."""
        return Structure(tuple(map(_block, self.structure.blocks)), tuple(self.structure.references))

    def to_dict(self) -> dict[str, Any]:
        """What the file holds."""
        return self.model_dump(mode="json", exclude_defaults=True)

    def rows(self) -> list[Row]:
        return [
            ("problem", self.problem, ""),
            ("created", self.created, ""),
            ("requirements met", all(r.met for r in self.requirements), ""),
            *((f"{r.name} {r.sense} {r.limit:g}", r.value, r.unit) for r in self.requirements),
            *((name, value, "") for name, value in self.values().items()),
            ("promises", len(self.promises), ""),
            ("undecided", len(self.undecided), ""),
            ("digest", self.digest, "SHA-256"),
        ]


def plant_table(design: "Design") -> PlantTable:
    """The table of a design of any plant.

    Parameters
    ----------
    design : its problem's models and structure, its values and verdicts

    Raises
    ------
    InputError
        For a block that no table can hold (an expression).
    """
    problem = design.problem
    document: dict[str, Any] = {
        "format": "maglev-workbench gain table", "version": VERSION, "problem": problem.name, "title": problem.title,
        "data_sha256": problem.data_sha256,
        "created": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "versions": versions(), "seed": design.seed, "solver": design.solver, "starts": len(design.starts),
        "models": [model_part(model) for model in problem.systems], "structure": structure_part(design.structure),
        "measured": {}, "requirements": [], "promises": [], "undecided": [],
    }  # fmt: skip
    judged = [(goal, verdict) for goal in problem.goals for verdict in design.verdicts if verdict.name == goal.name]
    asked: dict[str, list[Promise]] = {"": [Promise("stability", ">=", 0.0)]}
    for goal, verdict in judged:
        asked[goal.name] = list(goal.promises_on(problem.loops[0], verdict))
    asked[""] += _usual(problem, design.structure, [p for promises in asked.values() for p in promises])
    _sort(document, list(dict.fromkeys(p for promises in asked.values() for p in promises)))
    kept = [json.dumps(p, sort_keys=True) for p in document["promises"]]
    for goal, verdict in judged:
        own = [json.dumps(p.to_dict(), sort_keys=True) for p in asked[goal.name]]
        record = {
            "name": verdict.name, "hard": goal.hard, "sense": verdict.sense, "limit": verdict.limit,
            "value": _finite(verdict.value), "unit": verdict.unit, "met": verdict.met, "where": verdict.where,
            "model": verdict.model, "method": verdict.method, "upper": _finite(verdict.upper),
            "promises": [kept.index(p) for p in own] if set(own) <= set(kept) else [],  # held by all, or by none
        }  # fmt: skip
        document["requirements"].append(record)
    document["digest"] = "0" * 64
    return PlantTable.model_validate(document).signed()


def _usual(problem, structure: Structure, promised: Sequence[Promise]) -> list[Promise]:
    """What is promised unasked: the peak sensitivity reached at each input of the models that the structure drives."""
    K, found = structure.controller(), []
    for point in problem.loops[0].commands:
        if any(p.kind == Sensitivity.proof and p.subject.points == (point,) for p in promised):
            continue
        goal = Sensitivity(points=point, limit=TINY)
        found += goal.promises_on(problem.loops[0], goal.judge(Closed(problem.loops, K))[0])
    return found


def _sort(document: dict[str, Any], promises: Sequence[Promise]) -> None:
    """Puts each promise where it belongs: what the checker proves among the promises, the rest among the undecided."""
    from workbench.verify.plant.check import findings_of

    records = [p.to_dict() for p in promises]
    found = findings_of({**document, "promises": records, "digest": ""}, MOST_SECONDS)
    for promise, record, finding in zip(promises, records, found, strict=True):
        if finding.holds:
            document["promises"].append(record)
        else:
            document["undecided"].append(
                {"name": promise.name[:500], "sense": promise.sense, "limit": promise.limit,
                 "reason": finding.reason[:500]}
            )  # fmt: skip


def model_part(model: Model) -> dict[str, Any]:
    """The models part of a table, numbers as decimals; sampled dead times as whole multiples of the sample time."""
    p, h = model.plant, model.sample_time
    matrices = {key: [[repr(float(x)) for x in row] for row in getattr(p, key)] for key in "ABCD"}
    lines = [
        {
            "source": x.source,
            "sink": x.sink,
            "dead_time_s": repr(x.dead_time) if h is None else _samples(x.dead_time, h),
        }
        for x in model.lines
    ]
    return {
        "name": model.name, "sample_time_s": None if h is None else repr(float(h)), "states": list(p.states),
        "inputs": list(p.inputs), "outputs": list(p.outputs), **matrices, "lines": lines,
    }  # fmt: skip


def structure_part(structure: Structure) -> dict[str, Any]:
    """The structure part of a table, parameter values as decimals."""
    blocks = []
    for block in structure.blocks:
        if block.kind not in BLOCKS:
            raise InputError(
                f"a block in a gain table must be of a kind that data can state ({', '.join(BLOCKS)}); got "
                f"{block.kind or 'none'!r}. Replace it by a state_space or a transfer_function."
            )
        parameters = {
            slot: {"name": p.name, "value": repr(p.value)}
            for slot, p in zip(block.slots, block.parameters, strict=True)
        }
        blocks.append({
            "kind": block.kind, "inputs": list(block.inputs), "outputs": list(block.outputs),
            "options": plain(dict(block.options)), "parameters": parameters,
        })  # fmt: skip
    return {"references": list(structure.references), "blocks": blocks}


def schema() -> dict[str, Any]:
    """The JSON schema of a table of any plant."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **PlantTable.model_json_schema()}


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _samples(time: float, h: float) -> str:
    """A whole number of sample times as the decimal that is just that many times the sample time's decimal."""
    return str(round(time / h) * Digits(repr(h)))


def _model(part: ModelPart) -> Model:
    matrices = {key: [[float(x) for x in row] for row in getattr(part, key)] for key in "ABCD"}
    n, m, p = len(part.states), len(part.inputs), len(part.outputs)
    sizes = {"A": (n, n), "B": (n, m), "C": (p, n), "D": (p, m)}
    arrays = {key: _shaped(matrices[key], key, *sizes[key]) for key in "ABCD"}
    plant = Plant(**arrays, states=tuple(part.states), inputs=tuple(part.inputs), outputs=tuple(part.outputs))
    lines = tuple(DelayLine(x.source, x.sink, float(x.dead_time_s)) for x in part.lines)
    h = None if part.sample_time_s is None else float(part.sample_time_s)
    return Model(part.name, plant, sample_time=h, lines=lines)


def _shaped(rows: list[list[float]], key: str, count: int, width: int):
    import numpy as np

    if len(rows) != count or any(len(row) != width for row in rows):
        raise InputError(f"matrix {key} must have shape {(count, width)}; the table's has another. Get it again.")
    return np.array(rows, float).reshape(count, width)


def _block(part: BlockPart) -> Block:
    parameters = {slot: Parameter(p.name, float(p.value), free=False) for slot, p in part.parameters.items()}
    block = make_block(part.kind, part.inputs, part.outputs, part.options, parameters)
    if set(parameters) != set(block.slots):
        raise InputError(
            f"a {part.kind} must have the parameters {', '.join(block.slots)}; got {', '.join(parameters)}."
        )
    return block
