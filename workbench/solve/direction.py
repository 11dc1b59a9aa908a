"""The direction of a nonsmooth step: the model's minimiser over a max of linear pieces, a metric and a box.

    gradients, gaps, metric, box --simplex_direction--> convex combination, step, slope

The model at x is t(d) = max_i (−gap_i + g_i'd) + ½ d'W⁻¹d over low ≤ d ≤ high. Its dual is a least-squares problem with
nonnegative unknowns and one normalisation, which scipy's NNLS solves in tens of microseconds.
"""

from typing import NamedTuple

import numpy as np

from workbench.errors import InputError

GAP_WEIGHT = 1e4  # κ: the dual gains the term (gap'λ)²/2κ, at most 1e-4 of gap'λ because κ is scaled by the largest gap


class Direction(NamedTuple):
    """Step and certificate of the model.

    weights : (k,) convex combination of the pieces;  combined : (n,) Σ λ_i g_i plus the pull of the bounds met
    step : (n,);  slope : t'(0) along the step as the model predicts it, negative unless stationary
    """

    weights: np.ndarray
    combined: np.ndarray
    step: np.ndarray
    slope: float


def simplex_direction(
    gradients: np.ndarray, gaps: np.ndarray, factor: np.ndarray, low: np.ndarray, high: np.ndarray
) -> Direction:
    """The minimiser of the model.

    Parameters
    ----------
    gradients : (k, n)
        One row per piece.
    gaps : (k,)
        How far each piece lies below the largest, not negative.
    factor : (n, n)
        L with W = L L', W the inverse of the model's Hessian.
    low, high : (n,)
        Room below and above, low ≤ 0 ≤ high, infinite where there is none.

    The shortest vector of a convex hull as nonnegative least squares: minimising ‖Gλ‖² + (1'λ − 1)² over λ ≥ 0 gives a
    multiple of it, because s²v + (s − 1)² has at its best s the value v/(1 + v), which grows with v. A linear term
    enters through the row √κ + gap/√κ.

    Source: Lawson & Hanson, Solving Least Squares Problems (1974), chapter 23; Hare & Sagastizábal (2010) for the use
    of gaps in nonconvex bundles.
    """
    from scipy.optimize import nnls

    gradients, gaps = np.atleast_2d(np.asarray(gradients, float)), np.asarray(gaps, float)
    if len(gradients) == 0 or gradients.shape[0] != len(gaps):
        raise InputError(
            f"each piece must have one gradient and one gap; got {len(gradients)} gradients and {len(gaps)} gaps. "
            "Give as many of both."
        )
    below, above = np.flatnonzero(np.isfinite(low)), np.flatnonzero(np.isfinite(high))
    count, n = gradients.shape
    walls = np.zeros((n, len(below) + len(above)))
    walls[below, np.arange(len(below))] = -1.0
    walls[above, len(below) + np.arange(len(above))] = 1.0
    slack = np.r_[-low[below], high[above]]
    top = factor.T @ np.hstack([gradients.T, walls])
    size = float(np.sqrt(np.max(np.sum(top[:, :count] ** 2, axis=0)))) or 1.0
    kappa = GAP_WEIGHT * max(float(gaps.max()), size**2, 1e-300)
    root = np.sqrt(kappa)
    row = np.r_[root + gaps / root, slack / root]
    unit = size * np.r_[np.ones(count), np.zeros(len(slack))]
    matrix = np.vstack([top, row, unit])
    target = np.r_[np.zeros(n + 1), size]
    try:
        solution, _ = nnls(matrix, target, maxiter=20 * matrix.shape[1])
    except RuntimeError:  # NNLS may cycle on nearly parallel gradients: the largest piece alone is a valid choice
        solution = np.r_[gaps == gaps.min(), np.zeros(len(slack), bool)].astype(float)
    total = float(solution[:count].sum())
    if total <= 0:
        solution = np.r_[gaps == gaps.min(), np.zeros(len(slack), bool)].astype(float)
        total = float(solution[:count].sum())
    solution = solution / total
    weights = solution[:count]
    combined = weights @ gradients + walls @ solution[count:]
    step = np.clip(-factor @ (factor.T @ combined), low, high)
    slope = float(np.max(gradients @ step - gaps))
    return Direction(weights, combined, step, slope)


def shortest(gradients: np.ndarray, low: np.ndarray, high: np.ndarray) -> tuple[float, np.ndarray]:
    """Norm of the smallest convex combination of gradients, bounds met counted in, and the combination.

    low, high : room of each coordinate; a coordinate without room below absorbs a positive gradient, and vice versa
    """
    blocked_low = np.where(low < 0, -np.inf, 0.0)
    blocked_high = np.where(high > 0, np.inf, 0.0)
    found = simplex_direction(
        gradients, np.zeros(len(gradients)), np.eye(gradients.shape[1]), blocked_low, blocked_high
    )
    return float(np.linalg.norm(found.combined)), found.combined
