"""The largest value of a function of frequency, from both sides: branch and bound over intervals.

    grid --sampled, refined--> a value attained
         --each interval bounded from above; halved while its bound exceeds that value--> a value not exceeded

A bound that is not reached within the work allowed is handed back as it stands: it is true, only not close.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from workbench.lti.peak_search import local_peaks

CLOSE = 1e-6  # relative width of a bracket that ends the search
MOST = 200_000  # intervals
CHUNK = 1024  # intervals bounded at once
DEEP = 1e-6  # of a grid's first frequency: what vanishes at rest is rounding there, and no value is taken
LOOSE = 1e-3  # relative: what lies beyond the last interval may exceed the largest value by, with dead time
FARTHEST = 1e7  # of the last frequency of a grid
MOST_TURNS = 5e3  # of a dead time [rad] up to the last interval
NARROW = 1e-13  # of its frequency, or of the grid's first: an interval that is halved no more


class Bracket(NamedTuple):
    """A value attained at a frequency, and one that is exceeded nowhere."""

    value: float
    frequency: float
    upper: float
    intervals: int


def bracket(
    size: Callable[[np.ndarray], np.ndarray], above: Callable[[np.ndarray, np.ndarray], np.ndarray], grid: np.ndarray,
    close: float = CLOSE, floor: float = 0.0,
) -> Bracket:  # fmt: skip
    """The largest `size` over a finite grid's range, to a relative width; below `floor` no bound needs to be close.

    size : omega (k,) → (k,);  above : ends low, high (k,) → bounds (k,) of the size in between
    """
    floor, smallest = max(floor, float(np.finfo(float).tiny)), float(grid[grid > 0][0])

    def clean(at: np.ndarray) -> np.ndarray:
        return np.where((at == 0) | (at >= DEEP * smallest), size(at), -math.inf)

    frequency, value = local_peaks(clean, grid)[0]
    low, high, used, top = grid[:-1], grid[1:], 0, 0.0
    while len(low):
        used += len(low)
        if used > MOST:
            rest = np.concatenate([above(low[k : k + CHUNK], high[k : k + CHUNK]) for k in range(0, len(low), CHUNK)])
            top = max(top, float(rest.max()))
            break
        middle = (low + high) / 2
        seen = clean(middle)
        best = int(np.argmax(np.where(np.isnan(seen), -math.inf, seen)))
        if seen[best] > value:
            frequency, value = local_peaks(clean, np.array([low[best], middle[best], high[best]]))[0]
        bounds = np.concatenate([above(low[k : k + CHUNK], high[k : k + CHUNK]) for k in range(0, len(low), CHUNK)])
        level = max(value * (1 + close), floor)
        open_ = bounds > level
        stuck = open_ & ((high - low <= NARROW * high) | (high <= NARROW * smallest))
        top = max([top, *bounds[stuck]])
        open_ &= ~stuck
        low, high, middle = low[open_], high[open_], middle[open_]
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    return Bracket(value, frequency, max(top, value * (1 + close), floor), used)


def farther(
    grid: np.ndarray, dead_time: float, value: float, beyond: Callable[[float], float]
) -> tuple[np.ndarray, float]:
    """The grid, ended or continued where what lies beyond is bounded by a value, or far enough; and that bound."""
    level = value * (1 + CLOSE)
    if dead_time > 0:  # its phase turns on for ever, and near a value that stays each turn would be cut finely
        level *= 1 + LOOSE
        level = max(value * (1 + CLOSE), 1.0) if value < 1 < level else level
    bounds = np.array([beyond(float(at)) if at > 0 else math.inf for at in grid])
    enough = np.flatnonzero(np.isfinite(bounds) & (bounds <= level))  # an infinite one says nothing, whatever the value
    if len(enough):
        return grid[: enough[0] + 1], float(bounds[enough[0]])
    last = start = float(grid[-1])
    bound = beyond(last)
    while bound > level and start < FARTHEST * last and start * dead_time < MOST_TURNS:
        start *= 2
        bound = beyond(start)
    return np.unique(np.r_[grid, np.geomspace(last, start, round(math.log2(start / last)) + 1)]), bound
