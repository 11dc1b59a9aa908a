"""The structured singular value μ of complex matrices for diagonal complex perturbations, from above and from below.

    M (k, m, m) --balancing------> D that gives all channels units of like size                        (the first guess)
    M (k, m, m) --scaling_below--> D with σ_max(D M D⁻¹) under a level for all k at once, or the best there is   (μ ≤)
    M(jω)       --worst_turn-----> diagonal unitary Q and ω with a large spectral radius ρ(Q M)                  (μ ≥)

log σ_max(e^X M e^−X) is a convex function of the diagonal X, so the first is a small convex problem, solved by smooth
functions above it; the second climbs.
"""

import math
from collections.abc import Callable
from typing import cast

import numpy as np

# Scalings stay between 1e-4 and 1e4 of the balanced one; wider ones only approach channels that do not interact
SCALING_LIMIT = math.log(1e4)
BALANCED = 1e-13  # of the logarithm of a scaling: no further sweep
MOST_SWEEPS = 2000
ONE_WAY = 1e-3  # of what returns through the other channels: size that a coupling without a way back is brought to
SHARPER = (4.0, 32.0, 256.0, 2048.0, 16384.0, 131072.0)  # exponents; log σ_max is met to 3e-5 of 20 × 20 matrices
MOST_TURNS = 4  # singular vectors whose turns a climb starts from

Worst = tuple[float, float, np.ndarray]  # ρ(diag(turn) M(jω)), ω [rad/s], turn (m,) with |turn_k| = 1


def balancing(M: np.ndarray) -> np.ndarray:
    """Logarithms (m,) of the D for which the largest entries over k of D M_k D⁻¹ have rows and columns of equal length.

    M : (k, m, m)

    In any units of the channels the same D M D⁻¹, up to rounding: so what follows does not depend on units. A coupling
    that has no way back may be scaled to anything; it becomes `ONE_WAY` of the spectral radius.

    Source: Osborne, Journal of the ACM 7 (1960) 338.
    """
    size = np.abs(M).max(axis=0)
    level = float(np.abs(np.linalg.eigvals(size)).max())
    np.fill_diagonal(size, 0.0)
    one_way = (size > 0) & (size.T == 0)
    with np.errstate(divide="ignore"):
        logs = np.log(size)
        if level > 0:
            logs.T[one_way] = 2 * math.log(ONE_WAY * level) - logs[one_way]
    x = np.zeros(len(size))
    for _ in range(MOST_SWEEPS):
        largest = 0.0
        for i in range(len(x)):
            row, column = _log_norm(logs[i] + x[i] - x), _log_norm(logs[:, i] + x - x[i])
            if math.isfinite(row) and math.isfinite(column):
                step = (column - row) / 2
                x[i] += step
                largest = max(largest, abs(step))
        if largest < BALANCED:
            break
    return x - x[0]


def _log_norm(logs: np.ndarray) -> float:
    """The logarithm of the length of a vector given by the logarithms of its entries."""
    top = float(logs.max())
    return top + math.log(float(np.sum(np.exp(2 * (logs - top))))) / 2 if math.isfinite(top) else top


def scaling_below(M: np.ndarray, level: float, start: np.ndarray) -> tuple[np.ndarray, float, int]:
    """A scaling under which all matrices have a largest singular value below a level, or the best scaling if none has.

    Parameters
    ----------
    M : (k, m, m) complex
    level : float
        The search ends when it is reached.
    start : (m,)
        Logarithms of the first D.

    Returns
    -------
    x : (m,), the logarithms of D
    size : float, the largest σ_max(D M_k D⁻¹)
    hardest : int, its k

    (1/2q) log of the sum of all σ^2q is smooth and convex in x, at least log σ_max and at most log(k m)/2q more; each q
    begins where the one before ended.
    """
    from scipy.optimize import minimize

    goal = math.log(level) if level > 0 else -math.inf
    first = np.clip(start[1:] - start[0], -SCALING_LIMIT, SCALING_LIMIT)
    best: tuple[float, np.ndarray, int] = (math.inf, first, 0)
    tiny = float(np.finfo(float).tiny)

    def smooth(x: np.ndarray, q: float) -> tuple[float, np.ndarray]:
        nonlocal best
        d = np.exp(np.r_[0.0, x])
        left, sizes, right = np.linalg.svd(d[:, None] * M / d)
        logs = np.log(np.maximum(sizes, tiny))
        top = float(logs.max())
        if top < best[0]:
            best = top, x.copy(), int(np.argmax(logs[:, 0]))
        if top <= goal:
            raise StopIteration  # the way out of the minimiser
        weights = np.exp(2 * q * (logs - top))
        slopes = np.einsum("ki,kai->a", weights, np.abs(left) ** 2) - np.einsum(
            "ki,kia->a", weights, np.abs(right) ** 2
        )
        return top + math.log(weights.sum()) / (2 * q), slopes[1:] / weights.sum()

    try:
        x, bounds = first, [(-SCALING_LIMIT, SCALING_LIMIT)] * len(first)
        for q in SHARPER if len(first) else ():
            x = minimize(smooth, x, args=(q,), jac=True, method="L-BFGS-B", bounds=bounds).x
        smooth(x, SHARPER[-1])
    except StopIteration:
        pass
    return np.r_[0.0, best[1]], math.exp(best[0]), best[2]


def worst_turn(response: Callable[[np.ndarray], np.ndarray], omega: float, x: np.ndarray) -> Worst:
    """A large spectral radius ρ(diag(turn) M(jω)) near a frequency.

    Parameters
    ----------
    response : omega (k,) → M (k, m, m)
    omega : float
        Where to begin [rad/s].
    x : (m,)
        Logarithms of a good scaling; its singular vectors give the first turns: where |u_i| = |v_i| they attain μ.

    Returns
    -------
    ρ, ω, turn
    """
    from scipy.optimize import minimize_scalar

    d = np.exp(x)
    M = response(np.array([omega]))[0]
    left, _, right = np.linalg.svd(d[:, None] * M / d)
    starts = [np.angle(right[k].conj()) - np.angle(left[:, k]) for k in range(min(len(x), MOST_TURNS))]
    size, turn = max((_climb(M, start) for start in (np.zeros(len(x)), *starts)), key=lambda found: found[0])
    if not 0 < omega < math.inf:
        return size, omega, turn
    angles = np.angle(turn)

    def fall(log_omega: float) -> float:
        turned = np.exp(1j * angles)[:, None] * response(np.array([math.exp(log_omega)]))[0]
        return -float(np.abs(np.linalg.eigvals(turned)).max())

    for _ in range(4):  # alternately along ω and over the turns
        middle = math.log(omega)
        found = minimize_scalar(fall, bounds=(middle - 0.1, middle + 0.1), method="bounded", options={"xatol": 1e-7})
        moved = math.exp(found.x)
        moved_size, moved_turn = _climb(response(np.array([moved]))[0], angles)
        if moved_size <= size * (1 + 1e-7):
            break
        size, omega, turn = moved_size, moved, moved_turn
        angles = np.angle(turn)
    return size, omega, turn


def _climb(M: np.ndarray, start: np.ndarray) -> tuple[float, np.ndarray]:
    """A local maximum over the angles θ of ρ(diag(e^jθ) M), and the turns that make that eigenvalue positive.

    With y, z the left and right eigenvectors of the largest eigenvalue, d log ρ/dθ_k = −Im(ȳ_k z_k / yᴴz).
    """
    from scipy.linalg import eig
    from scipy.optimize import minimize

    def fall(theta: np.ndarray) -> tuple[float, np.ndarray]:
        solution = eig(np.exp(1j * theta)[:, None] * M, left=True, right=True)
        values, left, right = cast(tuple[np.ndarray, np.ndarray, np.ndarray], solution)
        k = int(np.argmax(np.abs(values)))
        product = left[:, k].conj() * right[:, k]
        overlap = product.sum()
        if values[k] == 0 or overlap == 0:
            return 0.0, np.zeros(len(theta))
        return -math.log(abs(values[k])), np.imag(product / overlap)

    theta = minimize(fall, start, jac=True, method="BFGS").x if len(M) > 1 else start
    turn = np.exp(1j * theta)
    values = np.linalg.eigvals(turn[:, None] * M)
    largest = values[np.argmax(np.abs(values))]
    return float(abs(largest)), turn * np.exp(-1j * np.angle(largest))
