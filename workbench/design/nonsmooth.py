"""The design of a plant of one's own: goals with corners, followed by the nonsmooth tuner.

problem --tune_labelled--> parameters --round as printed--> exact verdicts --> Design, or what cannot be met
"""

import math
from collections.abc import Callable, Mapping

import numpy as np

from workbench.design.problem import Problem
from workbench.design.record import Design, Start, printed
from workbench.design.tuner.pieces import Labelled
from workbench.design.tuner.tune import Progress, refuse_unmet, tune_labelled
from workbench.machine.budget import current

SECONDS = 60.0  # of the search where nothing else is said
SHARE = 0.7  # of a budget's rest, for the search
AT_LIMIT = 1e-3  # relative distance within which a goal is called binding


def nonsmooth_design(
    problem: Problem, *, starts: int, seed: int = 0, seconds: float | None = None, workers: int = 1,
    start: Mapping[str, float] | None = None, on_start: Callable[[Start], None] | None = None,
) -> Design:  # fmt: skip
    """The structure's parameters for which the largest soft goal is small and every hard one is met; see `tune`."""
    left = current().remaining
    if seconds is None:
        seconds = SECONDS if math.isinf(left) else min(SECONDS, SHARE * left)
    theta = None if start is None else theta_of(problem, start)
    tuning = tune_labelled(
        [Labelled(m.name, m) for m in problem.systems], problem.structure, list(problem.goals), starts=starts,
        seed=seed, budget_seconds=seconds, workers=workers, start=theta, on_progress=_told(on_start), refuse=False,
    )  # fmt: skip
    log = tuple(
        Start(number=s.number - 1, cost=s.soft, violation=max(s.hard - 1, 0.0), evaluations=0, message=s.message)
        for s in tuning.starts
    )
    refuse_unmet(tuning, problem.goals)
    binding = [g.name for g in tuning.goals if g.hard and g.value >= 1 - AT_LIMIT]
    return printed(problem, tuning.values, starts=log, binding=binding, seed=seed, solver="nonsmooth")


def theta_of(problem: Problem, start: Mapping[str, float]) -> np.ndarray:
    """Values by name as the structure's free parameters, those left out as in the structure."""
    chosen = problem.structure_at(start).values()
    return np.array([chosen[name] for name in problem.structure.names])


def _told(on_start: Callable[[Start], None] | None):
    """Passes on what a start told when the next one begins, as far as it is known then."""
    if on_start is None:
        return None
    last: list[Progress] = []

    def told(progress: Progress) -> bool:
        if last and last[-1].start != progress.start:
            ended = last[-1]
            on_start(
                Start(number=ended.start - 1, cost=ended.soft, violation=max(ended.hard - 1, 0.0), evaluations=0,
                      message=ended.phase)
            )  # fmt: skip
        last[:] = [progress]
        return False

    return told
