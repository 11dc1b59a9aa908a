"""Ctrl-C and SIGTERM from the first line of a command to its last.

starting  nothing has begun: said, and left at once     | exit code 130 for SIGINT,
working   KeyboardInterrupt, so that what is finished   | 143 for SIGTERM
          can be kept; once more, and it is left at once |
leaving   left at once
"""

import os
import signal
from time import monotonic
from types import FrameType

WORDS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
AGAIN = 0.5  # [s] a signal that comes sooner is the same one: a terminal and a parent may both send it


class Terminated(KeyboardInterrupt):
    """SIGTERM: whatever keeps its work when it is interrupted keeps it now as well."""


class _State:
    working = False
    first: int | None = None
    since = 0.0


_state = _State()


def watch() -> None:
    """Takes the signals over; one that whoever started us wants ignored stays so (nohup, background jobs)."""
    for number in WORDS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _handle)


def working(whether: bool) -> None:
    """Says that there may be something to keep from now on, or that there is nothing left to do."""
    _state.working = whether


def received() -> int | None:
    """The signal that came first, if any did."""
    return _state.first


def word() -> str:
    """What befell the command, for a sentence."""
    return WORDS.get(signal.Signals(_state.first), "ended") if _state.first else "interrupted"


def _handle(number: int, frame: FrameType | None) -> None:
    again = _state.first is not None
    if again and monotonic() - _state.since < AGAIN:
        return
    if not again:
        _state.first, _state.since = number, monotonic()
    if again or not _state.working:
        os.write(2, f"{word()}.\n".encode())
        os._exit(128 + (_state.first or number))
    raise (Terminated if number == signal.SIGTERM else KeyboardInterrupt)
