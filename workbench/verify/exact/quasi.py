"""Quasi-polynomials Σ p_k(s) e^(−s T_k) with exact coefficients: values on boxes, and roots counted in a region.

    det [sI − A, −B_d; −Z C_c, I − Z D_cd] --minors, interpolated--> Σ_S z_S p_S(s),  z_S = e^(−s Σ_S T)
    value on a box:  P(m) + P'(box)(s − m)     turn of P along a path: enclosed piece by piece, zero excluded
    roots in a region:  the turn along its boundary over 2π  (argument principle)

Beyond |s| = R the leading term outweighs all others, as |e^(−sT)| ≤ e^(σT) for Re s ≥ −σ.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

from flint import acb, acb_poly, arb, ctx, fmpq, fmpq_mat, fmpq_poly

from workbench.verify.exact.deadline import check
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.system import part, stacked

PRECISION = 192
MOST_LINES, MOST_DETERMINANTS = 8, 40_000
DEEPEST = 60  # halvings of a piece of path
ZERO = fmpq(0)
HAIR = arb(2) ** -60  # by which a region is made larger than asked, far above the rounding of its corners
FURTHEST = fmpq(2) ** 60  # [rad/s]


@dataclass(frozen=True, slots=True)
class Quasi:
    """Σ p_k(s) e^(−s T_k); T_k ≥ 0, one term each."""

    terms: Mapping[fmpq, fmpq_poly]

    @property
    def degree(self) -> int:
        """Highest power of s; −1 for zero."""
        return max((p.degree() for p in self.terms.values()), default=-1)

    def shifted(self, sigma: fmpq) -> "Balls":
        """P(s − σ) in balls."""
        return Balls(
            [(arb(T), acb_poly(list((p(fmpq_poly([-sigma, 1]))).coeffs())) * acb((arb(sigma) * arb(T)).exp()))
             for T, p in self.terms.items()]
        )  # fmt: skip

    def balls(self) -> "Balls":
        """The same in balls."""
        return self.shifted(fmpq(0))

    def __sub__(self, other: "Quasi") -> "Quasi":
        terms = dict(self.terms)
        for T, p in other.terms.items():
            terms[T] = terms.get(T, fmpq_poly([0])) - p
        return Quasi({T: p for T, p in terms.items() if p != 0})

    def scaled(self, factor: fmpq) -> "Quasi":
        """Every coefficient times a factor."""
        return Quasi({T: p * factor for T, p in self.terms.items()})


class Balls:
    """A quasi-polynomial with its derivative, for evaluation."""

    def __init__(self, terms: Sequence[tuple[arb, acb_poly]]) -> None:
        self.terms = list(terms)
        self._slopes = [(T, p.derivative() - p * acb(T)) for T, p in self.terms]

    def at(self, s: acb) -> acb:
        """The value at a point, or a wide enclosure on a box."""
        return _sum(self.terms, s)

    def slope(self, s: acb) -> acb:
        """The derivative on a box, by Taylor's form around its middle."""
        return _sum(self._slopes, s)

    def on(self, middle: acb, half: acb) -> acb:
        """An enclosure on middle + half · [−1, 1]."""
        span = half * acb(arb(0, 1))
        return self.at(middle) + self.slope(middle + span) * span

    def at_infinity(self, degree: int, least: fmpq) -> acb:
        """P(s)/s^degree for every s = jω with ω at least `least`, e^(−sT) anywhere on the unit circle."""
        v = (arb(1) / arb(least)) * (arb(1) / 2 + arb(0, arb(1) / 2))  # [0, 1/least]
        inverse = acb(0, -1) * acb(v)  # 1/s
        unit = acb(arb(0, 1), arb(0, 1))
        total = acb(0)
        for T, p in self.terms:
            value = acb(0)
            for c in p.coeffs():  # lowest first: Horner in 1/s
                value = value * inverse + c
            value = value * inverse ** (degree - p.degree()) if p.degree() >= 0 else acb(0)
            total += value if T.is_zero() else value * unit
        return total


def _sum(terms: Sequence[tuple[arb, acb_poly]], s: acb) -> acb:
    middle = acb(s.real.mid(), s.imag.mid())
    rest = s - middle
    total = acb(0)
    for T, p in terms:
        value = p(acb_poly([middle, 1]))(rest) if p.degree() > 0 and not rest.is_zero() else p(s)
        total += value if T.is_zero() else value * (-s * acb(T)).exp()
    return total


def minors(
    A: fmpq_mat, Bd: fmpq_mat, Cd: fmpq_mat, D: fmpq_mat, times: Sequence[fmpq],
    border: tuple[fmpq_mat, fmpq_mat, fmpq_mat, fmpq_mat] | None = None,
) -> Quasi:  # fmt: skip
    """det of [sI − A, −B_d; −Z C_c, I − Z D_cd], bordered by one more row and column if given.

    border : (−b over the states, −d over the lines (taken times Z), c over states and lines in one row, the corner)
    """
    n, m, edge = A.nrows(), len(times), 0 if border is None else 1
    if m > MOST_LINES or (n + 1) * 2**m > MOST_DETERMINANTS:
        raise NotProved(f"{m} dead times and {n} states are more than the checker expands")
    inverse = _vandermonde_inverse(n)
    terms: dict[fmpq, fmpq_poly] = {}
    for size in range(m + 1):
        for S in combinations(range(m), size):
            check()
            values = []
            fixed = _matrix(A, Bd, Cd, D, S, border)
            for k in range(n + 1):
                whole = fmpq_mat(fixed)
                for i in range(n):
                    whole[i, i] = whole[i, i] + k
                values.append(whole.det() if n + size + edge else fmpq(1))
            p = fmpq_poly((inverse * fmpq_mat(n + 1, 1, values)).entries())
            T = sum((times[j] for j in S), fmpq(0))
            terms[T] = terms.get(T, fmpq_poly([0])) + p
    return Quasi({T: p for T, p in terms.items() if p != 0})


def _matrix(A, Bd, Cd, D, S, border) -> fmpq_mat:
    x = range(A.nrows())
    rows = [[-A, -part(Bd, x, S)], [-part(Cd, S, x), -part(D, S, S)]]
    if border is None:
        return stacked(rows)
    b, d, c, corner = border
    rows[0].append(b)
    rows[1].append(part(d, S, [0]))
    at = [*x, *(len(x) + j for j in S)]
    return stacked([*rows, [part(c, [0], at), corner]])


_INVERSES: dict[int, fmpq_mat] = {}


def _vandermonde_inverse(n: int) -> fmpq_mat:
    if n not in _INVERSES:
        _INVERSES[n] = fmpq_mat(n + 1, n + 1, [fmpq(k) ** i for k in range(n + 1) for i in range(n + 1)]).inv()
    return _INVERSES[n]


def largest_root_size(P: Quasi, sigma: fmpq = ZERO) -> fmpq:
    """R such that no root with Re s ≥ −σ has |s + σ| ≥ R.

    Raises NotProved where dead times act on the highest derivative as strongly as no dead time does.
    """
    n, shifted = P.degree, P.shifted(sigma).terms
    lead = [(T, p) for T, p in shifted if T.is_zero()]
    if not lead or lead[0][1].degree() < n:
        raise NotProved("the loop's highest derivative passes a dead time")
    R = fmpq(1)
    while R < FURTHEST:
        rest, top = arb(0), abs(lead[0][1][n])
        for T, p in shifted:
            for i, c in enumerate(p.coeffs()):
                if not (T.is_zero() and i == n):
                    rest += abs(c) * arb(R) ** (i - n)
        if rest < top:
            return R
        R *= 2
    raise NotProved("the loop's highest derivative passes a dead time undiminished, or its roots are too far out")


def beyond(P: Quasi, sigma: fmpq) -> int:
    """How many roots have Re s > −σ, none lying on the line; raises NotProved where that cannot be told."""
    with ctx.workprec(PRECISION):
        R = largest_root_size(P, sigma)
        Q = P.shifted(sigma)
        top = acb(0, arb(R))
        n = P.degree
        lead = next(p[n] for T, p in Q.terms if T.is_zero())
        at_end = (Q.at(top) / (lead * top**n)).arg()
        whole = n * arb.pi() + 2 * at_end - 2 * turn(Q, [acb(0), top])
        return _count(whole / (2 * arb.pi()))


def in_sector(P: Quasi, ratio: fmpq, low: fmpq, high: fmpq) -> int:
    """How many roots have −Re s/|s| < ratio and low ≤ |s| ≤ high, or lie a little outside these circles."""
    with ctx.workprec(PRECISION):
        Q = P.balls()
        angle = arb.pi() / 2 + arb(ratio).asin() + HAIR
        pieces = 24
        step = angle / pieces
        around, within = arb(high) * (1 + HAIR) / (step / 2).cos(), arb(low) * (1 - HAIR)
        outer = [acb(0, step * k).exp() * acb(around) for k in range(pieces + 1)]
        inner = [acb(0, step * k).exp() * acb(within) for k in range(pieces, -1, -1)] if low > 0 else [acb(0)]
        path = [acb(p.mid()) for p in (*outer, *inner)]
        path[0], path[-1] = acb(path[0].real), acb(path[-1].real)
        return _count(turn(Q, path) / arb.pi())


def turn(Q: Balls, path: Sequence[acb]) -> arb:
    """Change of the argument of Q along straight pieces between points."""
    total = arb(0)
    for a, b in pairwise(path):
        waiting = [(a, b, 0)]
        while waiting:
            check()
            start, end, depth = waiting.pop()
            middle, half = (start + end) / 2, (end - start) / 2
            value = Q.at(middle)
            if abs(value) > 0 and (Q.on(middle, half) / value).real > 0:
                total += (Q.at(end) / value).arg() - (Q.at(start) / value).arg()
                continue
            if depth >= DEEPEST:
                raise NotProved(
                    f"a root lies on the boundary or too close to it, near {float(abs(middle.imag).mid()):.4g} rad/s"
                )
            middle = acb(middle.mid())
            waiting += [(middle, end, depth + 1), (start, middle, depth + 1)]
    return total


def _count(value: arb) -> int:
    found = value.unique_fmpz()
    if found is None:
        raise NotProved("the roots could not be counted: the turn of the characteristic function is too wide")
    return int(found)
