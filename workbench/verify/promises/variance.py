"""Rms of a channel's outputs under white noise at its inputs, each of two-sided density 1: the H₂ norm.

continuous      tr C P C',  A P + P A' + B B' = 0 in balls
sampled         (tr C P C' + tr D D')/h,  P = A P A' + B B', by w of z = (1 + w)/(1 − w)
dead times      (1/π) ∫ ‖T(jω)‖² dω, enclosed by quadrature up to R and bounded by c²/ω² beyond
"""

from flint import acb, arb, arb_mat, ctx, fmpq, fmpq_mat

from workbench.verify.exact.deadline import check
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import root
from workbench.verify.exact.quasi import PRECISION, Balls
from workbench.verify.exact.system import identity
from workbench.verify.exact.variance import Stationary
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.response import Response, chained, require_stable, response_of
from workbench.verify.plant.table import Promise
from workbench.verify.promises.answer import Answer, enclosed, require_sense

KIND = "variance"
SUBJECT = ("inputs", "outputs", "openings")
STRAIGHT = "white noise passes straight to the output, whose variance is infinite"
LYAPUNOV = "ball arithmetic: Lyapunov equation with its residual"
QUADRATURE = "ball arithmetic: quadrature of the spectrum, its tail bounded, dead times exact"
FURTHEST = fmpq(10) ** 9
SHARE = 1e-7  # of the limit's square that the tail may take before R stops growing


def prove(loop: Loop, promise: Promise) -> Answer:
    """Whether the rms stays at or below the limit."""
    require_sense(promise, "<=")
    subject = promise.subject
    if not subject.inputs or not subject.outputs:
        raise NotProved("a variance is of a channel")
    require_stable(loop, subject.openings)
    response = response_of(loop, subject.inputs, subject.outputs, subject.openings)
    with ctx.workprec(PRECISION):
        if response.delayed:
            return _by_quadrature(response, promise)
        system = loop.channel(subject.inputs, subject.outputs, subject.openings)
        return enclosed(promise, root(_mean_square(*chained(system), loop.sample_time)), LYAPUNOV)


def _mean_square(A: fmpq_mat, B: fmpq_mat, C: fmpq_mat, D: fmpq_mat, h: fmpq | None) -> arb:
    direct = sum((d * d for d in D.entries()), fmpq(0))
    if h is None and direct != 0:
        raise NotProved(STRAIGHT)
    if A.nrows() == 0:
        return arb(direct / (h or fmpq(1)))
    if h is not None:
        inverse = (A + identity(A.nrows())).inv()
        A, B = inverse * (A - identity(A.nrows())), inverse * B
    Q = arb_mat(B * B.transpose()) * (1 if h is None else 2)
    covariance = Stationary(A, Q)
    rows = [[arb(C[i, j]) for j in range(C.ncols())] for i in range(C.nrows())]
    total = sum((covariance.mean_square(row) for row in rows), arb(0))
    return total if h is None else (total + arb(direct)) / arb(h)


def _by_quadrature(response: Response, promise: Promise) -> Answer:
    """The limit's square less the tail must hold the integral."""
    P, N = response.P, [q for row in response.N for q in row]
    n = P.degree
    if any(q.degree >= n for q in N):
        raise NotProved(STRAIGHT)
    below, above = P.balls(), [q.balls() for q in N]
    square, R, total = arb(promise.limit) ** 2, fmpq(1), arb(0)
    last = fmpq(0)
    while True:
        check()
        total += _integral(below, above, last, R)
        tail = _tail(below, above, n, R)
        if tail is not None and total + tail <= square:
            return enclosed(promise, root(total.union(total + tail)), QUADRATURE)
        if total > square:
            return enclosed(promise, root(total.union(total + (tail or square))), QUADRATURE)
        if R > FURTHEST or (tail is not None and tail < square * SHARE):
            raise NotProved("the limit lies too close to the variance")
        last, R = R, R * 2


def _integral(P: Balls, N: list[Balls], low: fmpq, high: fmpq) -> arb:
    """(1/π) ∫ Σ |N|²/|P|² dω, of the analytic N(jω) N(−jω)/(P(jω) P(−jω))."""

    def density(omega: acb, _) -> acb:
        s = acb(0, 1) * omega
        whole = sum((q.at(s) * q.at(-s) for q in N), acb(0))
        return whole / (P.at(s) * P.at(-s))

    found = acb.integral(density, acb(arb(low)), acb(arb(high)), rel_tol=arb(2) ** -40)
    if not found.is_finite():
        raise NotProved("the spectrum could not be integrated")
    return found.real / arb.pi()


def _tail(P: Balls, N: list[Balls], n: int, R: fmpq) -> arb | None:
    """A bound of the integral beyond R: |T|² ≤ c²/ω²; None where R is too small."""
    size = abs(P.at_infinity(n, R))
    if not size > 0:
        return None
    squares = [(abs(q.at_infinity(n - 1, R)) / size) ** 2 for q in N]
    c2 = sum(squares, arb(0)).upper()
    return arb(c2) / (arb.pi() * arb(R)) if arb(c2).is_finite() else None
