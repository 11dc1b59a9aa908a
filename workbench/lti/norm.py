"""Norms of a stable linear system: its largest gain over all frequencies, and its response to white noise.

    A, B, C, D --peak_gain--> sup over ω of σ_max(G(jω)), between a value attained and a value never reached
               --h2_norm----> rms of the outputs under unit white noises

The largest gain needs no grid: σ_max(G(jω)) = γ for some ω exactly if a matrix built from A, B, C, D and γ
(Hamiltonian: its eigenvalues are mirrored at both axes) has the eigenvalue jω. So each γ tells where the gain exceeds
it, and when it never does. Floating point throughout: the bracket carries an estimate of rounding, it is not
outward-rounded.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, cast

import numpy as np

from workbench.errors import InputError
from workbench.lti.grid import special, spread
from workbench.lti.realisation import (
    EPS,
    Realisation,
    balanced,
    checked,
    frequency_response,
    responder,
    stable_poles,
    state_scale,
)
from workbench.lti.variance import stationary
from workbench.result import Result, Row

__all__ = [
    "Peak", "frequency_response", "h2_norm", "intervals_above", "largest_singular_value", "peak_gain", "proposals",
]  # fmt: skip

SAFE_FEEDTHROUGH = 1e-3  # γ² − σ_max(D)² over γ², above which inverting γ²I − D'D costs at most three of sixteen digits
NEAR_AXIS = 1e-5  # |Re λ|/‖H‖ of a Hamiltonian eigenvalue worth a look; evaluation decides
MOST_STEPS = 60  # the two-step method needs three to six; each step at least passes the former level


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Peak(Result):
    """The largest gain of a stable system over all frequencies, with the bracket that holds it.

    `value` is the gain found at `frequency`; `lower` is `value` less the rounding estimated there. At `upper` no
    eigenvalue of the Hamiltonian problem lies on the imaginary axis, by more than rounding can move it.
    """

    value: float  # σ_max(G(jω)) at `frequency`
    frequency: float  # [rad/s]; 0 for the static gain, infinity for the direct feedthrough
    lower: float
    upper: float
    rounding: float  # relative, first order: how far A's rounding n ε ‖A‖ moves `value`

    def rows(self) -> list[Row]:
        """Value, frequency, bracket."""
        return [
            ("peak gain", self.value, ""),
            ("frequency", self.frequency, "rad/s"),
            ("lower bound", self.lower, ""),
            ("upper bound", self.upper, ""),
        ]


def peak_gain(A, B, C, D=None, *, tolerance: float = 1e-9) -> Peak:
    """The H∞ norm of a stable system: the supremum of σ_max(G(jω)) over all frequencies.

    Parameters
    ----------
    A, B, C, D : (n, n), (n, m), (p, n), (p, m)
        Real; A with all eigenvalues in the open left half plane; D zero if left out.
    tolerance : float
        Relative width of the bracket, 1e-13 … 0.1. Where rounding is larger (very light damping) the bracket is as wide
        as that.

    Raises
    ------
    InputError
        If A is not stable, shapes do not fit or the tolerance is out of range.

    Each step tests γ = (1 + tolerance) × the best gain so far. Frequencies proposed by the eigenvalues, and the
    midpoints between them, are accepted for nothing but the gain evaluated there; if none exceeds γ and every
    eigenvalue keeps off the axis by more than its own first-order rounding error, γ is the upper bound, otherwise γ is
    raised.

    Source: Bruinsma & Steinbuch, Systems & Control Letters 14 (1990) 287; Boyd, Balakrishnan & Kabamba (1989).
    """
    if not 1e-13 <= tolerance <= 0.1:
        raise InputError(f"tolerance must lie between 1e-13 and 0.1; got {tolerance!r}. Leave it out for 1e-9.")
    A, B, C, D = checked(A, B, C, D)
    poles = stable_poles(A, "A", "The peak of an unstable system has no meaning; stabilise it first.")
    unit = 2.0 ** np.round(np.log2(np.abs(poles).max(initial=1.0 if len(poles) == 0 else 0.0)))
    found = _peak(balanced(A / unit, B / unit, C, D), poles / unit, tolerance)
    return replace(found, frequency=found.frequency * unit)


def _peak(system: Realisation, poles: np.ndarray, tolerance: float) -> Peak:
    """The same in a unit of time in which the fastest pole is near 1, where a pencil's rows have like size."""
    gain = largest_singular_value(*system)
    value, frequency = _best(gain, _first_frequencies(poles))
    if value == 0:  # more distinct frequencies than a nonzero rational function of this order has zeros
        return Peak(value=0.0, frequency=0.0, lower=0.0, upper=0.0, rounding=0.0)
    slack, rounding = 0.0, _rounding(system, frequency, value)
    for _ in range(MOST_STEPS):
        slack = max(slack, tolerance, rounding)
        level = value * (1 + slack)
        problem = _axis_problem(system, level)
        proposed = _proposals(problem)
        better, where = _best(gain, proposed)
        if better > value:
            value, frequency = better, where
            rounding = _rounding(system, frequency, value)
        if better <= level:
            if problem.clear_of_axis():
                break
            slack *= 4  # an eigenvalue that rounding may have pushed off the axis: ask again a little higher
    else:
        level = math.inf  # nothing was proved
    return Peak(value=value, frequency=frequency, lower=value * (1 - rounding), upper=level, rounding=rounding)


def intervals_above(A, B, C, D, level: float) -> list[tuple[float, float]]:
    """Where σ_max(G(jω)) exceeds a level: disjoint intervals of ω in [0, ∞], in order.

    Parameters
    ----------
    A, B, C, D : (n, n), (n, m), (p, n), (p, m)
        Real; no pole on the imaginary axis.
    level : float
        Positive.

    Returns
    -------
    list of (low, high) [rad/s]

    Between the frequencies that the level's eigenvalue problem proposes, all of them whether near the axis or not, the
    gain is on one side of the level, so one evaluation each decides. Excesses of the size of rounding are not seen.
    """
    if not level > 0:
        raise InputError(f"level must be positive; got {level!r}. A gain is above zero nearly everywhere.")
    system = balanced(*checked(A, B, C, D))
    gain = largest_singular_value(*system)
    ends = np.unique(np.r_[0.0, np.abs(_axis_problem(system, level).values.imag)])
    inside = np.r_[(ends[1:] + ends[:-1]) / 2, 2 * ends[-1] + 1.0]
    found: list[tuple[float, float]] = []
    for low, high, above in zip(ends, np.r_[ends[1:], math.inf], gain(inside) > level, strict=True):
        if above and found and found[-1][1] == low:
            found[-1] = (found[-1][0], float(high))
        elif above:
            found.append((float(low), float(high)))
    return found


def proposals(A, B, C, D, level: float) -> np.ndarray:
    """One frequency inside every interval where σ_max(G(jω)) may exceed a level, none left out but for rounding.

    Parameters
    ----------
    A, B, C, D : (n, n), (n, m), (p, n), (p, m)
        Real float64 arrays that fit together: nothing is checked, this is the inner loop of optimisers.
    level : float
        Positive.

    Returns
    -------
    (k,)
        Frequencies [rad/s], finite: midpoints between the imaginary parts of the level's eigenvalue problem and one
        above them all. Where the gain exceeds the level at none of them, it exceeds it nowhere.
    """
    ends = np.unique(np.r_[0.0, np.abs(_axis_problem(Realisation(A, B, C, D), level).values.imag)])
    return np.r_[(ends[1:] + ends[:-1]) / 2, 2 * ends[-1] + 1.0]


def largest_singular_value(A, B, C, D) -> Callable[[np.ndarray], np.ndarray]:
    """The function omega (k,) → σ_max(G(jω)) (k,)."""
    response = responder(A, B, C, D)

    def gain(omega: np.ndarray) -> np.ndarray:
        return np.linalg.svd(response(omega), compute_uv=False)[:, 0]

    return gain


def _best(gain, omega: np.ndarray) -> tuple[float, float]:
    """The largest gain among the frequencies and where it is."""
    values = gain(omega)
    best = int(np.argmax(values))
    return float(values[best]), float(omega[best])


def _first_frequencies(poles: np.ndarray) -> np.ndarray:
    """0, ∞, the resonance of every pole, and 2n + 8 frequencies spread over the decades around them."""
    return np.concatenate([[0.0, math.inf], special(poles), spread(poles, 2 * len(poles) + 8)])


def hamiltonian(system: Realisation, level: float) -> np.ndarray | None:
    """The matrix (2n, 2n) whose eigenvalues jω are where a singular value of G(jω) equals the level.

    None where the level is so close to σ_max(D) that inverting level² I − D'D costs more than three digits.
    """
    A, B, C, D = system
    if level**2 - np.linalg.norm(D, 2) ** 2 <= SAFE_FEEDTHROUGH * level**2:
        return None
    p, m = D.shape
    inner = np.linalg.inv(level**2 * np.eye(m) - D.T @ D)
    outer = np.linalg.inv(level**2 * np.eye(p) - D @ D.T)
    drift = A + B @ inner @ D.T @ C
    return np.block([[drift, level * B @ inner @ B.T], [-level * C.T @ outer @ C, -drift.T]])


def crossings(system: Realisation, level: float) -> np.ndarray | None:
    """Frequencies where a singular value may equal a level: imaginary parts of Hamiltonian eigenvalues near the axis.

    None where the level is too close to the feedthrough's gain. Lean: error bounds are `peak_gain`'s.
    """
    H = hamiltonian(system, level)
    if H is None:
        return None
    values = np.linalg.eigvals(H)
    return np.abs(values.imag[np.abs(values.real) <= NEAR_AXIS * np.linalg.norm(H)])


class _AxisProblem(NamedTuple):
    """M x = λ N x whose finite eigenvalues jω are the frequencies where a singular value of G equals the level."""

    M: np.ndarray
    N: np.ndarray | None  # identity if None
    infinite: int  # how many eigenvalues are infinite by construction
    values: np.ndarray  # the finite ones

    def clear_of_axis(self) -> bool:
        """Whether every eigenvalue keeps further from the imaginary axis than rounding moves it, to first order.

        An eigenvalue moves by at most ε (‖M‖ + |λ| ‖N‖) ‖y‖ ‖x‖ / |yᴴ N x| under relative changes ε of M and N, y and x
        its left and right eigenvectors; the eigenvalue solver's own error is such a change with ε a few times the unit
        roundoff.
        """
        from scipy.linalg import eig

        solution = eig(self.M, self.N, left=True, right=True)
        values, left, right = cast(tuple[np.ndarray, np.ndarray, np.ndarray], solution)
        keep = _finite(values, self.infinite)
        values, left, right = values[keep], left[:, keep], right[:, keep]
        N_right = right if self.N is None else self.N @ right
        size_n = 1.0  # N is the identity or a projection
        lengths = np.linalg.norm(left, axis=0) * np.linalg.norm(right, axis=0)
        change = 4 * EPS * (_norm_bound(self.M) + np.abs(values) * size_n) * lengths
        return bool(np.all(np.abs(values.real) * np.abs(np.sum(left.conj() * N_right, axis=0)) > change))


def _norm_bound(M: np.ndarray) -> float:
    """An upper bound of ‖M‖₂ without singular values: the smaller of √(‖M‖₁ ‖M‖∞) and the Frobenius norm."""
    size = np.abs(M)
    return min(
        math.sqrt(float(size.sum(axis=0).max(initial=0.0) * size.sum(axis=1).max(initial=0.0))),
        float(np.linalg.norm(M)),
    )


def _finite(values: np.ndarray, infinite: int) -> np.ndarray:
    """Indices of all but the `infinite` largest eigenvalues."""
    size = np.where(np.isfinite(values), np.abs(values), math.inf)
    return np.argsort(size)[: len(values) - infinite]


def _axis_problem(system: Realisation, level: float) -> _AxisProblem:
    """The eigenvalue problem of a level: a Hamiltonian matrix, or a pencil where the level is close to σ_max(D)."""
    from scipy.linalg import eigvals

    A, B, C, D = system
    n, (p, m) = len(A), D.shape
    M = hamiltonian(system, level)
    if M is not None:
        scale = state_scale(M)
        M = M / scale[:, None] * scale
        return _AxisProblem(M, None, 0, np.linalg.eigvals(M))
    M = np.zeros((2 * n + m + p, 2 * n + m + p))
    inputs, outputs = slice(2 * n, 2 * n + m), slice(2 * n + m, None)
    M[:n, :n], M[n : 2 * n, n : 2 * n] = A, -A.T
    M[:n, inputs], M[n : 2 * n, outputs] = B, -C.T
    M[outputs, :n], M[inputs, n : 2 * n] = C / level, B.T / level
    M[outputs, inputs], M[inputs, outputs] = D / level, D.T / level
    M[inputs, inputs], M[outputs, outputs] = -np.eye(m), -np.eye(p)
    N = np.diag(np.r_[np.ones(2 * n), np.zeros(m + p)])
    values = eigvals(M, N)
    return _AxisProblem(M, N, m + p, values[_finite(values, m + p)])


def _proposals(problem: _AxisProblem) -> np.ndarray:
    """Frequencies worth evaluating: the eigenvalues' and midpoints between them, of all and of those near the axis."""
    values = problem.values
    if len(values) == 0:
        return np.zeros(1)
    near = values[np.abs(values.real) <= 1e-6 * np.linalg.norm(problem.M)]  # generous: evaluation decides
    points = [np.zeros(1)]
    for chosen in (values, near):
        omega = np.unique(np.abs(chosen.imag))
        points += [omega, (omega[1:] + omega[:-1]) / 2]
    return np.concatenate(points)


def _rounding(system: Realisation, omega: float, value: float) -> float:
    """Relative change of σ_max(G(jω)) under the change n ε ‖A‖ of A that its evaluation amounts to, to first order."""
    A, B, C, _ = system
    n = len(A)
    if not math.isfinite(omega) or n == 0:
        return n * EPS + EPS
    shifted = 1j * omega * np.eye(n) - A
    states = np.linalg.solve(shifted, B)
    weights = np.linalg.solve(shifted.T, C.T)
    left, _, right = np.linalg.svd(system.D + C @ states)
    sensitivity = np.linalg.norm(weights @ left[:, 0].conj()) * np.linalg.norm(states @ right[0].conj())
    return float(n * EPS * (1 + _norm_bound(A) * sensitivity / value))


def h2_norm(A, B, C) -> float:
    """The H₂ norm of a stable system without feedthrough: the rms of all its outputs together under unit white noises.

    Parameters
    ----------
    A, B, C : (n, n), (n, m), (p, n)
        Real; A stable.

    Returns
    -------
    float
        √(trace C P C') with A P + P A' + B B' = 0. White noise of unit two-sided intensity (density 1 per hertz from −∞
        to ∞).

    Raises
    ------
    InputError
        If A is not stable or shapes do not fit. A system with feedthrough has no finite H₂ norm and therefore no D
        here.
    """
    A, B, C, _ = checked(A, B, C)
    return math.sqrt(max(float(stationary(A, B, correlation=np.eye(B.shape[1])).mean_squares(C).sum()), 0.0))
