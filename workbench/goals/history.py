"""What goals over time need of step responses with dead times: `lti.march` on a channel, or the reason why not."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from workbench.goals.measure import Value
from workbench.lti.count import unstable_poles
from workbench.lti.march import Lined, step_pieces

if TYPE_CHECKING:
    from workbench.control.structure.block import Controller

BY_STEPS = "method of steps, dead times exact"


def delayed_reason(channel: Any, K: "Controller") -> str:
    """Empty for a stable loop with dead times, else the sentence that says how many of its poles are not."""
    count = unstable_poles(channel.lined(K), channel.late(K))
    return f"the closed loop is unstable: poles at or right of the axis {count}; its measure does not exist." * (
        count > 0
    )


def delayed_pieces(channel: Any, K: "Controller", around: Callable[[Lined], Lined] = lambda T: T, straight: str = ""):
    """Step responses of a channel with dead times, with what is `around` it, or None; and why there are none.

    With `straight` the reason that the energy of an impulse response has no bound, where it has none.
    Raises InputError where they cannot be had.
    """
    reason, whole = delayed_reason(channel, K), around(Lined(*channel.lined_system(K), channel.late(K)))  # pyright: ignore[reportCallIssue]
    reason = reason or (straight if whole.straight() else "")
    return (None, reason) if reason else (step_pieces(whole), "")


def unjudged(steered: Value, why: str) -> Value:
    """A steering value where no judgement could be had: nothing bounds it from above, so it is never met."""
    return replace(steered, gradients=(), upper=math.inf, reason=why, method=f"{steered.method}; not judged")
