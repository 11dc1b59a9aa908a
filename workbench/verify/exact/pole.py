"""The poles of a closed loop in balls: each root of the exact characteristic polynomial in a disc of its own.

rational matrix --charpoly--> integer polynomial --isolated roots (Arb)--> discs --> stable, damping ratio, decay rate

Every disc holds exactly one distinct root, so what is read from the discs holds for the poles of the printed decimals,
nothing cancelled and nothing rounded. Double roots are no special case: the isolation works on squarefree factors.
"""

from collections.abc import Sequence
from typing import cast

from flint import acb, arb, ctx, fmpq, fmpq_mat, fmpq_poly

from workbench.verify.exact.deadline import check
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.polynomial import powers_of_the_ray, real_and_imaginary

PRECISION = 128  # bits; the discs come out 1e-30 wide, forty thousand million times below what is promised


def poles(A: fmpq_mat) -> list[acb]:
    """One disc for each distinct eigenvalue of a rational matrix."""
    with ctx.workprec(PRECISION):
        return isolated_roots(A.charpoly()) if A.nrows() else []


def isolated_roots(p: fmpq_poly) -> list[acb]:
    """A disc around each distinct root of a rational polynomial; the discs of real roots are real."""
    return [root for root, _ in counted(p)]


def counted(p: fmpq_poly) -> list[tuple[acb, int]]:
    """The same, each with its multiplicity."""
    check()
    with ctx.workprec(PRECISION):
        return cast(list[tuple[acb, int]], p.numer().complex_roots())


def stable(discs: Sequence[acb]) -> bool:
    """Whether every pole is proved to lie left of the imaginary axis."""
    return all(bool(root.real < 0) for root in discs)


def require_stable(discs: Sequence[acb]) -> None:
    """Raises NotProved where the loop is not proved stable, so that nothing said of its responses would hold."""
    if not stable(discs):
        worst = max(float(root.real.mid()) for root in discs)
        raise NotProved(f"the loop is not stable: a pole has the real part {worst:.4g} 1/s")


def decay(discs: Sequence[acb]) -> arb:
    """Decay rate of the slowest pole [1/s], negative if it grows."""
    with ctx.workprec(PRECISION):
        return smallest([-root.real for root in discs])


def damping(discs: Sequence[acb]) -> arb:
    """Smallest damping ratio −Re p/|p|; a real pole counts 1 if it decays and −1 if it grows."""
    with ctx.workprec(PRECISION):
        return smallest([-root.real / abs(root) for root in discs])


def boundary_kept(A: fmpq_mat, limit: fmpq, *, ray: bool) -> bool:
    """Whether every pole keeps a limit, on it allowed: damping ratio (ray) or decay rate.

    A pole on the boundary is a common root of the two real polynomials that p makes along it, counted exactly; discs
    not clear of the boundary must be as many, for then each of them holds one.
    """
    p = A.charpoly()
    simple = p / p.gcd(p.derivative())  # each pole once
    with ctx.workprec(PRECISION):
        margins = [
            -d.real - arb(limit) * abs(d) if ray else -d.real - arb(limit) for d in isolated_roots(simple)
        ]  # fmt: skip
        if any(m < 0 for m in margins):
            return False
        near = sum(not m > 0 for m in margins)
    if ray and not 0 < limit < 1:
        return near == 0
    return near == _on_boundary(simple, limit, ray)


def _on_boundary(p: fmpq_poly, limit: fmpq, ray: bool) -> int:
    """How many roots lie on Re s = −σ, or on both rays s = r (−ζ ± j √(1 − ζ²)), r > 0."""
    if ray:
        ray_powers = powers_of_the_ray(limit, p.degree())
        real, other = (fmpq_poly([c * k for c, k in zip(p.coeffs(), q, strict=True)]) for q in ray_powers)
        on_real_axis = 0
    else:
        moved = p(fmpq_poly([-limit, 1]))
        real, other = real_and_imaginary(moved)
        on_real_axis = int(moved[0] == 0)
    common = real.gcd(other)
    with ctx.workprec(PRECISION):
        return on_real_axis + 2 * sum(bool(r.imag.is_zero() and r.real > 0) for r in isolated_roots(common))


def ends(ball: arb) -> tuple[fmpq, fmpq]:
    """Lower and upper end of a ball, exactly."""
    if not ball.is_finite():
        raise NotProved("the numbers leave no room for a proof: the enclosure is without end")
    low, high = (
        fmpq(mantissa) * fmpq(2) ** int(two) for mantissa, two in (e.man_exp() for e in (ball.lower(), ball.upper()))
    )
    return low, high


def root(square: arb) -> arb:
    """√ of a ball around something that is not negative, whatever the ball's rounding says."""
    low, high = ends(square)
    return arb(max(low, fmpq(0))).sqrt().union(arb(max(high, fmpq(0))).sqrt())


def smallest(values: Sequence[arb]) -> arb:
    """The least of some balls."""
    out = values[0]
    for value in values[1:]:
        out = out.min(value)
    return out


def largest(values: Sequence[arb]) -> arb:
    """The greatest of some balls."""
    out = values[0]
    for value in values[1:]:
        out = out.max(value)
    return out
