"""How long a piece of work may take: a budget in seconds of the wall's clock, checked once, kept by everybody below.

    budget_seconds --Deadline.after--> Deadline --share, remaining, expired--> whoever has something to spend
                                          `------- keeping(deadline): heed() ---> whoever works below, however deep

Without a budget the time never ends.
"""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from time import monotonic

from workbench.errors import BudgetEnded, InputError


def checked_budget(seconds: float, name: str = "budget_seconds") -> float:
    """A budget that can be kept: positive and finite.

    Examples
    --------
    >>> checked_budget(2)
    2.0
    >>> checked_budget(0)
    Traceback (most recent call last):
        ...
    workbench.errors.InputError: budget_seconds must be a positive, finite number of seconds; got 0. Give more, or leave it out.
    """  # noqa: E501
    try:
        value = float(seconds)
    except (TypeError, ValueError):
        value = math.nan
    if not 0 < value < math.inf:
        raise InputError(
            f"{name} must be a positive, finite number of seconds; got {str(seconds)[:40]}. Give more, or leave it out."
        )
    return value


@dataclass(frozen=True, slots=True)
class Deadline:
    """The moment at which work must be over. It may travel to another process of this machine: their clock is one.

    budget : of all the work [s], infinite where none was given;  end : on `time.monotonic` [s]
    """

    budget: float
    end: float

    @classmethod
    def after(cls, seconds: float | None, name: str = "budget_seconds") -> "Deadline":
        """So many seconds from now; never, without a budget."""
        if seconds is None:
            return cls(math.inf, math.inf)
        budget = checked_budget(seconds, name)
        return cls(budget, monotonic() + budget)

    def since(self, moment: float) -> "Deadline":
        """The same budget, counted from a moment on `time.monotonic`."""
        return Deadline(self.budget, moment + self.budget)

    @property
    def remaining(self) -> float:
        """Seconds left [s], not below zero."""
        return max(self.end - monotonic(), 0.0)

    @property
    def expired(self) -> bool:
        """Whether the time is over."""
        return monotonic() >= self.end

    def share(self, part: float) -> "Deadline":
        """An earlier deadline of the same budget, after a part of what is left now."""
        return Deadline(self.budget, monotonic() + part * self.remaining)

    def check(self, work: str) -> None:
        """Raises BudgetEnded where the time is over; `work` names what was under way."""
        if self.expired:
            raise BudgetEnded(
                f"the budget of {self.budget:.4g} s must suffice for {work}; it ended before. "
                "Give more with --budget-seconds."
            )


NEVER = Deadline.after(None)
_current: ContextVar[Deadline] = ContextVar("deadline", default=NEVER)


@contextmanager
def keeping(deadline: Deadline) -> Iterator[None]:
    """Makes everything inside the block heed a deadline; an earlier one that is kept already stays."""
    before = _current.get()
    token = _current.set(deadline if deadline.end < before.end else before)
    try:
        yield
    finally:
        _current.reset(token)


def current() -> Deadline:
    """The deadline that is kept here; `NEVER` without one."""
    return _current.get()


def heed(work: str) -> None:
    """What long work calls at every step of it: raises BudgetEnded where the time that is kept here is over."""
    _current.get().check(work)
