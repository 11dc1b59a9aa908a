"""The energy of what a stable system does from given starts, and its gradient: two Lyapunov equations, one Schur form.

    y(t) = C e^{At} B    --A P + P A' + B B' = 0-->  ∫ |y|² dt = tr C P C'
    y_k = C A^k B        --A P A' − P + B B' = 0-->  Σ |y_k|²
                         --the same with A', C'---> Q, and the gradient 2 Q P, 2 Q B, 2 C P

So the H₂ norm (B the input matrix), and the energy of the transient of a step or a ramp (B replaced by A⁻¹B, A⁻²B).
"""

import numpy as np

from workbench.lti.bilinear import tustin
from workbench.lti.realisation import Realisation, state_scale

MOST_DOUBLINGS = 60


def energy(A: np.ndarray, B: np.ndarray, C: np.ndarray, *, sampled: bool):
    """The energy and its gradients with respect to A, B, C; A stable.

    A : (n, n), B : (n, m), C : (p, n). Sampled: without the direct term D.
    """
    if len(A) == 0:
        return 0.0, np.zeros_like(A), np.zeros_like(B), np.zeros_like(C)
    P, Q = _both_sampled(A, B, C) if sampled else gramians(A, B, C)
    value = float(np.einsum("pi,ij,pj->", C, P, C))
    by_A = 2 * Q @ A @ P if sampled else 2 * Q @ P
    return max(value, 0.0), by_A, 2 * Q @ B, 2 * C @ P


def gramians(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """P and Q with A P + P A' + B B' = 0 and A'Q + Q A + C'C = 0, by one Schur form; A (n, n) stable."""
    from scipy.linalg import schur
    from scipy.linalg.lapack import dtrsyl

    scale = state_scale(A)
    balanced = A / scale[:, None] * scale
    T, U, *_ = schur(balanced)
    drive, sight = U.T @ (B / scale[:, None]), (C * scale) @ U
    P, shrink, _ = dtrsyl(T, T, -drive @ drive.T, trana="N", tranb="T")
    Q, shrink_q, _ = dtrsyl(T, T, -sight.T @ sight, trana="T", tranb="N")
    P, Q = U @ (P / shrink) @ U.T, U @ (Q / shrink_q) @ U.T
    units = np.outer(scale, scale)
    return (P + P.T) / 2 * units, (Q + Q.T) / 2 / units


def _both_sampled(A: np.ndarray, B: np.ndarray, C: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same for a sampled system, through A → (A − I)(A + I)⁻¹, which leaves the Gramians up to known factors."""
    closing = np.linalg.inv(A + np.eye(len(A)))  # `bilinear.in_w_plane` at h = 2, its states as they are
    continuous = closing @ (A - np.eye(len(A)))
    return gramians(continuous, np.sqrt(2) * closing @ B, np.sqrt(2) * C @ closing)


def energy_by_doubling(A: np.ndarray, B: np.ndarray, C: np.ndarray, *, sampled: bool) -> float:
    """The energy by another route: P_{2k} = P_k + A^k P_k A^k' (Smith); continuous systems by their w plane."""
    if len(A) == 0:
        return 0.0
    if not sampled:  # s = r (z − 1)/(z + 1) with r near the poles keeps the sum short
        sizes = np.abs(np.linalg.eigvals(A))
        rate = float(np.exp(np.mean(np.log(np.maximum(sizes, 1e-12 * sizes.max())))))
        A, B, *_ = tustin(Realisation(A, B, C, np.zeros((len(C), B.shape[1]))), 2 / rate)
    P, power = B @ B.T, A
    for _ in range(MOST_DOUBLINGS):
        more = power @ P @ power.T
        P = P + more
        if (more.diagonal() <= 1e-16 * P.diagonal()).all():  # each state in its own unit
            break
        power = power @ power
    return float(np.einsum("pi,ij,pj->", C, P, C))
