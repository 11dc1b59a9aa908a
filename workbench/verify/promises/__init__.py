"""Proofs of what a gain table promises, one file a kind: KIND, SUBJECT and prove(loop, promise) → Answer.

SUBJECT names what a promise of the kind speaks of besides models and factors on their signals. What it does not speak
of must not stand there: a reader would take it for part of what is proved. A new kind is a new file here; a kind
without one is not proved.
"""

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from workbench.verify.exact.failure import NotProved
from workbench.verify.plant.loop import Loop
from workbench.verify.plant.table import SUBJECT, Promise
from workbench.verify.promises.answer import Answer

Proof = Callable[[Loop, Promise], Answer]


@cache
def proofs() -> dict[str, Proof]:
    """Kind → its proof."""
    modules = [import_module(f"{__name__}.{found.name}") for found in iter_modules(__path__)]
    return {module.KIND: _of(module.prove, module.SUBJECT) for module in modules if hasattr(module, "KIND")}


def _of(prove: Proof, subject: tuple[str, ...]) -> Proof:
    def within_subject(loop: Loop, promise: Promise) -> Answer:
        given = promise.subject
        for key in SUBJECT:
            if getattr(given, key) and key not in (*subject, "models", "scaled"):
                raise NotProved(f"a {promise.kind} does not speak of {key}")
        both = set(given.points) & set(given.openings)
        if both:
            raise NotProved(f"{sorted(both)[0][:60]!r} is open: nothing comes back to it, so it has no margin")
        return prove(loop, promise)

    return within_subject
