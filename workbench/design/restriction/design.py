"""A design by restriction: `method="restriction"` (a convex sequence) or "slsqp" of a plant of one's own.

problem --Affine--> start within the limits --sequence | local--> gains --round as printed--> exact verdicts --> Design
                                    ^---- further from the limits where an exact bracket passes one ----'
"""

from collections.abc import Callable, Mapping

import numpy as np

from workbench.design.nonsmooth import SHARE, theta_of
from workbench.design.problem import Problem
from workbench.design.record import Design, Start, printed
from workbench.design.restriction.affine import Affine
from workbench.design.restriction.local import BACK_OFF, local
from workbench.design.restriction.sequence import sequence
from workbench.errors import InfeasibleError, InputError
from workbench.machine.budget import Deadline, current
from workbench.machine.threads import one_thread

METHODS = {"restriction": sequence, "slsqp": local}
AT_LIMIT = 1e-3  # relative distance within which a limit is called binding
BACK_OFFS = (BACK_OFF, 1e-4, 1e-3)  # relative distances kept from the limits, in turn


def restricted_design(
    problem: Problem, method: str, *, start: Mapping[str, float] | None = None,
    seconds: float | None = None, on_start: Callable[[Start], None] | None = None,
) -> Design:  # fmt: skip
    """Least integrated error under limits of gains, of a controller affine in its parameters; see `design`.

    start : values to begin from, stable (and within the limits, of restriction); slow integral action if left out
    """
    left = current()
    until = left.share(SHARE) if seconds is None else Deadline.after(min(seconds, max(left.remaining, 1e-3)))
    with one_thread():
        affine = Affine(problem)
        within = method == "restriction"
        x = affine.start(within=within) if start is None else _checked(affine, theta_of(problem, start), within)

        def told(number: int, value: float) -> None:
            if on_start is not None:
                on_start(Start(number=number, cost=value, violation=0.0, evaluations=number, message=method))

        hard = {goal.name for goal in problem.goals if goal.hard}
        missed = []
        for back_off in BACK_OFFS:
            end = METHODS[method](affine, x, back_off, until, told)
            values = problem.structure.values(end.x)
            binding = [rows.name for rows in affine.dense if rows.shares(end.x).max() > 1 - AT_LIMIT]
            log = [
                Start(
                    number=0, cost=end.history[-1], violation=0.0, evaluations=end.solves, message=end.outcome,
                )
            ]  # fmt: skip
            design = printed(problem, values, starts=log, binding=binding, seed=0, solver=method)
            missed = [v for v in design.verdicts if v.name in hard and not v.met]
            if not missed:
                return design
    raise InfeasibleError(
        f"the limits of {problem.name!r} cannot be met together: {'; '.join(v.sentence() for v in missed)}. "
        "Raise one of them, free more places of the controller, or give a start that keeps them."
    )


def _checked(affine: Affine, x: np.ndarray, within: bool) -> np.ndarray:
    """A start that is stable and, where it must, within the limits."""
    if affine.unstable(x):
        raise InputError("the start must be stable; its closed loop is not. Start from less gain, or leave it out.")
    share = affine.worst(x)
    if within and share > 1:
        raise InputError(
            f"the start must keep the limits; it exceeds one by a factor of {share:.4g}. "
            "Leave it out for slow integral action."
        )
    return x
