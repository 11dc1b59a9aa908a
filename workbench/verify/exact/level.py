"""A level above the largest singular value of N(jω)/P(jω), by intervals of frequency: dead times exact.

    G(ω) = γ²|P|² I − N*N      positive definite at the middle of an interval (LDL in balls)
    det G(ω) on an interval    det G(m) + (det G)'(interval)(ω − m) > 0, so no eigenvalue of G passes zero there
    ω ≥ R                      P/(jω)^n, N/(jω)^n with e^(−jωT) anywhere on the circle: G positive definite at once

Several points may be weighed against each other: D N D⁻¹ with a diagonal D of each interval (`scaled`), which bounds
the structured singular value.
"""

import cmath
from collections.abc import Sequence

from flint import acb, acb_mat, acb_series, arb, ctx, fmpq

from workbench.verify.exact.deadline import check
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.polynomial import determinant
from workbench.verify.exact.quasi import DEEPEST, FURTHEST, PRECISION, Balls, Quasi

BALANCINGS = 12
ZERO = fmpq(0)


class Levels:
    """N/P at s = jω, of P without a root on the axis, tested level by level."""

    def __init__(self, P: Quasi, N: Sequence[Sequence[Quasi]], *, scaled: bool = False) -> None:
        """N: (p, m), proper; scaled: whether D may differ from one, for a square N."""
        if len(N) < len(N[0]):
            N = [list(column) for column in zip(*N, strict=True)]  # the same singular values
        self._order = P.degree
        self._P, self._N = P.balls(), [[q.balls() for q in row] for row in N]
        self._scaled = scaled and len(N) > 1
        self._known: dict[fmpq, tuple[acb, list[list[acb]]]] = {}
        self._jet: dict[tuple[fmpq, fmpq], tuple[acb_series, list[list[acb_series]]]] = {}

    def below(self, level: fmpq, low: fmpq = ZERO, high: fmpq | None = None) -> bool:
        """Whether the peak over [low, high] is proved below a level; False: a frequency was found where it is not.

        Raises NotProved where neither can be shown.
        """
        with ctx.workprec(PRECISION):
            square = arb(level * level)
            if high is None:
                high = self._tail(square, max(low, fmpq(1)))
                if high is None:
                    return False
            waiting = [(low, high, 0)]
            while waiting:
                check()
                a, b, depth = waiting.pop()
                middle = (a + b) / 2
                P, N = self._values(middle)
                weights = self._weights(P, N)
                G = _gram(square, P, N, weights)
                there = _definite(G)
                if there is False and self._scaled:
                    raise NotProved(
                        f"no weights of the points were found for which the limit holds at {float(middle):.4g} rad/s"
                    )
                if there is False:
                    return False
                if there and self._no_crossing(square, G, weights, a, b):
                    continue
                if depth >= DEEPEST:
                    raise NotProved(f"the gain is at the limit or too close to it near {float(middle):.4g} rad/s")
                waiting += [(middle, b, depth + 1), (a, middle, depth + 1)]
            return True

    def _tail(self, square: arb, start: fmpq) -> fmpq | None:
        """R beyond which the level is kept; None where it is not at R."""
        R = start
        while R < FURTHEST:
            P = self._P.at_infinity(self._order, R)
            N = [[q.at_infinity(self._order, R) for q in row] for row in self._N]
            there = self._values(R)
            weights = self._weights(*there)
            if _definite(_gram(square, P, N, weights)):
                return R
            if not self._scaled and _definite(_gram(square, *there, weights)) is False:
                return None
            R *= 4
        raise NotProved(
            "no frequency was found beyond which the limit is kept: it is too close to the gain at infinity"
        )

    def _values(self, omega: fmpq) -> tuple[acb, list[list[acb]]]:
        """P and N at a frequency; remembered, for the next level asks for them again."""
        if omega not in self._known:
            s = acb(0, arb(omega))
            self._known[omega] = self._P.at(s), [[q.at(s) for q in row] for row in self._N]
        return self._known[omega]

    def _jets(self, a: fmpq, b: fmpq) -> tuple[acb_series, list[list[acb_series]]]:
        """Enclosures of P and N and of their derivatives by ω on an interval."""
        if (a, b) not in self._jet:
            span = arb(0, 1) * arb((b - a) / 2)
            box = acb(0, arb((a + b) / 2) + span)

            def jet(q: Balls, value: acb) -> acb_series:
                slope = acb(0, 1) * q.slope(box)
                return acb_series([value + slope * acb(span), slope], 2)

            P, N = self._values((a + b) / 2)
            rows = [[jet(*pair) for pair in zip(q, n, strict=True)] for q, n in zip(self._N, N, strict=True)]
            self._jet[a, b] = jet(self._P, P), rows
        return self._jet[a, b]

    def _weights(self, P: acb, N: Sequence[Sequence[acb]]) -> list[arb]:
        """D of an interval, from its middle: rows and columns of D N D⁻¹ of like length (Osborne).

        Any D is right; a good one bounds closer.
        """
        n = len(N[0])
        if not self._scaled:
            return [arb(1)] * n
        size = [[abs(complex(q.mid())) for q in row] for row in N]
        d = [1.0] * n
        for _ in range(BALANCINGS):
            for i in range(n):
                row = sum((size[i][j] * d[i] / d[j]) ** 2 for j in range(n) if j != i)
                column = sum((size[j][i] * d[j] / d[i]) ** 2 for j in range(n) if j != i)
                if row > 0 and column > 0 and cmath.isfinite(row / column):
                    d[i] *= (column / row) ** 0.25
        return [arb(x) for x in d]

    def _no_crossing(self, square: arb, G: acb_mat, weights: Sequence[arb], a: fmpq, b: fmpq) -> bool:
        """Whether det G keeps from zero on the interval, G being its value in the middle."""
        P, N = self._jets(a, b)
        slope = determinant(_series_gram(square, P, N, weights))[1].real
        return bool(G.det().real + slope * arb(0, 1) * arb((b - a) / 2) > 0)


def _gram(square: arb, P: acb, N: Sequence[Sequence[acb]], d: Sequence[arb]) -> acb_mat:
    """γ²|P|² I − (D N D⁻¹)* (D N D⁻¹)."""
    n = len(N[0])
    W = acb_mat(len(N), n, [q * acb(_weight(d, i, j)) for i, row in enumerate(N) for j, q in enumerate(row)])
    size = P.real * P.real + P.imag * P.imag
    G = acb_mat(n, n, [acb(square * size) if i == j else acb(0) for i in range(n) for j in range(n)])
    return G - W.conjugate().transpose() * W


def _weight(d: Sequence[arb], i: int, j: int) -> arb:
    return d[i] / d[j] if i < len(d) else 1 / d[j]


def _series_gram(square: arb, P, N, d) -> list[list[acb_series]]:
    n = len(N[0])
    W = [[q * acb(_weight(d, i, j)) for j, q in enumerate(row)] for i, row in enumerate(N)]
    size = P * _conjugate(P) * acb(square)
    out = []
    for i in range(n):
        row = []
        for j in range(n):
            total = size if i == j else acb_series([0], 2)
            for k in range(len(N)):
                total = total - _conjugate(W[k][i]) * W[k][j]
            row.append(total)
        out.append(row)
    return out


def _conjugate(q: acb_series) -> acb_series:
    """At real ω."""
    return acb_series([q[0].conjugate(), q[1].conjugate()], 2)


def _definite(G: acb_mat) -> bool | None:
    """Whether a Hermitian matrix in balls is positive definite: by its pivots; None where a ball decides nothing."""
    rows = [list(row) for row in G.tolist()]
    for k in range(len(rows)):
        pivot = rows[k][k].real
        if pivot < 0:
            return False
        if not pivot > 0:
            return None
        for i in range(k + 1, len(rows)):
            factor = rows[i][k] / acb(pivot)
            for j in range(k + 1, len(rows)):
                rows[i][j] = rows[i][j] - factor * rows[k][j]
    return True
