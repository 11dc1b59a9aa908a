"""Zero exclusion for gains known to half a unit of their last digit: the mean-value term.

    p(g + δ) = p(g) + Σ_i δ_i ∂p/∂g_i + remainder,  |δ_i| <= u_i   -->   d·b - Σ_i |d·b_i| - d·remainder > 0

Coefficients widened to balls forget that the same δ_i moves all of them; here every gain keeps its own polynomial, so
nothing is lost to first order. The remainder follows from Cauchy's estimate: p is analytic in the gains, so on the
complex polydisc |δ_i| <= ρ u_i, where a ball evaluation bounds |p(g + δ) - p(g)| by M, its terms of order n are below
M/ρ^n. Central differences at ±u_i stand for the derivatives; what they leave, of third order, is bounded the same way.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flint import acb, acb_mat, arb, ctx, fmpq, fmpq_mat, fmpq_poly

from workbench.verify.family.exclusion import along, confirmed, direction_of, ray_factors
from workbench.verify.family.form import Form
from workbench.verify.family.lanes import BIAS, LANE
from workbench.verify.family.polynomial import Box, Family, Point, interpolate, spread
from workbench.verify.family.search import Mark

RADII = (64, 512, 4096, 32768)  # of the polydisc in half units: each gives a bound, the least is taken
PRECISION = 192  # bits

Rows = Callable[[Sequence[Any], Mapping[str, Any]], Sequence[Sequence[Any]]]


@dataclass(frozen=True, slots=True)
class RoundedFamily:
    """A family, what half a unit of each gain adds to first order, and bounds (nonnegative) of what remains."""

    nominal: Family
    effects: tuple[Family, ...]
    remainder: Family

    @property
    def box(self) -> Box:
        """The parameters."""
        return self.nominal.box

    def at(self, theta: Sequence[object]) -> fmpq_poly:
        """The polynomial with the gains as printed."""
        return self.nominal.at(theta)


def rounded_family(
    rows: Rows,
    gains: Mapping[str, fmpq],
    units: Mapping[str, fmpq],
    box: Box,
    degrees: Sequence[int],
    multiplier: Callable[[Point], fmpq] | None = None,
) -> RoundedFamily:
    """The characteristic polynomials of a loop whose gains lie anywhere within ± their half units.

    rows : (θ, gains) -> rows of the state matrix, by + - * / alone, so that rationals and complex balls pass through
    units : half a unit of the last digit, for the gains that are rounded
    """
    names = [name for name, unit in units.items() if unit > 0]
    before = ctx.prec

    def sample(theta: Point) -> list[fmpq_poly]:
        factor = multiplier(theta) if multiplier else fmpq(1)

        def polynomial(changed: Mapping[str, fmpq]) -> fmpq_poly:
            return factor * fmpq_mat([list(row) for row in rows(theta, {**gains, **changed})]).charpoly()

        centre = polynomial({})
        out = [centre]
        for name in names:
            up, down = (polynomial({name: gains[name] + side * units[name]}) for side in (1, -1))
            out.append((up - down) / 2)
        return out

    def what_remains(theta: Point, rho: int) -> list[fmpq] | None:
        """Bounds on the coefficients' terms beyond the first order; None if the polydisc holds a singular loop."""
        factor = multiplier(theta) if multiplier else fmpq(1)
        wide = {name: acb(value) for name, value in gains.items()}
        for name in names:
            ball = arb(0, arb(rho * units[name]).upper())
            wide[name] += acb(ball, ball)
        there = _charpoly([[acb(e) for e in row] for row in rows([acb(v) for v in theta], wide)])
        here = fmpq_mat([list(row) for row in rows(theta, gains)]).charpoly()
        changes = [abs(factor * (there[k] - here[k])) for k in range(here.degree() + 1)]
        share = fmpq(1, rho * (rho - 1)) + fmpq(len(names), rho * (rho**2 - 1))
        return [share * _above(c) for c in changes] if all(c.is_finite() for c in changes) else None

    ctx.prec = PRECISION
    try:
        # not reduced: with other gains the degrees in θ may be higher than with the printed ones
        nominal, *effects = interpolate(sample, box, degrees, reduced=False)
        grid, stretch = spread(box, nominal.degrees)
        most = [fmpq(0)] * (nominal.order + 1)
        for theta in grid:
            found = [bound for rho in RADII if (bound := what_remains(theta, rho)) is not None]
            if not found:
                raise ValueError(
                    f"gains must be printed with so many digits that {RADII[0]} half units leave the loop regular; "
                    "they are not. Print more digits."
                )
            most = [max(m, stretch * min(column)) for m, *column in zip(most, *found, strict=True)]
    finally:
        ctx.prec = before
    count = len(nominal.coefficients) // len(most)
    remainder = Family(box, nominal.degrees, nominal.order, tuple(most * count))
    return RoundedFamily(nominal, tuple(effects), remainder)


def _charpoly(rows: Sequence[Sequence[acb]]) -> list[acb]:
    """Coefficients of det(sI - A), lowest first, of a matrix of balls: Faddeev and Le Verrier.

    It divides by integers only, so wide balls stay finite.
    """
    A = acb_mat(rows)
    n = A.nrows()
    out, product = [acb(1)], acb_mat(n, n)
    for k in range(1, n + 1):
        product = A * (product + acb_mat([[out[-1] if i == j else acb(0) for j in range(n)] for i in range(n)]))
        out.append(-sum((product[i, i] for i in range(n)), acb(0)) / k)
    return out[::-1]


def _above(value: arb) -> fmpq:
    """A rational not below the ball."""
    mantissa, exponent = value.upper().man_exp()
    return fmpq(mantissa) * fmpq(2) ** int(exponent)


def rounded_forms(family: RoundedFamily, zeta: fmpq, sigma: fmpq) -> tuple[Form, ...]:
    """Real and imaginary part of p, then of every perturbation, all real ones in one unit, all imaginary in another."""
    nominal = family.nominal.shifted(-sigma)
    # |Σ_k C(k, j) (-σ)^(k-j) r_k| <= the same sum with +σ
    remainder = family.remainder.shifted(abs(sigma))
    effects = [effect.shifted(-sigma) for effect in family.effects]
    degrees = (*nominal.degrees, nominal.order)
    real, imaginary = ray_factors(nominal, zeta)
    nothing = [fmpq(0)] * len(nominal.coefficients)
    parts = []
    for which, factors in enumerate((real, imaginary)):
        size = along(remainder, [abs(f) for f in factors])
        rest = [size, nothing] if which == 0 else [nothing, size]
        parts.append(Form.of(degrees, along(nominal, factors), *(along(e, factors) for e in effects), *rest))
    return tuple(form for pair in zip(*parts, strict=True) for form in pair)


def direction_with_rounding(forms: tuple[Form, ...]) -> Mark | None:
    """A direction that separates whatever the rounding was, or None."""
    direction = direction_of(forms)
    return direction if direction is not None and separated_with_rounding(forms, direction) else None


def separated_with_rounding(forms: tuple[Form, ...], direction: Sequence[int]) -> bool:
    """Whether d·b exceeds the sum of |d·b_i| for every coefficient."""
    masks = forms[0].layout.lanes
    p, q = abs(direction[0]), abs(direction[1])
    centre = (p + q) * BIAS
    error = sum(p * a.error + q * b.error for a, b in zip(forms[::2], forms[1::2], strict=True)) + 1

    def projected(a: int, b: int) -> int:
        return p * (a if direction[0] >= 0 else masks.negated(a)) + q * (b if direction[1] >= 0 else masks.negated(b))

    for k in range(len(forms[0].elements)):
        sizes = 0
        for a, b in zip(forms[2::2], forms[3::2], strict=True):
            value = projected(a.elements[k], b.elements[k])
            negative = masks.below(value, centre)
            chosen = negative - (negative >> (LANE - 1))
            sizes += (value ^ ((value ^ (2 * centre * masks.ones - value)) & chosen)) - centre * masks.ones
        value = projected(forms[0].elements[k], forms[1].elements[k])
        enough = ((value | masks.top) - sizes - (centre + error) * masks.ones) & masks.top
        if enough != masks.top:
            return False
    return True


def confirmed_with_rounding(forms: tuple[Form, ...], mark: Any) -> bool:
    """Whether a stored direction is one, and separates whatever the rounding was."""
    return confirmed(forms[:2], mark) and separated_with_rounding(forms, mark)
