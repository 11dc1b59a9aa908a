"""Upper bounds of the H∞ and H₂ norms by linear matrix inequalities, proved again after the solver has spoken.

    systems (A, B, C, D) --bounded-real or H₂ inequality, one P for all--> P
      --P lifted by ε of a Lyapunov solution, bound computed anew from P--> the bound that P proves

One P ≻ 0 with A'P + PA + C'C + (PB + C'D)(γ²I − D'D)⁻¹(PB + C'D)' ≺ 0 for every system bounds the energy gain of each,
and of all that lie between them and of any switching among them, where the family is affine. For one system the best γ
is its H∞ norm; for many it is larger (`analysis.norm.peak_gain` of each is the comparison).

Source: Boyd, El Ghaoui, Feron & Balakrishnan (1994), sections 2.7.3 and 6.3; Scherer & Weiland, LMIs in Control.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from workbench.convex.lyapunov import scaling
from workbench.errors import InputError
from workbench.lti.norm import h2_norm, peak_gain
from workbench.lti.realisation import Realisation, checked, stable_poles
from workbench.result import Result, Row
from workbench.solve.semidefinite import Answer, Inequality, hermitian, minimise, symmetric_basis

LIFTS = 10.0 ** np.arange(-12, -1.5, 0.5)  # of the Lyapunov solution added to P, relative; the best is kept


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class GainBound(Result):
    """A number that one quadratic form proves to lie above a norm of each system of a family.

    `bound` is computed from `P` by eigenvalues and Cholesky factors (floating point, not outward-rounded);
    `claimed` is what the solver said, which may lie below the truth. `holds` is False, and the bound infinite, where
    P proves nothing.
    """

    norm: str  # "H-infinity" or "H2"
    holds: bool
    bound: float
    claimed: float
    P: np.ndarray  # (n, n), in the states' own units
    worst: int  # which system is the tightest
    solver_status: str

    def rows(self) -> list[Row]:
        return [
            ("norm", self.norm, ""),
            ("upper bound, proved again", self.bound, ""),
            ("solver's own number", self.claimed, ""),
            ("holds", self.holds, ""),
            ("tightest system", self.worst, ""),
        ]


def bounded_real(systems: Sequence[Sequence], *, seconds: float = 60.0) -> GainBound:
    """An upper bound of sup σ_max(G(jω)), common to a family of stable systems.

    Parameters
    ----------
    systems : one or more (A, B, C, D)
        (n, n), (n, m), (p, n), (p, m), real, all of the same sizes, A stable.
    seconds : float
        Time allowed to the solver.

    Raises
    ------
    InputError
        If a system is unstable or the sizes differ.
    """
    family, units = _in_unit_size(_family(systems), lambda s: peak_gain(*s).value)
    factor, scaled = _scaled(family)
    n, m = family[0].B.shape
    basis = symmetric_basis(n)
    F0, F = [], []
    for A, B, C, D in scaled:
        corner = basis @ A
        side = basis @ B
        falls = np.zeros((len(basis), n + m, n + m))
        falls[:, :n, :n], falls[:, :n, n:] = -(corner + corner.swapaxes(-1, -2)), -side
        falls[:, n:, :n] = -side.swapaxes(-1, -2)
        level = np.zeros((n + m, n + m))
        level[n:, n:] = np.eye(m)
        F.append(np.concatenate([falls, level[None]]))
        F0.append(-np.block([[C.T @ C, C.T @ D], [D.T @ C, D.T @ D]]))
    answer = _solved(F0, F, basis, seconds)
    claimed = math.sqrt(max(float(answer.x[-1]), 0.0))
    return _judged("H-infinity", answer, scaled, factor, claimed, _energy_gain, units)


def h2_bound(systems: Sequence[Sequence], *, seconds: float = 60.0) -> GainBound:
    """An upper bound of the H₂ norm √trace(B'PB), common to a family of stable systems without feedthrough.

    Parameters and errors as of `bounded_real`; each system is (A, B, C).
    """
    family = _family(systems)
    if any(system.D.any() for system in family):
        raise InputError("the H2 norm of a system with feedthrough is infinite; got D ≠ 0. Leave the feedthrough out.")
    family, units = _in_unit_size(family, lambda s: h2_norm(s.A, s.B, s.C), power=0.5)
    factor, scaled = _scaled(family)
    basis = symmetric_basis(len(factor))
    F0, F, powers = [], [], []
    for A, B, C, _ in scaled:
        corner = basis @ A
        F.append(np.concatenate([-(corner + corner.swapaxes(-1, -2)), np.zeros((1, *A.shape))]))
        F0.append(-(C.T @ C))
        powers.append(np.r_[-np.einsum("ji,ujk,ki->u", B, basis, B), 1.0])
    below = Inequality(np.zeros((len(F), 1, 1)), np.array(powers)[:, :, None, None])
    answer = _solved(F0, F, basis, seconds, below)
    claimed = math.sqrt(max(float(answer.x[-1]), 0.0))
    return _judged("H2", answer, scaled, factor, claimed, _power, units)


def _family(systems) -> list[Realisation]:
    family = [checked(*system) for system in systems]
    if not family:
        raise InputError("a bound needs at least one system (A, B, C, D); got none.")
    shapes = [tuple(part.shape for part in system) for system in family]
    if len(set(shapes)) > 1:
        raise InputError(f"all systems must have the same sizes; got {sorted(set(shapes))}. Bring them to one order.")
    for number, system in enumerate(family):
        stable_poles(system.A, f"A of system {number}", "The norm of an unstable system has no meaning.")
    return family


class _Units(NamedTuple):
    """What the solver's numbers count in: the norm, and the form P."""

    norm: float
    form: float


def _in_unit_size(
    family: list[Realisation], norm: Callable[[Realisation], float], power: float = 0.0
) -> tuple[list[Realisation], _Units]:
    """The family in units of time, inputs and outputs for which poles, output energy and the largest norm are near 1.

    With time times `pace`, outputs over κ and inputs over β, P is κ²/pace times the solver's and a norm βκ pace^power
    times it. The solver's tolerances are absolute; without this its answer depends on the units.
    """
    pace = float(np.exp(np.mean([np.log(np.abs(np.linalg.eigvals(s.A))) for s in family]))) if len(family[0].A) else 1.0
    slower = [Realisation(s.A / pace, s.B / pace, s.C, s.D) for s in family]
    lower, seen = _scaled([Realisation(s.A, s.B, s.C / (np.linalg.norm(s.C) or 1.0), s.D) for s in slower])
    energies = [
        np.linalg.norm(s.C) ** 2 * np.trace(_observed(t)) for s, t in zip(slower, seen, strict=True)
    ]  # fmt: skip
    kappa = math.sqrt(max(float(np.mean(energies)) / max(len(lower), 1), 0.0)) or 1.0
    largest = max(norm(s) for s in slower) or 1.0
    beta = largest / kappa
    sized = [Realisation(s.A, s.B / beta, s.C / kappa, s.D / largest) for s in slower]
    return sized, _Units(largest * pace**power, kappa**2 / pace)


def _observed(system: Realisation) -> np.ndarray:
    """P of A'P + PA + C'C = 0."""
    from scipy.linalg import solve_continuous_lyapunov

    return solve_continuous_lyapunov(system.A.T, -system.C.T @ system.C)


def _scaled(family: list[Realisation]) -> tuple[np.ndarray, list[Realisation]]:
    """L with x̄ = L'x, where L L' is the mean solution of A'P + PA + C'C + δI = 0, and the systems in x̄."""
    from scipy.linalg import solve_triangular

    lower = scaling([(s.A, s.C.T @ s.C) for s in family])
    inverse = solve_triangular(lower, np.eye(len(lower)), lower=True).T
    return lower, [Realisation(lower.T @ s.A @ inverse, lower.T @ s.B, s.C @ inverse, s.D) for s in family]


def _solved(F0, F, basis, seconds: float, *more: Inequality) -> Answer:
    """Minimise the last unknown, with P ⪰ 0 beside the inequalities."""
    n = basis.shape[-1]
    positive = np.concatenate([basis, np.zeros((1, n, n))])
    c = np.r_[np.zeros(len(basis)), 1.0]
    return minimise(c, [Inequality(np.array(F0), np.array(F)), Inequality(np.zeros((1, n, n)), positive[None]), *more],
                    seconds=seconds)  # fmt: skip


def _judged(
    norm: str, answer: Answer, scaled: list[Realisation], lower, claimed: float, proved, units: _Units
) -> GainBound:
    """The best bound that P, lifted by a multiple of a form that decays along every system, proves."""
    from scipy.linalg import solve_continuous_lyapunov

    n = len(lower)
    start = np.tensordot(np.nan_to_num(answer.x[:-1]), symmetric_basis(n), 1)
    lift = np.mean([solve_continuous_lyapunov(s.A.T, -np.eye(n)) for s in scaled], axis=0)
    lift = hermitian(lift) / np.trace(lift) * max(float(np.abs(np.trace(start))), 1e-300)
    best = (math.inf, 0, start)
    for share in (0.0, *LIFTS):
        P = start + share * lift
        bounds = [proved(P, s) for s in scaled]
        worst = int(np.argmax(bounds))
        if bounds[worst] < best[0]:
            best = (float(bounds[worst]), worst, P)
    bound, worst, P = best
    return GainBound(
        norm=norm, holds=math.isfinite(bound), bound=bound * units.norm, claimed=claimed * units.norm,
        P=lower @ P @ lower.T * units.form, worst=worst, solver_status=answer.status,
    )  # fmt: skip


def _definite(M: np.ndarray) -> bool:
    """Whether a symmetric matrix is positive definite by more than the rounding of a Cholesky factorisation."""
    size = np.sqrt(np.abs(np.diag(M)))
    if not size.min(initial=1.0) > 0:
        return False
    smallest = np.linalg.eigvalsh(M / np.outer(size, size))[0]
    return bool(smallest > 4 * len(M) ** 2 * np.finfo(float).eps)


def _energy_gain(P, system: Realisation) -> float:
    """The smallest γ for which P proves the energy gain of a system to lie below it; infinity if there is none."""
    A, B, C, D = system
    product = P @ A
    falls = -(product + product.T + C.T @ C)
    if not (_definite(P) and _definite(falls)):
        return math.inf
    side = P @ B + C.T @ D
    level = D.T @ D + side.T @ np.linalg.solve(falls, side)
    return math.sqrt(max(float(np.linalg.eigvalsh(hermitian(level))[-1]), 0.0))


def _power(P, system: Realisation) -> float:
    """√trace(B'PB) if A'P + PA + C'C ≺ 0 and P ≻ 0, else infinity."""
    A, B, C, _ = system
    product = P @ A
    if not (_definite(P) and _definite(-(product + product.T + C.T @ C))):
        return math.inf
    return math.sqrt(max(float(np.trace(B.T @ P @ B)), 0.0))
