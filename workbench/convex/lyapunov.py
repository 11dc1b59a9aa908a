"""One quadratic form that decays along every matrix of a family: stability that survives variation in time.

    state matrices, parameter of each --mean of their Lyapunov solutions--> better coordinates
      --linear matrix inequalities--> P(v) = P_0 + v P_1 --eigenvalues computed anew--> certificate, or not

If A'P + P A + 2σP ≺ 0 at the vertices of a family that is affine in its parameters, with one P ≻ 0 for all, then x'Px
decays at least as e^{−2σt} however fast the parameters vary. With P affine in a parameter v whose rate is bounded,
Ṗ = v̇ P_1 is added and both signs of the rate are asked for. On a grid of a family that is not affine the certificate
speaks for the grid alone; `LyapunovCertificate.margin` tells at any other matrix.

Unscaled problems fail their re-check: coordinates in which the mean of the members' own Lyapunov solutions is the
identity bring the condition of P from 1e6 to 1e2…1e4 on vehicles.

Source: Boyd, El Ghaoui, Feron & Balakrishnan, Linear Matrix Inequalities in System and Control Theory (1994), ch. 5.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.lti.realisation import EPS, state_scale
from workbench.result import Result, Row
from workbench.solve.semidefinite import Inequality, minimise, symmetric_basis

FLOOR = 1e-7  # least eigenvalue of P in scaled coordinates, where the largest is 1: bounds a certificate's condition


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LyapunovCertificate(Result):
    """A quadratic form x'(P_0 + v P_1)x and what its eigenvalues, computed apart from the solver, say of a family.

    `margin` is the largest μ with A'P + PA + 2σP + v̇P_1 ⪯ −μP over the family, less its rounding: what is left of decay
    beyond 2σ, in every coordinate system the same. The certificate holds if it is positive and P positive definite.
    """

    holds: bool
    decay: float  # σ [1/s]
    rate: float  # bound of |v̇| [unit of the parameter per s]; 0 for a common matrix
    coefficients: np.ndarray  # (1 or 2, n, n): P_0, P_1 in the coordinates x̄ = L'x
    coordinates: np.ndarray  # L (n, n), lower triangular
    margin: float  # [1/s]; negative where it does not hold
    worst: int  # which matrix of the family is the tightest
    smallest: float  # smallest eigenvalue of P over the family, in coordinates where the mean Lyapunov solution is 1
    condition: float  # of P in those coordinates, the worst of the family
    solver_status: str  # the solver's own words, which decide nothing

    def matrix(self, parameter: float = 0.0) -> np.ndarray:
        """P (n, n) at a parameter, in the states' own units."""
        return self.coordinates @ self._form(parameter) @ self.coordinates.T

    def _form(self, parameter: float) -> np.ndarray:
        return np.sum([P * parameter**k for k, P in enumerate(self.coefficients)], axis=0)

    def margin_at(self, A, parameter: float = 0.0) -> float:
        """The margin [1/s] at any state matrix (n, n) and its parameter: positive if the form decays there too."""
        A = np.asarray(A, float)
        if A.shape != self.coefficients[0].shape:
            raise InputError(f"A must have shape {self.coefficients[0].shape} like the certificate; got {A.shape}.")
        slope = self.coefficients[1] if len(self.coefficients) > 1 else np.zeros_like(A)
        return _margin(_seen_in(self.coordinates, A), self._form(parameter), slope, self.decay, self.rate)

    def rows(self) -> list[Row]:
        return [
            ("holds", self.holds, ""),
            ("margin", self.margin, "1/s"),
            ("decay", self.decay, "1/s"),
            ("bound of the parameter's rate", self.rate, "1/s"),
            ("tightest matrix", self.worst, ""),
            ("condition of P", self.condition, ""),
        ]


def lyapunov_certificate(
    matrices, *, parameters: Sequence[float] | None = None, rate: float = 0.0, decay: float = 0.0, seconds: float = 60.0
) -> LyapunovCertificate:
    """A common Lyapunov matrix of a family, or one affine in a parameter of bounded rate.

    Parameters
    ----------
    matrices : (k, n, n)
        State matrices [1/s]: the vertices of an affine family, or a grid.
    parameters : k numbers, optional
        The parameter of each matrix, such as the speed; then P(v) = P_0 + v P_1.
    rate : float
        Bound of |dv/dt|; with it each matrix is asked at both signs of the rate.
    decay : float
        σ [1/s] of A'P + PA + 2σP ≺ 0.
    seconds : float
        Time allowed to the solver.

    Returns
    -------
    LyapunovCertificate
        With `holds` False if no form was found: this is not a proof that there is none.

    Raises
    ------
    InputError
        If a matrix is not stable with the decay asked for, or the arguments do not fit together.
    """
    family, values = _checked(matrices, parameters, rate, decay)
    return _certificate(family, values, rate, decay, _scaling(family), seconds)


def _checked(matrices, parameters, rate: float, decay: float) -> tuple[np.ndarray, np.ndarray | None]:
    family = np.asarray(matrices, float)
    if family.ndim == 2:
        family = family[None]
    if family.ndim != 3 or family.shape[1] != family.shape[2] or 0 in family.shape or not np.isfinite(family).all():
        raise InputError(f"matrices must be finite and of shape (k, n, n); got {family.shape}. Stack square matrices.")
    if not (math.isfinite(rate) and rate >= 0 and math.isfinite(decay) and decay >= 0):
        raise InputError(f"rate and decay must be finite and not negative; got {rate!r} and {decay!r}.")
    if parameters is None and rate > 0:
        raise InputError(
            f"a rate needs the parameter of each matrix; got rate {rate!r} alone. Give parameters, "
            "or leave the rate out: a common matrix holds for every rate."
        )
    values = None if parameters is None else np.asarray(parameters, float)
    if values is not None and (
        values.shape != family.shape[:1] or not np.isfinite(values).all() or np.ptp(values) == 0
    ):
        raise InputError(
            f"parameters must be {len(family)} finite numbers, one per matrix and not all equal; "
            f"got {str(values.tolist())[:60]}."
        )
    slowest = np.linalg.eigvals(family).real.max(axis=1)
    worst = int(np.argmax(slowest))
    if slowest[worst] >= -decay:
        raise InputError(
            f"every matrix must be stable with the decay asked for ({decay:g} 1/s); number {worst} has a pole with "
            f"real part {slowest[worst]:.4g} 1/s. Ask for less decay, or leave that point out."
        )
    return family, values


def _scaling(family: np.ndarray) -> np.ndarray:
    """L (n, n), lower triangular: L L' is the mean of the solutions P of A'P + PA + I = 0, each of unit trace.

    States are in balanced units for that; in x̄ = L'x the mean is the identity.
    """
    from scipy.linalg import cholesky, solve_continuous_lyapunov

    units = state_scale(np.abs(family).mean(axis=0))
    solutions = [solve_continuous_lyapunov((A * units / units[:, None]).T, -np.eye(len(A))) for A in family]
    mean = np.mean([P / np.trace(P) for P in solutions], axis=0)
    size = np.sqrt(np.diag(mean))
    lower = cholesky((mean + mean.T) / 2 / np.outer(size, size), lower=True)
    return lower * (size / units)[:, None]


def _certificate(family, values, rate: float, decay: float, lower: np.ndarray, seconds: float) -> LyapunovCertificate:
    """Solve in scaled coordinates, go back, and judge what came back."""
    n = family.shape[1]
    scaled = np.array([_seen_in(lower, A) for A in family])
    middle, half = (0.0, 1.0) if values is None else (float(np.mean(values)), float(np.ptp(values)) / 2)
    place = None if values is None else (values - middle) / half
    answer = minimise(*_inequalities(scaled, place, rate / half, decay), seconds=seconds)
    parts = 1 if values is None else 2
    unknowns = n * (n + 1) // 2
    basis = symmetric_basis(n)
    found = [np.tensordot(answer.x[k * unknowns : (k + 1) * unknowns], basis, 1) for k in range(parts)]
    if not all(np.isfinite(P).all() for P in found):
        found = [np.zeros((n, n))] * parts
    slope = found[1] if parts == 2 else np.zeros((n, n))
    margins, spectra = [], []
    for k, A in enumerate(scaled):
        P = found[0] + (0.0 if place is None else place[k]) * slope
        margins.append(_margin(A, P, slope, decay, rate / half))
        spectra.append(np.linalg.eigvalsh(P)[[0, -1]])
    worst, smallest = int(np.argmin(margins)), float(min(s[0] for s in spectra))
    if parts == 2:  # from v̄ = (v − middle)/half to v
        found = [found[0] - middle / half * found[1], found[1] / half]
    return LyapunovCertificate(
        holds=bool(margins[worst] > 0 and smallest > 0), decay=decay, rate=rate, coefficients=np.array(found),
        coordinates=lower,
        margin=float(margins[worst]), worst=worst, smallest=smallest,
        condition=float(max(s[1] / s[0] for s in spectra)) if smallest > 0 else math.inf, solver_status=answer.status,
    )  # fmt: skip


def _seen_in(lower: np.ndarray, A: np.ndarray) -> np.ndarray:
    """L'A L'⁻¹: the state matrix in the coordinates x̄ = L'x."""
    from scipy.linalg import solve_triangular

    return solve_triangular(lower, A.T @ lower, lower=True).T


def _inequalities(family, place, rate: float, decay: float) -> tuple[np.ndarray, list[Inequality]]:
    """Maximise t with A'P + PA + 2σP ± rate P_1 ⪯ −t I and FLOOR I ⪯ P ⪯ I over the family."""
    k, n, _ = family.shape
    basis = symmetric_basis(n)
    unknowns = len(basis)
    product = np.einsum("bji,ujl->buil", family, basis)
    derivative = -(product + product.swapaxes(-1, -2)) - 2 * decay * basis
    unit = np.broadcast_to(np.eye(n), (k, 1, n, n))
    if place is None:
        form = basis[None]
        falls = [np.concatenate([derivative, -unit], axis=1)]
    else:
        ends = np.array([place.min(), place.max()])
        form = np.concatenate([np.broadcast_to(basis, (2, *basis.shape)), ends[:, None, None, None] * basis], axis=1)
        falls = [
            np.concatenate([derivative, place[:, None, None, None] * derivative + sign * rate * basis, -unit], axis=1)
            for sign in ((1.0, -1.0) if rate else (0.0,))
        ]
    form = np.concatenate([form, np.zeros((len(form), 1, n, n))], axis=1)
    floor = np.broadcast_to(np.eye(n), (len(form), n, n))
    c = np.zeros((1 if place is None else 2) * unknowns + 1)
    c[-1] = -1.0
    limits = [Inequality(-FLOOR * floor, form), Inequality(floor, -form)]
    return c, [*limits, *(Inequality(np.zeros((k, n, n)), F) for F in falls)]


def _margin(A, P, slope, decay: float, rate: float) -> float:
    """The largest μ with A'P + PA + 2σP ± rate P_1 ⪯ −μP, less its rounding; −∞ where P is not positive definite."""
    from scipy.linalg import eigh

    diagonal = np.diag(P)
    if not diagonal.min() > 0:
        return -math.inf
    size = np.sqrt(diagonal)
    P, slope, A = P / np.outer(size, size), slope / np.outer(size, size), size[:, None] * A / size
    smallest = float(np.linalg.eigvalsh(P)[0])
    if smallest <= len(A) * EPS * len(A):
        return -math.inf
    product = P @ A
    change = product + product.T + 2 * decay * P
    growth = max(eigh(change + sign * rate * slope, P, eigvals_only=True)[-1] for sign in (1.0, -1.0))
    spread = 2 * np.linalg.norm(A) * np.linalg.norm(P) + rate * np.linalg.norm(slope) + abs(growth) * np.linalg.norm(P)
    return float(-growth - 4 * len(A) * EPS * spread / smallest)
