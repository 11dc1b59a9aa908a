"""Sequential linear programmes in a trust region: for constraints of which about as many bind as there are unknowns.

    x --f, g, gradients--> linear programme within ± radius --> step, taken if the penalised objective falls as foretold

The penalty is exact: price times the largest violation; it rises until the violation is gone or cannot fall. At a
vertex, where as many constraints bind as there are variables, steps converge quadratically; the rows may be crests and
sorted roots, which a quasi-Newton method mistakes for one curved constraint.  Source: Fletcher & Sainz de la Maza,
Math. Programming 43 (1989) 235.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

PRICES = (30.0, 200.0, 1500.0)  # of the largest relative violation, in units of the objective
RADIUS, LARGEST_RADIUS, SMALLEST_RADIUS = 0.2, 0.6, 1e-7  # of a variable's size
SMALLEST_SIZE = 0.3  # of a variable, as which a smaller one counts
TAKEN, GOOD = 0.1, 0.7  # part of the foretold fall from which a step is taken, and the region widened
MET = 1e-5  # largest violation that needs no higher price
FAR = 0.5  # constraints with more room than this, and three radii, are left out of the linear programme


class Point(Protocol):
    """What a programme says at one x; see `solve.smooth.Point`."""

    objective: float
    slope: np.ndarray
    constraints: np.ndarray
    jacobian: np.ndarray


def sequential(
    at: Callable[[np.ndarray], Point], x: np.ndarray, low: np.ndarray, high: np.ndarray, *,
    iterations: int = 200, tolerance: float = 1e-7,
) -> tuple[np.ndarray, str]:  # fmt: skip
    """A local minimum of f subject to g >= 0 and bounds, from x (n,); and the words with which it ended.

    at : x → objective, gradient (n,), constraints (m,), their gradients (m, n)
    tolerance : fall of the penalised objective, foretold over a small region, at which it ends
    """
    left = iterations
    message = "iteration limit reached"
    for price in PRICES:
        x, used, message = _descended(at, x, low, high, price, left, tolerance)
        left -= used
        if left <= 0 or float(-at(x).constraints.min(initial=0.0)) <= MET:
            break
    return x, message


def _descended(at, x, low, high, price: float, iterations: int, tolerance: float) -> tuple[np.ndarray, int, str]:
    """Steps at one price until none helps."""

    def penalised(point: Point) -> float:
        return point.objective + price * max(0.0, float(-point.constraints.min(initial=0.0)))

    here = at(x)
    value, radius = penalised(here), RADIUS
    for k in range(iterations):
        size = np.maximum(np.abs(x), SMALLEST_SIZE)
        step, foretold = _step(
            here, np.maximum(low - x, -radius * size), np.minimum(high - x, radius * size), price, radius
        )
        fall = value - foretold
        if fall < tolerance:
            if radius <= 1e-3:
                return x, k, "no step of a linear programme helps"
            radius /= 4
            continue
        there = at(x + step)
        new = penalised(there)
        part = (value - new) / fall if np.isfinite(new) else -1.0
        if part > TAKEN:
            x, here, value = x + step, there, new
        radius = min(1.8 * radius, LARGEST_RADIUS) if part > GOOD else radius if part > 3 * TAKEN else radius / 2.5
        if radius < SMALLEST_RADIUS:
            return x, k, "the trust region has shrunk to nothing"
    return x, iterations, "iteration limit reached"


def _step(here: Point, low: np.ndarray, high: np.ndarray, price: float, radius: float) -> tuple[np.ndarray, float]:
    """Minimiser of the linear model and the penalised objective that it foretells."""
    from scipy.optimize import linprog

    n = len(low)
    near = np.flatnonzero(here.constraints < FAR + 3 * radius)
    rows = -np.column_stack([here.jacobian[near], np.ones(len(near))])
    found = linprog(
        np.append(here.slope, price), A_ub=rows, b_ub=here.constraints[near],
        bounds=[*zip(low, high, strict=True), (0.0, None)], method="highs",
    )  # fmt: skip
    if found.status != 0:
        return np.zeros(n), np.inf
    return found.x[:n], float(here.objective + here.slope @ found.x[:n] + price * found.x[n])
