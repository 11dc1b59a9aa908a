"""Work that must end in time, whatever it is doing: in a process of its own, ended when its time is over.

    guarded(work, seconds, on_message) --fork--> work(say): each message passes a pipe as a line of JSON
      --> True: it ended by itself; False: it was ended, or ended without a word; what it said before stands

Exact arithmetic spends its time inside single calls that no clock interrupts; only the end of its process does. The
process ends with its parent too: it asks a pipe whose other end only the parent holds.
"""

import json
import os
import select
import signal
import sys
import threading
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Any

from workbench.errors import InfeasibleError, InputError

Say = Callable[[dict[str, Any]], None]
REFUSALS = {"InputError": InputError, "InfeasibleError": InfeasibleError}
LARGEST_MEMORY = 4 << 30  # bytes of address space; a box of nine factors takes a quarter of it


def guarded(work: Callable[[Say], None], end: float, on_message: Say) -> bool:
    """Runs work(say) until `end` (time.monotonic); on_message gets what it says.

    Raises what the work refused (InputError, InfeasibleError), and RuntimeError with its traceback for anything else.
    """
    if not hasattr(os, "fork"):  # its loops keep the time themselves
        work(on_message)
        return True
    reading, writing = os.pipe()
    lifeline, held = os.pipe()
    sys.stdout.flush()
    sys.stderr.flush()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads: the child starts none and waits for none
        child = os.fork()
    if child == 0:
        os.close(reading)
        os.close(held)
        _run(work, writing, lifeline)
    os.close(writing)
    os.close(lifeline)
    try:
        return _listen(reading, end, on_message)
    finally:
        os.close(reading)
        os.close(held)
        with suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


def _listen(reading: int, end: float, on_message: Say) -> bool:
    """Passes messages on until the work is done, is over time or says no more."""
    rest = b""
    while True:
        ready, _, _ = select.select([reading], [], [], max(end - monotonic(), 0.0))
        if not ready:
            return False
        block = os.read(reading, 1 << 16)
        if not block:
            return False
        *lines, rest = (rest + block).split(b"\n")
        for line in lines:
            message = json.loads(line)
            if "refused" in message:
                raise REFUSALS[message["refused"]](message["sentence"])
            if "crashed" in message:
                raise RuntimeError(message["crashed"])
            if "done" in message:
                return True
            on_message(message)


def _run(work: Callable[[Say], None], writing: int, lifeline: int) -> None:
    """The child: never returns."""

    def say(message: dict[str, Any]) -> None:
        line = json.dumps(message).encode() + b"\n"
        while line:
            line = line[os.write(writing, line) :]

    try:
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent is interrupted, and ends this
        threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()
        _bound_memory()
        try:
            work(say)
            say({"done": True})
        except (InputError, InfeasibleError) as error:
            say({"refused": type(error).__name__, "sentence": str(error)})
        except MemoryError:
            pass  # says no more: its parent sees that
        except Exception:  # a defect: the parent shows it
            say({"crashed": traceback.format_exc()})
    finally:
        os._exit(0)


def _end_with(lifeline: int) -> None:
    os.read(lifeline, 1)
    os._exit(1)


def _bound_memory() -> None:
    with suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (LARGEST_MEMORY, resource.getrlimit(resource.RLIMIT_AS)[1]))
