"""Proofs of what a gain table promises, one file a kind: KIND and prove(loop, promise) → Answer.

A new kind is a new file here; a kind without one is not proved.
"""

from collections.abc import Callable
from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from workbench.verify.plant.loop import Loop
from workbench.verify.plant.table import Promise
from workbench.verify.promises.answer import Answer

Proof = Callable[[Loop, Promise], Answer]


@cache
def proofs() -> dict[str, Proof]:
    """Kind → its proof."""
    modules = [import_module(f"{__name__}.{found.name}") for found in iter_modules(__path__)]
    return {module.KIND: module.prove for module in modules if hasattr(module, "KIND")}
