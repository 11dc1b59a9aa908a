"""The force law of one coil set, as the vehicle sees it: gap changes, roll and control current in, two forces and a
moment out.

    ForceLaw (protocol) <-- FirstOrderLaw, ExtendedLaw   coefficients, here; the report's are printed in A.3
                        <-- CornerLaw, TaylorLaw         from coil geometry (workbench.physics.forces.corner, .taylor)

Deviations are from the nominal pose; gaps grow away from the guideway; roll > 0 lowers the edge that faces the wall;
alpha is control current over main-coil current. Drag of the set is drag_ratio (F_L + F_G).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Protocol, runtime_checkable

import casadi as ca
import numpy as np

from workbench.errors import InputError

REPORT_LIFT_RATIO = 0.8380  # f_L at 134 m/s over f_L at infinite speed (report, A.3)
REPORT_LIFT_TO_DRAG = 61.505  # f_L / f_D at 134 m/s (report, A.3)
REPORT_AMPERE_TURNS = 429.69e3  # of one main coil (report, A.3)


Tangent = tuple[np.ndarray, np.ndarray]


@runtime_checkable
class ForceLaw(Protocol):
    """What the equations of motion need to know about a coil set."""

    @property
    def drag_ratio(self) -> float:
        """K_1 = f_D / f_L [1]."""
        ...

    def forces(self, gap_change, gap_lateral_change, roll, alpha) -> tuple[Any, Any, Any]:
        """Lift F_L [N], lateral force F_G [N] and roll moment L [N m] at a deviation from the nominal pose.

        Parameters
        ----------
        gap_change, gap_lateral_change : scalar, DM or SX, elementwise
            Δh and Δh' [m].
        roll : same
            φ [rad].
        alpha : same
            Control current over main-coil current [1].
        """
        ...

    @property
    def affine(self) -> bool:
        """Whether the forces are linear in the deviations: one tangent is then as good as another."""
        ...

    def tangent(self, deviation: np.ndarray, alpha: np.ndarray) -> Tangent:
        """Forces (3, n) of n coil sets and their slopes (3, 4n) by Δh, Δh', φ, α, set by set.

        deviation : (3, n) Δh, Δh' [m], φ [rad];  alpha : (n,) [1]. `formula_tangent` answers for any law whose `forces`
        take symbols.
        """
        ...


def formula_tangent(law: ForceLaw, deviation: np.ndarray, alpha: np.ndarray) -> Tangent:
    """`ForceLaw.tangent` of a law whose forces take symbols; law: hashable."""
    slopes = _slopes(law)
    each = [slopes(*map(float, d), float(a)) for d, a in zip(deviation.T, alpha, strict=True)]
    return np.hstack([value.full() for value, _ in each]), np.hstack([slope.full() for _, slope in each])


@lru_cache(maxsize=64)
def _slopes(law: ForceLaw) -> ca.Function:
    symbols = [ca.SX.sym(name) for name in ("gap", "gap_lateral", "roll", "alpha")]
    forces = ca.vertcat(*law.forces(*symbols))
    return ca.Function("slopes", symbols, [ca.densify(forces), ca.densify(ca.jacobian(forces, ca.vertcat(*symbols)))])


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstOrderLaw:
    """Forces and moment linear in the deviations.

    Parameters
    ----------
    lift, lateral, moment : five numbers each
        Value at the nominal pose and derivative by Δh, Δh', φ, α: [N, N/m, N/m, N/rad, N] for the forces,
        [N m, N, N, N m/rad, N m] for the moment.
    drag_ratio : float
        K_1 = f_D / f_L [1].

    Source: report, A.3, first-order expansion.
    """

    lift: tuple[float, ...]
    lateral: tuple[float, ...]
    moment: tuple[float, ...]
    drag_ratio: float

    def __post_init__(self) -> None:
        for name in ("lift", "lateral", "moment"):
            object.__setattr__(self, name, _coefficients(f"FirstOrderLaw.{name}", getattr(self, name), 5))
        _check_drag_ratio(self.drag_ratio)

    def forces(self, gap_change, gap_lateral_change, roll, alpha):
        """F_L [N], F_G [N], L [N m], elementwise; see ForceLaw."""
        deviations = (gap_change, gap_lateral_change, roll, alpha)
        return tuple(row[0] + _inner(row[1:], deviations) for row in (self.lift, self.lateral, self.moment))

    @property
    def affine(self) -> bool:
        """True: the coefficients are the slopes."""
        return True

    def tangent(self, deviation: np.ndarray, alpha: np.ndarray) -> Tangent:
        """Forces (3, n) and slopes (3, 4n); see ForceLaw."""
        table = np.array([self.lift, self.lateral, self.moment], float)
        return table[:, :1] + table[:, 1:] @ np.vstack([deviation, alpha]), np.tile(table[:, 1:], len(alpha))


@dataclass(frozen=True, slots=True, kw_only=True)
class ExtendedLaw:
    """Forces and moment linear in gaps and roll, whose coefficients are quadratic in the control current.

    Parameters
    ----------
    lift, lateral, moment : three rows each, of 5, 4 and 3 numbers
        Row 1: value at the nominal pose and factors of Δh, Δh', φ, α.  Row 2: factors of α Δh, α Δh', α φ, α².
        Row 3: factors of α² Δh, α² Δh', α² φ.  Forces in N, moment in N m, lengths in m, roll in rad.
    drag_ratio : float
        K_1 = f_D / f_L [1].

    Source: report, A.3, table after Figure A-9.
    """

    lift: tuple[tuple[float, ...], ...]
    lateral: tuple[tuple[float, ...], ...]
    moment: tuple[tuple[float, ...], ...]
    drag_ratio: float

    def __post_init__(self) -> None:
        for name in ("lift", "lateral", "moment"):
            rows = tuple(getattr(self, name))
            if len(rows) != 3:
                raise InputError(
                    f"ExtendedLaw.{name} must have three rows (factors of 1, α, α²); got {len(rows)}. Give all three."
                )
            checked = tuple(
                _coefficients(f"ExtendedLaw.{name}, row {number}", row, size)
                for number, (row, size) in enumerate(zip(rows, (5, 4, 3), strict=True), start=1)
            )
            object.__setattr__(self, name, checked)
        _check_drag_ratio(self.drag_ratio)

    def forces(self, gap_change, gap_lateral_change, roll, alpha):
        """F_L [N], F_G [N], L [N m], elementwise; see ForceLaw."""
        pose = (gap_change, gap_lateral_change, roll)
        return tuple(
            constant[0]
            + _inner(constant[1:], (*pose, alpha))
            + alpha * _inner(linear, (*pose, alpha))
            + alpha * alpha * _inner(square, pose)
            for constant, linear, square in (self.lift, self.lateral, self.moment)
        )

    @property
    def affine(self) -> bool:
        """False: deviations multiply one another."""
        return False

    def tangent(self, deviation: np.ndarray, alpha: np.ndarray) -> Tangent:
        """Forces (3, n) and slopes (3, 4n); see ForceLaw."""
        return formula_tangent(self, deviation, alpha)

    def first_order(self) -> FirstOrderLaw:
        """The same law without products of deviations."""
        return FirstOrderLaw(
            lift=self.lift[0], lateral=self.lateral[0], moment=self.moment[0], drag_ratio=self.drag_ratio
        )


def report_first_order() -> FirstOrderLaw:
    """The first-order expansion as printed (report, A.3): h = h' = 0.3 m, 134 m/s, 429.69 kA-turns."""
    return report_extended(corrected=False).first_order()


def report_extended(*, corrected: bool = True) -> ExtendedLaw:
    """The extended expansion of the report, A.3, as printed or with its five wrong entries mended.

    Parameters
    ----------
    corrected : bool
        True replaces the entries that contradict symmetry (F_Lφ = L_h, F_Gφ = L_h' in every row) or the energy
        derivative: α φ in F_L (a digit transposed), α² φ in F_G and α² Δh' in L (sign), α φ and α² φ in L (roll arm
        left out). The last two cannot be read off the page and carry the values of the exact law, to the five printed
        digits.
    """
    lift_alpha_roll, lateral_square_roll, moment_alpha_roll, moment_square_roll = (
        (6.2601e3, -9.2180e4, -8.5542e4, -8.2996e4) if corrected else (6.6260e3, 9.2180e4, -1.0240e5, -1.0968e5)
    )
    return ExtendedLaw(
        lift=(
            (1.1120e5, -8.9372e5, 8.2437e4, -1.2899e4, 3.3981e5),
            (-3.0328e6, 2.4477e5, lift_alpha_roll, 2.7177e5),
            (-2.6868e6, 1.6119e5, 2.9376e4),
        ),
        lateral=(
            (3.9640e4, 8.2437e4, -3.2430e5, -4.7202e4, 6.3715e4),
            (2.4477e5, -5.4840e5, -1.4250e5, 2.7417e4),
            (1.6119e5, -2.6359e5, lateral_square_roll),
        ),
        moment=(
            (1.1768e4, -1.2899e4, -4.7202e4, -2.3642e4, 2.7473e4),
            (6.2601e3, -1.4250e5, moment_alpha_roll, 1.4795e4),
            (2.9376e4, lateral_square_roll, moment_square_roll),
        ),
        drag_ratio=1 / REPORT_LIFT_TO_DRAG,
    )


def _inner(row: Iterable, values: Iterable):
    return sum((coefficient * value for coefficient, value in zip(row, values, strict=True)), 0.0)


def _coefficients(name: str, row: Iterable, size: int) -> tuple[float, ...]:
    given = tuple(row)
    if len(given) != size:
        raise InputError(
            f"{name} must hold {size} coefficients; got {len(given)}. Give one per column of the expansion."
        )
    for value in given:
        if isinstance(value, int | float) and not math.isfinite(value):
            raise InputError(f"{name} must hold finite numbers; got {value!r}. Check where the coefficient comes from.")
    return given


def _check_drag_ratio(value) -> None:
    if isinstance(value, int | float) and not 0 <= value < math.inf:
        raise InputError(
            f"drag_ratio must be f_D/f_L, finite and not negative; got {value!r}. Give 1/61.505 for the report's."
        )
