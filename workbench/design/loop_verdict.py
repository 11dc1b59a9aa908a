"""Verdicts on the goals of loops: each by its exact measure, on the model where it is worst.

problem, values --loop of each model--> closed loops --goal.judge--> verdicts; none is met where a loop is unstable
"""

from collections.abc import Mapping

from workbench.control.structure.block import Controller
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.goals.goal import Closed
from workbench.goals.measure import infinite
from workbench.goals.verdict import Verdict
from workbench.machine.threads import one_thread


def loop_verdicts(problem: Problem, values: Mapping[str, float]) -> tuple[Verdict, ...]:
    """The verdicts on every goal, at values of the parameters.

    A loop that is unstable meets nothing, whatever a goal looks at.
    """
    K = problem.structure.with_values(values).controller()
    with one_thread():
        reason, model = unstable(problem, K)
        if reason:
            return tuple(goal.verdict(infinite(reason), model) for goal in problem.goals)
        closed = Closed(problem.loops, K)
        return tuple(verdict for goal in problem.goals for verdict in goal.judge(closed))


def unstable(problem: Problem, K: Controller) -> tuple[str, str]:
    """Why a loop is not stable, the whole of it, and its model; empty if all are."""
    for loop in problem.loops:
        try:
            count = loop.unstable_poles(K)
        except InputError as error:
            return str(error), loop.name
        if count:
            return f"the closed loop is unstable: {count} poles on or beyond the limit", loop.name
    return "", ""
