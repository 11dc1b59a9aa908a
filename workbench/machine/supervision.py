"""A command that must end in time: one process works, another one holds the clock.

    supervised(budget) --fork--> the child goes on with the command, and keeps the deadline as well as it can
                          `----> the parent passes signals on, and ends the child where it did not keep it

No work escapes the clock that way, whatever library it hangs in. A child that is late and still runs Python gets
Late first, so that it can clear away what it began. It ends with its parent.
"""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import NoReturn, TypeVar

from workbench.errors import BudgetEnded
from workbench.machine.budget import Deadline

T = TypeVar("T")

GRACE = 0.1, 0.2  # what a command may take beyond its budget: this part of it, and this much at least [s]
RAISED, KILLED = 0.2, 0.5  # of the grace; the rest is for ending a process on a busy machine
PASSED_ON = {signal.SIGINT, signal.SIGTERM}
LONGEST_WAIT = 1e6  # [s] that the system takes

QUIET = "ignore:resource_tracker:UserWarning"  # a killed pool's semaphores are cleared away, and told of
LATE = 124  # exit code of a child that was late; its parent says so and leaves with 1

_permitted = _divided = False


class Late(BudgetEnded):
    """The time is over, and a little more; raised in the middle of whatever is being done."""


def permit() -> None:
    """Says that this process is a command's own, and may be divided."""
    global _permitted
    _permitted = True


def supervised(seconds: float | None, work: str) -> Deadline:
    """The deadline of a command with a budget, counted from the start of the process; never without one.

    The process that returns from here is a child of the one that called; that one ends when its child has ended, with
    its exit code, or with 1 and a sentence when the time is over. In a process that is not a command's own nothing
    watches.

    seconds : the option --budget-seconds;  work : what the command does, for the sentence
    """
    if seconds is None:
        return Deadline.after(None)
    deadline = Deadline.after(seconds, "--budget-seconds")
    if not _permitted:
        return deadline
    deadline = deadline.since(begun())
    signal.pthread_sigmask(signal.SIG_BLOCK, {*PASSED_ON, signal.SIGCHLD})
    lifeline, held = os.pipe()
    child = os.fork()
    if child:
        os.close(lifeline)
        os._exit(_guarded(child, deadline, work))
    global _divided
    _divided = True
    os.environ["PYTHONWARNINGS"] = QUIET
    os.close(held)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()
    _raise_when_late(deadline, work)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, {*PASSED_ON, signal.SIGCHLD})
    return deadline


def leave(code: int) -> NoReturn:
    """Ends the process; a child at once, since all is said and its parent waits."""
    if _divided:
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError):
                stream.flush()
        os._exit(code)
    sys.exit(code)


def finishing() -> None:
    """Says that the answer is there and only has to be written: too late to raise Late."""
    if _divided:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def attempted(extra: Callable[[], T], otherwise: T, deadline: Deadline) -> tuple[T, bool]:
    """What a part of a command gives that it can do without, and whether it ended before its own deadline."""
    if deadline.expired:
        return otherwise, False
    if not _divided:
        return extra(), True
    before = signal.setitimer(signal.ITIMER_REAL, min(max(deadline.remaining, 1e-3), LONGEST_WAIT))[0] + monotonic()
    try:
        return extra(), True
    except BudgetEnded:
        return otherwise, False
    finally:
        signal.setitimer(signal.ITIMER_REAL, max(before - monotonic(), 1e-3))


def begun() -> float:
    """When a command began, on `time.monotonic`, to a hundredth of a second: Python has started since.

    Now, in a process that is not a command's own.
    """
    if not _permitted:
        return monotonic()
    try:
        with open("/proc/self/stat", encoding="utf-8") as file:
            ticks = int(file.read().rpartition(")")[2].split()[19])  # after the boot, field 22 of proc(5)
    except (OSError, ValueError, IndexError):
        return monotonic()
    age = time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")
    return monotonic() - max(age, 0.0)


def _raise_when_late(deadline: Deadline, work: str) -> None:
    def late(*_) -> None:
        raise Late(f"the budget for {work} is over")

    signal.signal(signal.SIGALRM, late)
    wait = deadline.end + RAISED * _grace(deadline) - monotonic()
    signal.setitimer(signal.ITIMER_REAL, min(max(wait, 1e-3), LONGEST_WAIT))


def _grace(deadline: Deadline) -> float:
    part, least = GRACE
    return max(part * deadline.budget, least)


def _too_short(deadline: Deadline, work: str) -> int:
    return _said(
        f"the budget of {deadline.budget:.4g} s must suffice for {work}; it ended before. Nothing half-written is "
        "left. Give more with --budget-seconds.", 1
    )  # fmt: skip


def _guarded(child: int, deadline: Deadline, work: str) -> int:
    """Waits for the child; its exit code, or that of a budget that is over."""
    limit = deadline.end + KILLED * _grace(deadline)
    while True:
        left = min(max(limit - monotonic(), 0.0), LONGEST_WAIT)
        arrived = signal.sigtimedwait({*PASSED_ON, signal.SIGCHLD}, left)
        if arrived is None:
            if monotonic() < limit:
                continue
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return _too_short(deadline, work)
        if arrived.si_signo != signal.SIGCHLD:
            os.kill(child, arrived.si_signo)
            continue
        ended, status = os.waitpid(child, os.WNOHANG)
        if ended:
            code = os.waitstatus_to_exitcode(status)
            if code == LATE:
                return _too_short(deadline, work)
            if code >= 0:
                return code
            name = signal.Signals(-code).name
            return _said(f"internal error: {work} was ended by {name}. Please report it with the files you gave.", 3)


def _said(sentence: str, code: int) -> int:
    print(sentence, file=sys.stderr, flush=True)  # noqa: T201
    return code


def _end_with(lifeline: int) -> None:
    """Ends this process when nobody holds the other end of the pipe any more."""
    os.read(lifeline, 1)
    os._exit(1)
