"""Expansions of the exact force law to any order, and how far they may be trusted.

    CornerLaw  -->  power series of its energy along a fan of directions  -->  energy polynomial  -->  TaylorLaw
    TaylorLaw, CornerLaw, Region  -->  ExpansionError

The energy is expanded, not the forces: so the polynomial law has an energy too, and its stiffness is symmetric. The
control current enters exactly (the energy is quadratic in α).
"""

import math
from dataclasses import dataclass
from functools import cache
from itertools import product

import casadi as ca
import numpy as np

from workbench.errors import InputError
from workbench.physics.forces.corner import CornerLaw, energy_function
from workbench.physics.forces.energy import CoilSet
from workbench.physics.forces.law import ExtendedLaw, FirstOrderLaw, ForceLaw, Tangent, formula_tangent
from workbench.physics.forces.series import series
from workbench.result import Result, Row

HIGHEST_ORDER = 5

Term = tuple[tuple[int, int, int, int], float]  # powers of Δh, Δh', φ, α and their factor [J, m, rad]


@dataclass(frozen=True, slots=True, kw_only=True)
class TaylorLaw:
    """Forces polynomial in gap changes and roll, quadratic in the control current.

    Parameters
    ----------
    energy : tuple of ((i, j, k, l), factor)
        Terms factor · Δh^i Δh'^j φ^k α^l of the energy whose gradient by (Δh, Δh', φ) is (F_L, F_G, L).
    order : int
        Highest total power of Δh, Δh', φ in the forces.
    drag_ratio : float
        K_1 = f_D/f_L [1].
    """

    energy: tuple[Term, ...]
    order: int
    drag_ratio: float

    @classmethod
    def from_corner(cls, law: CornerLaw, order: int) -> "TaylorLaw":
        """The expansion of the exact law about its nominal pose; `order` 1 … 5.

        The first call for a coil set expands its energy: a second or two.
        """
        if order not in range(1, HIGHEST_ORDER + 1):
            raise InputError(
                f"the order of an expansion must be 1 … {HIGHEST_ORDER}; got {order!r}. "
                "Beyond that the exact law is cheaper than its polynomial."
            )
        polynomials = _energy_polynomials(law.coils, law.gap, law.gap_lateral, order + 1, law.order)
        terms = tuple(
            ((*powers, alpha_power), law.scale * factor)
            for alpha_power, polynomial in enumerate(polynomials)
            for powers, factor in polynomial
        )
        return cls(energy=terms, order=order, drag_ratio=law.drag_ratio)

    def forces(self, gap_change, gap_lateral_change, roll, alpha):
        """F_L [N], F_G [N], L [N m], elementwise; see ForceLaw."""
        pose = (gap_change, gap_lateral_change, roll)
        forces = []
        for axis in range(3):
            by_alpha = [0.0, 0.0, 0.0]  # polynomials in the pose, which a slope by α shares
            for (*powers, alpha_power), factor in self.energy:
                if powers[axis]:
                    lowered = tuple(power - (position == axis) for position, power in enumerate(powers))
                    term = powers[axis] * factor * _monomial(pose, lowered)
                    by_alpha[alpha_power] = by_alpha[alpha_power] + term
            forces.append(by_alpha[0] + alpha * (by_alpha[1] + alpha * by_alpha[2]))
        return tuple(forces)

    @property
    def affine(self) -> bool:
        """False: deviations multiply one another."""
        return False

    def tangent(self, deviation: np.ndarray, alpha: np.ndarray) -> Tangent:
        """Forces (3, n) and slopes (3, 4n); see ForceLaw."""
        return formula_tangent(self, deviation, alpha)

    def coefficient(self, axis: int, powers: tuple[int, int, int, int]) -> float:
        """Factor of Δh^i Δh'^j φ^k α^l in F_L (axis 0), F_G (1) or L (2)."""
        raised = tuple(power + (position == axis) for position, power in enumerate(powers))
        terms: dict[tuple[int, ...], float] = dict(self.energy)
        return terms.get(raised, 0.0) * raised[axis]

    def extended(self) -> ExtendedLaw:
        """The terms of the report's extended expansion: linear in the pose, quadratic in α."""
        pose = ((1, 0, 0), (0, 1, 0), (0, 0, 1))

        def row(axis: int, alpha_power: int, powers: tuple) -> list[float]:
            return [self.coefficient(axis, (*p, alpha_power)) for p in powers]

        rows = [
            (
                tuple(row(axis, 0, ((0, 0, 0), *pose)) + row(axis, 1, ((0, 0, 0),))),
                tuple(row(axis, 1, pose) + row(axis, 2, ((0, 0, 0),))),
                tuple(row(axis, 2, pose)),
            )
            for axis in range(3)
        ]
        return ExtendedLaw(lift=rows[0], lateral=rows[1], moment=rows[2], drag_ratio=self.drag_ratio)

    def first_order(self) -> FirstOrderLaw:
        """The terms of first order in all four deviations."""
        return self.extended().first_order()


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """Deviations |Δh| ≤ gap, |Δh'| ≤ gap_lateral [m], |φ| ≤ roll [rad], |α| ≤ alpha [1]."""

    gap: float
    gap_lateral: float
    roll: float
    alpha: float

    def __post_init__(self) -> None:
        for name in ("gap", "gap_lateral", "roll", "alpha"):
            if not 0 <= getattr(self, name) < math.inf:
                raise InputError(
                    f"Region.{name} must be a half width, finite and not negative; got {getattr(self, name)!r}."
                )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ExpansionError(Result):
    """Largest deviations of an approximate law from the exact one, over the grid points of a region.

    lift, lateral [N], moment [N m]; relative: the same over the exact nominal F_L, F_G, L. Found on a grid of `points`
    poses that includes the corners; between its points the error may be larger by the grid's coarseness.
    """

    lift: float
    lateral: float
    moment: float
    relative: tuple[float, float, float]
    region: Region
    points: int

    def rows(self) -> list[Row]:
        return [
            ("largest lift error", self.lift, "N"),
            ("largest lateral error", self.lateral, "N"),
            ("largest moment error", self.moment, "N m"),
            ("lift error over nominal lift", self.relative[0], ""),
            ("lateral error over nominal", self.relative[1], ""),
            ("moment error over nominal", self.relative[2], ""),
        ]


def error_over(law: ForceLaw, exact: CornerLaw, region: Region, points: int = 5) -> ExpansionError:
    """Error of a force law against the exact one.

    Parameters
    ----------
    law : ForceLaw
        Expansion about the nominal pose of `exact`.
    exact : CornerLaw
    region : Region
    points : int
        Grid points along each of the four deviations, 2 or more.

    Raises
    ------
    InputError
        If the region takes a coil through the guideway.
    """
    if points < 2:
        raise InputError(f"points must be at least 2, the two ends; got {points!r}.")
    half = (region.gap, region.gap_lateral, region.roll, region.alpha)
    grid = np.meshgrid(*(np.linspace(-size, size, points) if size else np.zeros(1) for size in half), indexing="ij")
    deviations = [axis.ravel() for axis in grid]
    true = exact.forces(*deviations)
    largest = [float(np.abs(a - b).max()) for a, b in zip(law.forces(*deviations), true, strict=True)]
    relative = tuple(error / abs(value) for error, value in zip(largest, exact.forces(0.0, 0.0, 0.0, 0.0), strict=True))
    return ExpansionError(
        lift=largest[0],
        lateral=largest[1],
        moment=largest[2],
        relative=(relative[0], relative[1], relative[2]),
        region=region,
        points=deviations[0].size,
    )


def _monomial(deviation, powers):
    term = 1.0
    for value, power in zip(deviation, powers, strict=True):
        for _ in range(power):
            term = term * value
    return term


@cache
def _energy_polynomials(coils: CoilSet, gap: float, gap_lateral: float, degree: int, order: int) -> tuple:
    """For α⁰, α¹, α²: ((i, j, k), factor) of the energy [H] up to total `degree` in (Δh, Δh', φ), without the constant.

    Along a direction d the coefficient of sⁿ of W(s d) is Σ factor d^powers over the terms of degree n. The directions
    of a triangular lattice determine all terms of one degree (Griewank, Utke, Walther, Math. Comp. 69 (2000) 1117).
    """
    pose, parts = energy_function(coils, order)
    energy = ca.Function("energy", [ca.vertcat(*pose)], [ca.vertcat(*parts)], {"cse": True})
    polynomials: list[list] = [[], [], []]
    every = {n: [p for p in product(range(n + 1), repeat=3) if sum(p) == n] for n in range(1, degree + 1)}
    lattices = [np.array(powers, dtype=float) / n for n, powers in every.items()]
    along = series(energy, np.array([gap, gap_lateral, 0.0]), np.vstack(lattices), degree)  # all of them at once
    ends = np.cumsum([len(directions) for directions in lattices])[:-1]
    for (n, powers), directions, *orders in zip(
        every.items(), lattices, *(np.split(a, ends) for a in along[1:]), strict=True
    ):
        values = orders[n - 1]
        lattice = np.array([[math.prod(c**e for c, e in zip(d, p, strict=True)) for p in powers] for d in directions])
        for polynomial, factors in zip(polynomials, np.linalg.solve(lattice, values).T, strict=True):
            polynomial.extend((p, float(factor)) for p, factor in zip(powers, factors, strict=True))
    return tuple(tuple(polynomial) for polynomial in polynomials)
