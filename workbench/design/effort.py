"""How hard a design looks: what a problem says of it, and before that what its caller says.

[design] of a data file --Effort--> Problem.effort --said(starts, seed, seconds)--> what a design keeps to
"""

from dataclasses import dataclass
from numbers import Integral

from workbench.errors import InputError
from workbench.machine.budget import checked_budget

MOST_STARTS = 10_000  # hours of work, and the largest number that anybody means


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """starts : random starts, as the method has them if None;  seed : of these;  budget : of the clock [s], if any."""

    starts: int | None = None
    seed: int = 0
    budget: float | None = None

    def __post_init__(self) -> None:
        if self.starts is not None:
            check_starts(self.starts)
        if isinstance(self.seed, bool) or not isinstance(self.seed, Integral) or self.seed < 0:
            raise InputError(f"the seed of a design must be a whole number from 0 on; got {self.seed!r}. Give 0.")
        if self.budget is not None:
            object.__setattr__(self, "budget", checked_budget(self.budget, "the budget of a design"))

    def said(self, starts: int | None, seed: int | None, seconds: float | None = None) -> "Effort":
        """The same where a caller says nothing (None), else what he says."""
        return Effort(
            starts=self.starts if starts is None else starts, seed=self.seed if seed is None else seed,
            budget=self.budget if seconds is None else seconds,
        )  # fmt: skip


def check_starts(starts: int) -> None:
    """Refuses a number of starts that makes no design, or no memory for one."""
    if isinstance(starts, bool) or not isinstance(starts, Integral):
        raise InputError(f"the number of starts must be a whole number; got {starts!r}. Give one from 1 on.")
    if starts < 1:
        raise InputError(f"the number of starts must be at least 1; got {starts}.")
    if starts > MOST_STARTS:
        raise InputError(f"the number of starts must be at most {MOST_STARTS}; got {starts}. Ask for fewer.")
