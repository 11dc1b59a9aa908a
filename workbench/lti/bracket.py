"""Zeros of real functions in brackets, and a maximum in an interval: all points of a step asked at once.

brackets (k,) --inverse quadratic interpolation, bisection as guard--> zeros (k,)
"""

from collections.abc import Callable

import numpy as np

STEPS = 200  # of a bracket over 300 decades bisected to the last digit; interpolation takes about ten
ZOOM = 11  # points of an interval, of which the two beside the largest bound the next


def zeros_between(
    function: Callable[[np.ndarray], np.ndarray], low: np.ndarray, high: np.ndarray, relative: float
) -> np.ndarray:
    """One zero in each bracket.

    Parameters
    ----------
    function : (k,) -> (k,)
        Real and continuous; entry i is asked within bracket i, at whose ends its signs differ.
    low, high : (k,)
    relative : float
        Width of the bracket left, of the zero's size.

    Returns
    -------
    (k,)

    Source: Chandrupatla, Advances in Engineering Software 28 (1997) 145.
    """
    a, b = np.array(high, float), np.array(low, float)
    fa, fb = function(a), function(b)
    c, fc, t, settled = b.copy(), fb.copy(), np.full(len(a), 0.5), np.zeros(len(a), bool)
    best = np.where(np.abs(fa) < np.abs(fb), a, b)
    for _ in range(STEPS):
        near = np.minimum(np.abs(fa), np.abs(fb))
        best = np.where(settled, best, np.where(np.abs(fa) <= np.abs(fb), a, b))
        width = np.abs(b - a)
        least = relative * np.abs(best)
        settled |= (near == 0) | (width <= 2 * least)
        if settled.all():
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            x = np.where(settled, best, a + np.clip(t, least / width, 1 - least / width) * (b - a))
            fx = function(x)
            same = np.sign(fx) == np.sign(fa)
            c, fc = np.where(same, a, b), np.where(same, fa, fb)
            b, fb = np.where(same, b, a), np.where(same, fb, fa)
            a, fa = x, fx
            xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
            quadratic = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
            t = np.where((phi**2 < xi) & ((1 - phi) ** 2 < 1 - xi), quadratic, 0.5)
    return best


def largest_between(function: Callable[[np.ndarray], np.ndarray], low: float, high: float, width: float) -> float:
    """The largest value of a function (k,) -> (k,) with one maximum in an interval, narrowed to `width`."""
    best = -np.inf
    while True:
        points = np.linspace(low, high, ZOOM)
        values = function(points)
        k = int(values.argmax())
        best = max(best, float(values[k]))
        if high - low <= width:
            return best
        low, high = points[max(k - 1, 0)], points[min(k + 1, ZOOM - 1)]
