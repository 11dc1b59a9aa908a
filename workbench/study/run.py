"""Runs a study: what is not finished is computed and kept; then the table and what it says.

Study --identity--> folder, refused if it holds another study --missing rows--> executor --> pieces, kept at once
      --all rows--> StudyResult --> table, summary
"""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from workbench.control import Gains
from workbench.errors import InputError, unknown_name
from workbench.machine.budget import Deadline
from workbench.machine.threads import one_thread
from workbench.machine.writing import check_file, write_text
from workbench.result import Result, Row, plain
from workbench.study.cluster import cluster
from workbench.study.definition import Limit, Study
from workbench.study.executor import local, serial
from workbench.study.folder import hashes, workbench_sha256
from workbench.study.given import Given
from workbench.study.pareto import Wanted, flown_rows, limits_by_row, nondominated, objectives, plan, swept, wanted_of
from workbench.study.plant import PlantStudy, PlantTask
from workbench.study.quantity import document_of, limited, limits_of, required, usual, value_at
from workbench.study.sampling import sample
from workbench.study.sensitivity import Index, indices
from workbench.study.source import Source
from workbench.study.store import Piece, missing, opened
from workbench.study.summary import Failing, Spread, failing, spread_of
from workbench.study.table import write_study
from workbench.study.task import Task

PIECE = {"batch": 512, "analyse": 8, "design": 1}  # rows kept at a time: a sixth of a second, and one design
WORTH_IT = 20_000  # rows of batches below which other processes cost more than they bring
PACKAGES = ("maglev-workbench", "casadi", "numpy", "scipy")
# Bytes that one value of one row takes at the end, with the copies that table and indices are made from: measured 173
# over 200 000 rows, CSV or Parquet.
PER_VALUE = 200
MOST_BYTES = 4_000_000_000


@dataclass(frozen=True, kw_only=True, repr=False)
class StudyResult(Result):
    """A finished study.

    columns : name to values of every row: "row", parameters, quantities, "error" (and "nondominated" of a Pareto study)
    provenance : hashes, versions, seed, times;  limits : what counts as failing;  failed : (rows,) which fail
    table : the file with all rows;  front : what a Pareto study is drawn over
    """

    study: Study
    columns: dict[str, list[Any]]
    provenance: dict[str, Any]
    limits: tuple[Limit, ...]
    failing: Failing
    failed: np.ndarray
    spreads: tuple[Spread, ...]
    indices: tuple[Index, ...]
    table: Path
    front: Wanted

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of the recorded quantities."""
        return tuple(self.provenance["quantities"])

    def numbers(self, name: str) -> np.ndarray:
        """A column as floats (rows,), NaN where there is none."""
        if name not in self.columns:
            raise unknown_name("column", name, self.columns)
        return np.array([np.nan if v is None else float(v) for v in self.columns[name]], float)

    def to_dict(self) -> dict[str, Any]:
        """Everything but the rows, which are in the table."""
        return {
            "provenance": plain(self.provenance), "failing": plain(self.failing),
            "limits": [str(limit) for limit in self.limits],
            "quantities": plain(self.spreads), "indices": plain(self.indices), "table": str(self.table),
        }  # fmt: skip

    def to_frame(self):
        """All rows as a pandas.DataFrame."""
        import pandas as pd

        return pd.DataFrame(self.columns)

    def rows(self) -> list[Row]:
        return [
            *self.study.rows(),
            ("failing share", self.failing.share, "1"),
            *((f"median of {s.quantity}", s.quantiles[3] if s.quantiles else None, "") for s in self.spreads),
        ]


def study(
    given: Study | Path | str,
    folder: Path | str | None = None,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    fresh: bool = False,
    trust: bool = False,
    on_rows: Callable[[int, int], None] | None = None,
    deadline: Deadline | None = None,
) -> StudyResult:
    """A study, or the one that a file describes, run or resumed in a folder; results/<name> if left out.

    The rest as of `run_study`.
    """
    if isinstance(given, Study):
        asked, stem = given, given.name
    else:
        from workbench.study.file import read_study

        asked, stem = read_study(Path(given)), Path(given).stem
    place = Path("results") / stem if folder is None else Path(folder)
    return run_study(
        asked, place, workers=workers, scheduler=scheduler, fresh=fresh, trust=trust, on_rows=on_rows, deadline=deadline
    )


def run_study(
    study: Study,
    folder: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    fresh: bool = False,
    trust: bool = False,
    size: int | None = None,
    on_rows: Callable[[int, int], None] | None = None,
    deadline: Deadline | None = None,
) -> StudyResult:
    """Computes what is missing of a study in its folder, and sums it up.

    Parameters
    ----------
    workers : processes of this machine; 1 computes in this one. More need the usual `if __name__ == "__main__"`.
    scheduler : address of a Dask scheduler to use instead
    fresh : throw away what the folder holds of another study, or of this one
    trust : run the problem.py of a folder that does not ship with the workbench
    size : rows kept at a time; the rows do not depend on it, nor on who computes them
    on_rows : called with (rows finished, rows in all) at the start and after every piece
    deadline : after which no piece is waited for

    Raises
    ------
    InputError
        If the study does not fit its problem, the folder holds another study or damaged rows, or the cluster fails.

    BudgetEnded
        If the deadline comes before the last row.

    An interrupt, or a kill, loses what was under way and nothing else: the same call goes on from there.
    """
    with one_thread():  # small matrices, and sums that do not depend on the number of processors
        return _run(study, folder, workers, scheduler, fresh, trust, size, on_rows, deadline)


def _run(
    study: Study, folder: Path, workers: int, scheduler, fresh: bool, trust: bool, size, on_rows, deadline
) -> StudyResult:  # fmt: skip
    begun = perf_counter()
    source = Source.of(study.problem, trust=trust)
    problem = source.problem()
    plant = None if problem.flies else PlantStudy(study, source, problem)
    if plant is not None:
        plant = plant.with_senses()
        study = plant.study
    if plant is None:
        quantities, limits, gains, more = _vehicle(study, source, problem)
    else:
        plant.check()
        quantities, gains = plant.quantities(), plant.values()
        limits, more = _limits(study, plant.limits(), quantities), {"gains": gains, "schedule": None}
        plant.check_quantities(quantities)
    _check_memory(study, quantities)
    identity = {
        "definition": plain(study.definition()), "problem": source.name, "data_sha256": source.sha256,
        "problem_files": hashes(source.files), **more, "quantities": list(quantities),
        "versions": {name: version(name) for name in PACKAGES}, "workbench_sha256": workbench_sha256(),
    }  # fmt: skip
    table = folder / ("table.csv" if study.output == "csv" else "table.parquet")
    with opened(folder, identity, fresh=fresh) as store:
        for path in (table, folder / "summary.json"):
            check_file(path)
        pieces = list(store.pieces(len(quantities) + 1))
        total, created = study.rows_planned, datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        finished = sum(len(p.values) for p in pieces)
        if on_rows:
            on_rows(finished, total)
        samples = np.zeros((total, 0))
        if study.task == "pareto":
            missing(total, [(p.first, p.first + len(p.values)) for p in pieces], 1, 1)
            kept = {p.first + k for p in pieces for k in range(len(p.values))}
            flown = partial(flown_rows, study, problem, gains, quantities)
            work = swept(study, flown if plant is None else partial(plant.rows_of, quantities), kept)
        else:
            samples = sample(study)
            make = partial(Task.of, study, source) if plant is None else plant.task
            work = _work(study, make, quantities, samples, pieces, size, workers, scheduler)
        for piece in work:
            store.add(piece)
            pieces.append(piece)
            finished += len(piece.values)
            if on_rows:
                on_rows(finished, total)
            if deadline is not None:
                deadline.check("the study, whose finished rows are kept")
        rows = [row for p in sorted(pieces, key=lambda p: p.first) for row in p.values]
        provenance = {
            "format": "maglev-workbench study table", "study_sha256": store.sha256, **identity,
            "seed": study.seed, "rows": total, "finished": created, "wall_seconds_of_last_run": perf_counter() - begun,
            "compute_seconds": sum(p.seconds for p in pieces),
        }  # fmt: skip
        of = partial(limited, problem) if plant is None else plant.limited
        held = limits_by_row(study, limits, of) if study.task == "pareto" else dict.fromkeys(limits)
        front = wanted_of(name for name, _ in plan(study)) if plant is None else plant.wanted()
        result = _summed_up(study, samples, rows, quantities, held, provenance, table, front)
        write_study(result.table, result.columns, provenance)
        write_text(folder / "summary.json", json.dumps(result.to_dict(), indent=1, ensure_ascii=False) + "\n")
    return result


def _vehicle(study: Study, source: Source, problem):
    """Quantities, limits, gains and their identity of a study of a vehicle."""
    for p in study.parameters:
        if p.kind == "data":
            source.check(p.name)
    quantities = study.quantities or usual(problem, study.task)
    if study.task == "pareto":
        more = [*usual(problem, "design"), *(q for name, _ in plan(study) for q in limited(problem, name))]
        quantities = tuple(dict.fromkeys([*quantities, *more]))
    if not study.limits:
        quantities = (*quantities, *(q for q in required(problem) if q not in quantities))
    given = Given.of(study, source, problem)
    gains = None if given.gains is None else dict(given.at(problem.setting.speed))
    if study.task == "analyse" and gains is None:
        raise InputError(f'problem {source.name!r} has no approved gains; name some in the study with gains = "FILE".')
    _check_quantities(problem, gains, quantities)
    return quantities, _limits(study, limits_of(problem), quantities), gains, given.identity()


def _work(study: Study, make: Callable[..., Task | PlantTask], quantities, samples, pieces: list[Piece], size,
          workers: int, scheduler):  # fmt: skip
    """The pieces that are missing, from whoever computes them."""
    held = [(p.first, p.first + len(p.values)) for p in pieces]
    if not missing(len(samples), held, 1, 1):
        return iter(())
    task = make(quantities, samples)
    wanted = size or PIECE["batch" if task.batched else study.task]
    ranges = missing(len(samples), held, math.ceil(wanted / task.block) * task.block, task.block)
    if scheduler is not None:
        return cluster(task, ranges, scheduler)
    rows = sum(last - first for first, last in ranges)
    workers = 1 if task.batched and rows < WORTH_IT else min(workers, len(ranges))
    return serial(task, ranges) if workers <= 1 else local(task, ranges, workers)


def _summed_up(study: Study, samples, rows, quantities, held, provenance, table: Path, front: Wanted) -> StudyResult:
    columns: dict[str, list[Any]] = {"row": list(range(len(rows)))}
    if study.task == "pareto":
        columns["requirement"], columns["limit"] = (list(part) for part in zip(*plan(study), strict=True))
    columns |= dict(zip(study.names, samples.T.tolist(), strict=True))
    columns |= {name: [row[k] for row in rows] for k, name in enumerate(quantities)}
    columns["error"] = [row[-1] for row in rows]
    if study.task == "pareto":
        columns["nondominated"] = nondominated(objectives(columns, front)[1]).tolist()
    numbers = {q: np.array([np.nan if v is None else float(v) for v in columns[q]], float) for q in quantities}
    random = study.sampling in ("latin_hypercube", "monte_carlo") and study.task != "pareto"
    found, failed = failing(columns, columns["error"], held, random=random, confidence=study.confidence)
    known: tuple[Index, ...] = ()
    if study.task != "pareto":
        known = indices(
            study.sampling, study.count, samples, numbers, study.names, confidence=study.confidence
        )  # fmt: skip
    return StudyResult(
        study=study, columns=columns, provenance=provenance, limits=tuple(held), failing=found, failed=failed,
        spreads=tuple(spread_of(q, numbers[q]) for q in quantities), indices=known,
        table=table, front=front,
    )  # fmt: skip


def _check_memory(study: Study, quantities) -> None:
    """Refuses a table that would not fit, before hours of work."""
    width = len(study.names) + len(quantities)
    most = MOST_BYTES // (PER_VALUE * width)
    if study.rows_planned > most:
        raise InputError(
            f"a study of {width} parameters and quantities must have at most {most} rows, {MOST_BYTES / 1e9:g} GB of "
            f"memory; this one asks for {study.rows_planned}. Sample fewer, or record fewer quantities."
        )


def _check_quantities(problem, gains, quantities) -> None:
    """Refuses quantities that no row could have, by one analysis: of the gains to vary, or of some within bounds."""
    some = gains or {**problem.fixed, **{name: (low + high) / 2 for name, (low, high) in problem.bounds.items()}}
    document = document_of(problem, Gains.from_mapping(some), quantities)
    for name in quantities:
        value_at(document, name)


def _limits(study: Study, required: tuple[Limit, ...], quantities) -> tuple[Limit, ...]:
    """The study's limits, or all that the problem requires."""
    for limit in study.limits:
        if limit.quantity not in quantities:
            raise InputError(
                f"a limit needs a recorded quantity; {limit.quantity!r} is not one of {', '.join(quantities[:20])}. "
                "Add it to quantities."
            )
    return study.limits or required
