"""Processes that share a piece of work: begun alike, never left behind.

    with pool(workers, prepare, argument) as executor:      a worker runs prepare(argument) once, then what is submitted
        executor.submit(…)

Every worker holds the reading end of a pipe that only its parent can write to. It closes when the parent ends, however
that happens, and when the block ends by an exception (an interrupt, a budget that is over): the workers end at once.
"""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager, suppress
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection, wait

from workbench.machine.threads import keep_one_thread


@contextmanager
def pool(workers: int, prepare: Callable[..., None] | None = None, *arguments) -> Iterator[ProcessPoolExecutor]:
    """An executor on spawned processes; a script that uses it needs the usual `if __name__ == "__main__"`."""
    lifeline, held = Pipe(duplex=False)
    executor = ProcessPoolExecutor(
        workers, get_context("spawn"), initializer=_begin, initargs=(lifeline, prepare, arguments)
    )
    try:
        _start(executor)
        yield executor
    except BaseException:
        held.close()
        for process in list((executor._processes or {}).values()):  # one that has only begun watches no pipe yet
            process.kill()
        raise
    finally:
        executor.shutdown(wait=True, cancel_futures=True)
        held.close()
        lifeline.close()


def _start(executor: ProcessPoolExecutor) -> None:
    """Begins the workers deaf to Ctrl-C, which reaches them too: until `_begin` nothing in them could answer it."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        executor.submit(os.getpid)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(lifeline: Connection, prepare: Callable[..., None] | None, arguments: tuple) -> None:
    """What every worker does first."""
    with suppress(ValueError):  # a thread of some other executor takes no signals
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is interrupted, and ends its workers
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()
    keep_one_thread()
    if prepare is not None:
        prepare(*arguments)


def _end_with(lifeline: Connection) -> None:
    """Ends this process when the other end of the pipe is closed."""
    wait([lifeline])
    os._exit(1)
