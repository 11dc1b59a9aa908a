"""Tuning problems from folders: a data.toml with `kind = "tuning"`, checked, and problem.py called.

<folder>/data.toml --schema--> TuningData --problem.py--> convex.pid_problem.PidProblem

Time is in minutes in the data (process industry) and in the record too: rates and frequencies are per minute.
"""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from workbench.convex.delayed import AffineLaw, DelayedPlant, Rational
from workbench.convex.pid_problem import PidProblem
from workbench.errors import InputError
from workbench.files.problem_code import maker
from workbench.machine.reading import read_mapping, shown

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Block(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)
    source: str = Field(min_length=1)


class HeadBlock(_Block):
    """[problem]"""

    kind: Literal["tuning"]
    title: str = Field(min_length=1)


class PlantBlock(_Block):
    """[plant]: first-order lags with dead times, row by row."""

    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    gain: tuple[tuple[Finite, ...], ...]
    time_constant_min: tuple[tuple[Positive, ...], ...]
    dead_time_min: tuple[tuple[NotNegative, ...], ...]

    def plant(self) -> DelayedPlant:
        """The matrix of transfer functions."""
        shape = len(self.outputs), len(self.inputs)
        for name in ("gain", "time_constant_min", "dead_time_min"):
            rows = getattr(self, name)
            if len(rows) != shape[0] or {len(row) for row in rows} != {shape[1]}:
                raise InputError(
                    f"plant.{name} must have {shape[0]} rows of {shape[1]} numbers, one per output and input; "
                    f"got rows of {[len(row) for row in rows]}."
                )
        return DelayedPlant(
            entries=tuple(
                tuple(
                    Rational(numerator=(k,), denominator=(lag, 1.0), delay=dead)
                    for k, lag, dead in zip(*row, strict=True)
                )
                for row in zip(self.gain, self.time_constant_min, self.dead_time_min, strict=True)
            )
        )


class ControllerBlock(_Block):
    """[controller]: which places have a PID controller, and the filter of its derivative."""

    kind: Literal["pid"]
    filter_time_min: Positive
    structure: tuple[tuple[Literal[0, 1], ...], ...]


class LimitsBlock(_Block):
    """[limits] of the largest singular values of S, T and Q."""

    peak_sensitivity_at_most: Positive | None = None
    peak_complementary_sensitivity_at_most: Positive | None = None
    peak_control_sensitivity_at_most: Positive | None = None
    peak_control_sensitivity_times_smallest_static_gain_at_most: Positive | None = None


class TuningFile(BaseModel):
    """A data.toml with `kind = "tuning"`."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    problem: HeadBlock
    plant: PlantBlock
    controller: ControllerBlock
    limits: LimitsBlock


class TuningData:
    """What problem.py gets: the checked file, and `build()` that turns it into a PidProblem."""

    def __init__(self, file: TuningFile, name: str) -> None:
        self.file, self.name = file, name

    def build(self) -> PidProblem:
        """The problem as the data describe it."""
        f = self.file
        plant = f.plant.plant()
        p, m = plant.shape
        structure = f.controller.structure
        if len(structure) != m or {len(row) for row in structure} != {p}:
            raise InputError(
                f"controller.structure must have {m} rows of {p}, one per plant input and output; "
                f"got {[len(row) for row in structure]}."
            )
        law = AffineLaw.pid(m, p, filter_time=f.controller.filter_time_min, mask=structure)
        blocks = {"problem": f.problem, "plant": f.plant, "controller": f.controller, "limits": f.limits}
        return PidProblem(
            name=self.name, title=f.problem.title, plant=plant, law=law, limits=self._limits(plant),
            sources={name: block.source for name, block in blocks.items()},
        )  # fmt: skip

    def _limits(self, plant: DelayedPlant) -> dict[str, float]:
        given = self.file.limits
        scaled = given.peak_control_sensitivity_times_smallest_static_gain_at_most
        if scaled is not None and given.peak_control_sensitivity_at_most is not None:
            raise InputError("limits of Q must be given once: as it is, or times the smallest static gain; got both.")
        control = given.peak_control_sensitivity_at_most
        if scaled is not None:
            control = scaled / float(np.linalg.svd(plant.static_gain(), compute_uv=False)[-1])
        whole = {
            "S": given.peak_sensitivity_at_most, "T": given.peak_complementary_sensitivity_at_most, "Q": control,
        }  # fmt: skip
        return {name: limit for name, limit in whole.items() if limit is not None}


def load_tuning_problem(folder: Path) -> PidProblem:
    """The tuning problem of a folder; raises InputError that names the first key at fault."""
    path = folder / "data.toml"
    try:
        file = TuningFile.model_validate(read_mapping(path))
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        key = ".".join(str(part) for part in first["loc"])
        raise InputError(f"{path}: {key} is not usable: {first['msg']}; got {shown(first.get('input'))}.") from error
    problem = maker(folder, TuningData.build, "PidProblem")(TuningData(file, folder.resolve().name))
    if not isinstance(problem, PidProblem):
        raise InputError(f"{folder / 'problem.py'} must return a PidProblem; got a {type(problem).__name__}.")
    return problem
