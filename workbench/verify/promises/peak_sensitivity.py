"""Peak sensitivity: the largest singular value of S at points, from a push there to the signal behind it."""

from workbench.verify.plant.loop import Loop
from workbench.verify.plant.table import Promise
from workbench.verify.promises.answer import Answer
from workbench.verify.promises.peak import peak

KIND = "peak sensitivity"
SUBJECT = ("points", "openings", "band")


def prove(loop: Loop, promise: Promise) -> Answer:
    """Whether σ_max(S) stays at or below the limit."""
    return peak(loop, promise, promise.subject.points, promise.subject.points)
