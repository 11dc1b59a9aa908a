"""A state some time later: the exponential of a matrix, and what inputs held meanwhile add to it.

    x' = A x + B u, u held --advanced--> x(t) = e^{At} x(0) + ∫₀ᵗ e^{As} ds B u

Source: Van Loan, IEEE Trans. Automatic Control 23 (1978) 395.
"""

import numpy as np


def advanced(A: np.ndarray, B: np.ndarray, time: float) -> tuple[np.ndarray, np.ndarray]:
    """e^{At} (n, n) and ∫₀ᵗ e^{As} ds B (n, m) from one exponential; t of any sign. What overflows is not finite."""
    from scipy.linalg import expm

    n, m = B.shape
    whole = np.zeros((n + m, n + m))
    whole[:n, :n], whole[:n, n:] = A, B
    if len(whole) == 0:
        return whole, whole
    with np.errstate(all="ignore"):
        both = expm(whole * time)[:n]
    return both[:, :n], both[:, n:]
