"""Stability: every characteristic root of the closed loop decays; with dead times the roots beyond are counted.

The limit, 0 or more, is a decay [1/s] that every root exceeds.
"""

from flint import ctx

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import PRECISION, ends, smallest
from workbench.verify.exact.quasi import beyond
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.response import COUNTED, ISOLATED, late, poles
from workbench.verify.plant.table import Promise
from workbench.verify.promises.answer import Answer, require_sense

KIND = "stability"
SUBJECT = ("openings",)


def prove(loop: Loop, promise: Promise) -> Answer:
    """Whether all roots have Re s < −limit."""
    require_sense(promise, ">=")
    subject = promise.subject
    if promise.limit < 0:
        raise NotProved("stability speaks of a decay of zero or more")
    if late(loop, subject.openings):
        P = loop.characteristic(subject.openings)
        kept = beyond(P, promise.limit) == 0
        return Answer(kept, promise.limit if kept else None, None if kept else promise.limit, COUNTED)
    found = poles(loop, subject.openings)
    if not found:
        return Answer(True, promise.limit, None, ISOLATED)
    with ctx.workprec(PRECISION):
        decay = smallest([-s.real for s in found])
        if not (decay > promise.limit or decay <= promise.limit):
            raise NotProved("a root lies on the limit or too close to it")
        return Answer(bool(decay > promise.limit), *ends(decay), ISOLATED)
