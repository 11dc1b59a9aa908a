"""The largest singular value of a channel against a level, by the proof that suits the loop."""

from collections.abc import Sequence

from flint import arb, ctx, fmpq

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.level import Levels
from workbench.verify.exact.pole import PRECISION, ends
from workbench.verify.exact.quasi import Quasi
from workbench.verify.exact.sensitivity import Peak
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.response import Response, require_stable, response_of
from workbench.verify.plant.table import Promise, Subject
from workbench.verify.promises.answer import ABOVE_PEAK, Answer, require_sense

STURM = "exact: Sturm's theorem, the loop proved stable"
INTERVALS = "ball arithmetic: intervals of frequency, the loop proved stable, dead times exact"


def peak(loop: Loop, promise: Promise, inputs: Sequence[str], outputs: Sequence[str]) -> Answer:
    """Whether the gain from inputs to outputs stays at or below the limit, and its bracket where that is cheap."""
    require_sense(promise, "<=")
    if promise.limit <= 0:
        raise NotProved("a peak is proved against a limit above zero")
    subject = promise.subject
    kept, method = level_kept(loop, subject, inputs, outputs, promise.limit)
    if method == STURM and subject.band is None:
        found = _exact(loop, subject, inputs, outputs)
        low, high = found.enclosure(promise.limit, ABOVE_PEAK) if not found.zero else (fmpq(0), fmpq(0))
        return Answer(kept, low, high, method)
    return Answer(kept, None if kept else promise.limit, promise.limit if kept else None, method)


def level_kept(
    loop: Loop, subject: Subject, inputs: Sequence[str], outputs: Sequence[str], level: fmpq, *, half: bool = False
) -> tuple[bool, str]:
    """Whether σ_max(T) (with `half` of T − I/2, weights of the points free) stays at or below a level; and by what.

    The level itself may be touched only where Sturm's theorem tells it exactly.
    """
    if not inputs or not outputs:
        raise NotProved("the promise names no signals")
    require_stable(loop, subject.openings)
    response = response_of(loop, inputs, outputs, subject.openings)
    if half:
        response = _less_half(response)
    low, high = _band(subject, loop.sample_time)
    scaled = half and len(inputs) > 1
    if response.delayed or scaled:
        P, N = response.P, response.N
        if not response.delayed:
            p, n = response.polynomials()
            P, N = Quasi({fmpq(0): p}), [[Quasi({fmpq(0): q} if q != 0 else {}) for q in row] for row in n]
        return Levels(P, N, scaled=scaled).below(level, low, high), INTERVALS
    exact = Peak.of_fractions(*response.polynomials())
    if high is not None:
        return exact.below_between(level, low * low, high * high), STURM
    if low > 0:
        raise NotProved("a band without an upper end must begin at zero")
    return exact.at_most(level), STURM


def _exact(loop: Loop, subject: Subject, inputs, outputs) -> Peak:
    return Peak.of_fractions(*response_of(loop, inputs, outputs, subject.openings).polynomials())


def _less_half(response: Response) -> Response:
    """S − I/2."""
    half = response.P.scaled(fmpq(1, 2))
    N = [[q - half if i == j else q for j, q in enumerate(row)] for i, row in enumerate(response.N)]
    return Response(response.P, N, response.sample_time)


def _band(subject: Subject, h: fmpq | None) -> tuple[fmpq, fmpq | None]:
    """The band in ω, or in tan(ωh/2) of a sampled loop; outward."""
    low, high = subject.band or (fmpq(0), None)
    if h is None:
        return low, high
    with ctx.workprec(PRECISION):
        nyquist = arb.pi() / arb(h)
        above = high is None or not arb(high) < nyquist
        if not arb(low) < nyquist:
            raise NotProved("the band lies above the Nyquist frequency")
        tangents = [(arb(w) * arb(h) / 2).tan() for w in ((low,) if above else (low, high))]
        first = max(ends(tangents[0])[0], fmpq(0))
        return first, None if above else ends(tangents[1])[1]
