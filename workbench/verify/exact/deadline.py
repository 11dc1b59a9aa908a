"""When a check must be over: set once around it, asked by every loop below.

    with within(seconds):      check() raises OutOfTime from then on;  remaining() says what is left

What a single call of the exact arithmetic costs is bounded by the size of a table's numbers (`reading`); the command
puts the whole into a process of its own besides (`workbench.commands.guard`).
"""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from math import inf
from time import monotonic

from workbench.verify.exact.failure import NotProved

_END: ContextVar[float] = ContextVar("end of a check", default=inf)


class OutOfTime(NotProved):
    """The budget of a check ended before there was an answer."""


@contextmanager
def within(seconds: float) -> Iterator[None]:
    """Everything inside is to be over after so many seconds; an earlier end outside stays."""
    token = _END.set(min(_END.get(), monotonic() + seconds))
    try:
        yield
    finally:
        _END.reset(token)


def remaining() -> float:
    """Seconds left, not below zero."""
    return max(_END.get() - monotonic(), 0.0)


def check() -> None:
    """Raises OutOfTime where nothing is left."""
    if monotonic() >= _END.get():
        raise OutOfTime("the budget of the check ended first")
