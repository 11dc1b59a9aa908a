"""Problems of plants of one's own: models, a structure and goals in a data.toml.

<folder>/data.toml --schema--> OwnFile --problem.py, or OwnData.build--> design.Problem
design.Problem --problem_toml--> text of a data.toml that gives the same problem
"""

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, field_validator

from workbench.control.structure.structure import Structure
from workbench.design.models import several
from workbench.design.problem import Problem
from workbench.errors import InputError, unknown_name
from workbench.files.digest import check_digest
from workbench.files.effort import EffortTable, effort_of
from workbench.files.goal import goal_of
from workbench.files.matrix import beside
from workbench.files.number import FACTOR, numbers, with_numbers
from workbench.files.plant import PlantBlock
from workbench.files.structure import StructureTable
from workbench.files.table import MOST, Above, Table, Text, read_table
from workbench.goals.goal import Goal
from workbench.lti.model import Model
from workbench.machine.reading import read_mapping, read_text


class HeadTable(Table):
    """[problem]"""

    title: Annotated[str, Field(min_length=3, max_length=200)]
    source: Text


class StepTable(Table):
    """[discretisation] of the controller"""

    sample_time_s: Above
    source: Text | None = None


class OwnFile(Table):
    """A data.toml that states its models itself."""

    problem: HeadTable
    model: Annotated[tuple[PlantBlock, ...], Field(min_length=1, max_length=60)]
    structure: StructureTable
    goal: Annotated[tuple[dict[str, Any], ...], Field(max_length=MOST)] = ()
    discretisation: StepTable | None = None
    design: EffortTable | None = None

    @field_validator("model", mode="before")
    @classmethod
    def one_or_several(cls, given: Any) -> Any:
        """[model] for one, [[model]] for several."""
        return (given,) if isinstance(given, Mapping) else given


@dataclass(frozen=True, slots=True)
class FileModels:
    """The models of a data file, which vary with the numbers that it says of them.

    systems : the models;  document : the data;  folder : where they lie, with the files that they read
    """

    systems: tuple[Model, ...]
    document: Mapping[str, Any] = field(repr=False)
    folder: Path = field(repr=False)

    def at(self, values: Mapping[str, float]) -> "FileModels":
        """The models with other numbers, by dotted path: "model.0.A.0.0", "factor.model.0.A.0.0" for a multiple."""
        known = [path for path in numbers(self.document) if path.partition(".")[0] == "model"]
        for name in values:
            if name.removeprefix(FACTOR) not in known:
                raise unknown_name("number of the models", name, known)
        data = own_problem_data(self.folder, with_numbers(self.document, values))
        return data.models()


class OwnData:
    """What problem.py gets: the checked file, and `build()` that turns it into a Problem."""

    def __init__(self, file: OwnFile, folder: Path, document: Mapping[str, Any]) -> None:
        self.file, self.folder, self.place = file, folder, str(folder / "data.toml")
        self._document = document

    def models(self) -> FileModels:
        """Every model."""
        made = []
        for number, table in enumerate(self.file.model):
            try:
                made.append(table.model(self.folder))
            except InputError as error:
                raise InputError(f"{self.place}: model.{number}: {error}") from error
        return FileModels(several(made), self._document, self.folder)

    def goals(self) -> tuple[Goal, ...]:
        """Every goal."""
        made = []
        for number, keys in enumerate(self.file.goal):
            try:
                made.append(goal_of(keys))
            except InputError as error:
                raise InputError(f"{self.place}: goal.{number}: {error}") from error
        return tuple(made)

    def build(self) -> Problem:
        """The problem as the data describe it; every goal is tried on the loops it speaks of."""
        d = self.file
        structure = d.structure.structure(self.place)
        sources = {"problem": d.problem.source, **{m.name: m.source for m in d.model if m.source}}
        sources |= {"structure": d.structure.source} if d.structure.source else {}
        approved = self.folder / "approved.json"
        try:
            problem = Problem(
                models=self.models(), structure=structure, goals=self.goals(), name=self.folder.resolve().name,
                title=d.problem.title, sample_time=d.discretisation.sample_time_s if d.discretisation else None,
                effort=effort_of(d.design),
                approved=read_values(approved, structure) if approved.is_file() else None,
                data_sha256=self._sha256(), sources=sources,
            )  # fmt: skip
        except InputError as error:
            text = str(error)
            raise InputError(text if text.startswith(str(self.folder)) else f"{self.place}: {text}") from error
        self._try_goals(problem)
        return problem

    def _try_goals(self, problem: Problem) -> None:
        names = [model.name for model in problem.systems]
        for number, wanted in enumerate(problem.goals):
            try:
                for name in wanted.models or ():
                    if name not in names:
                        raise InputError(f"goal {wanted.name!r} must name models of {', '.join(names)}; got {name!r}.")
                for loop in problem.loops:
                    if wanted.holds_for(loop.model.name):
                        wanted.bind(loop)
            except InputError as error:
                raise InputError(f"{self.place}: goal.{number}: {error}") from error

    def _sha256(self) -> str:
        """Of data.toml and of what it reads beside it."""
        found = hashlib.sha256(read_text(self.folder / "data.toml").encode())
        for name in self.files():
            found.update(beside(self.folder, name).read_bytes())
        return found.hexdigest()

    def files(self) -> tuple[str, ...]:
        """Names of the files beside data.toml that its models read."""
        return tuple(dict.fromkeys(name for table in self.file.model for name in table.files()))


def own_problem_data(folder: Path, document: Mapping[str, Any]) -> OwnData:
    """The checked data of a folder; raises InputError that names the first key at fault."""
    try:
        return OwnData(read_table(OwnFile, document, str(folder / "data.toml")), folder, document)
    except RecursionError as error:
        raise InputError(f"{folder / 'data.toml'} must not be nested deeply; keep to the keys of the guide.") from error


def read_values(path: Path, structure: Structure) -> dict[str, float]:
    """Values of a structure's parameters from a gain table of it, unchanged since it was signed, or from a mapping.

    A mapping of names to numbers, by itself or under "values", may leave some out.

    Raises
    ------
    InputError
        For a table of another structure, a name that is no parameter, or a value that is no number.
    """
    values = named_values(path)
    try:
        for name in values:
            structure.parameter(name)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    missing = [p.name for p in structure.parameters if p.name not in values]
    if missing and "format" in read_mapping(path):
        raise InputError(f"{path} must be a table of this structure; it lacks the parameter {missing[0]!r}.")
    return values


def named_values(path: Path) -> dict[str, float]:
    """Name to number of what `read_values` reads, whatever structure it belongs to."""
    mapping = read_mapping(path)
    if "format" in mapping or "digest" in mapping:
        check_digest(mapping, path)
        found = _of_table(mapping, path)
    else:
        found = mapping.get("values", mapping)
    if not isinstance(found, dict):
        raise InputError(f"{path} must map names of parameters to numbers; got a {type(found).__name__}.")
    values = {}
    for name, value in found.items():
        try:
            values[str(name)] = float(value) if not isinstance(value, bool) else math.nan
        except (TypeError, ValueError):
            values[str(name)] = math.nan
        if not math.isfinite(values[str(name)]):
            raise InputError(f"{path} must give a number for {str(name)[:60]!r}; got {str(value)[:40]!r}.")
    return values


def _of_table(mapping: dict, path: Path) -> dict:
    """Name to decimal of every parameter in a table of format version 2."""
    try:
        blocks = mapping["structure"]["blocks"]
        return {p["name"]: p["value"] for block in blocks for p in block["parameters"].values()}
    except (KeyError, TypeError, AttributeError) as error:
        raise InputError(
            f"{path} must be a gain table of a plant of one's own (format version 2); it holds no structure of blocks. "
            "Give the table that 'workbench design' wrote for this problem."
        ) from error
