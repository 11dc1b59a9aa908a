"""The peaks of a function of frequency: seeds, local refinement, and a check that nothing was missed.

    grid (`lti.grid`) --local maxima--> brackets --refine--> peaks --crossing(level)--> more points, or done

Where the function is the largest singular value of a rational matrix, `crossing` answers from the Hamiltonian where it
exceeds the best peak, so a narrow peak between grid points cannot hide. Elsewhere (dead times, breakpoints, μ) the grid
is made from the poles: three widths around every resonance.
"""

import math
from collections.abc import Callable

import numpy as np

Function = Callable[[np.ndarray], np.ndarray]  # omega (k,) -> (k,)
Crossing = Callable[[float], list[tuple[float, float]]]  # level -> intervals where the function exceeds it

# ends and middle of brackets, and the function there; that at the ends is unknown at first
Brackets = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray | None, np.ndarray, np.ndarray | None]

MOST_PEAKS = 12  # refined in one pass
WORTH_REFINING = 0.5  # of the largest sample; a sample one width off a resonance has 0.7 of its peak
ROUNDS = 7  # each shrinks a bracket by 4 or more; smooth peaks end after three
STILL = 1e-14  # relative; a round that gains less ends the refinement: the peak's place is then good to 1e-7 widths
PASSES = 12  # of the Hamiltonian check; each at least passes the former peak
SLACK = 1e-7  # relative; how far above the best peak the check looks


def peaks(function: Function, grid: np.ndarray, crossing: Crossing | None = None) -> list[tuple[float, float]]:
    """Local maxima (ω, value), the largest first; the first is the global one as far as `crossing` or the grid tell."""
    band = (float(grid[0]), float(grid[-1]))
    found = local_peaks(function, grid)
    if crossing is None:
        return found
    for _ in range(PASSES):
        best = found[0][1]
        if not best > 0:
            break
        above = [(max(a, band[0]), min(b, band[1])) for a, b in crossing(best * (1 + SLACK))]
        above = [(a, b) for a, b in above if b > a]
        if not above:
            break
        extra = [local_peaks(function, _inside(a, b)) for a, b in above]
        more = sorted((peak for peaks_there in extra for peak in peaks_there), key=lambda peak: -peak[1])
        if more[0][1] <= best * (1 + SLACK):
            break
        found = sorted([*found, *more], key=lambda peak: -peak[1])
    return found


def _inside(low: float, high: float) -> np.ndarray:
    """Nine frequencies from low to high, which may be infinite."""
    part = np.linspace(0, 1, 9)
    if math.isinf(high):
        scale = low or 1.0
        return np.r_[low + scale * part[:-1] / (1 - part[:-1]), math.inf]
    return low + (high - low) * part


def local_peaks(function: Function, grid: np.ndarray) -> list[tuple[float, float]]:
    """Refined local maxima of a function sampled on a sorted grid."""
    values = _finite(function(grid))
    count = len(grid)
    left = np.r_[-math.inf, values[:-1]]
    right = np.r_[values[1:], -math.inf]
    top = float(values.max())
    is_peak = (values >= left) & (values >= right) & ((values > left) | (values > right) | (count == 1))
    if not is_peak.any():
        is_peak[int(np.argmax(values))] = True
    chosen = np.flatnonzero(is_peak & (values >= WORTH_REFINING * top if top > 0 else is_peak))
    chosen = chosen[np.argsort(-values[chosen])][:MOST_PEAKS]
    low, high = grid[np.maximum(chosen - 1, 0)], grid[np.minimum(chosen + 1, count - 1)]
    where, size = _refine(function, low, grid[chosen], high, values[chosen])
    order = np.argsort(-size)
    return [(float(where[i]), float(size[i])) for i in order]


def _finite(values: np.ndarray) -> np.ndarray:
    """Undefined samples (0·∞ at an end of the axis) never win."""
    return np.where(np.isnan(values), -math.inf, values)


def _refine(function: Function, low, middle, high, value) -> tuple[np.ndarray, np.ndarray]:
    """Maxima (k,) inside brackets (k,), all refined together; a bracket that reaches to ∞ is worked in 1/ω.

    Each round samples the parabola's vertex, two points close to it and three between each end and the middle, then
    keeps the best sample and its neighbours.
    """
    flip = np.isinf(high)
    with np.errstate(divide="ignore"):
        a = np.where(flip, 0.0, low)
        b = np.where(flip, 1 / middle, middle)
        c = np.where(flip, 1 / np.maximum(low, np.finfo(float).tiny), high)
    a, b, c = a.copy(), b.copy(), c.copy()
    lost = flip & (low == 0)  # a bracket over the whole axis: work in ω up to a hundred times its middle
    c[lost] = 100 * np.where(np.isfinite(middle[lost]), np.maximum(middle[lost], 1.0), 1.0)
    a[lost], flip = 0.0, flip & ~lost
    b[lost] = np.where(np.isfinite(middle[lost]), middle[lost], 1.0)
    best = value.copy()
    best[lost & np.isinf(middle)] = -math.inf
    brackets: Brackets = (a, b, c, None, best, None)
    for turn in range(ROUNDS):
        before: np.ndarray = brackets[4]
        brackets = _narrower(function, flip, brackets)
        if turn >= 2 and np.all(brackets[4] <= before + STILL * np.abs(brackets[4])):
            break
    with np.errstate(divide="ignore"):
        return np.where(flip, 1 / brackets[1], brackets[1]), brackets[4]


def _narrower(function: Function, flip: np.ndarray, brackets: Brackets) -> Brackets:
    """One round: brackets a, b, c (k,) and the function there, its ends unknown at first, around the best sample."""
    a, b, c, fa, best, fc = brackets
    part, rows = np.array([0.25, 0.5, 0.75]), np.arange(len(b))
    points = [a[:, None], a[:, None] + (b - a)[:, None] * part, b[:, None] + (c - b)[:, None] * part, c[:, None]]
    if fa is not None and fc is not None:
        beside = _vertex(a, b, c, fa, best, fc)[:, None] + ((c - a) / 64)[:, None] * np.array([-1, 0, 1])
        points.append(np.clip(beside, a[:, None], c[:, None]))
    x = np.concatenate(points, axis=1)
    with np.errstate(divide="ignore"):
        omega = np.where(flip[:, None], 1 / x, x)
    f = _finite(function(omega.ravel())).reshape(x.shape)
    both = np.concatenate([x, b[:, None]], axis=1), np.concatenate([f, best[:, None]], axis=1)
    order = np.argsort(both[0], axis=1, kind="stable")
    xs, fs = np.take_along_axis(both[0], order, 1), np.take_along_axis(both[1], order, 1)
    i = np.argmax(fs, axis=1)
    lower, upper = np.maximum(i - 1, 0), np.minimum(i + 1, xs.shape[1] - 1)
    return xs[rows, lower], xs[rows, i], xs[rows, upper], fs[rows, lower], fs[rows, i], fs[rows, upper]


def _vertex(a, b, c, fa, fb, fc) -> np.ndarray:
    """The maximum of the parabola through three points; the middle one where there is none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        p, q = (b - a) * (fb - fc), (b - c) * (fb - fa)
        vertex = b - 0.5 * ((b - a) * p - (b - c) * q) / (p - q)
    return np.where(np.isfinite(vertex), vertex, b)
