"""Where the poles of a loop with dead times lie: spectral collocation proposes, Newton's method refines.

    Cycle --generator on Chebyshev points--> eigenvalues --Newton on det X--> roots, the rightmost ones first

Nothing here proves that no root was missed: `loop_count` does, or the caller says that he only steers.
"""

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from workbench.errors import InputError
from workbench.lti.count import MOST, OnEdge, TooManySteps, right_of
from workbench.lti.cycle import FAR_LEFT, Cycle, inverses, parts

FEWEST_NODES = 18  # of a line; those resolve |s| T up to about 12
NODES_PER_RADIAN = 0.6  # of |s| T beyond; two a wavelength are the least
MOST_ROWS = 320  # of a generator; its eigenvalues then take half a second
FEW_ROWS = 100  # where roots only steer
NEWTON = 40
SETTLED = 1e-13  # of its size: a root that moves less in a step stands
LOST = 1e-4  # a start whose root still moves by this much after all steps belongs to none
SAME = 1e-9  # of their size: roots closer than this are one
SLACKS = (1e-9, 1e-7, 1e-5, 1e-3)  # of a root's size: how far beyond it the count must be 0
QUICK = 30_000  # steps of a count that may fail
LARGEST_STEP = 0.5  # of a root's distance from zero, so that a start does not leave its region


def spectrum(A: np.ndarray, late: np.ndarray) -> np.ndarray:
    """Poles (k,) of a loop: all that no dead time touches, and of each cycle those that a small collocation finds."""
    return _spectrum(A.tobytes(), late.tobytes())


@lru_cache(maxsize=16)  # several goals ask for the spectrum of one loop
def _spectrum(A: bytes, late: bytes) -> np.ndarray:
    times = np.frombuffer(late)
    poles, cycles = parts(np.frombuffer(A).reshape(len(times), len(times)), times)
    return np.concatenate([poles, *(located(cycle, rows=FEW_ROWS) for cycle in cycles)])


def located(cycle: Cycle, fastest: float | None = None, rows: int = MOST_ROWS) -> np.ndarray:
    """Roots (k,) of a cycle up to a frequency [rad/s], that of its fastest state if left out; rightmost first."""
    n, q = cycle.A_xl.shape
    known = cycle.states
    reach = float(np.abs(known).max(initial=0.0)) if fastest is None else fastest
    reach = max(reach, 1 / float(cycle.dead_times.max()))
    wanted = FEWEST_NODES + np.ceil(NODES_PER_RADIAN * np.minimum(reach * cycle.dead_times, 2.0 * rows))
    room = max(rows - n, q * FEWEST_NODES)
    if wanted.sum() > room:
        wanted = np.maximum(FEWEST_NODES, wanted * room / wanted.sum())
    start = np.r_[np.linalg.eigvals(cycle.generator(wanted.astype(int))), known]
    start = start[np.isfinite(start) & (start.real * cycle.dead_times.max() > -FAR_LEFT / 2)]
    roots = refined(cycle, start)
    return roots[np.argsort(-roots.real)]


def refined(cycle: Cycle, start: np.ndarray) -> np.ndarray:
    """The distinct roots (k,) that Newton's method on det X reaches from starts; s − 1/tr(X⁻¹X')."""
    s = np.unique(np.where(start.imag < 0, start.conj(), start)).astype(complex)
    size = np.maximum(np.abs(s), 1e-3 / cycle.dead_times.max())
    step = np.full(len(s), np.inf)
    live = np.ones(len(s), bool)
    for _ in range(NEWTON):
        at = s[live]
        if not len(at):
            break
        rows = cycle.row_size(at)
        with np.errstate(all="ignore"):
            move = 1 / np.einsum("kij,kji->k", inverses(cycle.at(at, rows)), cycle.slope(at, rows))
        move = np.where(np.isfinite(move), move, 0.0)  # X is singular: this is a root
        largest = LARGEST_STEP * np.maximum(np.abs(at), size[live])
        move *= np.minimum(1.0, largest / np.maximum(np.abs(move), 1e-300))
        s[live] = at - move
        step[live] = np.abs(move) / np.maximum(np.abs(at), 1e-300)
        live = (step > SETTLED) & (s.real * cycle.dead_times.max() > -FAR_LEFT)
    s = s[step < LOST]
    s = np.where(np.abs(s.imag) <= 1e-12 * np.abs(s), s.real, s)
    s = np.where(s.imag < 0, s.conj(), s)
    kept: list[complex] = []
    for root in s[np.argsort(-s.real)]:
        if not any(abs(root - other) <= SAME * max(abs(root), cycle.rounding / SAME) for other in kept):
            kept.append(complex(root))
    found = np.array(kept, complex)
    return np.concatenate([found, found[found.imag > 0].conj()])


def abscissa(A: np.ndarray, late: np.ndarray) -> float:
    """Largest real part of all poles [1/s], confirmed by counting: none lies further right, but for 1e-9 of its size.

    Raises InputError where infinitely many lie as far right as 0.
    """
    poles, cycles = parts(A, late)
    return max([-math.inf, *poles.real, *(_rightmost(cycle) for cycle in cycles)])


def _rightmost(cycle: Cycle) -> float:
    """Largest real part of a cycle's roots; the edge of its infinitely many where these are the rightmost."""
    roots = located(cycle)
    scale = max(float(np.abs(roots).max(initial=0.0)), 1e-3 / float(cycle.dead_times.max()))
    guess, near = (float(roots[0].real), float(abs(roots[0]))) if len(roots) else (-scale, scale)
    near = max(near, 1e4 * cycle.rounding)
    return first_empty(lambda sigma, most: right_of(cycle, sigma, most=most), guess, near)[0]


def first_empty(count: Callable[[float, int], int], guess: float, near: float) -> tuple[float, float]:
    """The least level at which a count is 0, which falls with rising level: the guess, or bisected; and a proved one.

    The guess stands where the count is 0 a little above it, by the first of `SLACKS` times `near` that lets the count
    tell: roots that nearly coincide are told from an edge only at some distance.
    """

    def empty(level: float, most: int) -> bool | None:
        try:
            return count(level, most) == 0
        except (OnEdge, TooManySteps):
            return None

    def at_last(level: float) -> bool:
        try:
            return count(level, MOST) == 0
        except OnEdge:
            return False

    for slack in SLACKS:
        found = empty(guess + slack * near, QUICK)
        if found:
            return guess, guess + slack * near
        if found is False:
            break
    width = SLACKS[-1] * near
    low, high = guess, guess + width
    while not at_last(high):
        low, high, width = high, high + 4 * width, 4 * width
        if width > 1e9 * near:
            raise InputError(
                "the poles of a loop with dead time must be told from the edge of a region; here they sit on it. Move "
                "the focus band a little, or add a lag to the controller."
            )
    while high - low > SLACKS[0] * max(near, abs(high)):
        middle = (low + high) / 2
        low, high = (low, middle) if empty(middle, QUICK) else (middle, high)
    return high, high
