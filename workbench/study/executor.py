"""Who computes the rows: this process, some processes of this machine, or a Dask cluster; the rows are the same.

    Task, ranges --serial, local, cluster--> (first row, rows, seconds) in the order they are finished

Only as much is handed out as keeps everybody busy, so that an interrupt waits for little.
"""

import threading
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from itertools import islice
from time import perf_counter

from workbench.errors import InputError
from workbench.study.store import Piece
from workbench.study.task import Task
from workbench.workers import pool

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


def cluster(task: Task, ranges: Ranges, address: str) -> Iterator[Piece]:
    """On the workers of a Dask scheduler, which must have this package installed."""
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        raise InputError(
            "a cluster needs the package distributed; install maglev-workbench[cluster], or leave out --scheduler."
        ) from error
    try:
        client = Client(address, timeout=10, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(
            f"a Dask scheduler must answer at {address[:100]!r}; {reason or type(error).__name__}. "
            "Start one with 'dask scheduler', or leave out --scheduler."
        ) from error
    with client:
        shared = client.scatter(task, broadcast=True)
        count = max(1, sum(client.nthreads().values()))
        todo = iter(ranges)
        first = list(islice(todo, AHEAD * count))
        if not first:
            return
        futures = [client.submit(_cluster_rows, shared, *one, pure=False) for one in first]
        running = as_completed(futures, loop=client.loop)
        for future in running:
            yield future.result()
            if (one := next(todo, None)) is not None:
                running.add(client.submit(_cluster_rows, shared, *one, pure=False))


def computed(task: Task, first: int, last: int) -> Piece:
    """One piece of work."""
    start = perf_counter()
    values = task.rows(first, last)
    return Piece(first, values, perf_counter() - start)


_prepared: list[Task] = []  # of a worker process; one at most
_one_at_a_time = threading.Lock()  # a cluster's worker may have threads; compiled functions have memory of their own


def _begin(task: Task) -> None:
    _prepared[:] = [task]


def _prepared_rows(first: int, last: int) -> Piece:
    return computed(_prepared[0], first, last)


def _cluster_rows(task: Task, first: int, last: int) -> Piece:
    with _one_at_a_time:
        return computed(task, first, last)
