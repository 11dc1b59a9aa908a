"""The delay margin of one current pattern, the others closed: the smallest dead time that brings a pole to the axis.

    S_ii = N/p --> L = (p − N)/N;   |L(jω)| = 1 where |p − N|² − |N|² has a root x = ω² (isolated in balls)
      --> lag φ = arg(−L) in [0, 2π) there --> φ/ω, the smallest of them

At other frequencies no dead time turns L into −1. Every root counts, crossing or touching. With |L(∞)| ≥ 1 any delay
destabilises: the margin is 0.
"""

from collections.abc import Sequence

from flint import acb, arb, arb_poly, ctx, fmpq_poly

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import isolated_roots, smallest
from workbench.verify.exact.polynomial import real_and_imaginary, size_squared
from workbench.verify.exact.sensitivity import numerators
from workbench.verify.exact.system import System

PRECISION = 192  # bits; roots are isolated to this, and a phase loses less than half of them


def delay_margins(seen: System) -> list[arb | None]:
    """Delay margin [s] of each pattern; None where it is unlimited. seen: the stable sensitivity at the patterns."""
    p = seen.A.charpoly()
    N = numerators(seen, p)
    return [_margin(p, N[i][i]) for i in range(len(N))]


def smallest_delay_margin(margins: Sequence[arb | None]) -> arb | None:
    """The least of some margins; None where all are unlimited."""
    limited = [m for m in margins if m is not None]
    return smallest(limited) if limited else None


def _margin(p: fmpq_poly, N: fmpq_poly) -> arb | None:
    loop, below = p - N, size_squared(N)
    difference = size_squared(loop) - below
    if difference == 0:
        raise NotProved("the loop gain of a pattern is 1 at every frequency")
    highest = below.degree()
    if difference.degree() > highest or difference[highest] >= 0:
        return arb(0)
    with ctx.workprec(PRECISION):
        found = []
        for root in isolated_roots(difference):
            if root.imag.is_zero() and not root.real < 0 and not root.real.is_zero():
                if not root.real > 0:
                    raise NotProved("a crossover of a pattern cannot be told from zero frequency")
                found.append(_delay(loop, N, root.real))
        return smallest(found) if found else None


def _delay(top: fmpq_poly, bottom: fmpq_poly, x: arb) -> arb:
    """φ/ω at one crossover of the loop top/bottom."""
    omega = x.sqrt()
    parts = [[arb_poly(half)(x) for half in real_and_imaginary(p)] for p in (top, bottom)]
    one, other = (acb(even, omega * odd) for even, odd in parts)
    turned = -one / other
    angle = turned.arg()
    if not (angle > 0 or angle < 0):  # zero, or a ball across the argument's cut
        raise NotProved("the phase at a crossover cannot be told from the critical one")
    return (angle if angle > 0 else angle + 2 * arb.pi()) / omega
