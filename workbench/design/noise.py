"""Mean squares of a loop under white noise, with derivatives by the parameters it depends on.

A, B --Lyapunov--> covariance P;  outputs C --adjoint Lyapunov--> X;  gradient 2 tr(X dA P + X dB B')
"""

import numpy as np

ROUNDING = 1e-9  # of the largest eigenvalue: a root nearer to the axis than this counts as on it


def mean_squares(A, A_slope, B, B_slope, C) -> tuple[np.ndarray, np.ndarray]:
    """Mean squares (k,) of the outputs C x, and their derivatives (k, p).

    A : (n, n), A_slope : (n, n, p);  B : (n, m), B_slope : (n, m, p);  C : (k, n)
    Beyond the axis, where there is none, that of A moved back to it: a solver's trial point gets a finite value.
    """
    from scipy.linalg import solve_continuous_lyapunov as lyapunov

    poles = np.linalg.eigvals(A)
    beyond = float(poles.real.max() + ROUNDING * np.abs(poles).max())
    A = A - max(0.0, beyond) * np.eye(len(A))
    P = lyapunov(A, -B @ B.T)
    values, slopes = [], []
    for row in C:
        X = lyapunov(A.T, -np.outer(row, row))
        by_A, by_B = np.einsum("ij,ijp->p", X @ P, A_slope), np.einsum("ij,ijp->p", X @ B, B_slope)
        values.append(row @ P @ row)
        slopes.append(2 * (by_A + by_B))
    return np.array(values), np.array(slopes)
