"""Decay rate [1/s] of the slowest characteristic root, in a band of |s| if one is named."""

from flint import ctx

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import PRECISION, smallest
from workbench.verify.exact.quasi import beyond
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.response import COUNTED, ISOLATED, exactly_kept, late, poles, within
from workbench.verify.plant.table import Promise
from workbench.verify.promises.answer import STEPS, Answer, bracket, enclosed, require_sense

KIND = "decay rate"
SUBJECT = ("openings", "band")


def prove(loop: Loop, promise: Promise) -> Answer:
    """Whether −Re s is at least the limit for every root."""
    require_sense(promise, ">=")
    subject = promise.subject
    if late(loop, subject.openings):
        if subject.band is not None:
            raise NotProved("the checker counts roots of a loop with dead time without a band")
        P = loop.characteristic(subject.openings)
        if beyond(P, promise.limit) > 0:
            return Answer(False, None, promise.limit, COUNTED)
        return Answer(True, *bracket(lambda decay: beyond(P, decay) == 0, promise.limit, None, STEPS), COUNTED)
    with ctx.workprec(PRECISION):
        found = within(poles(loop, subject.openings), subject.band)
        if not found:
            return Answer(True, None, None, ISOLATED)
        worst = smallest([-s.real for s in found])
        whole = subject.band is None

        def exactly() -> bool:
            return whole and exactly_kept(loop, subject.openings, promise.limit, ray=False)

        return enclosed(promise, worst, ISOLATED, exactly)
