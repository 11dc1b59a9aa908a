"""What a system tends to at the ends of the frequency axis: the first term that is not zero, and limits made of it.

    ω → 0:  G = Σ M_k sᵏ, M_0 = D − C A⁻¹ B, M_k = −C A^{−(k+1)} B      ω → ∞:  G = D + Σ C A^{k−1} B s⁻ᵏ

A limit such as 0.01/s has no value where the axis ends, and 0·∞ none either: there the first term of the response that
does not vanish, c sᵏ, decides with that of the limit whether the measure ends at zero, at a number, or nowhere. A term
counts as zero below its own rounding, followed entry by entry, so the units of states and signals do not matter.
"""

import math

import numpy as np

from workbench.lti.fraction import realised
from workbench.lti.join import difference, series
from workbench.lti.realisation import EPS, Realisation, balanced, responder

QUOTIENT = 1e-9  # relative: what a quotient may differ by from the response and the limit that it is made of


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


def over_steep(system: Realisation, top: np.ndarray, bottom: np.ndarray) -> Realisation | None:
    """G bottom/top where G falls at least as steeply as top/bottom, so that the quotient is proper; else None.

    With bottom = Q top + R, G Q is (A, Q(A) B, C, q C A^{r−1} B): G's terms before s^{−r} vanish, r the degree of Q.
    None too where rounding spoils more than `QUOTIENT` of it, as its values at the corners tell.
    """
    unit = float(abs(bottom[-1] / bottom[0])) ** (1 / (len(bottom) - 1)) or 1.0  # of time, as the mean pole has it
    top, bottom = (part * unit ** np.arange(len(part) - 1, -1, -1.0) for part in (top, bottom))
    system = Realisation(system.A / unit, system.B / unit, system.C, system.D)
    Q, R = np.polydiv(bottom, top)
    R = R[max(len(R) - len(top) + 1, 0) :]  # what stands before is rounding
    r, (power, size) = len(Q) - 1, first_terms(system, far=True)
    if np.any((size != 0) & (power > -r)):
        return None
    A, B, C, D = system
    x = np.zeros_like(B)
    for q in Q:  # Horner's rule
        x = A @ x + q * B
    quotient = Realisation(A, x, C, Q[0] * (C @ np.linalg.matrix_power(A, r - 1) @ B))
    if len(top) > 1 and R.any():
        rest = _from_fraction(R, top, len(D))
        quotient = difference(
            quotient, series(Realisation(rest.A, rest.B, -rest.C, rest.D), Realisation(A, B, C, D * 0))
        )
    corners = np.abs(np.r_[np.roots(top), np.roots(bottom), np.linalg.eigvals(A)])
    s = 1j * corners
    wanted = responder(*system)(corners) * (np.polyval(bottom, s) / np.polyval(top, s))[:, None, None]
    error = np.abs(responder(*quotient)(corners) - wanted).max(axis=(1, 2))
    if not np.all(error <= QUOTIENT * np.abs(wanted).max(axis=(1, 2))):
        return None
    return Realisation(quotient.A * unit, quotient.B * unit, quotient.C, quotient.D)


def _from_fraction(top: np.ndarray, bottom: np.ndarray, count: int) -> Realisation:
    """top/bottom on each of `count` signals."""
    one = realised([[np.trim_zeros(top, "f")]], [[bottom]])
    return Realisation(*(np.kron(np.eye(count), part) for part in one))


def limit(power: np.ndarray, size: np.ndarray, weight_power, weight, *, far: bool) -> np.ndarray:
    """Limits (p, m) of c ωᵏ · w ωʲ at an end: c w, 0 or ∞; weights broadcast."""
    total = power + weight_power
    grows = total > 0 if far else total < 0
    return np.where(size == 0, 0.0, np.where(grows, math.inf, np.where(total == 0, size * weight, 0.0)))


def size_at_end(limits: np.ndarray) -> float:
    """The largest singular value of a matrix of limits; infinite if one of them is."""
    return float(np.linalg.norm(limits, 2)) if np.isfinite(limits).all() else math.inf
