"""Pole frequency: the largest |s| [rad/s] of the characteristic roots, in a band of |s| if one is named."""

from flint import ctx

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import PRECISION, largest
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.response import ISOLATED, late, poles, within
from workbench.verify.plant.table import Promise
from workbench.verify.promises.answer import Answer, enclosed, require_sense

KIND = "pole frequency"
SUBJECT = ("openings", "band")


def prove(loop: Loop, promise: Promise) -> Answer:
    """Whether |s| is at most the limit for every root; with dead time in the loop there are infinitely many."""
    require_sense(promise, "<=")
    if late(loop, promise.subject.openings):
        raise NotProved("the roots of a loop with dead time lie at any distance")
    with ctx.workprec(PRECISION):
        found = within(poles(loop, promise.subject.openings), promise.subject.band)
        if not found:
            return Answer(True, None, None, ISOLATED)
        return enclosed(promise, largest([abs(s) for s in found]), ISOLATED)
