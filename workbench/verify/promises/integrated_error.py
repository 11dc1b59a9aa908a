"""Integrated error: ∫ of a channel's outputs after unit steps at its inputs, in exact rationals.

    Λ(s) q = A q + B w,  z = C q + D w     Λ: s of a state, e^{sT} of a dead time, e^{sh} of a sampled state
    T(0) = D + C M⁻¹ B = 0,  ∫ z dt = T'(0) = −C M⁻¹ Λ'(0) M⁻¹ B,  M = Λ(0) − A

Dead times and samples are in it exactly. The largest singular value stays below a limit where limit² I − T'(0)'T'(0)
has no negative eigenvalue: of a symmetric matrix, where the coefficients of its characteristic polynomial alternate.
"""

from flint import arb, ctx, fmpq, fmpq_mat

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import PRECISION, ends, root
from workbench.verify.exact.system import diagonal, identity, stacked
from workbench.verify.plant.loop import Lined, Loop
from workbench.verify.plant.response import require_stable
from workbench.verify.plant.table import Promise
from workbench.verify.promises.answer import Answer, require_sense

KIND = "integrated error"
SUBJECT = ("inputs", "outputs", "openings")
METHOD = "exact rationals: slope of the channel at rest"
HALVINGS = 40  # of the square's bracket that is shown


def prove(loop: Loop, promise: Promise) -> Answer:
    """Whether σ_max of the integrated outputs stays at or below the limit."""
    require_sense(promise, "<=")
    subject = promise.subject
    if not subject.inputs or not subject.outputs:
        raise NotProved("an integrated error is of a channel")
    require_stable(loop, subject.openings)
    slope = _slope(loop.channel(subject.inputs, subject.outputs, subject.openings))
    square = slope.transpose() * slope
    low, high = fmpq(0), sum((square[i, i] for i in range(square.nrows())), fmpq(0))
    kept = promise.limit >= 0 and _at_most(square, promise.limit**2)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if _at_most(square, middle) else (middle, high)
    with ctx.workprec(PRECISION):
        return Answer(kept, ends(root(arb(low)))[0], ends(root(arb(high)))[1], METHOD)


def _slope(system: Lined) -> fmpq_mat:
    """T'(0); raises NotProved where T(0) is not zero exactly."""
    h, n, lines = system.sample_time, system.A.nrows(), len(system.times)
    A = stacked([[system.A, system.Bd], [system.Cd, system.Dcd]])
    B, C = stacked([[system.B], [system.Dcw]]), stacked([[system.C, system.Dzd]])
    rest = diagonal([fmpq(0 if h is None else 1)] * n + [fmpq(1)] * lines)
    rate = diagonal([fmpq(1) if h is None else h] * n + list(system.times))
    try:
        inverse = (rest - A).inv()
    except ZeroDivisionError as error:
        raise NotProved("the loop has a pole at rest") from error
    remains = system.D + C * inverse * B
    if any(entry != 0 for entry in remains.entries()):
        raise NotProved("the error does not vanish exactly, so its integral has no end")
    return fmpq(-1) * (C * inverse * rate * inverse * B)


def _at_most(square: fmpq_mat, level: fmpq) -> bool:
    """Whether no eigenvalue of a symmetric matrix is above a level."""
    n = square.nrows()
    room = (identity(n) * level - square).charpoly()
    return all((-1) ** (n - k) * room[k] >= 0 for k in range(n))
