"""Promises over boxes of factors on the printed plant: its closed loops as families, each proved as a whole.

    table, group, box --exact interpolation--> families of polynomials --zero exclusion, positivity--> worst value

Factors are those of `loop.FACTORS`, 1 = as printed, constant in time. How often a factor enters: each mass and inertia
divides the accelerations of one coordinate, a matrix of rank one, so the characteristic polynomial times it is affine
in it (quadratic in "inertia" where two are meant); forces per current enter as often as there are patterns, forces per
displacement as often as there are coordinates. A point off the grid checks it.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Protocol, TypeVar

from flint import fmpq, fmpq_mat

from workbench.verify.box import (
    Enclosure,
    largest_damping,
    largest_decay,
    prove_damping,
    prove_decay,
    prove_peak_sensitivity,
    smallest_peak,
)
from workbench.verify.box_sensitivity import SensitivityFamily, peak_at, sensitivity_family
from workbench.verify.exclusion import damping, decay
from workbench.verify.failure import NotProved
from workbench.verify.law import GROUPS
from workbench.verify.loop import FACTORS, INERTIA_OF, closed_loop
from workbench.verify.pole import ends
from workbench.verify.polynomial_family import Box, Family, Point, characteristic, interpolate, multiaffine
from workbench.verify.table import Table

T = TypeVar("T")
ZERO_EXCLUSION = "ball arithmetic: zero exclusion over the box, exact families"
POSITIVITY = "ball arithmetic: positivity over the box, exact families"
BUDGET = 60.0  # s, of one promise
TOLERANCE = 2e-3  # relative, of the enclosures a table promises


class UncertainFamily(Protocol):
    """What a proof over a box asks of a loop."""

    @property
    def box(self) -> Box: ...  # the parameters

    @property
    def poles(self) -> Family: ...  # the characteristic polynomial, times something positive

    @property
    def sensitivity(self) -> SensitivityFamily: ...  # at the patterns

    @property
    def corners(self) -> list[Point]: ...  # members at which a worst value may be attained


class UncertainLoop:
    """One group's closed loop over a box of factors."""

    def __init__(self, table: Table, group: str, intervals: Mapping[str, tuple[fmpq, fmpq]]) -> None:
        unknown = [name for name in intervals if name not in FACTORS]
        if unknown:
            raise NotProved(f"a box over {unknown[0][:60]!r} is not known to the checker")
        coordinates = GROUPS[group].coordinates
        inertias = {INERTIA_OF[c] for c in coordinates}
        # a factor that cannot reach this group, such as the pitch inertia of sway, roll and yaw, drops out
        used = [name for name in intervals if not name.endswith("_inertia") or name in inertias]
        sides = [tuple(intervals[name][k] for name in used) for k in range(2)]
        self.box = _refused(lambda: Box(tuple(used), *sides))
        self._table, self._group, self._names = table, group, tuple(used)
        nominal = closed_loop(table, group)
        self._size, self._lengths = nominal.A.nrows(), nominal.lengths
        self._degree = {
            **dict.fromkeys(("mass", "roll_inertia", "pitch_inertia", "yaw_inertia"), 1),
            "inertia": len(inertias - {"mass"}),
            "current_force": min(len(nominal.patterns), len(coordinates)),
            "gap_force": len(coordinates),
        }
        self._divides = tuple(name for name in used if name == "mass" or name.endswith("inertia"))
        try:
            self._bordered = multiaffine(self._exact, self.box, self._divides)
        except ValueError:  # without current-loop lag the direct gain closes through the factors
            self._bordered = self._exact

    @cached_property
    def poles(self) -> Family:
        """The characteristic polynomial, times what divides."""

        def state_matrix(theta: Point) -> fmpq_mat:
            return self._parts(theta)[0]

        return _refused(lambda: interpolate(characteristic(state_matrix, self._multiplier), self.box, self._degrees)[0])

    @cached_property
    def sensitivity(self) -> SensitivityFamily:
        """The sensitivity at the patterns; two of them at most."""
        return _refused(
            lambda: sensitivity_family(self._parts, self.box, self._degrees, self._multiplier, self._lengths)
        )

    @property
    def corners(self) -> list[Point]:
        """The centre and the corners of the box."""
        return [self.box.centre, *self.box.vertices()]

    @property
    def _degrees(self) -> list[int]:
        return [self._degree[name] for name in self._names]

    def _exact(self, theta: Point) -> fmpq_mat:
        """[[A, B], [C, 0]] of the sensitivity at a point."""
        seen = closed_loop(self._table, self._group, dict(zip(self._names, theta, strict=True))).sensitivity
        k = len(self._lengths)
        rows = [a + b for a, b in zip(seen.A.tolist(), seen.B.tolist(), strict=True)]
        return fmpq_mat(rows + [row + [fmpq(0)] * k for row in seen.C.tolist()])

    def _parts(self, theta: Point) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat]:
        n, rows = self._size, self._bordered(theta).tolist()
        A, B, C = [r[:n] for r in rows[:n]], [r[n:] for r in rows[:n]], [r[:n] for r in rows[n:]]
        return fmpq_mat(A), fmpq_mat(B), fmpq_mat(C)

    def _multiplier(self, theta: Point) -> fmpq:
        out = fmpq(1)
        for name, value in zip(self._names, theta, strict=True):
            if name in self._divides:
                out *= value ** self._degree[name]
        return out


def worst_over_box(loops: Sequence[UncertainFamily], name: str) -> tuple[fmpq, fmpq, str]:
    """The worst value of a quantity over a box: one end proved for every member, the other attained by one.

    loops : of all groups for "damping ratio" and "decay rate", of the one group for "peak sensitivity, <group>"
    """
    found: list[Enclosure] = []
    for loop in loops:
        if _is_peak(name):
            one = _refused(lambda loop=loop: smallest_peak(loop.sensitivity, tolerance=TOLERANCE, budget=BUDGET))
        else:
            one = _largest(name)(loop.poles, tolerance=TOLERANCE, budget=BUDGET)
        if one.proof is None:
            at = ", ".join(f"{k} {float(v):.4g}" for k, v in zip(loop.box.names, one.at, strict=True))
            attained = one.low if _is_peak(name) else one.high
            raise NotProved(f"no bound holds over the whole box; the member at {at} attains {attained:.4g}")
        found.append(one)
    both = [(fmpq(*e.low.as_integer_ratio()), fmpq(*e.high.as_integer_ratio())) for e in found]
    if _is_peak(name):
        return *max(both, key=lambda e: e[1]), POSITIVITY
    return min(e[0] for e in both), min(e[1] for e in both), ZERO_EXCLUSION


def interval_holds(loops: Sequence[UncertainFamily], name: str, low: fmpq, high: fmpq) -> bool:
    """Whether the worst value is proved to lie in an interval: its bound for all members, its other end attained."""
    bound = high if _is_peak(name) else low
    for loop in loops:
        if _is_peak(name):
            proof = _refused(lambda loop=loop: prove_peak_sensitivity(loop.sensitivity, bound, budget=BUDGET))
        else:
            prove = prove_damping if _largest(name) is largest_damping else prove_decay
            proof = _refused(lambda loop=loop, prove=prove: prove(loop.poles, bound, budget=BUDGET))
        if not proof.proved:
            return False
    reached = attained(loops, name)
    return reached >= low if _is_peak(name) else reached <= high


def attained(loops: Sequence[UncertainFamily], name: str) -> fmpq:
    """The worst value among the members at the centre and the corners: as far as this, it is certainly reached."""
    if _is_peak(name):
        return max(ends(peak_at(loop.sensitivity, v)[0])[0] for loop in loops for v in loop.corners)
    measure = damping if _largest(name) is largest_damping else decay
    return min(ends(measure(loop.poles.at(v)))[1] for loop in loops for v in loop.corners)


def _is_peak(name: str) -> bool:
    return name.startswith("peak sensitivity, ")


def _largest(name: str) -> Callable[..., Enclosure]:
    known = {"damping ratio": largest_damping, "decay rate": largest_decay}
    if name not in known:
        raise NotProved("over a box the checker proves damping, decay and peak sensitivity alone")
    return known[name]


def _refused(make: Callable[[], T]) -> T:
    """What the makers of families refuse is not proved."""
    try:
        return make()
    except ValueError as error:
        raise NotProved(str(error)) from error
