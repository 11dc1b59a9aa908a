"""What a proof answers: the enclosure of a quantity on one loop, and whether a limit is kept on it."""

from collections.abc import Callable
from dataclasses import dataclass

from flint import arb, fmpq

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import ends
from workbench.verify.plant.table import Promise

FURTHEST = fmpq(2) ** 60
STEPS = 10  # halvings of a bracket found level by level
ABOVE_PEAK = fmpq(1, 10**6)  # relative width of a peak's bracket that is shown


@dataclass(frozen=True, slots=True)
class Answer:
    """The quantity lies in [low, high], an end None where it was not looked for; method: how that is known."""

    kept: bool
    low: fmpq | None
    high: fmpq | None
    method: str


def enclosed(promise: Promise, value: arb, method: str, exactly: Callable[[], bool] = lambda: False) -> Answer:
    """The answer of an enclosure; `exactly` says whether a limit that lies within it is kept.

    Raises NotProved where the limit lies within the enclosure and is not kept exactly.
    """
    low, high = ends(value)
    inside, outside = (high <= promise.limit, low > promise.limit)
    if promise.sense == ">=":
        inside, outside = low >= promise.limit, high < promise.limit
    if not inside and not outside and not exactly():
        raise NotProved(f"the limit lies within the enclosure [{float(low):.9g}, {float(high):.9g}]")
    return Answer(not outside, low, high, method)


def bracket(kept: Callable[[fmpq], bool], good: fmpq, bad: fmpq | None, steps: int) -> tuple[fmpq, fmpq | None]:
    """A level that is kept and one that is not, nearer to each other; `bad` is searched above `good` if None.

    A level that cannot be told ends the search.
    """
    try:
        step = abs(good) or fmpq(1, 2**20)
        while bad is None:
            if step > FURTHEST:
                return good, None
            if kept(good + step):
                good, step = good + step, step * 4
            else:
                bad = good + step
        for _ in range(steps):
            middle = (good + bad) / 2
            good, bad = (middle, bad) if kept(middle) else (good, middle)
    except NotProved:
        pass
    return good, bad


def require_sense(promise: Promise, sense: str) -> None:
    """Raises NotProved for a bound on the other side, of which there is no proof."""
    if promise.sense != sense:
        raise NotProved(f"a {promise.kind} is proved to be {sense} its limit only")
