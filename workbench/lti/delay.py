"""Systems whose states include delay lines: the frequency response exactly, and a finite number of states instead.

    state x_i: its derivative (or next value) is row i;  line η_i: its value one dead time later is row i

So a row's symbol is s (or z = e^(sh)) for a state and e^(s·dead time) for a line, and with Λ the diagonal of symbols
G(s) = D + C (Λ − A)⁻¹ B whatever the rows are.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from workbench.errors import InputError
from workbench.lti.algebraic import IllPosedError, closing
from workbench.lti.realisation import EPS, Realisation, responder

MANY = 12  # frequencies from which one Schur form is cheaper than a linear system each


class LinedSystem(NamedTuple):
    """The matrices (n + q, n + q), (n + q, m), (p, n + q), (p, m) of n states, then q lines."""

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    dead_times: np.ndarray  # (q,) [s]
    sample_time: float | None = None

    def symbols(self, omega: np.ndarray, more: int = 0) -> np.ndarray:
        """Λ (k, n + q + more) at (k,) [rad/s]; `more` states come behind the lines."""
        state = 1j * omega if self.sample_time is None else on_circle(omega * self.sample_time)
        n, q = len(self.A) - len(self.dead_times), len(self.dead_times)
        out = np.empty((len(omega), n + q + more), complex)
        out[:] = state[:, None]
        out[:, n : n + q] = np.exp(1j * omega[:, None] * self.dead_times)
        return out

    def late(self, more: int = 0) -> np.ndarray:
        """Dead times (n + q + more,) of the rows, zero for states; `more` states come behind the lines."""
        n = len(self.A) - len(self.dead_times)
        return np.r_[np.zeros(n), self.dead_times, np.zeros(more)]

    def response(self, omega: np.ndarray) -> np.ndarray:
        """G (k, p, m) at (k,) [rad/s], each from its own linear system.

        A Schur form fills what is zero in a chain of integrators, and its rounding then hides a steep roll-off.
        """
        omega = np.atleast_1d(np.asarray(omega, float))
        if not self.plain or np.isnan(omega).any():
            return response(self.A, self.B, self.C, self.D, self.symbols, omega, plain=self.plain)
        found = np.broadcast_to(self.D.astype(complex), (len(omega), *self.D.shape)).copy()
        finite = omega[np.isfinite(omega)]
        found[np.isfinite(omega)] += self.C @ resolved(self.A, self.symbols(finite), self.B, finite)
        return found

    @property
    def plain(self) -> bool:
        """Whether every row's symbol is jω."""
        return self.sample_time is None and len(self.dead_times) == 0


def on_circle(angle: np.ndarray) -> np.ndarray:
    """z = exp(j angle), −1 itself at the Nyquist frequency: π is no floating-point number."""
    return np.where(np.abs(angle - np.pi) <= 4 * EPS * np.pi, -1.0, np.exp(1j * angle))


def response(A, B, C, D, symbols, omega: np.ndarray, *, plain: bool) -> np.ndarray:
    """D + C (Λ − A)⁻¹ B, (k, p, m) at (k,) [rad/s]; `plain` says that Λ = jω I, which has faster ways at many ω."""
    omega = np.asarray(omega, float)
    if not plain and not np.isfinite(omega).all():
        raise InputError("omega must be finite for sampled systems and for dead times; got infinity or NaN.")
    if np.isnan(omega).any():
        raise InputError("omega must hold numbers; got NaN.")
    if plain and (len(omega) >= MANY or not np.isfinite(omega).all()):
        return responder(A, B, C, D)(omega)
    return C @ resolved(A, symbols(omega), B, omega) + D


def resolved(A: np.ndarray, symbols: np.ndarray, B: np.ndarray, omega: np.ndarray) -> np.ndarray:
    """(Λ − A)⁻¹ B, (k, n, m); one sentence if a frequency sits on a pole."""
    if len(A) == 0:
        return np.zeros((len(symbols), 0, B.shape[-1]), complex)
    pencil = np.broadcast_to(-A.astype(complex), (len(symbols), *A.shape)).copy()
    pencil[:, range(len(A)), range(len(A))] += symbols
    try:
        return np.linalg.solve(pencil, np.broadcast_to(B, (len(symbols), *B.shape[-2:])))
    except np.linalg.LinAlgError:
        at = omega[np.argmin(np.linalg.svd(pencil, compute_uv=False)[:, -1])]
        raise InputError(
            f"omega must avoid the poles on the stability limit; got {float(at)!r} rad/s. Move it or add damping."
        ) from None


def rational(system: LinedSystem, order: int) -> Realisation:
    """The system without lines: a Padé fraction of the given order for each, or a chain of states if sampled.

    Raises InputError where the fractions' direct gain closes an algebraic loop.
    """
    q = len(system.dead_times)
    if q == 0:
        return Realisation(system.A, system.B, system.C, system.D)
    n = len(system.A) - q
    if system.sample_time is None:
        parts = [pade(dead_time, order) for dead_time in system.dead_times]
    else:
        parts = [chain(round(dead_time / system.sample_time)) for dead_time in system.dead_times]
    F, G, H = (_diagonal([part[i] for part in parts]) for i in range(3))
    J = np.diag([part[3].item() for part in parts])
    # η = H x_d + J v and v = A_vx x + A_vη η + B_v w, the lines' rows
    A_xx, A_xl, A_lx, A_ll = system.A[:n, :n], system.A[:n, n:], system.A[n:, :n], system.A[n:, n:]
    E, sound = closing(A_ll, J)
    if not sound:
        raise IllPosedError("the delay lines' fractions close an algebraic loop; choose another pade_order.")
    v_x, v_d, v_w = E @ A_lx, E @ A_ll @ H, E @ system.B[n:]
    l_x, l_d, l_w = J @ v_x, H + J @ v_d, J @ v_w
    A = np.block([[A_xx + A_xl @ l_x, A_xl @ l_d], [G @ v_x, F + G @ v_d]])
    B = np.vstack([system.B[:n] + A_xl @ l_w, G @ v_w])
    C = np.hstack([system.C[:, :n] + system.C[:, n:] @ l_x, system.C[:, n:] @ l_d])
    return Realisation(A, B, C, system.D + system.C[:, n:] @ l_w)


def pade(dead_time: float, order: int) -> Realisation:
    """The diagonal Padé fraction of e^(−s·dead_time), an all-pass, in coordinates with A + A' = −B B' = −C' C."""
    A, B, C, D = _pade_of_one(order)
    root = dead_time**-0.5
    return Realisation(A / dead_time, B * root, C * root, D)


@cache
def _pade_of_one(order: int) -> Realisation:
    """The fraction of e^(−s).

    Denominator Σ c_k s^k with c_k = c_(k−1) (N − k + 1) / (k (2N − k + 1)); numerator with s → −s. The controllable
    form is turned by a factor of its Gramian, which makes both Gramians of the all-pass the identity.
    Source: Golub & Van Loan, Matrix Computations, 4th ed., §9.3.1.
    """
    from scipy.linalg import solve_continuous_lyapunov

    c = np.ones(order + 1)
    for k in range(1, order + 1):
        c[k] = c[k - 1] * (order - k + 1) / (k * (2 * order - k + 1))
    monic, numerator = c / c[-1], c * (-1.0) ** np.arange(order + 1) / c[-1]
    direct = numerator[-1]
    A = np.eye(order, k=1)
    A[-1] = -monic[:-1]
    scale = monic[0] ** (np.arange(order) / order)  # state k in units of the poles' mean size to the power k
    A = A / scale[:, None] * scale
    B, C = np.eye(order, 1, k=1 - order), (numerator[:-1] - direct * monic[:-1]) * scale / scale[-1]
    L = np.linalg.cholesky(solve_continuous_lyapunov(A, -B @ B.T))
    return Realisation(np.linalg.solve(L, A @ L), np.linalg.solve(L, B), C[None] @ L, np.array([[direct]]))


def chain(samples: int) -> Realisation:
    """z^−samples as a chain of states."""
    A = np.eye(samples, k=-1)
    B, C = np.eye(samples, 1), np.eye(1, samples, k=samples - 1)
    return Realisation(A, B, C, np.zeros((1, 1)))


def _diagonal(parts: list[np.ndarray]) -> np.ndarray:
    from scipy.linalg import block_diag

    return np.asarray(block_diag(*parts))
