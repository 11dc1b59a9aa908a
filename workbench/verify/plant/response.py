"""A channel of a loop as fractions N_ij/P with exact coefficients, and the loop's characteristic function P.

continuous, no dead time in a loop   polynomials in s
sampled                              polynomials in z, or in w of z = (1 + w)/(1 − w), where jω maps onto the circle
continuous with dead times           quasi-polynomials in s and e^(−sT)
"""

from collections.abc import Sequence
from dataclasses import dataclass

from flint import acb, arb, ctx, fmpq, fmpq_mat, fmpq_poly

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import PRECISION, boundary_kept, counted
from workbench.verify.exact.quasi import Quasi, beyond, minors
from workbench.verify.exact.system import part, stacked, zeros
from workbench.verify.plant.loop import Lined, Loop

MOST_DEGREE = 160  # of a sampled loop's polynomial in z
UNSTABLE = "the loop is not stable"


@dataclass(frozen=True, slots=True)
class Response:
    """Numerators (p × m) over one denominator, all Quasi; at most the term without dead time unless `delayed`."""

    P: Quasi
    N: list[list[Quasi]]
    sample_time: fmpq | None

    @property
    def delayed(self) -> bool:
        """Whether dead times of a continuous loop are left in it."""
        every = [self.P, *(entry for row in self.N for entry in row)]
        return self.sample_time is None and any(T != 0 for q in every for T in q.terms)

    def polynomials(self) -> tuple[fmpq_poly, list[list[fmpq_poly]]]:
        """P and N in s, or in w if sampled; |N_ij/P| is that of the loop at s = jω, w = j tan(ωh/2)."""
        if self.delayed:
            raise NotProved("a continuous dead time leaves no polynomials")
        if self.sample_time is None:
            return plain(self.P), [[plain(q) for q in row] for row in self.N]
        every = [self.P, *(q for row in self.N for q in row)]
        longest = max(_samples(q, self.sample_time) for q in every)
        in_z = [_in_z(q, self.sample_time, longest) for q in every]
        degree = max(p.degree() for p in in_z)
        in_w = [_bilinear(p, degree) for p in in_z]
        width = len(self.N[0]) if self.N else 0
        return in_w[0], [in_w[1 + i * width : 1 + (i + 1) * width] for i in range(len(self.N))]


def response_of(loop: Loop, inputs: Sequence[str], outputs: Sequence[str], openings: Sequence[str]) -> Response:
    """The channel's fractions."""
    system, P = loop.channel(inputs, outputs, openings), loop.characteristic(openings)
    N = [[_numerator(system, P, i, j) for j in range(len(inputs))] for i in range(len(outputs))]
    return Response(P, N, loop.sample_time)


def _numerator(system: Lined, P: Quasi, i: int, j: int) -> Quasi:
    x, lines = range(system.A.nrows()), range(len(system.times))
    b, c, corner = part(system.B, x, [j]), part(system.C, [i], x), part(system.D, [i], [j])
    if not lines:
        p = plain(P)
        N = (system.A - b * c).charpoly() - p + p * corner[0, 0]
        return Quasi({fmpq(0): N} if N != 0 else {})
    border = (-b, -part(system.Dcw, lines, [j]), stacked([[c, part(system.Dzd, [i], lines)]]), corner)
    return minors(system.A, system.Bd, system.Cd, system.Dcd, system.times, border)


def poles(loop: Loop, openings: Sequence[str] = ()) -> list[acb]:
    """A disc [1/s] for each distinct characteristic root; of a sampled loop log(z)/h, of z = 0 none.

    Raises NotProved for a continuous loop with a dead time in it, which has infinitely many.
    """
    P = loop.characteristic(openings)
    with ctx.workprec(PRECISION):
        if loop.sample_time is None:
            if any(T != 0 for T in P.terms):
                raise NotProved("a loop with dead time has infinitely many poles")
            return [root for root, _ in counted(plain(P))]
        p = _in_z(P, loop.sample_time, _samples(P, loop.sample_time))
        return [z.log() / acb(loop.sample_time) for z, _ in counted(p) if not z.is_zero()]


def require_stable(loop: Loop, openings: Sequence[str]) -> str:
    """How the loop was proved stable; raises NotProved where it was not, so that nothing said of it would hold."""
    if late(loop, openings):
        if beyond(loop.characteristic(openings), fmpq(0)) > 0:
            raise NotProved(UNSTABLE)
        return COUNTED
    if not all(bool(s.real < 0) for s in poles(loop, openings)):
        raise NotProved(UNSTABLE)
    return ISOLATED


def within(found: list[acb], band: tuple[fmpq, fmpq | None] | None) -> list[acb]:
    """The roots that may lie in a band of |s|."""
    if band is None:
        return found
    low, high = band
    return [s for s in found if not abs(s) < arb(low) and (high is None or not abs(s) > arb(high))]


def exactly_kept(loop: Loop, openings: Sequence[str], limit: fmpq, *, ray: bool) -> bool:
    """Whether every root keeps a limit of decay or damping (ray), on it allowed; continuous, without dead times."""
    system = loop.channel((), (), openings)
    return loop.sample_time is None and not system.times and boundary_kept(system.A, limit, ray=ray)


COUNTED = "characteristic roots counted by the argument principle in ball arithmetic, dead times exact"
ISOLATED = "ball arithmetic: characteristic polynomial, isolated roots"


def late(loop: Loop, openings: Sequence[str]) -> bool:
    """Whether a continuous loop has a dead time in its characteristic function."""
    return loop.sample_time is None and any(T != 0 for T in loop.characteristic(openings).terms)


def plain(q: Quasi) -> fmpq_poly:
    """The polynomial without dead time."""
    return q.terms.get(fmpq(0), fmpq_poly([0]))


def chained(system: Lined) -> tuple[fmpq_mat, fmpq_mat, fmpq_mat, fmpq_mat]:
    """(A, B, C, D) of a sampled system whose dead times are chains of states; of any system without dead times."""
    A, B, C, D = system.A, system.B, system.C, system.D
    if not system.times:
        return A, B, C, D
    if system.sample_time is None:
        raise NotProved("a continuous dead time has no finite number of states")
    lengths = [int((T / system.sample_time).p) for T in system.times]
    n, total = A.nrows(), sum(lengths)
    if n + total > MOST_DEGREE // 2:
        raise NotProved(f"{n + total} states with the samples of dead time are more than the checker expands")
    last = [sum(lengths[: k + 1]) - 1 for k in range(len(lengths))]  # d_k
    first = [sum(lengths[:k]) for k in range(len(lengths))]  # takes c_k
    pick = zeros(len(lengths), total)
    enter = zeros(total, len(lengths))
    shift = zeros(total, total)
    for k, (a, b) in enumerate(zip(first, last, strict=True)):
        pick[k, b], enter[a, k] = fmpq(1), fmpq(1)
        for i in range(a, b):
            shift[i + 1, i] = fmpq(1)
    whole = stacked([[A, system.Bd * pick], [enter * system.Cd, shift + enter * system.Dcd * pick]])
    return whole, stacked([[B], [enter * system.Dcw]]), stacked([[C, system.Dzd * pick]]), D


def _samples(q: Quasi, h: fmpq) -> int:
    return max((int((T / h).p) for T in q.terms), default=0)


def _in_z(q: Quasi, h: fmpq, longest: int) -> fmpq_poly:
    """z^longest Σ p_k(z) z^(−T_k/h)."""
    total, z = fmpq_poly([0]), fmpq_poly([0, 1])
    for T, p in q.terms.items():
        total += p * z ** (longest - int((T / h).p))
    if total.degree() > MOST_DEGREE:
        raise NotProved(f"a sampled loop of order {total.degree()} is more than the checker expands")
    return total


def _bilinear(p: fmpq_poly, degree: int) -> fmpq_poly:
    """(1 − w)^degree p((1 + w)/(1 − w))."""
    up, down = fmpq_poly([1, 1]), fmpq_poly([1, -1])
    total, power = fmpq_poly([0]), fmpq_poly([1])  # Horner: Σ c_k up^k down^(degree − k)
    for k, c in enumerate(reversed([p[i] for i in range(degree + 1)])):
        total = total * up + c * power if k else fmpq_poly([c])
        power = power * down
    return total
