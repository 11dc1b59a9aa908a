"""How many roots of a cycle lie in a region of poles: too little decay, too little damping, too high a frequency.

         ╭──── arc of radius R           turns of det X along the upper half of the edge, on which it is real at both
         │╲                              ends, are half of those along the whole
    σ ───┼─╲── edge: Re s = σ, or the ray of a damping ratio
         │  ╲

Only a band low < |s| < high counts: what lies within the arc of `high` less what lies within that of `low`.
"""

import math

import numpy as np

from workbench.errors import InputError
from workbench.lti.count import MOST, right_of, turn, whole
from workbench.lti.cycle import Cycle

Band = tuple[float, float]  # (low, high) of |s| [rad/s]
DIGITS = 30.0  # −Re s · dead time: beyond it e^(−s·dead time) exceeds 1e13 and differences of two have no digits left


def slower(cycle: Cycle, sigma: float, band: Band, most: int = MOST) -> int:
    """Number of roots with Re s > σ and |s| in the band."""

    def within(radius: float) -> int:
        if math.isinf(radius):
            return right_of(cycle, sigma, most=most)
        if radius <= max(sigma, 0.0):
            return 0
        angle = math.acos(max(sigma / radius, -1.0))
        return _enclosed(cycle, radius, angle, sigma if sigma > -radius else None, most)

    return within(band[1]) - within(band[0])


def lighter(cycle: Cycle, damping: float, band: Band, most: int = MOST) -> int:
    """Number of roots with −Re s/|s| < damping and |s| in the band, whose upper end is finite."""
    angle = math.pi / 2 + math.asin(damping)

    def within(radius: float) -> int:
        return 0 if radius == 0 else _enclosed(cycle, radius, angle, 0.0, most)

    return within(band[1]) - within(band[0])


def faster(cycle: Cycle, frequency: float, band: Band, most: int = MOST) -> int:
    """Number of roots with |s| > frequency in the band, whose upper end is finite."""

    def within(radius: float) -> int:
        return 0 if radius == 0 else _enclosed(cycle, radius, math.pi, None, most)

    return within(band[1]) - within(min(max(frequency, band[0]), band[1]))


def _enclosed(cycle: Cycle, radius: float, angle: float, foot: float | None, most: int) -> int:
    """Roots within an arc about zero from −angle to angle and the two edges from its ends to a real foot, if any."""
    left = -radius * math.cos(angle)
    if left * float(cycle.dead_times.max()) > DIGITS:
        raise InputError(
            f"poles with dead time are counted to −{DIGITS / cycle.dead_times.max():.4g} 1/s, {DIGITS:g} over the "
            f"longest dead time; a focus up to {radius:.4g} rad/s asks for more. Give it a lower upper end."
        )
    total = turn(cycle, lambda t: radius * np.exp(1j * angle * t), np.linspace(0, 1, 33), upright=False, most=most)
    if foot is not None:
        end = radius * np.exp(1j * angle)
        near = np.r_[0.0, np.geomspace(1e-9, 1.0, 40)]  # of the way from the foot: roots crowd at any scale there
        total -= turn(cycle, lambda t: foot + (end - foot) * t, near, upright=False, most=most)
    return whole(total / math.pi)
