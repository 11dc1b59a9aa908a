"""Mean squares of a stable loop under white noises that come to the front and, a wheel base later, to the rear.

    dx/dt = A x + B_F w(t) + B_R w(t − T):   A P + P A' + Q = 0,  Q = B_F R B_F' + B_R R B_R' + e^{AT} B_F R B_R' + (·)'
    P~ near P by the matrix sign iteration (floating, many digits)    --residual in balls--> |P − P~| ≤ (ρ/η) H

e^{AT} is enclosed by Arb. H stands for the solution of A H + H A' = −W, W a diagonal of weights: found likewise, and
proved by −(A H + H A') ⪰ η W (Gershgorin after scaling by W). With −ρW ⪯ A P~ + P~A' + Q ⪯ ρW and A Hurwitz the order
of matrices carries over to the solutions: −(ρ/η) H ⪯ P − P~ ⪯ (ρ/η) H. Whether the iteration converged decides nothing.
"""

from collections.abc import Sequence

from flint import arb, arb_mat, ctx, fmpq, fmpq_mat

from workbench.verify.exact.deadline import check
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import largest, smallest

PRECISION = 256  # bits; e^{AT} with ‖AT‖ ≈ 100 loses 150 of them on the way
MOST_STEPS = 60
CONVERGED = 2.0**-120


class Stationary:
    """The covariance of a state from each of several sources: point matrices, and bounds of their errors both ways."""

    def __init__(self, A: fmpq_mat, *sources: arb_mat) -> None:
        """A: rational, proved Hurwitz by the caller; sources: intensities Q of independent noises, balls."""
        with ctx.workprec(PRECISION):
            n = A.nrows()
            whole = arb_mat(A)
            weights = _weights(whole)
            W = _diagonal([w * w for w in weights])
            *found, H = _solutions(whole, [*(Q.mid() for Q in sources), W])
            spread = whole * H + H * whole.transpose()
            certain = smallest(_gershgorin(-spread, weights, lower=True))
            if not certain > 0:
                raise NotProved("the covariance's error bound could not be proved")
            self._parts = []
            for P, Q in zip(found, sources, strict=True):
                left = whole * P + P * whole.transpose() + Q
                rho = largest([abs(e) for e in _gershgorin(left, weights, lower=False)])
                self._parts.append((P, H * (rho.upper() / certain.lower()).upper()))
            self.order = n

    def mean_squares(self, row: Sequence[arb]) -> list[arb]:
        """E[y²] of y = row · x from each source."""
        with ctx.workprec(PRECISION):
            c = arb_mat(1, self.order, list(row))
            out = []
            for P, H in self._parts:
                value, error = (c * P * c.transpose())[0, 0], abs((c * H * c.transpose())[0, 0]).upper()
                low, high = value - error, value + error
                out.append(low.union(high).max(arb(0)))
            return out

    def mean_square(self, row: Sequence[arb]) -> arb:
        """E[y²] of y = row · x, all sources together."""
        with ctx.workprec(PRECISION):
            return sum(self.mean_squares(row), arb(0))


def intensity(A: fmpq_mat, arrivals: Sequence[tuple[fmpq, arb_mat]], R: arb_mat) -> arb_mat:
    """Q of white noises with intensity R that arrive by each matrix after its delay, foremost first."""
    with ctx.workprec(PRECISION):
        total = arb_mat(A.nrows(), A.nrows())
        for j, (later, C) in enumerate(arrivals):
            total += C * R * C.transpose()
            for first, B in arrivals[:j]:
                cross = arb_mat(A * (later - first)).exp() * B * R * C.transpose()
                total += cross + cross.transpose()
        return total


def _weights(A: arb_mat) -> list[arb]:
    """A length for each state, from the diagonal balance of |A|: powers of two, so that scaling is exact."""
    n, size = A.nrows(), [[abs(float(A[i, j].mid())) for j in range(A.ncols())] for i in range(A.nrows())]
    exponent = [0] * n
    for _ in range(30):
        moved = False
        for i in range(n):
            row = sum(size[i][j] * 2.0 ** (exponent[j] - exponent[i]) for j in range(n) if j != i)
            column = sum(size[j][i] * 2.0 ** (exponent[i] - exponent[j]) for j in range(n) if j != i)
            while row > 4 * column > 0:
                exponent[i], row, column, moved = exponent[i] + 1, row / 2, column * 2, True
            while column > 4 * row > 0:
                exponent[i], row, column, moved = exponent[i] - 1, row * 2, column / 2, True
        if not moved:
            break
    return [arb(2) ** e for e in exponent]


def _solutions(A: arb_mat, sources: Sequence[arb_mat]) -> list[arb_mat]:
    """Approximate X of A X + X A' + Q = 0 for each Q: Newton's iteration for the matrix sign, with scaling.

    Source: Roberts, Int. J. Control 32 (1980) 677; scaling by the determinant: Byers, Linear Algebra 85 (1987) 267.
    """
    n = A.nrows()
    step, terms = A.mid(), [Q.mid() for Q in sources]
    for _ in range(MOST_STEPS):
        check()
        size = abs(step.det().mid())
        try:
            inverse = step.inv().mid()
        except ZeroDivisionError as error:  # an eigenvalue on the imaginary axis, or as good as
            raise NotProved("the loop is too close to instability for a covariance") from error
        c = arb((-size.log() / n).exp().mid())
        far = largest([abs(e) for e in (step + _diagonal([arb(1)] * n)).entries()])
        if far < arb(1) / 16:
            c = arb(1)  # Newton's own steps end it quadratically
        terms = [((X * c + inverse * X * inverse.transpose() * (1 / c)) / 2).mid() for X in terms]
        step = ((step * c + inverse * (1 / c)) / 2).mid()
        if far < CONVERGED:
            break
    return [((X + X.transpose()) / 4).mid() for X in terms]  # symmetric to the last bit: sums commute


def _gershgorin(M: arb_mat, weights: Sequence[arb], *, lower: bool) -> list[arb]:
    """Per row of diag(w)⁻¹ M diag(w)⁻¹: a lower bound of its eigenvalues, or the sum of absolute entries."""
    out = []
    for i, row in enumerate(M.tolist()):
        scaled = [e / (weights[i] * w) for e, w in zip(row, weights, strict=True)]
        off = sum((abs(e) for j, e in enumerate(scaled) if j != i), arb(0))
        out.append(scaled[i] - off if lower else abs(scaled[i]) + off)
    return out


def _diagonal(entries: Sequence[arb]) -> arb_mat:
    n = len(entries)
    return arb_mat(n, n, [entries[i] if i == j else arb(0) for i in range(n) for j in range(n)])
