"""Rows from the workers of a Dask cluster, and one sentence when the cluster goes.

    Task, ranges --scheduler, workers of the same code--> (first row, rows, seconds) in the order they are finished

A scheduler that is not there, has no workers, loses them or ends is found within `PATIENCE`; what came before is kept.
"""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from time import monotonic

from workbench.errors import InputError
from workbench.study.executor import AHEAD, Ranges, computed
from workbench.study.folder import workbench_sha256
from workbench.study.store import Piece
from workbench.study.task import Task

ANSWER = 10  # [s] for a scheduler to answer
PATIENCE = 12  # [s] for a first worker, and without any
LOOK = 2.0  # [s] between looks at the workers while no rows arrive
RESUME = "Finished rows are kept: the same command goes on from there, with --scheduler of one that runs, or without."


def cluster(task: Task, ranges: Ranges, address: str) -> Iterator[Piece]:
    """On the workers of a Dask scheduler, which must have this package installed, in the same version."""
    try:
        import distributed  # noqa: F401
    except ImportError as error:
        raise InputError(
            "a cluster needs the package distributed; install maglev-workbench[cluster], or leave out --scheduler."
        ) from error
    with _connected(address) as client, _told(address):
        _wait_for_workers(client, address)
        shared = client.scatter(task, broadcast=True)
        ours, todo, under_way = workbench_sha256(), iter(ranges), 0
        finished: SimpleQueue = SimpleQueue()
        seen = monotonic()
        while True:
            room = AHEAD * max(1, sum(client.nthreads().values()))
            while under_way < room and (one := next(todo, None)) is not None:
                client.submit(_rows, shared, ours, *one, pure=False).add_done_callback(finished.put)
                under_way += 1
            if not under_way:
                return
            try:
                done = finished.get(timeout=LOOK)
            except Empty:
                seen = monotonic() if client.nthreads() else seen
                if client.status != "running" or monotonic() - seen > PATIENCE:
                    raise _lost(address, "its last worker is gone") from None
            else:
                seen, under_way = monotonic(), under_way - 1
                yield done.result()


@contextmanager
def _connected(address: str):
    """A client of the scheduler, closed without waiting for one that is gone; the library's own complaints unheard."""
    from distributed import Client

    heard = [log for log in _loggers() if not log.disabled]
    for log in heard:
        log.disabled = True
    try:
        try:
            client = Client(address, timeout=ANSWER, set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            reason = " ".join(str(error).split())[:200]
            raise InputError(
                f"a Dask scheduler must answer at {address[:100]!r}; {reason or type(error).__name__}. "
                "Start one with 'dask scheduler', or leave out --scheduler."
            ) from error
        try:
            yield client
        finally:
            with suppress(Exception):  # whatever a client of a dead scheduler says when it is closed
                client.close(timeout=2)
    finally:
        for log in heard:
            log.disabled = False


def _loggers() -> list[logging.Logger]:
    known = logging.root.manager.loggerDict.items()
    return [log for name, log in known if name.startswith("distributed") and isinstance(log, logging.Logger)]


@contextmanager
def _told(address: str) -> Iterator[None]:
    """What the library raises when scheduler or workers end, as one sentence; our own errors as they are."""
    from asyncio import CancelledError
    from concurrent.futures import CancelledError as Cancelled

    from distributed.client import FutureCancelledError
    from distributed.comm.core import CommClosedError
    from distributed.scheduler import KilledWorker

    try:
        yield
    except KilledWorker as error:
        raise _lost(address, "the same rows ended several workers") from error
    except (CommClosedError, FutureCancelledError, CancelledError, Cancelled, TimeoutError, OSError) as error:
        raise _lost(address, "the connection to it was lost") from error
    except RuntimeError as error:  # "Client lost the connection", "not running": there is no class for these
        if isinstance(error, RecursionError) or "lient" not in str(error):
            raise
        raise _lost(address, "the connection to it was lost") from error


def _lost(address: str, what: str) -> InputError:
    return InputError(f"the Dask scheduler at {address[:100]!r} must last as long as the study; {what}. {RESUME}")


def _wait_for_workers(client, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError as error:
        raise InputError(
            f"the Dask scheduler at {address[:100]!r} must have workers; it has none after {PATIENCE} s. "
            "Start some with 'dask worker', or leave out --scheduler."
        ) from error


_one_at_a_time = threading.Lock()  # a worker may have threads; compiled functions have memory of their own


def _rows(task: Task, code: str, first: int, last: int) -> Piece:
    if workbench_sha256() != code:
        raise InputError(
            "every worker must have the workbench of whoever runs the study; one has other code. "
            "Install the same version."
        )
    with _one_at_a_time:
        return computed(task, first, last)
