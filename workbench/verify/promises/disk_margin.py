"""Disk margin α at points together: gains and phases there may change at once within the disk of α.

The multiloop margin with zero skew is 1/sup μ(S − I/2), μ for a diagonal of complex numbers; with one point μ is the
size itself, with several it is bounded from above by weights of the points, of each frequency its own.
Source: Seiler, Packard & Gahinet, IEEE Control Systems 40 (2020) 78.
"""

from workbench.verify.exact.failure import NotProved
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.table import Promise
from workbench.verify.promises.answer import STEPS, Answer, bracket, require_sense
from workbench.verify.promises.peak import levels_of

KIND = "disk margin"
SUBJECT = ("points", "openings", "band")


def prove(loop: Loop, promise: Promise) -> Answer:
    """Whether σ_max(D (S − I/2) D⁻¹) stays at or below 1/limit."""
    require_sense(promise, ">=")
    if promise.limit <= 0:
        raise NotProved("a disk margin is above zero")
    points = promise.subject.points
    levels = levels_of(loop, promise.subject, points, points, half=True)
    if not levels.kept(1 / promise.limit):
        return Answer(False, None, promise.limit, levels.method)
    if len(points) > 1:
        return Answer(True, promise.limit, None, levels.method)
    return Answer(True, *bracket(lambda margin: levels.kept(1 / margin), promise.limit, None, STEPS), levels.method)
