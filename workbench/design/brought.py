"""Goals of other loops brought in one after another: what a search for gains begins without.

    gains that meet the requirements of the nominal loop --+ one goal--> solved --+ the next--> … --> all of them

Each goal of `goals.ride.reserve` adds tens of rows, far from met at first. All at once they lead a search astray, and
cost it ten times as much at every step; one after another, each begins where the others hold.
"""

from collections.abc import Callable

import numpy as np

from workbench.design.problem import Problem
from workbench.design.solve import finish
from workbench.design.steering import Programme
from workbench.goals.ride.cost import RideCost
from workbench.solve.smooth import Options, Outcome, minimise

ITERATIONS = 40  # of each goal brought in
# Of the last solution. Its rows are crests and sorted roots, on which a quasi-Newton method gains nine tenths of what
# there is to gain in some tens of steps, and may then wander for hundreds.
LAST = Options("slsqp", iterations=50, tolerance=1e-6)
MET = -1e-3  # relative room of a goal that needs no solution of its own

Job = tuple[np.ndarray, bool]  # where it begins, and whether that is near what is wanted and goes there at once


def nominal(problem: Problem) -> Problem:
    """The problem that a search begins with: of the nominal loop, whose forces are straight lines."""
    kept = [goal for goal in problem.goals if not goal.beside]
    return problem.with_goals(kept if any(not goal.hard for goal in kept) else [*kept, RideCost()])


def bringer(problem: Problem, back_off: float, solver: str) -> Callable[[Job], Outcome]:
    """From a start to a solution for all requirements; of a whole programme's variables."""
    whole, first = Programme(problem, back_off=back_off), Programme(nominal(problem), back_off=back_off)

    def brought(job: Job) -> Outcome:
        x, near = job
        if not near:
            x = finish(first, x, solver=solver)[0].x
            held = list(first.problem.requirements)
            for goal in (r for r in problem.requirements if r.beside):
                held.append(goal)
                programme = first.with_requirements(held)
                if programme.at(x).constraints.min() < MET:
                    x = minimise(programme, x, Options("slp", iterations=ITERATIONS)).x
        return finish(whole, x, (1.0,), options=LAST)[0]

    return brought
