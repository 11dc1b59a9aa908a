"""The peak sensitivity of a group without a frequency grid: an upper bound proved, a lower bound proved.

    S = N/p, rational   --minors of N--> |minors|² as polynomials in x = ω²
      --> F(γ, x) = Σ_k (−1)^k γ^{2(m−k)} Σ |k × k minors|² p^…  = |p|² det(γ² I − S*S)   --Sturm--> roots in x ≥ 0

The entries come from characteristic polynomials, c adj(sI − A) b = det(sI − A + b c) − det(sI − A); minors of S of
order k are minors of N over p^k, and p^{k−1} divides them. If F(γ, ·) has no root x ≥ 0 and S(∞) = I < γ, then no
singular value ever meets γ: it bounds the peak. If it has one, some singular value equals γ there: the peak is at least
γ. Patterns of unequal length d enter as d_i/d_j on |entry ij|².
"""

from collections.abc import Sequence
from itertools import combinations, pairwise

from flint import fmpq, fmpq_poly

from workbench.verify.exact.deadline import check
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.polynomial import determinant, size_squared
from workbench.verify.exact.system import System, part

WIDTH = fmpq(1, 10**9)  # relative; of the bracket a table promises


class Peak:
    """The largest singular value of S over all frequencies, tested level by level."""

    def __init__(self, seen: System, lengths: Sequence[fmpq]) -> None:
        """seen: the sensitivity between pattern commands, stable; lengths: squared lengths of the patterns."""
        p = seen.A.charpoly()
        self._of(squared_minors(p, numerators(seen, p), lengths))

    @classmethod
    def of_fractions(cls, p: fmpq_poly, N: Sequence[Sequence[fmpq_poly]]) -> "Peak":
        """Of any stable N/p, proper and of any shape: rows or columns of zeros make it square."""
        m = max(len(N), len(N[0]))
        none = fmpq_poly([0])
        square = [[N[i][j] if i < len(N) and j < len(N[0]) else none for j in range(m)] for i in range(m)]
        peak = cls.__new__(cls)
        peak._of(squared_minors(p, square, [fmpq(1)] * m))
        return peak

    def _of(self, terms: list[fmpq_poly]) -> None:
        self._terms = terms
        ends = [term.coeffs()[-1] if term.degree() == self._terms[0].degree() else fmpq(0) for term in self._terms]
        self._at_infinity = [end / ends[0] for end in ends]

    def polynomial(self, level: fmpq) -> fmpq_poly:
        """F(γ, x), positive for all x ≥ 0 if γ is above the peak."""
        square, out = level * level, fmpq_poly([0])
        for term in self._terms:
            out = out * square + term
        return out

    def below(self, level: fmpq) -> bool:
        """Whether the peak is proved to lie below a level; if not, it is proved to be at least that."""
        return _below(self._at_infinity, level) and roots_from_zero(self.polynomial(level)) == 0

    @property
    def zero(self) -> bool:
        """Whether nothing passes at any frequency."""
        return all(term == 0 for term in self._terms[1:])

    def at_most(self, level: fmpq) -> bool:
        """Whether the peak is proved not to exceed a level; of a single signal the level may be touched."""
        if self.zero or self.below(level):
            return True
        F = self.polynomial(level)
        single = all(term == 0 for term in self._terms[2:])
        if not single or -self._at_infinity[1] > level * level:
            return False
        return _never_negative(F)

    def below_between(self, level: fmpq, low: fmpq, high: fmpq) -> bool:
        """The same for ω² from low to high alone, by x = (low + high t)/(1 + t), t from 0 to ∞."""
        at_low = [term(low) for term in self._terms]
        if at_low[0] == 0 or not _below([value / at_low[0] for value in at_low], level):
            return False
        F = self.polynomial(level)
        over, under = fmpq_poly([low, high]), fmpq_poly([1, 1])
        total, power = fmpq_poly([0]), fmpq_poly([1])
        for k in range(F.degree(), -1, -1):
            total = total * over + F[k] * power
            power = power * under
        return total.degree() == F.degree() and roots_from_zero(total) == 0

    def enclosure(self, guess: fmpq, width: fmpq = WIDTH) -> tuple[fmpq, fmpq]:
        """(low, high) with low ≤ peak < high, high ≤ (1 + width) low, searched from a guess."""
        low, high = guess, guess
        step = width / 2
        while not self.below(high):
            low, high = high, high * (1 + step)
            step *= 4
            if step > 10**6:
                raise NotProved("no level was found that the sensitivity stays below")
        step = width / 2
        while low == high or self.below(low):
            high = min(high, low)
            low = low * (1 - min(step, fmpq(1, 2)))
            step *= 4
        while high > (1 + width) * low:
            middle = rounded((low + high) / 2)
            low, high = (low, middle) if self.below(middle) else (middle, high)
        return low, high


def _never_negative(p: fmpq_poly) -> bool:
    """Whether a polynomial is at least zero for all x ≥ 0: its factors of odd multiplicity have no root there."""
    if p == 0:
        return True
    _, factors = p.numer().factor_squarefree()
    x = fmpq_poly([0, 1])
    for factor, multiplicity in factors:
        odd = fmpq_poly(factor)
        if odd[0] == 0:
            odd = odd // x  # a root at zero: no sign on its left
        if multiplicity % 2 and odd.degree() > 0 and roots_from_zero(odd) > 0:
            return False
    return p.coeffs()[-1] > 0


def _below(shares: Sequence[fmpq], level: fmpq) -> bool:
    """Whether every singular value at one frequency lies below a level: det(γ² I − S*S) has no root from there on.

    shares : coefficients in falling powers of γ², the first 1
    """
    shifted = fmpq_poly([0])
    variable = fmpq_poly([level * level, 1])
    for share in shares:
        shifted = shifted * variable + share
    return shifted.degree() == len(shares) - 1 and roots_from_zero(shifted) == 0


def squared_minors(p: fmpq_poly, N: list[list[fmpq_poly]], lengths: Sequence[fmpq]) -> list[fmpq_poly]:
    """Coefficients of (−1)^k γ^{2(m−k)} in F, as polynomials in x = ω²: |p|², then sums of |minors of order k|²."""
    m = len(lengths)
    out = [size_squared(p)]
    for k in range(1, m + 1):
        total = fmpq_poly([0])
        for rows in combinations(range(m), k):
            check()
            for columns in combinations(range(m), k):
                weight = fmpq(1)
                for i, j in zip(rows, columns, strict=True):
                    weight *= lengths[i] / lengths[j]
                total += size_squared(_minor(N, p, rows, columns)) * weight
        out.append(-total if k % 2 else total)
    return out


def numerators(seen: System, p: fmpq_poly) -> list[list[fmpq_poly]]:
    """N_ij with S_ij = N_ij/p."""
    x, m = range(len(seen.states)), range(seen.D.nrows())
    columns = [part(seen.B, x, [j]) for j in range(seen.D.ncols())]
    rows = [part(seen.C, [i], x) for i in m]
    return [
        [(seen.A - column * row).charpoly() - p + p * seen.D[i, j] for j, column in enumerate(columns)]
        for i, row in enumerate(rows)
    ]


def principal_minor(N: list[list[fmpq_poly]], p: fmpq_poly, which: Sequence[int]) -> fmpq_poly:
    """p times a principal minor of S."""
    return _minor(N, p, which, which)


def _minor(N, p: fmpq_poly, rows: Sequence[int], columns: Sequence[int]) -> fmpq_poly:
    """det N[rows, columns] / p^(k − 1), which is a polynomial."""
    minor = determinant([[N[i][j] for j in columns] for i in rows])
    for _ in rows[1:]:
        minor, left = divmod(minor, p)
        if left != 0:
            raise NotProved("a minor of the sensitivity is not what its realisation says")  # cannot be; checked anyway
    return minor


def roots_from_zero(p: fmpq_poly) -> int:
    """How many distinct real roots lie in [0, ∞), by Sturm's theorem; 1 at least for the zero polynomial."""
    if p == 0:
        return 1
    if p[0] == 0:
        return 1
    chain = [p.numer(), p.derivative().numer()]
    if chain[1].degree() < 0:
        return 0
    while chain[-1].degree() > 0:
        check()
        a, b = fmpq_poly(chain[-2]), fmpq_poly(chain[-1])
        rest = -(a % b)
        if rest == 0:
            break
        rest = rest.numer()
        content = rest.content()
        chain.append(rest // content if content > 1 else rest)
    return _changes([q[0] for q in chain]) - _changes([q.leading_coefficient() for q in chain])


def _changes(values) -> int:
    signs = [v > 0 for v in values if v != 0]
    return sum(a != b for a, b in pairwise(signs))


def rounded(value: fmpq) -> fmpq:
    """A nearby rational with a short denominator, so that levels do not grow longer with every step."""
    scale = fmpq(2) ** 60
    return fmpq(int((value * scale).floor()), 1) / scale
