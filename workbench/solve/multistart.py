"""Several starts of one search, in turn or on processes of this machine: their ends as they come.

shared --prepare--> run        once here, or once in each process
jobs ----run------> (number, end), in the order in which they end
"""

import math
from collections.abc import Callable, Iterator, Sequence
from numbers import Integral
from typing import TypeVar

from workbench.errors import InputError
from workbench.machine.budget import Deadline, current, keeping

Shared = TypeVar("Shared")
Job = TypeVar("Job")
End = TypeVar("End")


def ends(
    jobs: Sequence[Job], prepare: Callable[[Shared], Callable[[Job], End]], shared: Shared, *, workers: int = 1,
    until: Callable[[], Deadline] = current, work: str = "a search", here: Callable[[Job], End] | None = None,
) -> Iterator[tuple[int, End]]:  # fmt: skip
    """Numbers of the jobs and what came of them. Whoever stops asking ends the processes.

    Parameters
    ----------
    prepare, shared : a function of a module, and what it makes the run of a job from; both travel to the processes
    workers : processes; a script that asks for more than one needs the usual `if __name__ == "__main__"`
    until : by when the next end must have come, asked anew for each; BudgetEnded is raised after that, naming `work`
    here : the run itself, where nothing has to be prepared for it in this process
    """
    check_workers(workers)
    if workers > 1 and len(jobs) > 1:
        yield from _side_by_side(jobs, prepare, shared, min(workers, len(jobs)), until, work)
        return
    run = prepare(shared) if here is None else here
    for number, job in enumerate(jobs):
        with keeping(until()):
            end = run(job)
        yield number, end


def check_workers(workers: int) -> None:
    """Refuses a number of processes that is none."""
    if isinstance(workers, bool) or not isinstance(workers, Integral) or workers < 1:
        raise InputError(f"workers must be a whole number of processes from 1 on; got {workers!r}. Give 1.")


def _side_by_side(jobs, prepare, shared, workers: int, until, work: str) -> Iterator[tuple]:
    from concurrent.futures import FIRST_COMPLETED, wait

    from workbench.machine.workers import pool

    with pool(workers, _prepare, prepare, shared) as executor:
        waiting = {executor.submit(_run, job): number for number, job in enumerate(jobs)}
        while waiting:
            left = until().remaining
            done, _ = wait(waiting, None if math.isinf(left) else left, FIRST_COMPLETED)
            if not done:
                until().check(work)
            for future in sorted(done, key=waiting.__getitem__):
                yield waiting.pop(future), future.result()


_prepared: list[Callable] = []  # of a process; one at most


def _prepare(prepare: Callable[[Shared], Callable], shared: Shared) -> None:
    _prepared[:] = [prepare(shared)]


def _run(job: object):
    return _prepared[0](job)
