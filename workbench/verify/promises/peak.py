"""The largest singular value of a channel against a level, by the proof that suits the loop."""

from collections.abc import Sequence
from dataclasses import dataclass

from flint import arb, ctx, fmpq

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.level import Levels
from workbench.verify.exact.pole import PRECISION, ends
from workbench.verify.exact.quasi import Quasi
from workbench.verify.exact.sensitivity import Peak
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.response import Response, require_stable, response_of
from workbench.verify.plant.table import Promise, Subject
from workbench.verify.promises.answer import ABOVE_PEAK, STEPS, Answer, bracket, require_sense

STURM = "exact: Sturm's theorem, the loop proved stable"
ZERO = fmpq(0)
INTERVALS = "ball arithmetic: intervals of frequency, the loop proved stable, dead times exact"


def peak(loop: Loop, promise: Promise, inputs: Sequence[str], outputs: Sequence[str]) -> Answer:
    """Whether the gain from inputs to outputs stays at or below the limit, and its bracket where that is cheap."""
    require_sense(promise, "<=")
    if promise.limit <= 0:
        raise NotProved("a peak is proved against a limit above zero")
    subject = promise.subject
    levels = levels_of(loop, subject, inputs, outputs)
    kept = levels.kept(promise.limit)
    if levels.exact is not None and subject.band is None:
        none = levels.exact.zero
        low, high = (fmpq(0), fmpq(0)) if none else levels.exact.enclosure(promise.limit, ABOVE_PEAK)
        return Answer(kept, low, high, STURM)
    if not kept:
        return Answer(False, promise.limit, None, levels.method)
    steps = STEPS if min(len(inputs), len(outputs)) == 1 else 0  # of several signals each takes several times as long
    return Answer(True, *bracket(lambda level: not levels.kept(level), ZERO, promise.limit, steps), levels.method)


@dataclass(frozen=True, slots=True)
class LevelTest:
    """Whether a level is kept, over a band, by one of two proofs."""

    exact: Peak | None
    intervals: Levels | None
    low: fmpq
    high: fmpq | None

    @property
    def method(self) -> str:
        """Which of the two."""
        return STURM if self.exact else INTERVALS

    def kept(self, level: fmpq) -> bool:
        """Whether the peak stays at or below a level, touched only where Sturm's theorem tells it exactly."""
        if self.intervals is not None:
            return self.intervals.below(level, self.low, self.high)
        if self.exact is None or (self.low > 0 and self.high is None):
            raise NotProved("a band without an upper end must begin at zero")
        if self.high is not None:
            return self.exact.below_between(level, self.low**2, self.high**2)
        return self.exact.at_most(level)


def levels_of(
    loop: Loop, subject: Subject, inputs: Sequence[str], outputs: Sequence[str], *, half: bool = False
) -> LevelTest:
    """The test of σ_max(T), with `half` of T − I/2 and weights of the points free, once the loop is proved stable."""
    if not inputs or not outputs:
        raise NotProved("the promise names no signals")
    require_stable(loop, subject.openings)
    response = response_of(loop, inputs, outputs, subject.openings)
    if half:
        response = _less_half(response)
    low, high = _band(subject, loop.sample_time)
    scaled = half and len(inputs) > 1
    if not response.delayed and not scaled:
        return LevelTest(Peak.of_fractions(*response.polynomials()), None, low, high)
    P, N = response.P, response.N
    if not response.delayed:
        p, n = response.polynomials()
        P, N = Quasi({ZERO: p}), [[Quasi({ZERO: q} if q != 0 else {}) for q in row] for row in n]
    return LevelTest(None, Levels(P, N, scaled=scaled), low, high)


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
