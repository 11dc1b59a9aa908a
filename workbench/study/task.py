"""The work of a study, in pieces that any process can do: rows from first to last, the same wherever they are computed.

    Task (texts and numbers, pickled) --rows(first, last)--> one list of values per row, and why a row has none

Rows are computed in blocks that start at multiples of `BLOCK`, whatever is asked for at a time; so no rounding depends
on how the work is cut.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import numpy as np

from workbench.analysis.batch.plants import Family, fit
from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES, LATERAL, TIME_CONSTANTS, VERTICAL
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.machine.threads import one_thread
from workbench.physics.vehicle import varied
from workbench.study.batch import Batch, quantity_names, suits
from workbench.study.definition import VEHICLE_FACTORS, Study
from workbench.study.designs import designed, with_factors
from workbench.study.given import Given
from workbench.study.quantity import Values, document_of, number, row_of
from workbench.study.source import Source

BLOCK = 128  # rows of a batch; larger ones leave the processor's cache
FEW = 8  # rows with the same data below which a batch is not worth its preparation


@dataclass
class Task:
    """What a study computes and from what.

    samples : (rows, parameters);  given : the gains at the middle of the study
    family : plants as functions of the factors, where the study varies them in batches
    """

    study: Study
    source: Source
    quantities: tuple[str, ...]
    given: Given
    samples: np.ndarray
    batched: bool
    family: Family | None = None
    _batches: dict[Any, Batch] = field(default_factory=dict, init=False, repr=False, compare=False)

    @classmethod
    def of(cls, study: Study, source: Source, quantities: Sequence[str], samples: np.ndarray) -> "Task":
        """The task of a study; decides, from the study alone, whether rows are computed in batches."""
        problem = source.problem()
        kinds = {p.kind for p in study.parameters}
        batched = (
            study.task == "analyse" and "speed" not in kinds and not kinds >= {"factor", "data"}
            and suits(problem.setting) and set(quantities) <= set(quantity_names(problem.setting))
        )  # fmt: skip
        task = cls(study, source, tuple(quantities), Given.of(study, source, problem), samples, batched)
        if batched and "factor" in kinds:
            names = [VEHICLE_FACTORS[p.name] for p in study.parameters if p.kind == "factor"]
            task.family = _family(problem, quantities, names)
            task.batched = task.family is not None
        return task

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "_batches": {}}

    @property
    def block(self) -> int:
        """Rows that are computed together."""
        return BLOCK if self.batched else 1

    def rows(self, first: int, last: int) -> list[Values]:
        """Rows first … last − 1; both at multiples of `block`, or the end."""
        out: list[Values] = []
        with one_thread():
            for start in range(first, last, self.block):
                part = range(start, min(start + self.block, last))
                out += self._in_batch(part) if self.batched else [self._alone(row) for row in part]
        return out

    # ---- one row

    def _alone(self, row: int) -> Values:
        return row_of(lambda: self._document(row), self.quantities)

    def _document(self, row: int) -> dict[str, Any]:
        problem = self.problem(row)
        if self.study.task == "design":
            fixed = {p.name: v for p, v in self._pairs(row) if p.kind == "gain"}
            start = None if self.study.starts else self._gains(row, problem.setting.speed)
            found = designed(problem.with_fixed(fixed), self.study, start, one_speed=self._speed(row) is not None)
            return document_of(problem, found.design.gains, self.quantities, found.whole.to_dict())
        return document_of(problem, self._gains(row, problem.setting.speed), self.quantities)

    def problem(self, row: int) -> Problem:
        """The problem of one row."""
        problem = self.source.problem({p.name: v for p, v in self._pairs(row) if p.kind == "data"}, self._speed(row))
        return with_factors(problem, {VEHICLE_FACTORS[p.name]: v for p, v in self._pairs(row) if p.kind == "factor"})

    def _speed(self, row: int) -> float | None:
        return next((v for p, v in self._pairs(row) if p.kind == "speed"), None)

    def _pairs(self, row: int):
        return zip(self.study.parameters, map(float, self.samples[row]), strict=True)

    def _gains(self, row: int, speed: float) -> Gains:
        values = self._gain_rows(range(row, row + 1), speed)[0].tolist()
        return Gains.from_mapping(dict(zip(GAIN_NAMES, values, strict=True)))

    def _gain_rows(self, rows: range, speed: float) -> np.ndarray:
        """Gains (rows, 17) at a speed: given or approved ones, the study's in their place, scaled with the sensors."""
        base = self.given.at(speed)
        out = np.tile(np.array([base[name] for name in GAIN_NAMES], float), (len(rows), 1))
        values = self.samples[rows.start : rows.stop]
        for k, p in enumerate(self.study.parameters):
            if p.kind == "gain":
                out[:, GAIN_NAMES.index(p.name)] = values[:, k]
        # sensors that read too much are filter gains that are too large
        for k, p in enumerate(self.study.parameters):
            if p.kind == "sensor":
                scaled = {"vertical": VERTICAL, "lateral": LATERAL}.get(p.name.partition(".")[2], VERTICAL + LATERAL)
                out[:, [GAIN_NAMES.index(name) for name in scaled]] *= values[:, k, None]
        return out

    # ---- many rows

    def _in_batch(self, rows: range) -> list[Values]:
        data = [k for k, p in enumerate(self.study.parameters) if p.kind == "data"]
        out: dict[int, Values] = {}
        for key, group in groupby(
            sorted(rows, key=lambda r: (*self.samples[r, data], r)), lambda r: tuple(self.samples[r, data])
        ):
            own = list(group)
            if data and len(own) < FEW:
                out.update((row, self._alone(row)) for row in own)
            else:
                out.update(self._batch_rows(key, own, rows))
        return [out[row] for row in rows]

    def _batch_rows(self, key: tuple[float, ...], own: list[int], rows: range) -> Iterator[tuple[int, Values]]:
        try:
            batch = self._batch(key, own[0])
        except InputError:
            yield from ((row, self._alone(row)) for row in own)
            return
        gains = self._gain_rows(rows, batch.setting.speed)[[row - rows.start for row in own]]
        usable = np.all(np.abs(gains) <= 1e6, axis=1) & np.all(gains[:, _TAUS] >= 0, axis=1)
        readings = None
        if self.family is not None:
            factors = self.samples[np.ix_(own, [k for k, p in enumerate(self.study.parameters) if p.kind == "factor"])]
            usable &= (factors > 0).all(axis=1)
            readings = self.family(np.where(factors > 0, factors, 1.0))
        found = batch.evaluate(np.where(usable[:, None], gains, 1.0), readings)
        columns = [found.columns[q].tolist() for q in self.quantities]
        for k, row in enumerate(own):
            if not (usable[k] and found.sound[k]):
                yield row, self._alone(row)
            else:
                values = (
                    bool(c[k]) if q == "stable" else number(c[k]) for q, c in zip(self.quantities, columns, strict=True)
                )
                yield row, [*values, ""]

    def _batch(self, key: tuple[float, ...], row: int) -> Batch:
        if key not in self._batches:
            self._batches.clear()
            setting = self.problem(row).setting if key else self.source.problem().setting
            if not suits(setting):
                raise InputError("this setting does not suit a batch.")
            self._batches[key] = Batch(setting, self.quantities)
        return self._batches[key]


_TAUS = [GAIN_NAMES.index(name) for name in TIME_CONSTANTS]


def _family(problem: Problem, quantities: Sequence[str], names: Sequence[str]) -> Family | None:
    batch = Batch(problem.setting, quantities)

    def make(factors: dict[str, float]):
        return batch.read(problem.with_vehicle(varied(problem.vehicle, **factors)).setting)

    return fit(names, make)
