"""Reading a STUDY.toml: strict, every key known, one sentence on failure.

STUDY.toml --schema--> StudyFile --records--> study.definition.Study
"""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from workbench.control.schedule import Schedule
from workbench.errors import InputError, unknown_name
from workbench.files.block import Finite, Positive
from workbench.files.gains import read_gains, read_schedule
from workbench.files.kind import is_own
from workbench.files.own_plant import named_values
from workbench.files.problem import shipped_problems
from workbench.files.refusal import sentence
from workbench.goals.ride.requirement import limit_keys, requirement_of
from workbench.machine.reading import read_mapping
from workbench.study.definition import MOST_PARAMETERS, MOST_ROWS, Limit, Parameter, Study, Sweep

Name = Annotated[str, Field(min_length=1, max_length=200)]
Count = Annotated[int, Field(strict=True, ge=0, le=MOST_ROWS)]
MOST_VALUES = 100_000
FAR = 4.0  # deviations at which a normal distribution without a range is cut


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class StudyBlock(_Table):
    problem: Name
    task: Literal["analyse", "design", "pareto"] = "analyse"
    sampling: Literal["grid", "latin_hypercube", "monte_carlo", "sobol", "list"] = "latin_hypercube"
    count: Count = 0
    seed: Annotated[int, Field(strict=True, ge=0, le=2**63 - 1)] = 0
    gains: Name | None = None
    quantities: Annotated[tuple[Name, ...], Field(max_length=200)] = ()
    starts: Annotated[int, Field(strict=True, ge=0, le=1000)] = 4
    output: Literal["parquet", "csv"] = "parquet"
    confidence: Annotated[float, Field(strict=True, gt=0, lt=1)] = 0.95

    @model_validator(mode="after")
    def used(self) -> "StudyBlock":
        """No key that nothing would be done with."""
        given = self.model_fields_set
        if "starts" in given and self.task == "analyse":
            raise ValueError("starts belong to designs; an analysis has none. Leave the key out")
        if "gains" in given and self.task == "design" and self.starts:
            raise ValueError("a design with random starts does not begin at given gains; set starts = 0, or drop gains")
        if self.task == "pareto" and given & {"sampling", "count"}:
            raise ValueError("a pareto study follows its sweeps; sampling and count are not for it. Leave them out")
        return self


class ParameterBlock(_Table):
    name: Name
    range: tuple[Finite, Finite] | None = None
    values: Annotated[tuple[Finite, ...], Field(min_length=1, max_length=MOST_VALUES)] | None = None
    distribution: Literal["uniform", "log_uniform", "normal"] | None = None
    mean: Finite | None = None
    deviation: Positive | None = None
    levels: Annotated[int, Field(strict=True, ge=2, le=MOST_VALUES)] | None = None

    @model_validator(mode="after")
    def one_way(self) -> "ParameterBlock":
        """Values, or a distribution with what it needs and nothing else."""
        if self.values is not None:
            if self.range or self.distribution or self.levels or self.mean is not None or self.deviation:
                raise ValueError("values stand alone; drop range, distribution, mean, deviation and levels")
        elif self.distribution == "normal":
            if self.mean is None or self.deviation is None:
                raise ValueError("a normal distribution must have mean and deviation")
        elif self.range is None:
            raise ValueError("a parameter must have a range or values")
        elif self.mean is not None or self.deviation is not None:
            raise ValueError('mean and deviation belong to distribution = "normal"')
        return self

    def parameter(self) -> Parameter:
        """The record."""
        if self.values is not None:
            return Parameter(name=self.name, distribution="values", values=self.values)
        if self.distribution == "normal":
            assert self.mean is not None
            assert self.deviation is not None
            far = FAR * self.deviation
            low, high = self.range or (self.mean - far, self.mean + far)
            return Parameter(
                name=self.name, distribution="normal", low=low, high=high, mean=self.mean, deviation=self.deviation,
                levels=self.levels or 0,
            )  # fmt: skip
        assert self.range is not None
        return Parameter(
            name=self.name, distribution=self.distribution or "uniform", low=self.range[0], high=self.range[1],
            levels=self.levels or 0,
        )  # fmt: skip


class LimitBlock(_Table):
    quantity: Name
    at_most: Finite | None = None
    at_least: Finite | None = None

    @model_validator(mode="after")
    def one_side(self) -> "LimitBlock":
        """Exactly one of the two."""
        if (self.at_most is None) == (self.at_least is None):
            raise ValueError("a limit must have either at_most or at_least")
        return self

    def limit(self) -> Limit:
        """The record."""
        if self.at_most is not None:
            return Limit(quantity=self.quantity, sense="<=", value=self.at_most)
        assert self.at_least is not None
        return Limit(quantity=self.quantity, sense=">=", value=self.at_least)


class ParetoBlock(_Table):
    requirement: Name  # as in a problem's [requirements], with its unit; of a plant of one's own the name of a goal
    limits: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=1000)]

    def sweep(self, *, own: bool) -> Sweep:
        """The record, in SI units; own : of a plant of one's own, in the unit of its goal."""
        if own:
            return Sweep(requirement=self.requirement, limits=self.limits)
        if self.requirement not in limit_keys():
            raise unknown_name("requirement", self.requirement, limit_keys())
        each = [requirement_of(self.requirement, limit) for limit in self.limits]
        return Sweep(requirement=each[0].name, limits=tuple(r.limit for r in each), sense=each[0].sense)


class StudyFile(_Table):
    """A whole STUDY.toml."""

    study: StudyBlock
    parameter: Annotated[tuple[ParameterBlock, ...], Field(max_length=MOST_PARAMETERS)] = ()
    limit: Annotated[tuple[LimitBlock, ...], Field(max_length=200)] = ()
    pareto: Annotated[tuple[ParetoBlock, ...], Field(max_length=20)] = ()


def read_study(path: Path) -> Study:
    """The study in a TOML file; problem and gains are looked for beside it.

    Raises
    ------
    InputError
        If the file cannot be read, a key is unknown or a value unusable; one sentence names it.
    """
    mapping = read_mapping(path)
    try:
        file = StudyFile.model_validate(mapping)
    except ValidationError as error:
        raise InputError(sentence(error, str(path), StudyFile)) from error
    except RecursionError as error:
        raise InputError(f"{path} must not be nested deeply; keep to the tables of a study.") from error
    s = file.study
    table = None if s.gains is None else _beside(path, s.gains)
    problem = s.problem if s.problem in shipped_problems() else str(_beside(path, s.problem))
    if not Path(problem).exists():
        problem = s.problem  # whoever loads it refuses it by the name that was given
    gains, schedule = (None, None) if table is None else _given(table, problem)
    try:
        return Study(
            problem=problem, task=s.task, sampling=s.sampling, count=s.count, seed=s.seed, gains=gains,
            schedule=schedule,
            parameters=tuple(p.parameter() for p in file.parameter), quantities=s.quantities,
            limits=tuple(x.limit() for x in file.limit), sweeps=tuple(x.sweep(own=_own(problem)) for x in file.pareto),
            starts=s.starts, output=s.output, confidence=s.confidence,
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _given(table: Path, problem: str) -> tuple[dict[str, float], Schedule | None]:
    """The gains in a file and their schedule; of a plant of one's own, values of its parameters."""
    if _own(problem):
        return named_values(table), None
    return read_gains(table).as_dict(), read_schedule(table)


def _own(problem: str) -> bool:
    """Whether a name or folder is a plant of one's own; of a problem that is not there nothing is known."""
    data = shipped_problems().get(problem, Path(problem)) / "data.toml"
    return data.is_file() and is_own(read_mapping(data))


def _beside(path: Path, name: str) -> Path:
    """A path as seen from the folder of the study."""
    return path.parent / name
