"""Damping ratio −Re s/|s| of the least damped characteristic root, in a band of |s| if one is named.

A loop with dead time has infinitely many roots whose damping falls to zero: there a band with an end is needed, and the
roots in the sector between its circles are counted.
"""

from flint import acb, arb, ctx, fmpq

from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import PRECISION, smallest
from workbench.verify.exact.quasi import in_sector
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.response import COUNTED, ISOLATED, exactly_kept, late, poles, within
from workbench.verify.plant.table import Promise
from workbench.verify.promises.answer import Answer, enclosed, require_sense

KIND = "damping ratio"
SUBJECT = ("openings", "band")


def prove(loop: Loop, promise: Promise) -> Answer:
    """Whether the damping is at least the limit; a real root that decays counts 1."""
    require_sense(promise, ">=")
    subject = promise.subject
    if not -1 < promise.limit <= 1:
        raise NotProved("a damping ratio is at most 1 and above −1")
    if late(loop, subject.openings):
        low, high = subject.band or (fmpq(0), None)
        if high is None or promise.limit == 1:
            raise NotProved("the damping of a loop with dead time falls to zero; a band with an end must be named")
        if in_sector(loop.characteristic(subject.openings), promise.limit, low, high) > 0:
            raise NotProved("a root lies in the sector, or a little outside the circles of the band")
        return Answer(True, promise.limit, None, COUNTED)
    with ctx.workprec(PRECISION):
        found = within(poles(loop, subject.openings), subject.band)
        if not found:
            return Answer(True, None, None, ISOLATED)
        worst = smallest([_damping(s) for s in found])
        whole = subject.band is None

        def exactly() -> bool:
            return whole and exactly_kept(loop, subject.openings, promise.limit, ray=True)

        return enclosed(promise, worst, ISOLATED, exactly)


def _damping(s: acb) -> arb:
    """−Re s/|s|, of a root on the real axis 1 or −1 exactly."""
    if s.imag.is_zero() and (s.real < 0 or s.real > 0):
        return arb(1 if s.real < 0 else -1)
    return -s.real / abs(s)
