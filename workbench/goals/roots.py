"""Limits on poles judged with dead times exact: roots located by collocation, and counted so that none is left out.

    limit --worst root located--> level --count of roots beyond it is 0--> value and a proved upper level
                                        --it is not--> bisected by counting alone

A cycle with a dead time has infinitely many roots. Far out their decay grows slowly and their damping falls to zero, so
limits on damping and on frequency need a focus band with a finite upper end.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.errors import InputError
from workbench.lti.cycle import Cycle, parts
from workbench.lti.region import faster, lighter, slower
from workbench.lti.roots import first_empty, located

COUNTED = "characteristic roots located by collocation, none left out by the argument principle"
ALL_ANGLES = 1 - 1e-9  # a damping ratio beyond which a root counts as real


@dataclass(frozen=True, slots=True)
class RootLimit:
    """One limit of a region at its worst root."""

    what: str
    value: float
    upper: float  # proved: no root lies beyond
    pole: complex


def root_limits(region: Any, A: np.ndarray, late: np.ndarray) -> list[RootLimit]:
    """Every limit of a region (`goal_poles.Region`) on each part of a loop that has roots in the focus band.

    Raises InputError where a limit has no meaning for infinitely many roots, or they cannot be counted.
    """
    poles, cycles = parts(A, late)
    check_focus(region, A, late)
    low, high = region.focus
    size = np.abs(poles)
    found = _worst(region, poles[(size >= low) & (size <= high)])
    return found + [limit for cycle in cycles for limit in _of_cycle(region, cycle)]


def check_focus(region: Any, A: np.ndarray, late: np.ndarray) -> None:
    """Refuse limits on damping and frequency of infinitely many roots."""
    limited = region.damping is not None or region.frequency is not None
    if limited and math.isinf(region.focus[1]) and parts(A, late)[1]:
        raise InputError(
            "a limit on damping or frequency of a loop with dead time must have a focus band with an upper end; got "
            "none. The loop has infinitely many poles, whose damping falls to zero; give focus=(0, highest rad/s)."
        )


def _worst(region: Any, poles: np.ndarray) -> list[RootLimit]:
    """Each limit at the worst of some poles."""
    if len(poles) == 0:
        return []
    ranked = [(what, measure, int(np.argmax(measure))) for what, measure, _ in region.measures(poles)]
    return [RootLimit(what, float(m[k]), float(m[k]), complex(poles[k])) for what, m, k in ranked]


def _of_cycle(region: Any, cycle: Cycle) -> list[RootLimit]:
    low, high = region.focus
    roots = located(cycle, None if math.isinf(high) else high)
    seen = roots[(np.abs(roots) >= low) & (np.abs(roots) <= high)]
    found = []
    guesses = {limit.what: limit for limit in _worst(region, seen)}
    for what in ("decay", "damping", "frequency"):
        if getattr(region, what) is None:
            continue
        guess = guesses.get(what)
        start = _least(region, what, cycle) if guess is None else guess.value
        # a level's size: what one root's size is in units of the limit
        near = 1.0 if what != "decay" else abs(guess.pole if guess else 1 / cycle.dead_times.max()) / _unit(region)
        near = max(near, abs(start))
        value, upper = first_empty(
            lambda level, most, what=what: _beyond(region, cycle, what, level, most), start, near
        )
        if guess is not None or value > start:
            found.append(RootLimit(what, value, upper, guess.pole if guess else complex("nan")))
    return found


def _beyond(region: Any, cycle: Cycle, what: str, level: float, most: int) -> int:
    """Number of roots in the focus band whose measure exceeds a level."""
    if what == "decay":
        return slower(cycle, (level - 1) * _unit(region) - region.decay, region.focus, most)
    if what == "frequency":
        return faster(cycle, level * region.frequency, region.focus, most)
    damping = (2 - level) * region.damping
    return 0 if damping <= -1 else lighter(cycle, min(damping, ALL_ANGLES), region.focus, most)


def _least(region: Any, what: str, cycle: Cycle) -> float:
    """A level that every root of the band exceeds, as far as is known."""
    low, high = region.focus
    if what == "frequency":
        return low / region.frequency
    if what == "damping":
        return 2 - ALL_ANGLES / region.damping
    end = high if math.isfinite(high) else 10 / float(cycle.dead_times.min())
    return 1 + (region.decay - end) / _unit(region)


def _unit(region: Any) -> float:
    return region.decay or 1.0
