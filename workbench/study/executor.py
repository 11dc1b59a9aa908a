"""Who computes the rows: this process, or some processes of this machine (`cluster`: others); the rows are the same.

    Task, ranges --serial, local--> (first row, rows, seconds) in the order they are finished

Only as much is handed out as keeps everybody busy, so that an interrupt waits for little.
"""

from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from time import perf_counter

from workbench.machine.workers import pool
from workbench.study.store import Piece
from workbench.study.task import Task

Ranges = Sequence[tuple[int, int]]
AHEAD = 2  # pieces handed out for each worker


def serial(task: Task, ranges: Ranges) -> Iterator[Piece]:
    """In this process."""
    return (computed(task, *one) for one in ranges)


def local(task: Task, ranges: Ranges, workers: int) -> Iterator[Piece]:
    """In processes of this machine."""
    with pool(workers, _begin, task) as executor:
        todo, running = iter(ranges), set()
        while True:
            while len(running) < AHEAD * workers and (one := next(todo, None)) is not None:
                running.add(executor.submit(_prepared_rows, *one))
            if not running:
                return
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()


def computed(task: Task, first: int, last: int) -> Piece:
    """One piece of work."""
    start = perf_counter()
    values = task.rows(first, last)
    return Piece(first, values, perf_counter() - start)


_prepared: list[Task] = []  # of a worker process; one at most


def _begin(task: Task) -> None:
    _prepared[:] = [task]


def _prepared_rows(first: int, last: int) -> Piece:
    return computed(_prepared[0], first, last)
