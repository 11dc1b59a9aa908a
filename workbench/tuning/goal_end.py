"""What a system tends to at the ends of the frequency axis: the first term that is not zero, and limits made of it.

    ω → 0:  G = Σ M_k sᵏ, M_0 = D − C A⁻¹ B, M_k = −C A^{−(k+1)} B      ω → ∞:  G = D + Σ C A^{k−1} B s⁻ᵏ

A limit such as 0.01/s has no value where the axis ends, and 0·∞ none either: there the first term of the response that
does not vanish, c sᵏ, decides with that of the limit whether the measure ends at zero, at a number, or nowhere. A term
counts as zero below its own rounding, followed entry by entry, so the units of states and signals do not matter.
"""

import math

import numpy as np

from workbench.analysis.realisation import EPS, Realisation, balanced


def first_terms(system: Realisation, *, far: bool) -> tuple[np.ndarray, np.ndarray]:
    """Powers k (p, m) and coefficients (p, m) of G_ij ≈ c_ij sᵏ at an end; c = 0 where an entry vanishes altogether.

    A stable system; k ≥ 0 at ω → 0, k ≤ 0 at ω → ∞.
    """
    A, B, C, D = balanced(*system)
    n = len(A)
    power, size = np.zeros(D.shape, int), np.zeros(D.shape)
    left_over = np.ones(D.shape, bool)
    inverse = np.linalg.inv(A) if n and not far else None
    x, error = B, np.abs(B) * 0.0  # C x is the next term, `error` bounds x's rounding entry by entry
    for k in range(n + 1):
        if k == 0 and (far or n == 0):
            term, rounding = D, np.abs(D) * 0.0
        elif inverse is None:
            if k > 1:
                error = np.abs(A) @ (error + n * EPS * np.abs(x))
                x = A @ x
            term, rounding = C @ x, np.abs(C) @ (error + n * EPS * np.abs(x))
        else:
            solved = inverse @ x
            error = np.abs(inverse) @ (error + 2 * n * EPS * (np.abs(A) @ np.abs(solved) + np.abs(x)))
            x = solved
            direct = D if k == 0 else 0.0
            term, rounding = direct - C @ x, np.abs(C) @ (error + n * EPS * np.abs(x)) + EPS * np.abs(direct)
        found = left_over & (np.abs(term) > rounding)
        power[found], size[found] = -k if far else k, term[found]
        left_over &= ~found
    return power, size


def limit(power: np.ndarray, size: np.ndarray, weight_power, weight, *, far: bool) -> np.ndarray:
    """Limits (p, m) of c ωᵏ · w ωʲ at an end: c w, 0 or ∞; weights broadcast."""
    total = power + weight_power
    grows = total > 0 if far else total < 0
    return np.where(size == 0, 0.0, np.where(grows, math.inf, np.where(total == 0, size * weight, 0.0)))


def size_at_end(limits: np.ndarray) -> float:
    """The largest singular value of a matrix of limits; infinite if one of them is."""
    return float(np.linalg.norm(limits, 2)) if np.isfinite(limits).all() else math.inf
