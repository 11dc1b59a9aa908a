"""Zero exclusion: no root of a family crosses the boundary of a region of the s-plane, anywhere on the box.

    boundary ray s = r u - σ, r = w x/(1 - x), x in [0, 1]
      --> (1 - x)^n p = Σ b_k B_k(x),  b_k = c_k w^k u^k / C(n, k)
    0 outside the convex hull of all b_k on a piece (a direction d with d·b > 0)   -->   no root there

The region is the sector |arg(s + σ) - π| < arccos ζ: ζ = 0 is a half plane, σ the decay rate. Its boundary is
symmetric, so one ray is enough. x runs over the closed interval: x = 0 is the apex (a real root that crosses it is
seen: the lowest coefficient keeps its sign), x = 1 is infinity (the highest coefficient keeps its sign). With no
crossing, all members have as many roots inside as any one of them, and one is looked at exactly. Bernstein coefficients
in x are the plain ones over binomials; Re u^k = T_k(-ζ) and Im u^k = √(1-ζ²) U_{k-1}(-ζ) are rational but for a factor
that excludes nothing, so all is exact until it is rounded to fixed point, with its error carried along.
"""

from collections.abc import Iterable, Sequence
from math import atan2, comb, cos, hypot, pi, sin

from flint import acb, arb, ctx, fmpq, fmpq_poly

from workbench.verify.exact.polynomial import powers_of_the_ray
from workbench.verify.family.form import Form
from workbench.verify.family.lanes import BIAS, WEIGHT, marked
from workbench.verify.family.polynomial import Family

NARROW = 2e-3  # rad: an interval of directions narrower than this is taken for empty
PRECISIONS = (64, 192, 512)  # bits, tried in turn for the roots of one member


def frequency_exponent(polynomial: fmpq_poly) -> int:
    """e with 2**e near the geometric mean of the roots' sizes: x = 1/2 lies there."""
    first, last = polynomial[0], polynomial[polynomial.degree()]
    if first == 0:
        return 0
    bits = [int(abs(v).p).bit_length() - int(v.q).bit_length() for v in (first, last)]
    return round((bits[0] - bits[1]) / polynomial.degree())


def ray_forms(family: Family, zeta: fmpq, sigma: fmpq) -> tuple[Form, Form]:
    """Real and imaginary part of p along the region's boundary, parameters first, x last."""
    moved = family.shifted(-sigma)
    real, imaginary = ray_factors(moved, zeta)
    degrees = (*family.degrees, family.order)
    return Form.of(degrees, along(moved, real)), Form.of(degrees, along(moved, imaginary))


def ray_factors(family: Family, zeta: fmpq) -> tuple[list[fmpq], list[fmpq]]:
    """What makes Bernstein coefficients in x of the coefficients of p: for the real and for the imaginary part."""
    step = fmpq(2) ** frequency_exponent(family.at(family.box.centre))
    scale = [step**k / comb(family.order, k) for k in range(family.order + 1)]
    real, imaginary = (
        [p * s for p, s in zip(part, scale, strict=True)] for part in powers_of_the_ray(zeta, family.order)
    )
    return real, imaginary


def along(family: Family, factors: Sequence[fmpq]) -> list[fmpq]:
    """The family's coefficients, those of s^k times the k-th factor."""
    return [c * factors[k % (family.order + 1)] for k, c in enumerate(family.coefficients)]


def separated(forms: Sequence[Form], direction: Sequence[int]) -> list[list[int]] | None:
    """None if d·b > 0 for every coefficient, else some lanes of every element where it is not."""
    real, imaginary = forms[0], forms[1]
    masks = real.layout.lanes
    p, q = abs(direction[0]), abs(direction[1])
    threshold = (p + q) * BIAS + p * real.error + q * imaginary.error + 1
    found, any_left = [], False
    for a, b in zip(real.elements, imaginary.elements, strict=True):
        a = a if direction[0] >= 0 else masks.negated(a)
        b = b if direction[1] >= 0 else masks.negated(b)
        below = masks.below(p * a + q * b, threshold)
        any_left = any_left or bool(below)
        found.append([next(marked(below))] if below else [])
    return found if any_left else None


def excluded(forms: tuple[Form, ...]) -> bool:
    """Whether a direction is found in which every coefficient is positive: zero lies outside their hull."""
    real, imaginary = forms[0], forms[1]
    masks = real.layout.lanes
    low, high, centre = -pi / 2, pi / 2, None
    found: list[list[int]] | None = [[0]] * len(real.elements)
    while found:
        for a, b, seen in zip(real.elements, imaginary.elements, found, strict=True):
            for lane in seen:
                x, y = masks.entry(a, lane), masks.entry(b, lane)
                if centre is None:
                    centre = atan2(y, x)
                    continue
                # directions are angles from `centre`; a coefficient at angle φ allows φ ± π/2
                angle = atan2(y, x) - centre
                angle -= 2 * pi * round(angle / (2 * pi))
                low, high = max(low, angle - pi / 2), min(high, angle + pi / 2)
        if high - low < NARROW or centre is None:
            return False
        middle = centre + (low + high) / 2
        size = WEIGHT / hypot(cos(middle), sin(middle))
        direction = [int(size * cos(middle)), int(size * sin(middle))]
        before = high - low
        found = separated(forms, direction)
        if found is not None and not _cuts(forms, found, centre, low, high, before):
            return False
    return True


def _cuts(forms: Sequence[Form], found: list[list[int]], centre: float, low: float, high: float, before: float) -> bool:
    """Whether the offending lanes narrow the interval of directions at all (error bounds alone do not)."""
    masks = forms[0].layout.lanes
    for a, b, seen in zip(forms[0].elements, forms[1].elements, found, strict=True):
        for lane in seen:
            angle = atan2(masks.entry(b, lane), masks.entry(a, lane)) - centre
            angle -= 2 * pi * round(angle / (2 * pi))
            if min(high, angle + pi / 2) - max(low, angle - pi / 2) < 0.999 * before:
                return True
    return False


def roots(polynomial: fmpq_poly, precision: int = 64) -> list[acb]:
    """Enclosures of all roots, isolated from each other; repeated ones once."""
    before = ctx.prec
    ctx.prec = precision
    try:
        return [pair[0] for pair in polynomial.numer().complex_roots()]  # type: ignore[index]
    finally:
        ctx.prec = before


def inside(polynomial: fmpq_poly, zeta: fmpq, sigma: fmpq) -> bool | None:
    """Whether every root lies in the region: proved, refuted, or (None) too close to say."""
    for precision in PRECISIONS:
        before = ctx.prec
        ctx.prec = precision
        try:
            margins = [_margin(root, zeta, sigma) for root in roots(polynomial, precision)]
            if all(m > 0 for m in margins):
                return True
            if any(m < 0 for m in margins):
                return False
        finally:
            ctx.prec = before
    return None


def _margin(root: acb, zeta: fmpq, sigma: fmpq) -> arb:
    """-Re(s + σ) - ζ |s + σ|: positive inside the region."""
    moved = root + arb(sigma)
    return -moved.real - arb(zeta) * abs(moved)


def damping(polynomial: fmpq_poly) -> arb:
    """The smallest damping ratio -Re s/|s| of the roots, as a ball."""
    return _least(-root.real / abs(root) for root in roots(polynomial))


def decay(polynomial: fmpq_poly) -> arb:
    """The smallest decay rate -Re s of the roots, as a ball."""
    return _least(-root.real for root in roots(polynomial))


def _least(values: Iterable[arb]) -> arb:
    out = None
    for value in values:
        out = value if out is None else out.min(value)
    if out is None:
        raise ValueError("a polynomial must have at least one root; got a constant. Look at the model's states.")
    return out
