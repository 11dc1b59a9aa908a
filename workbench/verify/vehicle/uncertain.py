"""Promises over boxes of factors on the printed plant: its closed loops as families, each proved as a whole.

    table, group, box --exact interpolation--> families of polynomials --zero exclusion, positivity--> worst value

Factors are those of `loop.FACTORS`, 1 = as printed, constant in time. How often a factor enters follows from the
equations (`degree`). Behind a current loop nothing is closed at once, so the state matrix is affine in each force and
sensor factor and in 1/mass and 1/inertia. Points off the grids check both; they prove nothing.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol, TypeVar

from flint import fmpq, fmpq_mat

from workbench.verify.exact.deadline import check, remaining
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import ends
from workbench.verify.family.box import (
    Enclosure,
    Proof,
    largest_damping,
    largest_decay,
    prove_damping,
    prove_decay,
    prove_peak_sensitivity,
    smallest_peak,
)
from workbench.verify.family.exclusion import damping, decay
from workbench.verify.family.polynomial import Family, ParameterBox, Point, characteristic, interpolate, multiaffine
from workbench.verify.family.sensitivity import SensitivityFamily, peak_at, sensitivity_family
from workbench.verify.vehicle.degree import degrees_of
from workbench.verify.vehicle.law import CHANNELS, GROUPS
from workbench.verify.vehicle.loop import FACTORS, closed_loop
from workbench.verify.vehicle.table import Table

T = TypeVar("T")
ZERO_EXCLUSION = "ball arithmetic: zero exclusion over the box, exact families"
POSITIVITY = "ball arithmetic: positivity over the box, exact families"
BUDGET = 60.0  # s, of one promise
TOLERANCE = 2e-3  # relative, of the enclosures a table promises
PIECES_OF_A_SHARE = {True: 50, False: 150}  # of a peak sensitivity, of a region of poles: a second or two


class UncertainFamily(Protocol):
    """What a proof over a box asks of a loop."""

    @property
    def box(self) -> ParameterBox: ...  # the parameters

    @property
    def poles(self) -> Family: ...  # the characteristic polynomial, times something positive

    @property
    def sensitivity(self) -> SensitivityFamily: ...  # at the patterns

    @property
    def corners(self) -> list[Point]: ...  # members at which a worst value may be attained


def _proof(loop: UncertainFamily, name: str, bound: fmpq, budget: float) -> Proof:
    """A bound for every member and, where a model error is stated, for every vehicle within it."""
    error = getattr(loop, "error", None)
    if _is_peak(name):
        return prove_peak_sensitivity(loop.sensitivity, bound - _growth(loop), budget=budget)
    ray = _largest(name) is largest_damping
    proof = (prove_damping if ray else prove_decay)(loop.poles, bound, budget=budget)
    kept = not (proof.proved and error) or error.keeps_region(*((bound, fmpq(0)) if ray else (fmpq(0), bound)))
    return (
        proof if kept else replace(proof, proved=False, detail="within the stated error of the coil forces it may fail")
    )


def _growth(loop: UncertainFamily) -> fmpq:
    """By how much a stated model error may raise a peak sensitivity."""
    error = getattr(loop, "error", None)
    return error.growth() if error else fmpq(0)


class Factors:
    """The factors of a box that reach one group: their intervals, and how often each enters its polynomials."""

    def __init__(self, table: Table, group: str, intervals: Mapping[str, tuple[fmpq, fmpq]]) -> None:
        unknown = [name for name in intervals if name not in FACTORS]
        if unknown:
            raise NotProved(f"a box over {unknown[0][:60]!r} is not known to the checker")
        # a factor that cannot reach this group, such as the pitch inertia of sway, roll and yaw, drops out
        self._degree = degrees_of(group, len(table.law.patterns(group)[1]))
        self.names = tuple(name for name in intervals if self._degree.get(name, 0) > 0)
        self.divide = tuple(name for name in self.names if name == "mass" or name.endswith("inertia"))
        lower, upper = (tuple(intervals[name][k] for name in self.names) for k in range(2))
        self.box = refused(lambda: ParameterBox(self.names, lower, upper))
        if any(low <= 0 for name, low in zip(self.names, lower, strict=True) if name in self.divide):
            raise NotProved("a box must keep mass and inertias positive")

    @property
    def degrees(self) -> list[int]:
        """Bounds of each factor's power in the polynomials."""
        return [self._degree[name] for name in self.names]

    def named(self, theta: Point) -> dict[str, fmpq]:
        """The factors of a point by name."""
        return dict(zip(self.names, theta, strict=True))

    def multiplier(self, theta: Point) -> fmpq:
        """What makes a polynomial of what divides."""
        out = fmpq(1)
        for name, value in self.named(theta).items():
            if name in self.divide:
                out *= value ** self._degree[name]
        return out


def require_lag(table: Table, group: str) -> None:
    """NotProved where accelerations pass to the currents at once: S(∞) is not I then, and factors close the loop."""
    law, plant = table.law, table.plant
    directions = {"acceleration_z" if c in CHANNELS[:3] else "acceleration_y" for c in GROUPS[group].channels}
    direct = {"acceleration_z": "K_zddot", "acceleration_y": "K_yddot"}
    felt = [f"{kind}_{i + 1}" for kind in directions if table.gains[direct[kind]] != 0 for i in range(law.count)]
    if felt and any(e != 0 for e in plant.select(law.commands, felt).D.entries()):
        raise NotProved("without a lag of the currents, accelerations pass straight to the commands: no box is proved")


class UncertainLoop:
    """One group's closed loop over a box of factors."""

    def __init__(self, table: Table, group: str, intervals: Mapping[str, tuple[fmpq, fmpq]]) -> None:
        self._factors = Factors(table, group, intervals)
        self.box = self._factors.box
        self._table, self._group = table, group
        require_lag(table, group)
        nominal = closed_loop(table, group)
        self._size, self._lengths = nominal.A.nrows(), nominal.lengths
        self._bordered = refused(lambda: multiaffine(self._exact, self.box, self._factors.divide))

    @cached_property
    def poles(self) -> Family:
        """The characteristic polynomial, times what divides."""
        f = self._factors
        return refused(
            lambda: interpolate(characteristic(lambda t: self._parts(t)[0], f.multiplier), self.box, f.degrees)[0]
        )

    @cached_property
    def sensitivity(self) -> SensitivityFamily:
        """The sensitivity at the patterns; two of them at most."""
        f = self._factors
        return refused(lambda: sensitivity_family(self._parts, self.box, f.degrees, f.multiplier, self._lengths))

    @property
    def corners(self) -> list[Point]:
        """The centre and the corners of the box."""
        return [self.box.centre, *self.box.vertices()]

    def _exact(self, theta: Point) -> fmpq_mat:
        """[[A, B], [C, 0]] of the sensitivity at a point."""
        seen = closed_loop(self._table, self._group, self._factors.named(theta)).sensitivity
        k = len(self._lengths)
        rows = [a + b for a, b in zip(seen.A.tolist(), seen.B.tolist(), strict=True)]
        return fmpq_mat(rows + [row + [fmpq(0)] * k for row in seen.C.tolist()])

    def _parts(self, theta: Point) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat]:
        n, rows = self._size, self._bordered(theta).tolist()
        A, B, C = [r[:n] for r in rows[:n]], [r[n:] for r in rows[:n]], [r[:n] for r in rows[n:]]
        return fmpq_mat(A), fmpq_mat(B), fmpq_mat(C)


@dataclass(frozen=True, slots=True)
class Worst:
    """The worst value of a quantity over a box lies in [low, high]; `at`: names to the member that attains one end."""

    low: fmpq
    high: fmpq
    at: Mapping[str, fmpq]
    method: str


def worst_over_box(loops: Sequence[UncertainFamily], name: str) -> Worst:
    """The worst value of a quantity over a box: one end proved for every member, the other attained by one.

    loops : of all groups for "damping ratio" and "decay rate", of the one group for "peak sensitivity, <group>"

    Raises NotProved, with the worst member met, where no bound holds over the whole box.
    """
    found: list[tuple[fmpq, fmpq, UncertainFamily, Enclosure]] = []
    for loop in loops:
        if _is_peak(name):
            one = refused(lambda loop=loop: smallest_peak(
                loop.sensitivity, tolerance=TOLERANCE, budget=_budget(), grown=_growth(loop),
            ))  # fmt: skip
        else:

            def prove(family, bound, *, budget, loop=loop):
                return _proof(loop, name, bound, budget)

            one = _largest(name)(loop.poles, tolerance=TOLERANCE, budget=_budget(), prove=prove)
        check()
        if one.proof is None:
            at = ", ".join(f"{k} {float(v):.4g}" for k, v in zip(loop.box.names, one.at, strict=True))
            reached = one.low if _is_peak(name) else one.high
            raise NotProved(f"no bound holds over the whole box; the member at {at} attains {reached:.4g}")
        found.append((fmpq(*one.low.as_integer_ratio()), fmpq(*one.high.as_integer_ratio()), loop, one))
    worst = max(found, key=lambda f: f[1]) if _is_peak(name) else min(found, key=lambda f: f[1])
    low, high = (worst[0], worst[1]) if _is_peak(name) else (min(f[0] for f in found), worst[1])
    return Worst(low, high, dict(zip(worst[2].box.names, worst[3].at, strict=True)), method_of(name))


def interval_holds(
    loops: Sequence[UncertainFamily], name: str, low: fmpq, high: fmpq, at: Mapping[str, fmpq] | None = None
) -> bool:
    """Whether the worst value is proved to lie in an interval: its bound for all members, its other end attained.

    at : the member said to attain it; centre and corners are looked at if left out
    """
    reached = attained(loops, name, at)
    if reached is None or not (reached >= low if _is_peak(name) else reached <= high):
        return False
    bound = high if _is_peak(name) else low
    for loop in loops:
        proof = refused(lambda loop=loop: _proof(loop, name, bound, _budget()))
        check()
        if not proof.proved:
            return False
    return True


def attained(loops: Sequence[UncertainFamily], name: str, at: Mapping[str, fmpq] | None = None) -> fmpq | None:
    """The worst value of a member, of those at the centre and the corners if none is named: as far is surely reached.

    None where the member named does not lie in the box.
    """
    members: list[tuple[UncertainFamily, Point]] = []
    for loop in loops:
        if not at:
            members += [(loop, v) for v in loop.corners]
            continue
        box = loop.box
        place = tuple(at.get(k, middle) for k, middle in zip(box.names, box.centre, strict=True))
        if not all(lo <= v <= hi for lo, v, hi in zip(box.lower, place, box.upper, strict=True)):
            return None
        members.append((loop, place))
    if _is_peak(name):
        return max(ends(peak_at(loop.sensitivity, v)[0])[0] for loop, v in members)
    measure = damping if _largest(name) is largest_damping else decay
    return min(ends(measure(loop.poles.at(v)))[1] for loop, v in members)


def open_share(loops: Sequence[UncertainFamily], name: str, limit: fmpq) -> float:
    """Share of the box on which a limit is not proved, never too small; of several groups, their sum."""
    total = 0.0
    for loop in loops:
        options = {"most": PIECES_OF_A_SHARE[_is_peak(name)], "budget": _budget(), "thorough": True}
        if _is_peak(name):
            total += refused(
                lambda loop=loop, o=options: prove_peak_sensitivity(loop.sensitivity, limit, **o)
            ).undecided
        else:
            prove = prove_damping if _largest(name) is largest_damping else prove_decay
            total += refused(lambda loop=loop, prove=prove, o=options: prove(loop.poles, limit, **o)).undecided
    return min(total, 1.0)


def _budget() -> float:
    """Seconds for one promise: its own, or what is left of the whole check."""
    return min(BUDGET, remaining())


def method_of(name: str) -> str:
    """How a quantity is enclosed over a box."""
    return POSITIVITY if _is_peak(name) else ZERO_EXCLUSION


def _is_peak(name: str) -> bool:
    return name.startswith("peak sensitivity, ")


def _largest(name: str) -> Callable[..., Enclosure]:
    known = {"damping ratio": largest_damping, "decay rate": largest_decay}
    if name not in known:
        raise NotProved("over a box the checker proves damping, decay and peak sensitivity alone")
    return known[name]


def refused(make: Callable[[], T]) -> T:
    """What the makers of families refuse is not proved."""
    try:
        return make()
    except ValueError as error:
        raise NotProved(str(error)) from error
