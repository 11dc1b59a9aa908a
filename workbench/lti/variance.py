"""Mean squares of a stable loop under white noises that reach it at several places, one after the other.

    A, (delay, B) of each place --arriving--> covariance of the state, with an error bound --> mean squares, mean power
    A, B_front, B_rear, delay  --stationary-->  the same of two places, a wheel base apart

    dx/dt = A x + Σ_k Σ_j B_j,k w_k(t − T_j)

w_k are white noises of unit two-sided intensity, E[w(t) w(t')] = δ(t − t'); a one-sided density S per hertz is the
intensity S/2, and the velocity of a track with one-sided roughness A_r/Ω² met at speed V has the intensity π A_r V.
Exact: no grid, no series for the delay.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from workbench.errors import InputError
from workbench.lti.realisation import EPS, matrix, square, stable_poles, state_scale
from workbench.result import Result, Row


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Stationary(Result):
    """The stationary covariance of a state, one for each independent noise, and how far it can be off.

    The exact covariance P of noise k obeys |v'(P − covariance[k])v| ≤ v' error[k] v for every vector v.
    """

    covariance: np.ndarray  # (k, n, n), symmetric
    error: np.ndarray  # (k, n, n), positive definite
    decay: float  # −largest real part of A's eigenvalues [1/s]

    def rows(self) -> list[Row]:
        """Sizes, decay and the relative error bound."""
        return [
            ("noises", len(self.covariance), ""),
            ("states", self.covariance.shape[1], ""),
            ("decay", self.decay, "1/s"),
            ("largest relative error bound of a state's mean square", self.relative_error(), ""),
        ]

    def mean_squares(self, C) -> np.ndarray:
        """E[y_i²] (k, p) of the outputs y = C x under each noise; C : (p, n)."""
        C = self._output("C", C)
        return np.einsum("pi,kij,pj->kp", C, self.covariance, C)

    def mean_square_bounds(self, C) -> np.ndarray:
        """(k, p): how far each of `mean_squares(C)` can be from the exact value of the given matrices."""
        C = self._output("C", C)
        return np.einsum("pi,kij,pj->kp", C, self.error, C)

    def products(self, C1, C2) -> np.ndarray:
        """E[y1_i y2_i] (k, p) of two sets of outputs y1 = C1 x and y2 = C2 x, row by row; C1, C2 : (p, n)."""
        C1, C2 = self._output("C1", C1), self._output("C2", C2)
        if C1.shape != C2.shape:
            raise InputError(
                f"C1 and C2 must have the same shape; got {C1.shape} and {C2.shape}. Pair each force with its velocity."
            )
        return np.einsum("pi,kij,pj->kp", C1, self.covariance, C2)

    def power(self, C1, C2) -> np.ndarray:
        """Mean power (k,): Σ_i E[y1_i y2_i] of forces y1 = C1 x and the velocities y2 = C2 x of their points."""
        return self.products(C1, C2).sum(axis=1)

    def relative_error(self) -> float:
        """The largest error bound of a state's mean square, over that state's mean square summed over the noises."""
        total = np.einsum("kii->i", self.covariance)
        bound = np.einsum("kii->i", self.error)
        present = total > 0
        return float(np.max(bound[present] / total[present])) if present.any() else 0.0

    def _output(self, name: str, C) -> np.ndarray:
        C = matrix(name, C)
        if C.shape[1] != self.covariance.shape[1]:
            raise InputError(
                f"{name} must have {self.covariance.shape[1]} columns, one per state; got shape {C.shape}."
            )
        return C


def stationary(A, B_front, B_rear=None, *, delay: float = 0.0, correlation=None) -> Stationary:
    """The stationary covariance of a stable state under white noises and the same noises delayed.

    Parameters
    ----------
    A : (n, n)
        Real, stable.
    B_front, B_rear : (n, k)
        One column per noise; B_rear zero if left out.
    delay : float
        T [s], not negative.
    correlation : (k, k), optional
        Correlation (or intensity) matrix of the noises, symmetric and positive semidefinite. If left out the noises are
        independent and each has its own covariance; if given, there is one covariance for all together.

    Raises
    ------
    InputError
        If A is not stable, shapes do not fit, the delay is negative or the correlation is not one.

    Solves A P + P A' + Q = 0 with Q = B_F R B_F' + B_R R B_R' + e^{AT} B_F R B_R' + B_R R B_F' e^{A'T}: one real Schur
    form for all noises, one step of iterative refinement, then the error bound. With E the error and ρ the norm of the
    residual (including the rounding of computing it), −ρH ≤ E ≤ ρH where A H + H A' + I = 0, because the Lyapunov
    operator keeps the order of matrices. The bound holds for A and Q as given; the rounding of Q itself, chiefly of
    e^{AT}, is not in it. Floating point, not outward-rounded.

    Source: Bartels & Stewart, Comm. ACM 15 (1972) 820; the delayed term: E[x(t) w(t − T)'] = e^{AT} B_F R + B_R R/2.

    Examples
    --------
    >>> state = stationary([[-2.0]], [[1.0]])
    >>> state.mean_squares([[1.0]]).round(9).tolist()  # 1/(2·2)
    [[0.25]]
    """
    A = square("A", A)
    front = matrix("B_front", B_front)
    rear = np.zeros_like(front) if B_rear is None else matrix("B_rear", B_rear)
    if len(front) != len(A) or rear.shape != front.shape:
        raise InputError(
            f"B_front and B_rear must have one row per state ({len(A)}) and one column per noise; "
            f"got shapes {front.shape} and {rear.shape}. Make them agree."
        )
    if not (math.isfinite(delay) and delay >= 0):
        raise InputError(f"delay must be a time of zero or more; got {delay!r} s. Give (a_F + a_R)/V.")
    return arriving(A, [(0.0, front), (delay, rear)] if rear.any() else [(0.0, front)], correlation=correlation)


def arriving(A, arrivals: Sequence[tuple[float, np.ndarray]], *, correlation=None) -> Stationary:
    """The stationary covariance under white noises that arrive more than once; see `stationary`.

    arrivals : (delay [s], B (n, k)) of each place, one column per noise, in the order of their delays

    Q = Σ_j B_j R B_j' + Σ_{i<j} [ e^{A(T_j − T_i)} B_i R B_j' + its transpose ].
    """
    scale = state_scale(A)
    A = A / scale[:, None] * scale
    poles = stable_poles(
        A, "A", "An unstable state has no stationary covariance; stabilise it or remove its drifting part."
    )
    placed = [(T, B / scale[:, None]) for T, B in arrivals]
    sources = _sources(A, placed, _mixing(correlation, placed[0][1].shape[1]))
    covariance, error = _solve(A, sources)
    units = np.outer(scale, scale)
    return Stationary(
        covariance=covariance * units, error=error * units, decay=float(-poles.real.max(initial=-math.inf))
    )


def _mixing(correlation, count: int) -> list[np.ndarray]:
    """One (k, k) intensity matrix per covariance asked for."""
    if correlation is None:
        return [np.diag(row) for row in np.eye(count)]
    R = square("correlation", correlation)
    size = np.linalg.norm(R)
    if (
        R.shape != (count, count)
        or np.linalg.norm(R - R.T) > 1e-12 * size
        or np.linalg.eigvalsh(R).min(initial=0) < -1e-12 * size
    ):
        # 1e-12: a matrix typed or computed in double precision is symmetric and semidefinite to that and better
        raise InputError(
            f"correlation must be positive semidefinite and ({count}, {count}); got shape {R.shape}. Mend it."
        )
    return [R]


def _sources(A, arrivals, mixing) -> np.ndarray:
    """Q (k, n, n) of every covariance."""
    from scipy.linalg import expm

    sources = [sum(B @ R @ B.T for _, B in arrivals) for R in mixing]
    for (first, B), (later, C) in combinations(arrivals, 2):
        met_again = expm(A * (later - first)) @ B
        for k, R in enumerate(mixing):
            cross = met_again @ R @ C.T
            sources[k] = sources[k] + cross + cross.T
    return np.array(sources)


def _solve(A: np.ndarray, sources: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """P (k, n, n) of A P + P A' + Q = 0 for each Q, and the matrices that bound the errors."""
    from scipy.linalg import schur
    from scipy.linalg.lapack import dtrsyl

    n = len(A)
    if n == 0:
        return sources.copy(), sources.copy()
    T, U, *_ = schur(A)

    def solve(Q: np.ndarray) -> np.ndarray:
        Y, shrink, _ = dtrsyl(T, T, -(U.T @ Q @ U), trana="N", tranb="T")
        P = U @ (Y / shrink) @ U.T
        return (P + P.T) / 2

    def residual(P: np.ndarray, Q: np.ndarray) -> np.ndarray:
        AP = A @ P
        return AP + AP.T + Q

    unit = solve(np.eye(n))
    excess = float(np.linalg.norm(residual(unit, np.eye(n))))  # A H + H A' + I = R gives |E| ≤ ρH/(1 − ‖R‖)
    if not excess < 0.5:
        raise InputError(f"A must be stable by more than rounding; its Lyapunov residual is {excess:.2g}. Add damping.")
    size = np.abs(A)
    covariance, error = [], []
    for Q in sources:
        P = solve(Q)
        P = P + solve(residual(P, Q))
        product = size @ np.abs(P)
        rounding = (n + 4) * EPS * np.linalg.norm(product + product.T + np.abs(Q))
        rho = (np.linalg.norm(residual(P, Q)) + rounding) / (1 - excess)
        covariance.append(P)
        error.append(rho * unit)
    return np.array(covariance), np.array(error)
