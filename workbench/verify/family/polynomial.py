"""Polynomials in s whose coefficients are polynomials in the parameters of a box, by exact interpolation.

    state_matrix(θ) --charpoly at a grid of rational points--> values --exact linear algebra--> Family on the box

What is interpolated must be polynomial in every parameter: a mass that divides is multiplied away (`multiplier`).
Degree bounds are the caller's; a point off the grid must agree exactly, or the family is refused.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from itertools import product
from math import comb

from flint import fmpq, fmpq_mat, fmpq_poly

from workbench.verify.exact.deadline import check

Point = tuple[fmpq, ...]
Sampler = Callable[[Point], Sequence[fmpq_poly]]


def rational(value: object) -> fmpq:
    """An exact rational from a decimal string, an integer, a fraction or (exactly as it is) a float."""
    if isinstance(value, fmpq):
        return value
    exact = Fraction(str(value)) if not isinstance(value, float) else Fraction(value)
    return fmpq(exact.numerator, exact.denominator)


@dataclass(frozen=True, slots=True)
class ParameterBox:
    """Intervals of named parameters; bounds become exact rationals ("0.85" is 17/20)."""

    names: tuple[str, ...]
    lower: Point
    upper: Point

    def __post_init__(self) -> None:
        for side in ("lower", "upper"):
            object.__setattr__(self, side, tuple(rational(v) for v in getattr(self, side)))
        if not len(self.names) == len(self.lower) == len(self.upper):
            raise ValueError(
                f"a box must have two bounds for each name; got {len(self.names)} names, "
                f"{len(self.lower)} lower and {len(self.upper)} upper bounds. Make them agree."
            )
        for name, low, high in zip(self.names, self.lower, self.upper, strict=True):
            if not low < high:
                raise ValueError(
                    f"the bounds of {name!r} must rise; got [{low}, {high}]. Exchange them or leave it out."
                )

    @classmethod
    def of(cls, **bounds: tuple[object, object]) -> "ParameterBox":
        """ParameterBox.of(mass=("0.85", "1.15"), …)."""
        lower, upper = zip(*bounds.values(), strict=True)
        return cls(tuple(bounds), lower, upper)  # type: ignore[arg-type]

    def point(self, shares: Sequence[fmpq]) -> Point:
        """The point that lies at these shares (0 … 1) of the intervals."""
        return tuple(lo + t * (hi - lo) for lo, hi, t in zip(self.lower, self.upper, shares, strict=True))

    @property
    def centre(self) -> Point:
        """The point in the middle."""
        return self.point([fmpq(1, 2)] * len(self.names))

    def vertices(self) -> list[Point]:
        """All corners."""
        return [tuple(corner) for corner in product(*zip(self.lower, self.upper, strict=True))]


@dataclass(frozen=True, slots=True)
class Family:
    """p(s, θ) = Σ c_k(θ) s^k on a box, exact.

    degrees : of each parameter;  order : of s
    coefficients : Bernstein coefficients of every c_k on the box; parameters in order, k fastest
    """

    box: ParameterBox
    degrees: tuple[int, ...]
    order: int
    coefficients: tuple[fmpq, ...]

    def at(self, theta: Sequence[object]) -> fmpq_poly:
        """The polynomial in s at one point, inside the box or not."""
        values: list[fmpq] = list(self.coefficients)
        for degree, low, high, value in zip(self.degrees, self.box.lower, self.box.upper, theta, strict=True):
            t = (rational(value) - low) / (high - low)
            weights = [comb(degree, k) * t**k * (1 - t) ** (degree - k) for k in range(degree + 1)]
            block = len(values) // (degree + 1)
            row = fmpq_mat(1, degree + 1, weights) * fmpq_mat(degree + 1, block, values)
            values = row.entries()
        return fmpq_poly(values)

    def shifted(self, distance: object) -> "Family":
        """p(s + distance, θ)."""
        d, n = rational(distance), self.order + 1
        step = fmpq_mat(n, n, [comb(k, j) * d ** (k - j) if k >= j else fmpq(0) for k in range(n) for j in range(n)])
        rows = fmpq_mat(len(self.coefficients) // n, n, list(self.coefficients)) * step
        return Family(self.box, self.degrees, self.order, tuple(rows.entries()))


def characteristic(
    state_matrix: Callable[[Point], fmpq_mat], multiplier: Callable[[Point], fmpq] | None = None
) -> Sampler:
    """θ -> (multiplier · det(sI − A(θ)),): what `interpolate` takes."""

    def sample(theta: Point) -> Sequence[fmpq_poly]:
        polynomial = state_matrix(theta).charpoly()
        return (polynomial * multiplier(theta) if multiplier else polynomial,)

    return sample


def interpolate(sample: Sampler, box: ParameterBox, degrees: Sequence[int]) -> tuple[Family, ...]:
    """Families through the values of several polynomials in s on the grid of a box.

    sample : θ -> polynomials in s, each coefficient a polynomial in θ of at most the given degrees
    degrees : bounds; the families get the true ones where those are smaller

    Raises ValueError if a point off the grid disagrees: a bound was too low, or the values are no polynomial.
    """
    if len(degrees) != len(box.names) or min(degrees, default=0) < 0:
        raise ValueError(
            f"each of {', '.join(box.names)} must have a degree bound; got {tuple(degrees)}. Give one each."
        )
    grid = product(*([fmpq(k, d) if d else fmpq(1, 2) for k in range(d + 1)] for d in degrees))
    values = []
    for shares in grid:
        check()
        values.append(tuple(sample(box.point(shares))))
    # n/(2n + 1) with n beyond every degree: its denominator divides no degree, so that it is on no axis' grid
    beyond = [max(degrees, default=0) + 1 + k for k in range(len(degrees))]
    elsewhere = box.point([fmpq(n, 2 * n + 1) for n in beyond])
    expected = tuple(sample(elsewhere))
    families = _through(values, box, tuple(degrees))
    if tuple(family.at(elsewhere) for family in families) != expected:
        raise ValueError(
            f"the polynomials must have at most degrees {tuple(degrees)} in {', '.join(box.names)}; a point off the "
            "grid disagrees. Raise the bounds, or multiply by what the parameters divide by."
        )
    return families


def multiaffine(
    matrix: Callable[[Point], fmpq_mat], box: ParameterBox, inverse: Sequence[str] = ()
) -> Callable[[Point], fmpq_mat]:
    """The same matrix function from its corner values, for one affine in each parameter, or in 1/parameter (`inverse`).

    Raises ValueError if the centre disagrees.
    """
    flips = [name in inverse for name in box.names]

    def place(theta: Point) -> Point:
        exact = [rational(v) for v in theta]
        return tuple(1 / v if flip else v for v, flip in zip(exact, flips, strict=True))

    low, high = place(box.lower), place(box.upper)
    corners = [matrix(v) for v in box.vertices()]
    shape = corners[0].nrows(), corners[0].ncols()
    columns = list(zip(*(c.entries() for c in corners), strict=True))
    moving = [k for k, column in enumerate(columns) if any(e != column[0] for e in column)]
    # tables[k]: the moving entries at the corners of the axes from k on, the earlier ones fixed at the shares kept
    tables = [fmpq_mat([[columns[k][row] for k in moving] for row in range(len(corners))])] if moving else []
    kept: list[fmpq] = []

    def evaluate(theta: Point) -> fmpq_mat:
        shares = [(v - lo) / (hi - lo) for v, lo, hi in zip(place(theta), low, high, strict=True)]
        same = next((k for k, (a, b) in enumerate(zip(shares, kept, strict=False)) if a != b), len(kept))
        del kept[same:], tables[same + 1 :]
        entries = [column[0] for column in columns]
        if moving:
            for t in shares[same:]:
                rows, half = tables[-1].tolist(), tables[-1].nrows() // 2
                tables.append((1 - t) * fmpq_mat(rows[:half]) + t * fmpq_mat(rows[half:]))
                kept.append(t)
            for k, entry in zip(moving, tables[-1].entries(), strict=True):
                entries[k] = entry
        return fmpq_mat(*shape, entries)

    if evaluate(box.centre) != matrix(box.centre):
        raise ValueError(
            f"the matrix must be affine in each of {', '.join(box.names)} (in 1/x for {', '.join(inverse) or 'none'}); "
            "its centre is not what its corners say. Name the parameters that divide, or sample it directly."
        )
    return evaluate


def _through(values: Sequence[Sequence[fmpq_poly]], box: ParameterBox, degrees: tuple[int, ...]) -> tuple[Family, ...]:
    """The families through values on the grid, all of the same degrees: the smallest possible."""
    order = max(p.degree() for v in values for p in v)
    count = len(values[0])
    flat = [c for v in values for p in v for c in (*p.coeffs(), *[fmpq(0)] * (order - p.degree()))]
    found = []
    for degree in degrees:
        check()
        # the axis at hand stands first in the flat list, and is put last among the parameters when it is done
        rows = fmpq_mat(degree + 1, len(flat) // (degree + 1), flat)
        powers = (_to_powers(degree) * rows).tolist()
        while len(powers) > 1 and not any(powers[-1]):
            powers.pop()
        found.append(len(powers) - 1)
        flat = _rotated((_to_bernstein(found[-1]) * fmpq_mat(powers)).tolist(), count * (order + 1))
    step = order + 1
    return tuple(
        Family(
            box, tuple(found), order,
            tuple(c for start in range(which * step, len(flat), count * step) for c in flat[start : start + step]),
        )
        for which in range(count)
    )  # fmt: skip


def _rotated(rows: list[list[fmpq]], width: int) -> list[fmpq]:
    """Entries of rows (axis, rest · width) in the order (rest, axis, width)."""
    return [entry for start in range(0, len(rows[0]), width) for row in rows for entry in row[start : start + width]]


@lru_cache(maxsize=64)
def _to_powers(degree: int) -> fmpq_mat:
    """Coefficients in powers of t from values at t = k/degree."""
    nodes = [fmpq(k, degree) if degree else fmpq(1, 2) for k in range(degree + 1)]
    return fmpq_mat([[t**k for k in range(degree + 1)] for t in nodes]).inv()


@lru_cache(maxsize=64)
def _to_bernstein(degree: int) -> fmpq_mat:
    """Bernstein coefficients on [0, 1] from coefficients in powers of t."""
    return fmpq_mat([[fmpq(comb(i, k), comb(degree, k)) for k in range(degree + 1)] for i in range(degree + 1)])
