"""How many poles of a loop with dead times lie in a region, counted exactly where they are infinitely many.

    Cycle --turns of det X along the region's edge, each step proved--> zeros inside (argument principle)

A step from s is accepted only where Perron's bound leaves det X no zero on the step's whole disc, and small enough that
the first-order prediction tr(X⁻¹ ΔX) of its turn cannot be a full turn off: so twin modes, light modes and long dead
times cannot hide a turn between two points. Floating point, not outward-rounded. Far out X is sI − A_xx beside the
lines' own I − E A_ll, whose turn is known while the dead times feed each other by less than 1 (a neutral loop of
1 or more has infinitely many poles on the right, or comes to have them by any change of a dead time).
"""

import math
from collections.abc import Callable

import numpy as np

from workbench.errors import InputError
from workbench.lti.cycle import Cycle, inverses, parts, perron
from workbench.lti.realisation import state_scale

FULL = 0.8 * math.pi  # largest error of a predicted turn; below π the nearer multiple of 2π is the right one
MOST = 400_000  # steps of one count
ROUNDED = 1e-12  # of 1: gains of lines around lines this near to 1 are no longer below it
CHUNK = 2048  # steps worked at once
NEAREST = 1e-13  # of its frequency: a root this near to the edge counts as on it
ASIDE = (1e-10, 1e-9, 1e-8, 1e-7)  # of a root's size: how far left the axis is moved to take in roots on it

Path = Callable[[np.ndarray], np.ndarray]  # parameter (k,) -> s (k,)


class OnEdge(Exception):
    """A root on the edge of the region, or nearer to it than rounding tells."""

    def __init__(self, where: complex) -> None:
        super().__init__(where)
        self.where = where


class TooManySteps(InputError):
    """A count that would take too long: a long band times dead time, or roots that nearly coincide near the edge."""


def unstable_poles(A: np.ndarray, late: np.ndarray) -> int:
    """Number of zeros of det(Λ(s) − A) with Re s ≥ 0, A (N, N) and the rows' dead times (N,), 0 of states.

    A zero on the axis itself counts as unstable.

    Raises
    ------
    InputError
        If dead times feed each other at once with a gain of 1 or more, so that the number is infinite.
    """
    poles, cycles = parts(A, late)
    return int(np.sum(poles.real >= 0)) + sum(right_of(cycle, 0.0, closed=True) for cycle in cycles)


def right_of(cycle: Cycle, sigma: float, *, closed: bool = False, most: int = MOST) -> int:
    """Number of roots with Re s > σ; `closed`: and of those on the line itself.

    Raises OnEdge for a root on the line unless closed, InputError where the number is infinite, TooManySteps.
    """
    moved = cycle.shifted(sigma)
    far = _quiet(moved)
    if math.isinf(far):
        where = "on the right" if sigma == 0 else f"right of {sigma:.4g} 1/s"
        raise InputError(
            "dead times must feed each other at once by a gain below 1, whatever their phases; here they do not, so "
            f"infinitely many poles lie {where} or come to by a change of a dead time. Add a lag to the controller or "
            "the plant."
        )
    try:
        return _right(moved, far, most)
    except OnEdge as edge:
        if not closed:
            raise
        size = max(abs(edge.where), moved.rounding / NEAREST)
    for aside in ASIDE:
        left = cycle.shifted(sigma - aside * size)
        try:
            return max(1, _right(left, _quiet(left), most))
        except OnEdge:
            continue
    return max(1, len(cycle.A_xx))  # roots on the axis, too many or too flat to be told apart


def _right(cycle: Cycle, far: float, most: int) -> int:
    """Roots with Re s > 0, given a frequency beyond which there is none."""
    n = len(cycle.A_xx)
    known = np.abs(np.r_[cycle.states, cycle.states.imag])
    smallest = min([1e-3 * far, *known[known > 0]])
    mesh = np.unique(np.r_[0.0, np.geomspace(1e-2 * smallest, far, 40), known[known < far]])
    axis = turn(cycle, lambda t: 1j * t, mesh, upright=True, most=most)
    zeros = n / 2 + (_outer_turn(cycle, far) - axis) / math.pi
    return whole(zeros)


def _outer_turn(cycle: Cycle, far: float) -> float:
    """Turn of det X along the arc of radius `far` from the real axis up to the imaginary one, beyond that of sⁿ."""
    E = np.exp(1j * far * cycle.dead_times)
    inner = np.diag(E) - cycle.A_ll
    lines = 1 - np.linalg.eigvals(cycle.A_ll / E[:, None])
    states = 1 - np.linalg.eigvals(cycle.A_xx + cycle.A_xl @ np.linalg.solve(inner, cycle.A_lx)) / (1j * far)
    return float(np.angle(lines).sum() + np.angle(states).sum())


def _quiet(cycle: Cycle) -> float:
    """A radius beyond which, on the right, det X/sⁿ keeps near the lines' own det(I − E A_ll); infinite if none is.

    sI − A_xx − A_xl (Λ_l − A_ll)⁻¹ A_lx is regular where |s| exceeds the spectral radius of the entries' bounds.
    """
    around = _around(cycle.A_ll)
    if around is None:
        return math.inf
    whole = np.abs(cycle.A_xx) + np.abs(cycle.A_xl) @ around @ np.abs(cycle.A_lx)
    slowest = 1e-3 / float(np.max(cycle.dead_times))
    return 1.25 * max(float(perron(whole[None])[0]) if len(whole) else 0.0, slowest)


def _around(A_ll: np.ndarray) -> np.ndarray | None:
    """A bound of |(Λ − A_ll)⁻¹| for all |Λ| ≥ 1, by entries or by norms; None if the lines' own loop gain reaches 1."""
    q, through = len(A_ll), np.abs(A_ll)
    nilpotent = not np.linalg.matrix_power((through > 0).astype(float), q).any()  # every circle holds a state
    if nilpotent or np.abs(np.linalg.eigvals(through)).max() < 1 - ROUNDED:
        return np.linalg.inv(np.eye(q) - through)
    scale = state_scale(A_ll)
    size = np.linalg.norm(A_ll / scale[:, None] * scale, 2)
    return scale[:, None] / scale / (1 - size) if size < 1 - ROUNDED else None


def turn(cycle: Cycle, path: Path, mesh: np.ndarray, *, upright: bool, most: int = MOST) -> float:
    """By how much det X turns along a path [rad], over a mesh (k,) of its parameter that is refined as needed.

    Every piece of the path must lie within the disc about its middle that reaches its further end (lines, arcs do).
    Raises OnEdge where no step is small enough, TooManySteps beyond `most` of them.
    """
    size = cycle.A_xl.shape[0] + cycle.A_xl.shape[1]
    largest = _largest_radius(size)
    low, high, total, used = mesh[:-1], mesh[1:], 0.0, 0
    while len(low):
        used += len(low)
        if used > most:
            raise TooManySteps(
                f"poles with dead time are counted in at most {most} steps; this loop's band times dead time asks for "
                "more. Take fast filters out of the model, or shorten the dead time."
            )
        done = np.zeros(len(low), bool)
        for k in range(0, len(low), CHUNK):
            piece = slice(k, k + CHUNK)
            done[piece], turned = _steps(cycle, path, low[piece], high[piece], largest, upright)
            total += turned
        low, high = low[~done], high[~done]
        if len(low):
            middle = (low + high) / 2
            at, ends = path(middle), path(high)
            small = np.abs(ends - at) <= np.maximum(NEAREST * np.abs(at), cycle.rounding)
            if small.any():
                raise OnEdge(complex(at[np.argmax(small)]))
            low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
    return total


def _steps(cycle, path, low, high, largest, upright) -> tuple[np.ndarray, float]:
    """Which steps are proved, and the turn over those."""
    s, ends = path((low + high) / 2), (path(low), path(high))
    radius = np.maximum(np.abs(ends[0] - s), np.abs(ends[1] - s))
    rows = cycle.row_size(s)
    X = cycle.at(s, rows)
    inverse = inverses(X)
    with np.errstate(invalid="ignore", over="ignore"):
        good = perron(np.abs(inverse) @ cycle.reach(s, radius, upright=upright)) <= largest
    if not good.any():
        return good, 0.0
    X, inverse = X[good], inverse[good]
    start, total = np.linalg.slogdet(X)[0], 0.0
    for sign, end in zip((-1, 1), ends, strict=True):
        other = cycle.at(end[good], rows[good])
        predicted = np.einsum("kij,kji->k", inverse, other - X).imag
        found = np.angle(np.linalg.slogdet(other)[0] / start)
        found += 2 * math.pi * np.round((predicted - found) / (2 * math.pi))
        total += sign * float(found.sum())
    return good, total


def _largest_radius(size: int) -> float:
    """The spectral radius ρ up to which size·(−log(1 − ρ) − ρ), an error of tr M as log det(I + M), is below `FULL`."""
    low, high = 0.0, 0.95
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if size * (-math.log1p(-middle) - middle) < FULL else (low, middle)
    return low


def whole(number: float) -> int:
    """A count; refused where rounding has spoilt it, far to the left of dead times that nearly cancel."""
    if not abs(number - round(number)) < 0.05:
        raise InputError(
            "poles with dead time must be counted where rounding leaves some digits of the loop; here it does not, far "
            "to the left. Give a focus band with a lower upper end, or a limit nearer to the axis."
        )
    return round(number)
