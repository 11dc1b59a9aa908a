"""What is asked of a problem or a design by name, whether it flies or not.

problem or design --analyse--> poles, verdicts, margins; a vehicle's ride too
                  --margins--> every break point of every loop   --simulate--> histories after steps
                  --robust---> parameters for a box of models        --trade_off--> cost over one limit
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

from workbench.analysis.full import FullAnalysis, full_analysis
from workbench.control import Gains
from workbench.design.design import method_of
from workbench.design.loop_margins import LoopMargins
from workbench.design.nonsmooth import SECONDS
from workbench.design.plant_analysis import PlantAnalysis, plant_analysis
from workbench.design.plant_simulation import PlantSimulation, simulate_plant
from workbench.design.plant_tradeoff import PlantTradeOff, plant_trade_off
from workbench.design.problem import Problem
from workbench.design.record import Design, Start, checked_values, given, printed
from workbench.design.robust import RobustDesign, robust_design
from workbench.design.starts import FEW, STARTS
from workbench.design.tradeoff import TradeOff
from workbench.design.tradeoff import trade_off as vehicle_trade_off
from workbench.design.tuner.robust import tune_robust
from workbench.design.variation import STANDARD_BOX, Box, Variation
from workbench.errors import InputError
from workbench.result import Result, Row
from workbench.simulation.course import Course
from workbench.simulation.history import History
from workbench.simulation.load import Failure, Load
from workbench.simulation.response import INSTANTS, Step
from workbench.simulation.rig import Rig
from workbench.simulation.simulate import simulate as simulate_rig

Values = Gains | Mapping[str, float]


def analyse(given_one: Problem | Design, values: Values | None = None) -> FullAnalysis | PlantAnalysis:
    """What values of the parameters do; those of the design, else the approved ones, if left out.

    Raises InputError where there are none.
    """
    problem, chosen = _chosen(given_one, values)
    if not problem.flies:
        return plant_analysis(problem, chosen)
    gains = chosen if isinstance(chosen, Gains) else Gains.from_mapping(chosen)
    return full_analysis(problem.setting, gains, problem.name, sampled=problem.own_sampling)


def margins(given_one: Problem | Design, values: Values | None = None) -> LoopMargins:
    """Gain, phase, delay and disk margins of every break point, one at a time, and all commands or measurements at
    once; of the design's values, else the approved ones, if left out.
    """
    problem, chosen = _chosen(given_one, values)
    return given(problem, chosen).margins()


def simulate(
    given_one: Problem | Design | Rig, duration: float | None = None, *, values: Values | None = None,
    steps: Mapping[str, float | Step | Sequence[Step]] | None = None, outputs: Sequence[str] | None = None,
    sample_time: float | None = None, computing_delay: float = 0.0, instants: int = INSTANTS,
    course: Course | None = None, loads: Sequence[Load] = (), failure: Failure | None = None, seed: int | None = None,
    keep_every: int = 1,
) -> PlantSimulation | History:  # fmt: skip
    """What happens over time: loops of a plant of one's own after steps, or a nonlinear vehicle on its way.

    Parameters
    ----------
    given_one : a problem or design of a plant of one's own; or a rig, `simulation.Rig` of a vehicle
    duration : [s]; of a plant until it has come to rest if left out
    values, steps, outputs, sample_time, computing_delay, instants : of a plant, as of `simulate_plant`
    course, loads, failure, seed, keep_every : of a rig, as of `simulation.simulate`
    """
    if isinstance(given_one, Rig):
        if duration is None or steps is not None or outputs is not None or values is not None:
            raise InputError("a rig takes a duration, and course, loads and failure in place of steps and outputs.")
        return simulate_rig(
            given_one, duration, course=course, loads=loads, failure=failure, seed=seed, keep_every=keep_every
        )
    if course is not None or loads or failure is not None or seed is not None or keep_every != 1:
        raise InputError("course, loads, failure, seed and keep_every are of a vehicle's rig. Give steps instead.")
    problem, chosen = _chosen(given_one, values)
    if problem.flies:
        raise InputError(
            f"problem {problem.name!r} flies; wb.fly(problem, hours=1) flies it over drawn guideways; one history is "
            "simulated by a rig: workbench.simulation.Rig(…), then wb.simulate(rig, duration)."
        )
    return simulate_plant(
        problem, checked_values(chosen), steps=steps, outputs=outputs,
        duration=duration, sample_time=sample_time, computing_delay=computing_delay, instants=instants,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True, repr=False)
class RobustPlant(Result):
    """Parameters for the worst models of a box, as far as a search finds them.

    design : judged on every model visited, each verdict naming the worst;  nominal : on the problem's own model
    visited : label of a model to the values it is made of;  settled : whether the last search found nothing worse
    """

    design: Design
    nominal: Design
    visited: Mapping[str, Mapping[str, float]]
    settled: bool
    rounds: int
    seconds: float

    def rows(self) -> list[Row]:
        return [("models designed for", len(self.visited), ""), ("settled", self.settled, ""), *self.design.rows()]


def robust(
    problem: Problem, box: Mapping[str, tuple[float, float]] | Variation | None = None, *, starts: int | None = None,
    seed: int | None = None, method: str | None = None, start: Values | None = None, workers: int = 1,
    on_start: Callable[[Start], None] | None = None, on_round: Callable[[int, str], None] | None = None,
    seconds: float | None = None,
) -> RobustDesign | RobustPlant:  # fmt: skip
    """Parameters that keep the goals at every model of a box, wherever a search looked.

    Parameters
    ----------
    box : name to (low, high) of what the models are made of; of a vehicle also a `Variation`, and the problem's own or
        the standard box if left out
    starts, seed, method, start, workers, on_start : as of `design`
    on_round : of a vehicle, called after each round with its number and what the search said
    seconds : of the search

    Raises
    ------
    InfeasibleError
        If a hard goal is kept by no parameters everywhere: names it, the model and the value.
    InputError
        If there is nothing to vary.
    """
    how, effort = method_of(problem, method), problem.effort.said(starts, seed)
    seed = effort.seed
    if problem.flies:
        named = Variation(box=Box(dict(box))) if isinstance(box, Mapping) else box
        gains = start if start is None or isinstance(start, Gains) else Gains.from_mapping(start)
        return robust_design(
            problem, named or problem.variation or Variation(box=STANDARD_BOX), starts=effort.starts or STARTS,
            seed=seed, solver=how, workers=workers, start=gains, on_start=on_start, on_round=on_round,
            time_budget=900.0 if seconds is None else seconds,
        )  # fmt: skip
    if not isinstance(box, Mapping) or len(problem.systems) != 1:
        raise InputError("a robust design needs one model and a box, name to (low, high), of what it is made of.")
    begun, structure = perf_counter(), problem.structure
    if start is not None:
        structure = structure.with_values(dict(start) if isinstance(start, Mapping) else start.as_dict())
    found = tune_robust(
        lambda values: problem.models.at(values).systems[0], box, structure, problem.goals, starts=effort.starts or FEW,
        seed=seed, workers=workers, budget_seconds=2 * SECONDS if seconds is None else seconds,
    )  # fmt: skip
    visited = {v.label: v.parameters for v in found.visited}
    models = [replace(problem.models.at(v).systems[0], name=label) for label, v in visited.items()]
    whole = problem.with_models(models)
    design = printed(whole, found.tuning.values, starts=(), binding=(), seed=seed, solver=how)
    return RobustPlant(
        design=design, nominal=given(problem, design.values, seed=seed, solver=how), visited=visited,
        settled=found.settled, rounds=found.rounds, seconds=perf_counter() - begun,
    )  # fmt: skip


def trade_off(
    given_one: Problem | Design, quantity: str, limits: Sequence[float], *, starts: int | None = None,
    seed: int | None = None, workers: int = 1, on_limit: Callable[[float, float | None], None] | None = None,
    seconds: float | None = None,
) -> TradeOff | PlantTradeOff:  # fmt: skip
    """The best cost for each limit of one goal, the others as they are, from the design's values where one is given.

    Parameters
    ----------
    quantity : name of the goal, which is hard while it is swept
    limits : in the unit of the goal's verdict, in any order; of goals without a unit, in multiples of what they ask
    starts, seed, workers : as of `design`;  seconds : of each search, for a plant of one's own
    on_limit : called with each limit and the cost found there
    """
    problem = given_one.problem if isinstance(given_one, Design) else given_one
    if problem.flies:
        effort = problem.effort.said(starts, seed)
        start = given_one.gains if isinstance(given_one, Design) else None
        return vehicle_trade_off(
            problem, quantity, limits, start=start, starts=effort.starts or STARTS, seed=effort.seed, workers=workers,
            on_limit=on_limit,
        )  # fmt: skip
    start = dict(given_one.values) if isinstance(given_one, Design) else None
    return plant_trade_off(
        problem, quantity, limits, start=start, starts=starts, seed=seed, workers=workers, seconds=seconds,
        on_limit=on_limit,
    )  # fmt: skip


def _chosen(given_one: Problem | Design, values: Values | None) -> tuple[Problem, Values]:
    """The problem, and the values that are meant."""
    if isinstance(given_one, Design):
        return given_one.problem, given_one.values if values is None else checked_values(values)
    if not isinstance(given_one, Problem):
        raise InputError(
            f"this takes a problem or a design; got a {type(given_one).__name__}. wb.load(name) makes one."
        )
    chosen = given_one.approved if values is None else values
    if chosen is None and given_one.flies:
        raise InputError(f"problem {given_one.name!r} has no approved gains; give some, or design it first.")
    return given_one, {} if chosen is None else chosen
