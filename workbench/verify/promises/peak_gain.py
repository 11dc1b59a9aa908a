"""Peak gain: the largest singular value of a channel over all frequencies, or over a band.

Without dead time in the loop by Sturm's theorem, exactly; with it by intervals of frequency in balls.
"""

from workbench.verify.plant.loop import Loop
from workbench.verify.plant.table import Promise
from workbench.verify.promises.answer import Answer
from workbench.verify.promises.peak import peak

KIND = "peak gain"
SUBJECT = ("inputs", "outputs", "openings", "band")


def prove(loop: Loop, promise: Promise) -> Answer:
    """Whether σ_max of inputs → outputs stays at or below the limit."""
    subject = promise.subject
    return peak(loop, promise, subject.inputs, subject.outputs)
