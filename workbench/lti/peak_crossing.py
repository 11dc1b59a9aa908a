"""Every frequency where the loop gain passes 1, none left out, and the dead times that make the loop unstable there.

    S(jω) enclosed on intervals --½ − Re S of one sign--> no crossing     (|L| = 1 exactly where Re S = ½)
                                --monotone-------------> at most one, told by the ends' signs
                                --neither--------------> halved
    beyond the last interval S keeps so near to S(∞) that its side is known

What cannot be told by rounding (|L| touches 1) counts as a crossing.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from workbench.lti.peak_jet import Enclosure
from workbench.lti.realisation import EPS

MOST = 200_000  # intervals
CHUNK = 1024  # intervals enclosed at once
NARROW = 1e-13  # of its frequency, or of the grid's first: an interval that is halved no more
ROUNDING = 64 * EPS  # of ½ − Re S, beside ½
BESIDE_REST = 1e-4  # of the grid's first frequency, itself a hundredth of the slowest pole: S differs there by 1e-12
FARTHEST = 1e9  # of the grid's last frequency
MOST_TURNS = 2e4  # of a dead time [rad] up to the last interval


class Crossings(NamedTuple):
    """Intervals (k, 2), each with one crossing or what rounding leaves of one; why some are missing, or empty."""

    intervals: np.ndarray
    reason: str


def crossings(S: Enclosure, grid: np.ndarray) -> Crossings:
    """All of them up to infinity; S has one input and output, the grid (k,) rises from 0."""
    grid, reason = _ended(S, grid)
    if reason:
        return Crossings(np.zeros((0, 2)), reason)
    low, high, found, used = grid[:-1], grid[1:], [], 0
    smallest = float(grid[grid > 0][0])
    at_rest = 0.5 - S.jet(np.zeros(1), np.zeros(1)).value[0, 0, 0].real
    if abs(at_rest) <= ROUNDING:  # |L(0)| = 1: ½ − Re S is even in ω, and first differs from it beyond rounding
        low = np.r_[BESIDE_REST * smallest, low[1:]]
    while len(low):
        used += len(low)
        if used > MOST:
            return Crossings(np.zeros((0, 2)), "the frequencies where the loop gain passes 1 are too close to be told.")
        clear, single = (np.concatenate(parts) for parts in zip(
            *(_told(S, low[k : k + CHUNK], high[k : k + CHUNK]) for k in range(0, len(low), CHUNK)), strict=True
        ))  # fmt: skip
        found.append(np.stack([low, high], axis=1)[single])
        left = ~clear & ~single
        narrow = left & ((high - low <= NARROW * high) | (high <= NARROW * smallest))
        found.append(np.stack([low, high], axis=1)[narrow & (low > 0)])  # at rest no dead time matters
        left &= ~narrow
        low, high = low[left], high[left]
        middle = (low + high) / 2
        low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    return Crossings(np.concatenate(found), "")


def _told(S: Enclosure, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which intervals have no crossing, and which have exactly one."""
    jet = S.jet((low + high) / 2, (high - low) / 2)
    value, slope, r = 0.5 - jet.value[:, 0, 0].real, -jet.slope[:, 0, 0].real, jet.radius
    with np.errstate(invalid="ignore"):
        rest = jet.bend * r**2 / 2 + ROUNDING
        clear = np.abs(value) > np.abs(slope) * r + rest
        monotone = np.abs(slope) > jet.bend * r
        ends = [value - slope * r, value + slope * r]
        certain = [np.abs(end) > rest for end in ends]  # the ends' signs are those of their first-order values
    monotone &= certain[0] & certain[1] & np.isfinite(jet.bend)
    opposite = np.sign(ends[0]) != np.sign(ends[1])
    return clear | (monotone & ~opposite), monotone & opposite


def _ended(S: Enclosure, grid: np.ndarray) -> tuple[np.ndarray, str]:
    """The grid, ended or continued where S keeps to one side of ½ for good; or why it does not."""
    direct = float(S.D[0, 0])
    away = abs(0.5 - direct)

    def keeps(start: float) -> bool:
        stays, falls = S.beyond(start)
        return stays - abs(direct) + falls < away

    enough = next((k for k, at in enumerate(grid) if at > 0 and keeps(float(at))), None)
    if enough is not None:
        return grid[: enough + 1], ""
    late, last = float(S.dead_times.max(initial=0.0)), float(grid[-1])
    start = last
    while start < FARTHEST * last and start * late < MOST_TURNS:
        start *= 2
        if keeps(start):
            count = round(math.log2(start / last)) + 1
            return np.unique(np.r_[grid, np.geomspace(last, start, count)]), ""
    return grid, "the loop gain comes too near to 1 at high frequencies for its dead times to be told."


def pursued(excess: Callable[[np.ndarray], np.ndarray], intervals: np.ndarray, steps: int = 60) -> np.ndarray:
    """The crossings (k,) in intervals (k, 2), bisected."""
    low, high = intervals.T
    above = excess(low) > 0
    for _ in range(steps):
        middle = (low + high) / 2
        stays = (excess(middle) > 0) == above
        low, high = np.where(stays, middle, low), np.where(stays, high, middle)
    return (low + high) / 2
