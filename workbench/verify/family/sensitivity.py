"""Peak sensitivity over a box: S = I + C (sI - A)⁻¹ B at one or two commands stays below γ for every member.

    rank-one updates --charpoly--> p, m_ij, p0 with S_ij = m_ij/p, det S = p0/p
    F(θ, ω²) = γ⁴|p|² - γ² Σ|m_ij|² + |p0|²  =  |p|² det(γ²I - S*S),   one command: γ²|p|² - |p0|²
    F > 0 on the box and ω = 0 … ∞   -->   both singular values < γ

For S(∞) = I and γ > 1 both singular values lie below γ at ω = ∞, and none can reach it without F = 0. p has no root on
the imaginary axis where the family is stable, which is proved first. ω² = w² x/(1 - x): one piece holds infinity too.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import product
from math import comb, inf, prod, sqrt

from flint import arb, fmpq, fmpq_mat, fmpq_poly, fmpz, fmpz_poly

from workbench.verify.exact.polynomial import size_squared
from workbench.verify.family.exclusion import frequency_exponent
from workbench.verify.family.form import Form
from workbench.verify.family.lanes import VALUE
from workbench.verify.family.polynomial import Family, ParameterBox, Point, interpolate, rational
from workbench.verify.family.search import Refuted

BITS = VALUE + 24  # of the polynomials before they are squared
GRID = 160  # frequencies at which an attained value is looked for
NEARLY = 0.8  # squares of peaks on the grid this close to the tallest are climbed too


@dataclass(frozen=True, slots=True, eq=False)
class SensitivityFamily:
    """p, the entries m_ij (row by row) and p0 on one box.

    weights[ij] multiplies |m_ij|²: d_i/d_j of patterns whose squared lengths d differ, else 1
    """

    p: Family
    entries: tuple[Family, ...]
    determinant: Family
    weights: tuple[fmpq, ...]

    @property
    def box(self) -> ParameterBox:
        """The parameters."""
        return self.p.box

    @property
    def single(self) -> bool:
        """Whether there is one command only."""
        return len(self.entries) == 1


def sensitivity_family(
    loop: Callable[[Point], tuple[fmpq_mat, fmpq_mat, fmpq_mat]],
    box: ParameterBox,
    degrees: Sequence[int],
    multiplier: Callable[[Point], fmpq] | None = None,
    lengths: Sequence[fmpq] = (),
) -> SensitivityFamily:
    """Interpolate the sensitivity at the commands of a closed loop.

    loop : θ -> (A, B, C) with S = I + C (sI - A)⁻¹ B, one or two commands
    degrees, multiplier : as for `interpolate` and `characteristic`, for every rank-one update of A
    lengths : squared lengths of the patterns the commands stand for; equal if left out
    """

    def sample(theta: Point) -> list[fmpq_poly]:
        A, B, C = loop(theta)
        k = range(B.ncols())
        if len(k) not in (1, 2):
            raise ValueError(f"a sensitivity must have one or two commands; got {len(k)}. Take the groups one by one.")
        factor = multiplier(theta) if multiplier else fmpq(1)
        columns = [fmpq_mat([[row[j]] for row in B.tolist()]) for j in k]
        rows = [fmpq_mat([C.tolist()[i]]) for i in k]
        p = A.charpoly()
        parts = [(A - columns[j] * rows[i]).charpoly() - (p if i != j else 0) for i in k for j in k]
        return [factor * q for q in (p, *parts, (A - B * C).charpoly())]

    p, *entries, determinant = interpolate(sample, box, degrees)
    d = tuple(lengths) or (fmpq(1),) * (1 if len(entries) == 1 else 2)
    return SensitivityFamily(p, tuple(entries), determinant, tuple(a / b for a in d for b in d))


def excess_form(family: SensitivityFamily, gamma: fmpq) -> Form:
    """F(θ, x) of a bound γ, scaled by a positive number; parameters in order, x last."""
    degrees, whole, sums, last, unit, error = _squares(family)
    top, bottom = int(gamma.p), int(gamma.q)
    if family.single:
        a, b, c = unit * top**2, 0, -unit * bottom**2
    else:
        a, b, c = unit * top**4, -(top**2) * bottom**2, unit * bottom**4
    values = [a * p + b * m + c * q for p, m, q in zip(whole, sums, last, strict=True)]
    return Form.rounded(degrees, values, (abs(a) + abs(b) + abs(c)) * error)


def positive(forms: tuple[Form, ...]) -> bool:
    """Whether F > 0 on the piece; raises Refuted where it is negative at a corner."""
    if forms[0].positive():
        return True
    if forms[0].negative_at_a_corner():
        raise Refuted
    return False


def positive_or_open(forms: tuple[Form, ...]) -> bool:
    """Whether F > 0 on the piece; where it is negative the piece stays open without ending the search."""
    return forms[0].positive()


@lru_cache(maxsize=8)
def _squares(family: SensitivityFamily) -> tuple[tuple[int, ...], list[int], list[int], list[int], int, int]:
    """Degrees; Bernstein coefficients of |p|², unit·Σ weight |m|², |p0|² (integers); unit; error of each."""
    order = family.p.order
    exponent = frequency_exponent(family.p.at(family.box.centre))
    every = (family.p, *family.entries, family.determinant)
    step = fmpq(2) ** exponent
    powers = [step**k * (-1) ** (k // 2) for k in range(order + 1)]
    scaled = [[c * powers[k % (order + 1)] for k, c in enumerate(q.coefficients)] for q in every]
    size = max(int(abs(c).p).bit_length() - int(c.q).bit_length() + 1 for q in scaled for c in q if c)
    up, down = 1 << max(BITS - size, 0), 1 << max(size - BITS, 0)
    whole, *parts, last = (
        _square([int(c.p) * up // (int(c.q) * down) for c in q], family.p.degrees, order) for q in scaled
    )
    unit = int(prod((int(w.q) for w in family.weights), start=1)) if any(w != 1 for w in family.weights) else 1
    total = fmpz_poly([])
    for weight, part in zip(family.weights, parts, strict=True):
        total += part * fmpz(int(weight.p) * unit // int(weight.q))
    doubled = tuple(2 * d for d in family.p.degrees)
    share = sum(abs(int(w.p)) * unit // int(w.q) for w in family.weights)
    error = max(share, 1) * (order + 2) * (2 * ((1 << BITS) + 1) + 1) + 1
    flat = [_unscaled(q, doubled, order) for q in (whole, total, last)]
    return (*doubled, order), flat[0], flat[1], flat[2], unit, error


def _square(values: list[int], degrees: tuple[int, ...], order: int) -> fmpz_poly:
    """|q|² = E² + y O² of q(jω) = E(y) + jω O(y), y = ω²: scaled Bernstein in θ, powers of y; packed in one variable.

    Coefficients times their binomials multiply like powers; the exponents of all variables are the digits of one.
    Values off by one each are off by at most (order + 2)(2 max + 1) in the square, binomials taken out again.
    """
    parts = [[0] * (prod(2 * d + 1 for d in degrees) * (order + 1)) for _ in range(2)]
    position = 0
    for place in product(*(range(d + 1) for d in degrees)):
        at = 0
        for k, d in zip(place, degrees, strict=True):
            at = at * (2 * d + 1) + k
        weight = prod(comb(d, k) for k, d in zip(place, degrees, strict=True))
        for k in range(order + 1):
            parts[k % 2][at * (order + 1) + k // 2] = weight * values[position]
            position += 1
    even, odd = fmpz_poly(parts[0]), fmpz_poly(parts[1])
    return even * even + (odd * odd).left_shift(1)


def _unscaled(packed: fmpz_poly, degrees: tuple[int, ...], order: int) -> list[int]:
    values = [int(c) for c in packed.coeffs()]
    values += [0] * (prod(d + 1 for d in degrees) * (order + 1) - len(values))
    across = [comb(order, k) for k in range(order + 1)]
    out, position = [], 0
    for place in product(*(range(d + 1) for d in degrees)):
        weight = prod(comb(d, k) for k, d in zip(place, degrees, strict=True))
        for binomial in across:
            out.append(values[position] // (weight * binomial))
            position += 1
    return out


def peak_at(family: SensitivityFamily, theta: Sequence[object]) -> tuple[arb, float]:
    """A value that the peak sensitivity of one member reaches, as a ball, and the frequency [rad/s] where.

    At infinite frequency S = I, so 1 is always reached.
    """
    every = [q.at(theta) for q in (family.p, *family.entries, family.determinant)]
    floats = [[float(c) for c in reversed(q.coeffs())] for q in every]
    weights = [float(w) for w in family.weights]

    def value(omega: float) -> float:
        p, *entries, last = (abs(_horner(q, 1j * omega)) ** 2 for q in floats)
        if family.single:
            return last / p
        half = sum(w * m for w, m in zip(weights, entries, strict=True)) / (2 * p)
        return half + sqrt(max(half * half - last / p, 0.0))

    centre = 2.0 ** frequency_exponent(every[0])
    grid = [centre * 10 ** (6 * k / GRID - 3) for k in range(GRID + 1)]
    sampled = [value(omega) for omega in grid]
    tall = NEARLY * max(sampled)
    tops = [k for k, v in enumerate(sampled) if v >= tall and v == max(sampled[max(k - 1, 0) : k + 2])]
    omega = max((_climbed(value, grid[max(k - 1, 0)], grid[min(k + 1, GRID)]) for k in tops), key=value)
    p, *parts, last = (size_squared(q)(rational(omega) ** 2) for q in every)
    if family.single:
        peak = arb(last / p).sqrt()
    else:
        half = sum((w * m for w, m in zip(family.weights, parts, strict=True)), fmpq(0)) / (2 * p)
        peak = (arb(half) + arb(half**2 - last / p).max(arb(0)).sqrt()).sqrt()
    return (peak, omega) if peak > 1 else (arb(1), inf)


def _climbed(value: Callable[[float], float], low: float, high: float) -> float:
    """Where a function with one top is largest: thirds, until the interval is 1e-10 of itself."""
    for _ in range(60):
        a, b = low + (high - low) / 3, high - (high - low) / 3
        low, high = (low, b) if value(a) >= value(b) else (a, high)
    return (low + high) / 2


def _horner(coefficients: Sequence[float], s: complex) -> complex:
    total = 0j
    for c in coefficients:
        total = total * s + c
    return total
