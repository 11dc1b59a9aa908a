"""Where a vehicle's search starts: seeded random gains around two centres, each solved with its limits relaxed.

    problem, seed --jobs_of--> centres, spreads --stable_start--> points --solver, on processes--> outcomes
    --distinct--> a few valleys, the cheapest first

The centres are the report's gains and their mirror image; bounds of K_yaw may leave one of them (`design.valley`).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from workbench.control import Gains
from workbench.design.problem import Problem
from workbench.design.record import Start
from workbench.design.solve import cost, relaxed, stable_start
from workbench.design.steering import Programme
from workbench.errors import BudgetEnded
from workbench.machine.budget import NEVER, Deadline, current
from workbench.solve.multistart import ends
from workbench.solve.smooth import Outcome

BACK_OFFS = (
    5e-4,
    1e-3,
    3e-3,
    1e-2,
)  # relative distance kept from every limit, raised where rounding or the grid crosses it
STARTS = 16
FEW = 4  # starts of the nonsmooth tuner
# Reversing these leaves the yaw loop as it was and reverses what the lateral signals do to sway and roll. The roll
# channel then carries them: on that side lie the best valleys of revenue_vehicle.
MIRRORED = ("K_hp", "K_hpdot", "K_yddot", "K_ydot", "K_yaw")
SPREADS = (0.3, 1.0, 3.0)  # of random starts around the centre, in typical sizes, in turn
SAME_COST = 1e-3  # relative; starts that end closer are taken for one valley
SAME_ROUGHLY = 0.02  # the same of starts that are ended coarsely
NEARLY = 0.02  # relative violation that a start may end with, since it is ended coarsely
CUT_SHORT = KeyboardInterrupt, BudgetEnded  # what was verified by then is kept
ALL_STARTS, FEW_STARTS = 0.4, 0.8  # of the time left, after which no start is awaited; if none has ended yet
WIND_UP = 5.0  # [s] for making something of the starts that had ended before an interrupt
FINISHED = 3  # distinct valleys brought to the wanted sensitivity

# Where random starts are centred: the report's gains with K_heave = K_sway = 1, the lateral filters shortened to 0.2 s,
# which is what keeps the loop stable when the accelerometers feel gravity (reference: report, C.5 and C.6).
CENTRE = {
    "K_h": -2.155, "K_hdot": 0.15, "tau_h": 0.637, "K_hp": 0.0, "K_hpdot": 0.152, "tau_hp": 0.2,
    "K_zddot": 0.0, "K_zdot": 0.15, "tau_z": 0.637, "K_yddot": -0.01, "K_ydot": 0.152, "tau_y": 0.2,
    "K_heave": 1.0, "K_pitch": 1.0, "K_sway": 1.0, "K_roll": 1.73, "K_yaw": 6.76,
}  # fmt: skip
# Of a law whose motor takes sway and yaw: the same side force per metre and roll moment; in yaw a tenth of the moment,
# which already is more than the rated current gives.
SPLIT_CENTRE = {**CENTRE, "K_sway": 3.0, "K_roll": 0.73, "K_yaw": 20.0}

Job = tuple[Gains, float, np.random.SeedSequence, str]  # centre, spread, seed, solver


def jobs_of(problem: Problem, starts: int, seed: int, solver: str, start: Gains | None) -> list[Job]:
    """The starts: around the centre and around its mirror image in turn, as far as bounds allow both."""
    centre = start or Gains(**(SPLIT_CENTRE if problem.law.split else CENTRE))
    mirrored = centre.with_values(**{name: -getattr(centre, name) for name in MIRRORED if name in problem.free})
    sides = [side for side in (centre, mirrored) if in_bounds(problem, side, "K_yaw")] or [centre]
    jobs: list[Job] = []
    for k, child in enumerate(np.random.SeedSequence(seed).spawn(starts)):
        spread = 0.0 if start is not None and k == 0 else SPREADS[k // 2 % len(SPREADS)]
        jobs.append((sides[k % len(sides)], spread, child, solver))
    return jobs


def in_bounds(problem: Problem, gains: Gains, name: str) -> bool:
    """Whether a gain lies within its bounds, which choose a valley; a fixed one does."""
    low, high = problem.bounds.get(name, (-np.inf, np.inf))
    return low <= getattr(gains, name) <= high


def relaxed_starts(
    problem: Problem, jobs, workers: int, on_start, *, rough: bool = False
) -> tuple[list[Outcome], list[Start]]:
    """Every start with the sensitivity relaxed; an interrupt or a budget leaves those that ended, if any did.

    rough : as of `solve.relaxed`
    """
    found: dict[int, Outcome] = {}
    whole = current()
    few = whole.share(FEW_STARTS)  # by when one start must have ended
    enough = whole.share(ALL_STARTS)
    until = {"until": lambda: enough if found else few, "work": "the starts of a design"}
    try:
        for number, outcome in ends(
            jobs, _rough_starter if rough else _starter, bare(problem), workers=workers, **until
        ):
            found[number] = outcome
            if on_start:
                on_start(_entry(number, outcome))
    except CUT_SHORT:
        if not found:
            raise
    order = sorted(found)
    return [found[k] for k in order], [_entry(k, found[k]) for k in order]


def time_after(all_ended: bool) -> Deadline:
    """What is left after the starts: the budget's rest, or a moment where an interrupt cut them short."""
    return current() if all_ended or current() is not NEVER else Deadline.after(WIND_UP)


def _starter(problem: Problem, rough: bool = False) -> Callable[[Job], Outcome]:
    """What runs one start after another of a problem."""
    programme = Programme(problem, back_off=BACK_OFFS[0])

    def run(job: Job) -> Outcome:
        return relaxed(programme, begin(programme, job), solver=job[3], rough=rough)

    return run


def _rough_starter(problem: Problem) -> Callable[[Job], Outcome]:
    return _starter(problem, rough=True)


def begin(programme: Programme, job: Job) -> np.ndarray:
    """Where a start begins: a stable point around its centre."""
    centre, spread, seed, _ = job
    return stable_start(programme, programme.x(centre), np.random.default_rng(seed), spread)


def bare(problem: Problem) -> Problem:
    """The problem without what a start does not need, so that it travels to another process."""
    return replace(problem, models=problem.vehicle_models.alone(), variation=None, plan=None)


def _entry(number: int, o: Outcome) -> Start:
    return Start(number=number, cost=cost(o), violation=o.violation, evaluations=o.evaluations, message=o.message)


def distinct(outcomes: list[Outcome], same: float = SAME_COST) -> list[Outcome]:
    """Nearly feasible outcomes by cost, then the others by violation; of those that cost the same, the first."""

    def rank(o: Outcome) -> tuple[bool, float]:
        near = o.violation <= NEARLY
        return not near, cost(o) if near else o.violation

    out: list[Outcome] = []
    for o in sorted(outcomes, key=rank):
        if not any(abs(cost(o) / cost(other) - 1) < same for other in out):
            out.append(o)
    return out
