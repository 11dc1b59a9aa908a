"""Solve, search for what is violated, add it, solve again: once, for whatever there is to add.

    held --solve--> answer --search--> nothing violated: settled
     ^-------------- add <------------ frequencies, models, parameters of a box, points of a schedule

What is held never changes: `add` makes the next one. What was added in which round, and why, is part of the result.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

Held = TypeVar("Held")  # what the answers have to satisfy: a programme, a sample of frequencies, a list of models
Answer = TypeVar("Answer")
Added = TypeVar("Added")


@dataclass(frozen=True, slots=True)
class Found(Generic[Added]):
    """What a search says of an answer.

    settled : whether nothing is violated;  added : what is to be held from now on;  words : what it saw
    stop : why to stop although something is violated; empty to go on
    """

    settled: bool
    added: tuple[Added, ...] = ()
    words: str = ""
    stop: str = ""


@dataclass(frozen=True, slots=True)
class Round(Generic[Added]):
    """One round: its number from 1, what was added after it, what the search saw."""

    number: int
    added: tuple[Added, ...]
    words: str


@dataclass(frozen=True, slots=True)
class Exchange(Generic[Held, Answer, Added]):
    """How an exchange ended.

    held : at the last solution;  answer : that solution;  settled : whether the last search found nothing violated
    outcome : in words
    """

    held: Held
    answer: Answer
    rounds: tuple[Round[Added], ...]
    settled: bool
    outcome: str

    @property
    def added(self) -> tuple[Added, ...]:
        """Everything added, in order."""
        return tuple(one for each in self.rounds for one in each.added)


def exchange(
    held: Held, solve: Callable[[Held, Answer | None], Answer], search: Callable[[Held, Answer], Found[Added]],
    add: Callable[[Held, Answer, tuple[Added, ...]], Held], *, rounds: int, expired: Callable[[], bool] = lambda: False,
    on_round: Callable[[Round[Added]], None] | None = None,
) -> Exchange[Held, Answer, Added]:  # fmt: skip
    """Rounds of solving and adding until a search finds nothing violated.

    Parameters
    ----------
    solve : what is held, the last answer (None at first) → answer
    search : what is held, answer → Found
    add : what is held, the answer, additions → what is held next
    rounds : most solutions, at least 1
    expired : whether the time is over, asked after each search; the answer so far is returned then
    on_round : called after each search, for progress
    """
    answer: Answer | None = None
    log: list[Round[Added]] = []
    for number in range(1, rounds + 1):
        answer = solve(held, answer)
        found = search(held, answer)
        log.append(Round(number, found.added, found.words))
        if on_round is not None:
            on_round(log[-1])
        if found.settled or found.stop:
            outcome = "nothing is violated any more" if found.settled else found.stop
            return Exchange(held, answer, tuple(log), found.settled, outcome)
        if number == rounds or expired():
            break
        held = add(held, answer, found.added)
    assert answer is not None, "an exchange has at least one round"
    outcome = f"stopped after {len(log)} rounds" if len(log) == rounds else "the time was over"
    return Exchange(held, answer, tuple(log), False, outcome)
