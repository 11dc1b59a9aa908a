"""What a stated error of the coil forces over the speed can change: a bound for every vehicle within it, not a guess.

    forces F(v) ± e --Physics--> loads Δ on the motions per displacement and current, |Δ_jl| <= M_jl
    closed loop with Δ fed back:  det(sI − A − U Δ W) = p det(I − Δ G),   G = W (sI − A)⁻¹ U = n/p
      Σ c_l r_j |G_lj|² < κ² < 1 on the boundary of a region   -->   no root crosses it, whatever Δ is
      S + T₁ Δ (I − G Δ)⁻¹ T₂                                   -->   σ_max grows by at most τ₁ τ₂ / (1 − κ)

r_j and c_l are the sums of M along a row and a column: in the norm Σ c_l x_l² the map x -> G Δ x shrinks by κ (Cauchy),
and |T₁ Δ x| <= τ₁ |x| with τ₁² = Σ r_j |T₁|², |x| <= τ₂/(1 − κ) with τ₂² = Σ c_l |T₂|². Each condition is that one
polynomial in speed and frequency is positive, decided as the peak sensitivity is. The numerators are rank-one updates,
c adj(sI − A) b = det(sI − A) − det(sI − A + b c) with the sign turned, exact at every speed.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from math import comb, prod
from time import perf_counter

from flint import fmpq, fmpq_mat, fmpq_poly, fmpz_poly

from workbench.verify.exact.deadline import check, remaining
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.polynomial import powers_of_the_ray
from workbench.verify.exact.system import matrix, part
from workbench.verify.family.exclusion import frequency_exponent
from workbench.verify.family.form import Form
from workbench.verify.family.lanes import VALUE
from workbench.verify.family.polynomial import Family, ParameterBox, Point, interpolate
from workbench.verify.family.search import search
from workbench.verify.family.sensitivity import positive
from workbench.verify.vehicle.law import GROUPS
from workbench.verify.vehicle.physics import LOADS, Physics

NONE = fmpq(0)
STEPS = (fmpq(1), fmpq(119, 100), fmpq(17, 12), fmpq(169, 100))  # not below 2^(k/4)
BITS = VALUE + 24
MOST_PIECES = 400
SHARES = (fmpq(1, 64), fmpq(1, 8), fmpq(1, 2), fmpq(9, 10))  # κ tried in turn: the smaller, the less a peak grows
BUDGET = 30.0  # s, of one condition


class ModelError:
    """The conditions under which promises over a range of speeds hold for every vehicle within the stated error."""

    def __init__(self, loop) -> None:
        """loop: workbench.verify.vehicle.scheduled.ScheduledLoop over the speed alone."""
        if len(loop.box.names) > 1:
            raise NotProved("an error of the coil forces is included over speeds alone, not over a box beside them")
        self._loop = loop
        self._group = loop.group
        self._lengths = loop.lengths
        self._coordinates = GROUPS[loop.group].coordinates

    @cached_property
    def bounds(self) -> list[list[fmpq]]:
        """M: load on each motion (rows) per displacement and per current along a pattern (columns)."""
        loop, forces = self._loop, self._loop.forces
        low, high = loop.box.lower[0], loop.box.upper[0]
        ratio = forces.polynomials.lower_bound("lift_to_drag", low, high)
        error = forces.error("lift_to_drag")
        if not ratio > error:
            raise NotProved("the stated error of the lift-to-drag ratio leaves no bound of the drag")
        largest, change = 1 / (ratio - error), error / (ratio * (ratio - error))
        names = [(row, k) for row in range(3) for k in range(5)]
        total: list[list[fmpq]] | None = None
        kinds = ("lift", "lateral", "moment")
        for row, k in names:
            check()
            name = f"{kinds[row]},{k}"
            off = forces.error(name)
            at_rest, by_drag = self._per_force(row, k)
            size = forces.polynomials.largest(name) + off
            share = [
                [off * (abs(a) + largest * abs(b)) + change * size * abs(b) for a, b in zip(one, other, strict=True)]
                for one, other in zip(at_rest, by_drag, strict=True)
            ]
            total = share if total is None else [
                [a + b for a, b in zip(x, y, strict=True)] for x, y in zip(total, share, strict=True)
            ]  # fmt: skip
        return total or []

    def _per_force(self, row: int, k: int) -> tuple[list[list[fmpq]], list[list[fmpq]]]:
        """Loads per unit of one force number: without drag, and per unit of the drag ratio; affine, so two suffice."""
        unit = [[fmpq(int((i, j) == (row, k))) for j in range(5)] for i in range(3)]
        nothing = [[fmpq(0)] * 5 for _ in range(3)]
        without = [a - b for a, b in zip(self._loads(unit, 0), self._loads(nothing, 0), strict=True)]
        with_drag = [a - b for a, b in zip(self._loads(unit, 1), self._loads(nothing, 1), strict=True)]
        width = len(self._coordinates) + len(self._lengths)
        flat = [b - a for a, b in zip(without, with_drag, strict=True)]
        return (
            [without[i : i + width] for i in range(0, len(without), width)],
            [flat[i : i + width] for i in range(0, len(flat), width)],
        )

    def _loads(self, forces: list[list[fmpq]], drag: int) -> list[fmpq]:
        """Inertia times acceleration of each motion per displacement and per current along a pattern; row by row."""
        physics: Physics = replace(self._loop.physics, forces=matrix(forces), drag_ratio=fmpq(drag))
        plant, law = physics.plant(), self._loop.table.law
        patterns = law.patterns(self._group)[0]
        rows = plant.index("states", [f"{c}_rate" for c in self._coordinates])
        inertia = dict(zip(("Z", "Theta", "Y", "Phi", "Psi"), physics.inertia, strict=True))
        moved = part(plant.A, rows, plant.index("states", self._coordinates)).tolist()
        if law.currents[0] in plant.states:
            source = part(plant.A, rows, plant.index("states", law.currents))
        else:
            source = part(plant.B, rows, plant.index("inputs", law.commands))
        driven = (source * patterns).tolist()
        return [
            inertia[c] * e for c, one, other in zip(self._coordinates, moved, driven, strict=True) for e in one + other
        ]

    @cached_property
    def _families(self) -> tuple[Family, dict[str, list[list[Family]]]]:
        """p, and the numerators of G (l, j), T₁ (pattern, j) and T₂ (l, pattern), on the range of speeds."""
        loop = self._loop
        J, L, m = len(self._coordinates), len(self._coordinates) + len(self._lengths), len(self._lengths)

        table_lag = loop.physics.lag

        def sample(theta: Point) -> Sequence[fmpq_poly]:
            gains = loop.schedule.at(theta[0])
            closed = loop.closed(theta[0], gains)
            system, n = closed.system, len(closed.system.states)
            loads = [dict(zip(("Z", "Theta", "Y", "Phi", "Psi"), LOADS, strict=True))[c] for c in self._coordinates]
            seen = system.select([*loads, *closed.patterns], closed.patterns)
            if table_lag == 0:
                raise NotProved("an error of the coil forces is included behind a lag of the currents alone")
            at = system.index("states", [*self._coordinates, *(f"current of {p}" for p in closed.patterns)])
            columns = [part(seen.B, range(n), [j]) for j in range(J + m)]
            signals = [fmpq_mat(1, n, [fmpq(int(i == k)) for i in range(n)]) for k in at]
            commands = [part(seen.C, [i], range(n)) for i in range(m)]
            p = system.A.charpoly()
            factor = loop.multiplier(theta[0], gains, ())

            def over(row: fmpq_mat, column: fmpq_mat, through: fmpq = NONE) -> fmpq_poly:
                return factor * ((system.A - column * row).charpoly() - p + through * p)

            out = [factor * p]
            out += [over(row, columns[j]) for row in signals for j in range(J)]
            out += [over(row, columns[j], seen.D[i, j]) for i, row in enumerate(commands) for j in range(J)]
            return out + [over(row, columns[J + q]) for row in signals for q in range(m)]

        box = ParameterBox(loop.box.names, loop.box.lower, loop.box.upper)
        p, *rest = interpolate(sample, box, (loop.degree_with_loads,))
        shapes = {"G": (L, J), "T1": (m, J), "T2": (L, m)}
        parts, start = {}, 0
        for name, (rows, columns) in shapes.items():
            parts[name] = [rest[start + i * columns : start + (i + 1) * columns] for i in range(rows)]
            start += rows * columns
        return p, parts

    def keeps_region(self, zeta: fmpq, sigma: fmpq) -> bool:
        """Whether no root can cross the boundary of the sector ζ about −σ, whatever the error is."""
        return self._small(zeta, sigma, SHARES[-1])

    def growth(self) -> fmpq:
        """By how much the peak sensitivity of a vehicle within the error may exceed that of the printed polynomials."""
        kappa = next((k for k in SHARES if self._small(fmpq(0), fmpq(0), k)), None)
        if kappa is None:
            raise NotProved("the stated error of the coil forces is too large for a bound of the sensitivity")
        _, parts = self._families
        M = self.bounds
        by_load = [sum(row, fmpq(0)) for row in M]
        by_signal = [sum(column, fmpq(0)) for column in zip(*M, strict=True)]
        ratio = max(self._lengths) / min(self._lengths)
        one = self._size([(by_load[j] * ratio, f) for row in parts["T1"] for j, f in enumerate(row)])
        other = self._size([(by_signal[k] * ratio, f) for k, row in enumerate(parts["T2"]) for f in row])
        return one * other / (1 - kappa)

    def _small(self, zeta: fmpq, sigma: fmpq, kappa: fmpq) -> bool:
        """Whether G Δ shrinks by κ along a boundary."""
        _, parts = self._families
        M = self.bounds
        r, c = [sum(row, fmpq(0)) for row in M], [sum(column, fmpq(0)) for column in zip(*M, strict=True)]
        terms = [(r[j] * c[k], f) for k, row in enumerate(parts["G"]) for j, f in enumerate(row) if r[j] * c[k]]
        return not terms or self._positive([(w / kappa**2, f) for w, f in terms], zeta, sigma)

    def _size(self, terms: list[tuple[fmpq, Family]]) -> fmpq:
        """A bound τ with Σ w |n|² < τ² |p|² on the imaginary axis, within a fifth of the least."""
        terms = [(w, f) for w, f in terms if w]
        if not terms:
            return fmpq(0)

        def proved(exponent: int) -> bool:  # of τ = 2^(exponent/4)
            square = fmpq(2) ** (exponent // 2) * (fmpq(7, 5) if exponent % 2 else 1)  # 7/5 < √2
            return self._positive([(w / square, f) for w, f in terms], fmpq(0), fmpq(0))

        low, high = -81, -80 + 16
        while not proved(high):
            low, high = high, high + 16
            if high > 160:
                raise NotProved("no bound was found for what an error of the coil forces does")
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if proved(middle) else (middle, high)
        return fmpq(2) ** (high // 4) * STEPS[high % 4]

    def _positive(self, terms: Sequence[tuple[fmpq, Family]], zeta: fmpq, sigma: fmpq) -> bool:
        """Whether |p|² − Σ w |n|² > 0 along a boundary, at every speed."""
        check()
        p, _ = self._families
        form = _difference(p, terms, zeta, sigma)
        found = search((form,), positive, most=MOST_PIECES, deadline=perf_counter() + min(BUDGET, remaining()))
        return not found.left and not found.refuted


def _difference(p: Family, terms: Sequence[tuple[fmpq, Family]], zeta: fmpq, sigma: fmpq) -> Form:
    """|p|² − Σ w |n|² on s = r u − σ as one form; speed first, r last, in units of a positive number."""
    order, degree = p.order, p.degrees
    step = fmpq(2) ** frequency_exponent(p.at(p.box.centre))
    t, u = powers_of_the_ray(zeta, order)
    powers = [step**k for k in range(order + 1)]

    def along(family: Family, factors: Sequence[fmpq]) -> list[fmpq]:
        moved = family.shifted(-sigma) if sigma else family
        return [c * powers[k % (order + 1)] * factors[k % (order + 1)] for k, c in enumerate(moved.coefficients)]

    every = [(fmpq(1), p), *terms]
    pairs = [(weight, along(f, t), along(f, u)) for weight, f in every]
    size = max(int(abs(c).p).bit_length() - int(c.q).bit_length() + 1 for part in pairs[0][1:] for c in part if c)
    up, down = 1 << max(BITS - size, 0), 1 << max(size - BITS, 0)
    turn = 1 - zeta * zeta
    unit = int(turn.q) * (1 << 40)
    doubled = tuple(2 * d for d in degree)
    values: list[int] | None = None
    error = 0
    for weight, real, imaginary in pairs:
        # n is scaled by √w, rounded up, before it is made whole; p by 1
        scale = fmpq(1) if weight == 1 and values is None else _root_above(weight)
        whole = [[int((c * scale).p) * up // (int((c * scale).q) * down) for c in q] for q in (real, imaginary)]
        largest = max(max(map(abs, q), default=0) for q in whole) + 1
        square = _packed_square(whole[0], degree, order) * unit
        square += _packed_square(whole[1], degree, order) * int(turn.p * (1 << 40))
        flat = _unpacked(square, doubled, order)
        values = flat if values is None else [a - b for a, b in zip(values, flat, strict=True)]
        error += 2 * unit * (order + 2) * (prod(d + 1 for d in degree)) * (2 * largest + 1) + 1
    return Form.rounded((*doubled, 2 * order), values or [], error)


def _root_above(value: fmpq) -> fmpq:
    """A rational whose square is not below a value, and hardly above."""
    guess = fmpq(*float(value).as_integer_ratio()) if value else fmpq(0)
    root = fmpq(*(float(guess) ** 0.5).as_integer_ratio()) * (1 + fmpq(1, 10**9))
    if root * root < value:
        raise NotProved("a bound of an error is too small to be computed with")
    return root


def _packed_square(values: list[int], degrees: tuple[int, ...], order: int) -> fmpz_poly:
    """The square of a polynomial in scaled Bernstein form in the speed and powers of r, packed in one variable."""
    width = 2 * order + 1
    out = [0] * (prod(2 * d + 1 for d in degrees) * width)
    (d,) = degrees
    for k in range(d + 1):
        for j in range(order + 1):
            out[k * width + j] = comb(d, k) * values[k * (order + 1) + j]
    packed = fmpz_poly(out)
    return packed * packed


def _unpacked(packed: fmpz_poly, doubled: tuple[int, ...], order: int) -> list[int]:
    """Bernstein coefficients of a packed square in the speed and in x, r = w x/(1 − x)."""
    (d,), width = doubled, 2 * order + 1
    values = [int(c) for c in packed.coeffs()]
    values += [0] * ((d + 1) * width - len(values))
    return [
        values[k * width + j] // (comb(d, k) * comb(2 * order, j)) for k in range(d + 1) for j in range(width)
    ]  # fmt: skip
