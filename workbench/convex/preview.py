"""The best that any linear controller can do against noise that strikes twice, at the front and a delay later.

    dx/dt = A x + B u + F w(t) + R w(t − T),   cost Σ_i c_i E|C_i x + D_i u|²

    c --Riccati--> P, K --+--> least cost of a controller that knows the state and every w so far
                          +--> plus what it loses if it has measurements y = C x + D u + v instead
      --the same differentiated--> slopes by every c_i

With E = e^{A_c T}, A_c = A − BK, the first is tr[F'PF + R'PR + 2F'E'PR − R'P G P R], G = X − E X E' and
A_c X + X A_c' + B R_u⁻¹B' = 0. Completing the square gives the loss: R_u times the variance of what the measurements
leave unknown of the noncausal optimum u* = −K x − R_u⁻¹B' ∫₀^∞ e^{A_c'τ} P [F w(t + τ) + R w(t + τ − T)] dτ, that is of
the state x(t) and of w over the last delay, on top of the future of w, which nobody knows.

That variance is approximated from below: the error covariance of a linear functional ⟨h, w⟩ is
⟨h, (I + 𝒢*V⁻¹𝒢)⁻¹ h⟩ = max_w 2⟨h, w⟩ − ⟨w, w⟩ − ⟨𝒢w, V⁻¹𝒢w⟩, 𝒢 from w to what is measured, and w is taken constant on
cells, with exact integrals. So both numbers stay bounds from below for every controller that has the measurements.

Source: Anderson & Moore, Optimal Control (1990); Kailath, Sayed & Hassibi, Linear Estimation (2000), ch. 16; doubling:
Chu, Fan, Lin & Wang, Int. J. Control 77 (2004) 767.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from workbench.errors import InputError
from workbench.lti.exponential import advanced

CELLS = 40  # of a wheel-base delay, on each of which the noise is held constant; twice as many add 0.1 % at most
DOUBLINGS = 18  # of the window of measurements: 2^18 cells of 3 ms are a quarter of an hour


class Cost(NamedTuple):
    """One quadratic cost E|C x + D u|²: (q, n), (q, m)."""

    C: np.ndarray
    D: np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """What is measured: the first `states` states through C (p, states), with white noise of two-sided intensity V."""

    states: int
    C: np.ndarray
    intensity: np.ndarray  # (p,), positive


class Optimum(NamedTuple):
    """The least cost, its slope by each coefficient, and the residual of the Riccati equation relative to its terms."""

    value: float
    slopes: np.ndarray
    residual: float


class PreviewRegulator:
    """The optimum as a function of the costs' coefficients.

    A : (n, n);  B : (n, m);  front, rear : (n, k);  delay : T [s];  costs : sequence of Cost;  measured : Measured, or
    None for a controller that knows everything so far, as is assumed without a delay
    """

    def __init__(self, A, B, front, rear, delay: float, costs: Sequence[Cost], measured: Measured | None) -> None:
        if delay == 0:
            front, rear = front + rear, np.zeros_like(rear)
        self.A, self.B, self.front, self.rear, self.delay = A, B, front, rear, delay
        self.Q = np.array([c.C.T @ c.C for c in costs])
        self.S = np.array([c.C.T @ c.D for c in costs])
        self.R = np.array([c.D.T @ c.D for c in costs])
        self.estimate = None if measured is None else _Estimate(A, front, rear, delay, measured)

    def at(self, coefficients) -> Optimum:
        """The optimum at non-negative coefficients (costs,).

        Raises InputError where the control is not penalised in every direction, or the Riccati equation has no
        solution.
        """
        from scipy.linalg import expm, expm_frechet, solve_continuous_are

        A, B, F, W = self.A, self.B, self.front, self.rear
        c = np.asarray(coefficients, float)
        Q, S, R = (np.tensordot(c, M, 1) for M in (self.Q, self.S, self.R))
        try:
            P = solve_continuous_are(A, B, Q, R, s=S)
            K = np.linalg.solve(R, B.T @ P + S.T)
        except (np.linalg.LinAlgError, ValueError) as error:
            raise InputError(
                "the costs must penalise every control and make the plant's unstable motions visible; "
                f"the Riccati equation has no stabilising solution ({error}). Give the control a cost."
            ) from error
        closed = A - B @ K
        inverse = np.linalg.inv(R)
        spread = B @ inverse @ B.T
        E = expm(closed * self.delay)
        lyapunov = _Lyapunov(closed)
        X = lyapunov.forward(spread)
        G = X - E @ X @ E.T
        PW = P @ W
        value = _trace(F, P @ F) + _trace(W, PW) + 2 * _trace(E @ F, PW) - _trace(PW, G @ PW)
        residual = A.T @ P + P @ A + Q - K.T @ R @ K
        size = np.linalg.norm(P @ A) + np.linalg.norm(Q) + np.linalg.norm(K.T @ R @ K)
        slopes, changes = np.zeros(len(c)), []
        for i in range(len(c)):
            seen = self.Q[i] - self.S[i] @ K - K.T @ self.S[i].T + K.T @ self.R[i] @ K
            dP = lyapunov.backward(seen)
            dK = inverse @ (B.T @ dP + self.S[i].T - self.R[i] @ K)
            dA = -B @ dK
            dR = -inverse @ self.R[i] @ inverse
            dE = expm_frechet(closed * self.delay, dA * self.delay, compute_expm=False) if self.delay else 0 * E
            dX = lyapunov.forward(dA @ X + X @ dA.T + B @ dR @ B.T)
            turned = dE @ X @ E.T
            dG = dX - turned - turned.T - E @ dX @ E.T
            dPW = dP @ W
            slopes[i] = (
                _trace(F, dP @ F) + _trace(W, dPW) + 2 * _trace(dE @ F, PW) + 2 * _trace(E @ F, dPW)
                - 2 * _trace(dPW, G @ PW) - _trace(PW, dG @ PW)
            )  # fmt: skip
            changes.append((dK, dA, dR, dPW))
        if self.estimate is not None:
            loss, loss_slopes = self._loss(K, R, inverse, closed, PW, changes)
            value, slopes = value + loss, slopes + loss_slopes
        return Optimum(float(value), slopes, float(np.linalg.norm(residual) / size))

    def _loss(self, K, R, inverse, closed, PW, changes) -> tuple[float, np.ndarray]:
        """tr(R_u Cov) of what the measurements leave unknown of u*, and its slopes."""
        known, B = self.estimate, self.B
        assert known is not None
        ahead = _averages(closed.T, PW, known.step, CELLS)  # (cells, n, k)
        spread = known.spread(K, inverse @ (B.T @ ahead))
        slopes = []
        for i, (dK, dA, dR, dPW) in enumerate(changes):
            moved = _averages_slope(closed.T, dA.T, PW, dPW, known.step, CELLS)
            change = known.spread(dK, dR @ (B.T @ ahead) + inverse @ (B.T @ moved))
            slopes.append(_trace(spread, self.R[i] @ spread) + 2 * _trace(spread, R @ change))
        return _trace(spread, R @ spread), np.array(slopes)


class _Estimate:
    """What measurements since long ago leave unknown of the state and of the noise of the last delay.

    Noise is held constant on cells of length T/CELLS; z = (state, noise of the present cell and the CELLS before it).
    The covariance after a window of 2^k cells, from perfect knowledge before it, follows from the one after 2^(k−1)
    cells by structure-preserving doubling; it grows with the window, so each is a bound from below.
    """

    def __init__(self, A, front, rear, delay: float, measured: Measured) -> None:
        self.step = h = delay / CELLS
        n, k = front.shape
        advance, entered = advanced(A, np.hstack([front, rear]), h)
        factor = _recorded(A, front, rear, h, measured)
        e, size = measured.states, n + (CELLS + 1) * k
        step = np.zeros((size, size))
        step[:n, :n], step[:n, n : n + k], step[:n, -k:] = advance, entered[:, :k], entered[:, k:]
        step[n + k :, n:-k] = np.eye(CELLS * k)
        step[:n, n:] /= np.sqrt(h)  # the noise's coefficients have unit variance
        seen = np.zeros((len(factor), size))
        seen[:, :e], seen[:, n : n + k], seen[:, -k:] = factor[:, :e], factor[:, e : e + k], factor[:, e + k :]
        seen[:, n:] /= np.sqrt(h)
        fresh = np.zeros((size, size))
        fresh[n : n + k, n : n + k] = np.eye(k)
        covariance = _doubled(step, seen, fresh)
        past = np.r_[:n, n + k : size]  # what the coming cell brings is not asked for
        values, vectors = np.linalg.eigh(covariance[np.ix_(past, past)])
        self.root = vectors * np.sqrt(np.maximum(values, 0.0))

    def spread(self, gain, ahead) -> np.ndarray:
        """(m, r): square root of the covariance of gain · state + Σ ahead · noise, ahead (CELLS, m, k) oldest first."""
        blocks = np.moveaxis(ahead[::-1], 0, 1).reshape(len(gain), -1) / np.sqrt(self.step)
        return np.hstack([gain, blocks]) @ self.root


def _recorded(A, front, rear, h: float, measured: Measured) -> np.ndarray:
    """F with |F (e, w_F, w_R)|² = ∫ over a cell of y'V⁻¹y, e the state at its beginning, w held (Van Loan)."""
    from scipy.linalg import expm

    e, k = measured.states, front.shape[1]
    both = np.zeros((e + 2 * k, e + 2 * k))
    both[:e, :e], both[:e, e : e + k], both[:e, e + k :] = A[:e, :e], front[:e], rear[:e]
    seen = np.hstack([measured.C, np.zeros((len(measured.C), 2 * k))]) / np.sqrt(measured.intensity)[:, None]
    size = len(both)
    whole = expm(np.block([[-both.T, seen.T @ seen], [np.zeros((size, size)), both]]) * h)
    gram = whole[size:, size:].T @ whole[:size, size:]
    values, vectors = np.linalg.eigh((gram + gram.T) / 2)
    return np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T


def _doubled(step, seen, fresh) -> np.ndarray:
    """Covariance of z before the measurement, from zero, after 2^DOUBLINGS cells or as soon as it stands still."""
    A, G, H = step.T, seen.T @ seen, fresh
    unit = np.eye(len(A))
    for _ in range(DOUBLINGS):
        both = np.linalg.solve(unit + G @ H, np.hstack([A, G]))
        gained = A.T @ H @ both[:, : len(A)]
        G = G + A @ both[:, len(A) :] @ A.T
        A = A @ both[:, : len(A)]
        H = H + (gained + gained.T) / 2
        G = (G + G.T) / 2
        if np.linalg.norm(gained) < 1e-10 * np.linalg.norm(H):
            break
    return H


class _Lyapunov:
    """Solutions of A X + X A' + Q = 0 and A'X + X A + Q = 0 for many Q, by one Schur form."""

    def __init__(self, A: np.ndarray) -> None:
        from scipy.linalg import schur

        self.T, self.U, *_ = schur(A)

    def forward(self, Q: np.ndarray) -> np.ndarray:
        """X of A X + X A' + Q = 0."""
        return self._solve(Q, "N", "T")

    def backward(self, Q: np.ndarray) -> np.ndarray:
        """X of A'X + X A + Q = 0."""
        return self._solve(Q, "T", "N")

    def _solve(self, Q: np.ndarray, left: str, right: str) -> np.ndarray:
        from scipy.linalg.lapack import dtrsyl  # pyright: ignore[reportAttributeAccessIssue]

        Y, shrink, _ = dtrsyl(self.T, self.T, -(self.U.T @ Q @ self.U), trana=left, tranb=right)
        X = self.U @ (Y / shrink) @ self.U.T
        return (X + X.T) / 2


def _trace(a: np.ndarray, b: np.ndarray) -> float:
    """tr(a'b)."""
    return float(np.sum(a * b))


def _averages(M: np.ndarray, b: np.ndarray, h: float, count: int) -> np.ndarray:
    """(count, n, k): ∫ of e^{Ms} b over each cell of length h from 0 on."""
    advance, current = advanced(M, b, h)
    out = []
    for _ in range(count):
        out.append(current)
        current = advance @ current
    return np.array(out)


def _averages_slope(M, dM, b, db, h: float, count: int) -> np.ndarray:
    """The change of `_averages` with dM and db."""
    n = len(M)
    twice = np.block([[M, dM], [np.zeros((n, n)), M]])
    return _averages(twice, np.vstack([db, b]), h, count)[:, :n]
