"""Delay margin [s] of each point, the others closed: every further dead time there from zero to the limit is borne.

    S_ii = N/P,  L = (P − N)/N:   N + (P − N) e^(−jθ) ≠ 0 for every ω and every lag θ from 0 to ω · limit

The loop is stable without it, roots move with it continuously, and none meets the axis; so all stay where they are.
Beyond R the loop gain is below 1. Dead times of the plant are exact.
"""

from flint import acb, arb, ctx, fmpq

from workbench.verify.exact.deadline import check
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.quasi import DEEPEST, FURTHEST, PRECISION, Balls, Quasi
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.response import require_stable, response_of
from workbench.verify.plant.table import Promise
from workbench.verify.promises.answer import Answer, require_sense

KIND = "delay margin"
SUBJECT = ("points", "openings")
METHOD = "ball arithmetic: lags at intervals of frequency, the loop proved stable, dead times exact"


def prove(loop: Loop, promise: Promise) -> Answer:
    """Whether each point bears every dead time up to the limit."""
    require_sense(promise, ">=")
    subject = promise.subject
    if loop.sample_time is not None or promise.limit < 0 or not subject.points:
        raise NotProved("a delay margin is of points of a continuous loop")
    require_stable(loop, subject.openings)
    with ctx.workprec(PRECISION):
        for point in subject.points:
            response = response_of(loop, (point,), (point,), subject.openings)
            if not _bears(response.P, response.N[0][0], promise.limit):
                return Answer(False, None, promise.limit, METHOD)
    return Answer(True, promise.limit, None, METHOD)


def _bears(P: Quasi, N: Quasi, limit: fmpq) -> bool:
    """Whether no lag up to ω · limit brings a root to the axis."""
    n, return_, back = P.degree, N.balls(), (P - N).balls()
    R = _roll_off(return_, back, n)
    waiting = [(fmpq(0), R, 0)]
    while waiting:
        check()
        a, b, depth = waiting.pop()
        middle, half = acb(0, arb((a + b) / 2)), acb(0, arb((b - a) / 2))
        one, other = return_.on(middle, half), back.on(middle, half)
        if abs(one) > abs(other) or abs(one) < abs(other) or _apart(one, other, arb(b) * arb(limit)):
            continue
        at = return_.at(middle), back.at(middle)
        if depth >= DEEPEST:
            raise NotProved(f"a lag at the limit or too close to it is critical near {float(b):.4g} rad/s")
        if abs(at[0]) < 2 * abs(at[1]) and _crossed(return_, back, a, b, limit):
            return False
        waiting += [((a + b) / 2, b, depth + 1), (a, (a + b) / 2, depth + 1)]
    return True


def _apart(one: acb, other: acb, lag: arb) -> bool:
    """Whether the turn from one to −other, clockwise from 0 to 2π, is larger than the lag."""
    if other.contains(0) or one.contains(0):
        return False
    turn = (-other / one).arg()  # e^(−jθ) = −one/other, so θ = arg(−other/one)
    if turn.contains(0) or not turn.is_finite():
        return False
    turn = turn if turn > 0 else turn + 2 * arb.pi()
    return bool(turn > lag)


def _crossed(return_: Balls, back: Balls, a: fmpq, b: fmpq, limit: fmpq) -> bool:
    """Whether the loop gain passes 1 between two frequencies at a lag that is proved to be within the limit."""
    a, b = max(a - (b - a) / 2, fmpq(0)), b + (b - a) / 2  # the crossing may lie on an end
    ends = [acb(0, arb(x)) for x in (a, b)]
    sizes = [abs(return_.at(s)) - abs(back.at(s)) for s in ends]
    if not ((sizes[0] > 0 and sizes[1] < 0) or (sizes[0] < 0 and sizes[1] > 0)):
        return False
    middle, half = acb(0, arb((a + b) / 2)), acb(0, arb((b - a) / 2))
    one, other = return_.on(middle, half), back.on(middle, half)
    if other.contains(0) or one.contains(0):
        return False
    turn = (-other / one).arg()
    turn = turn if turn > 0 else turn + 2 * arb.pi() if turn < 0 else arb.nan()
    return bool(turn < arb(a) * arb(limit))


def _roll_off(return_: Balls, back: Balls, n: int) -> fmpq:
    """R beyond which the loop gain is below 1."""
    R = fmpq(1)
    while R < FURTHEST:
        if abs(back.at_infinity(n, R)) < abs(return_.at_infinity(n, R)):
            return R
        R *= 4
    raise NotProved("the loop gain is not proved to fall below 1 at high frequencies")
