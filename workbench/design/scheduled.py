"""Gain schedules: gains and time constants as polynomials of the speed, tuned at points and checked between them.

    cruise design --constant gains--> polynomials tuned at a few speeds --round as printed--> dense check of margins
                  ^---- speeds where the check fails are added, until it holds at every one ----'

At cruise every requirement of the problem holds and J is made small; at the other speeds the margins that the plan asks
for hold. The dense check is exact (eigenvalues, Hamiltonian peaks); its plants are interpolated between exact ones,
with the error measured, and the worst speeds are checked again on exact plants.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from time import monotonic

import numpy as np

from workbench.control import GAIN_NAMES
from workbench.control.schedule import Schedule
from workbench.design.design import Design, Start, design
from workbench.design.family import Family, PolynomialChart
from workbench.design.plan import Plan
from workbench.design.problem import Problem
from workbench.design.record import given
from workbench.design.refusal import in_words
from workbench.design.solve import finish
from workbench.design.speed_family import PlantFamily, plant_family
from workbench.design.steering import Programme
from workbench.design.variation import Variant
from workbench.design.verdict import margin_verdicts
from workbench.errors import InfeasibleError, InputError
from workbench.goals.verdict import Verdict
from workbench.machine.budget import current, heed, keeping
from workbench.machine.threads import one_thread
from workbench.result import Result, Row
from workbench.solve.exchange import Found, exchange
from workbench.solve.smooth import Outcome

BACK_OFF = 5e-3  # relative distance kept from every limit while tuning: a smooth curve passes between its points
ROUNDS = 8  # of exchange; each adds the worst speed of every stretch that fails
CRUISE_SHARE = 0.5  # of a budget, for the design at the problem's own speed
FIRST_LOOK = 4  # every fourth speed of the dense check; all of them once these hold
# Share of the way from cruise to every speed, and multiples of the allowed peak sensitivity solved in turn there:
# constant gains are unstable at the far end, and a solver that starts there need not come back.
GROWTH = ((0.3, (1.2, 1.0)), (0.6, (1.0,)), (0.8, (1.0,)))


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MarginCurve(Result):
    """One margin over the speeds of the dense check.

    name, sense, limit, unit : as of the requirement;  value : (k,), NaN where the loop is unstable
    """

    name: str
    sense: str
    limit: float
    unit: str
    speed: np.ndarray
    value: np.ndarray

    @property
    def worst(self) -> tuple[float, float]:
        """Worst value and its speed [m/s]."""
        order = np.where(np.isnan(self.value), np.inf if self.sense == "<=" else -np.inf, self.value)
        k = int(np.argmax(order) if self.sense == "<=" else np.argmin(order))
        return float(self.value[k]), float(self.speed[k])

    @property
    def met(self) -> bool:
        """Whether the limit holds at every speed."""
        value = self.value
        return bool(np.all(value <= self.limit) if self.sense == "<=" else np.all(value >= self.limit))

    def rows(self) -> list[Row]:
        value, speed = self.worst
        return [(f"{self.name} {self.sense} {self.limit:g}", value, self.unit), ("at", speed, "m/s")]


@dataclass(frozen=True, kw_only=True, repr=False)
class ScheduledDesign(Result):
    """A schedule that keeps its margins at every speed checked, with the evidence.

    schedule : printed decimals;  cruise : gains, analysis and verdicts at the problem's own speed
    margins : one curve per margin;  rounds : of exchange;  plant_error : of the interpolated plants
    exact : the worst speeds on exact plants: verdicts by speed
    single_cost : J of the best gains found for cruise alone
    """

    problem: Problem
    schedule: Schedule
    cruise: Design
    margins: tuple[MarginCurve, ...]
    exact: tuple[tuple[float, tuple[Verdict, ...]], ...]
    rounds: int
    plant_error: float
    single_cost: float | None
    seconds: float

    def to_dict(self):
        """The cruise design's figures with schedule and margins over the speeds."""
        document = self.cruise.to_dict()
        document["schedule"] = self.schedule.to_dict()
        document["margins_over_speed"] = [
            {**m.to_dict(), "worst": m.worst[0], "worst_speed_m_s": m.worst[1], "met": m.met} for m in self.margins
        ]
        document["plant_interpolation_error"] = self.plant_error
        document["exchange_rounds"] = self.rounds
        document["cost_of_the_best_cruise_gains"] = self.single_cost
        return document

    def rows(self) -> list[Row]:
        return [
            *self.schedule.rows()[:3],
            ("cost J at cruise", self.cruise.flown.cost, ""),
            ("cost J of the best gains for cruise alone", self.single_cost, ""),
            ("rounds of exchange", self.rounds, ""),
            ("error of the interpolated plants", self.plant_error, "1"),
            *(row for m in self.margins for row in m.rows()),
        ]


def schedule_design(
    problem: Problem, plan: Plan | None = None, *, starts: int = 16, seed: int = 0, solver: str = "slsqp",
    workers: int = 1, cruise: Design | None = None, plants: PlantFamily | None = None,
    on_start: Callable[[Start], None] | None = None, on_round: Callable[[int, str], None] | None = None,
    time_budget: float = 600.0,
) -> ScheduledDesign:  # fmt: skip
    """A schedule that meets a problem's requirements at its own speed and the plan's margins at every speed.

    Parameters
    ----------
    plan : the problem's own if left out
    cruise : a design for the problem's own speed to start from; designed from `starts` random ones if left out
    plants : plants at the speeds of the plan, from an earlier `plant_family`; sampled anew if left out
    on_round : called after each round of exchange with its number and what the check said
    time_budget : [s] after which no new round starts

    Raises
    ------
    InfeasibleError
        If no schedule of this degree was found: names the worst margin and its speed.
    InputError
        If there is no plan, the problem's speed lies outside it, or the vehicle does not fly at the lowest speed.
    """
    plan = plan or problem.plan
    if plan is None:
        raise InputError(f"problem {problem.name!r} has no schedule to design; describe one under [schedule].")
    own = problem.setting.speed
    if not plan.range[0] <= own <= plan.range[1]:
        raise InputError(f"the schedule must cover the problem's own speed of {own:g} m/s; got {plan.range} m/s.")
    began = monotonic()
    if plants is None:
        with one_thread():
            plants = plant_family(problem, plan.range)
    with keeping(current().share(CRUISE_SHARE)):
        first = cruise or design(problem, starts=starts, seed=seed, method=solver, workers=workers, on_start=on_start)
    with one_thread():
        return _exchanged(problem, plan, plants, first, on_round, began, time_budget)


def _grown(problem, plan: Plan, plants: PlantFamily, chart: PolynomialChart, x: np.ndarray) -> np.ndarray:
    """A start for the whole range, from speeds near the first one that move away from it in steps."""
    own, *others = chart.speeds
    for share, factors in GROWTH:
        near = [own + share * (v - own) for v in others]
        x = finish(_family(problem, plan, plants, replace(chart, speeds=(own, *near))), x, factors)[0].x
    return x


def _family(problem, plan: Plan, plants: PlantFamily, chart: PolynomialChart) -> Family[PolynomialChart]:
    """The problem at its own speed, the first of the chart's, and the plan's margins at the others."""
    models = [_model(plants, plan, v) for v in chart.speeds[1:]]
    return Family.of(Programme(problem, back_off=BACK_OFF), models, chart, back_off=BACK_OFF)


@dataclass(frozen=True, slots=True)
class _Checked:
    """A schedule and what was seen of it: margins over the speeds, the design at cruise, where parameters are out."""

    schedule: Schedule
    margins: tuple[MarginCurve, ...]
    cruise: Design
    outside: dict[str, float]

    @classmethod
    def of(cls, problem, plan: Plan, plants: PlantFamily, first: Design, chart: PolynomialChart, outcome: Outcome):
        """By the exact measures: a first look, and every speed once that holds."""
        own, *others = chart.speeds
        schedule = Schedule(
            centre=chart.centre, scale=chart.scale, range=plan.range, coefficients=chart.coefficients(outcome.x),
            points=(*others, own),
        )  # fmt: skip
        margins = dense_check(plants, schedule, plan, every=FIRST_LOOK)
        if not _failing(margins):
            margins = dense_check(plants, schedule, plan)
        cruise = _at_cruise(problem, schedule, first, outcome)
        return cls(schedule, margins, cruise, _outside(problem, schedule, plan))

    @property
    def missed(self) -> list[Verdict]:
        """Requirements not met at cruise."""
        return [v for v in self.cruise.requirements if not v.met]

    @property
    def failing(self) -> list[float]:
        """Speeds at which something does not hold."""
        return sorted({*_failing(self.margins), *self.outside.values()})


_Answer = tuple[Outcome, Family[PolynomialChart], _Checked]


def _exchanged(problem, plan: Plan, plants: PlantFamily, first: Design, on_round, began, budget) -> ScheduledDesign:
    """Rounds of tuning and dense check until the check holds."""
    low, high = plan.range
    own = problem.setting.speed
    speeds = [v for v in np.linspace(low, high, plan.points).tolist() if abs(v - own) > 1e-6 * own]
    chart = PolynomialChart(problem, (own, *speeds), (low + high) / 2, (high - low) / 2, plan.degree)
    start = _grown(problem, plan, plants, chart, chart.x(first.gains))

    def solve(held: Family[PolynomialChart], last: _Answer | None) -> _Answer:
        outcome, held = finish(held, start if last is None else last[0].x, (1.0,))
        return outcome, held, _Checked.of(problem, plan, plants, first, held.chart, outcome)

    def search(held: Family[PolynomialChart], answer: _Answer) -> Found[float]:
        seen = answer[2]
        fresh = tuple(v for v in seen.failing if min(abs(v - s) for s in held.chart.speeds) > 1e-6)
        return Found(not seen.failing and not seen.missed, fresh, _words(seen.margins))

    def add(_: Family[PolynomialChart], answer: _Answer, fresh: tuple[float, ...]) -> Family[PolynomialChart]:
        held = answer[1]
        return held.with_models([_model(plants, plan, v) for v in fresh], held.chart.with_speeds(fresh))

    done = exchange(
        _family(problem, plan, plants, chart), solve, search, add, rounds=ROUNDS,
        expired=lambda: monotonic() - began > budget,
        on_round=on_round and (lambda one: on_round(one.number, one.words)),
    )  # fmt: skip
    seen = done.answer[2]
    if not done.settled:
        raise _unmet(problem, plan, seen.margins, seen.missed, seen.outside)
    rounds = len(done.rounds)
    return _verified(problem, plan, seen.schedule, seen.cruise, seen.margins, rounds, plants, first, began)


def _model(plants: PlantFamily, plan: Plan, speed: float) -> Variant:
    one = plants.problem_at(speed).with_requirements(plan.requirements)
    return Variant(name=f"{speed:.4g} m/s", values={"speed_m_s": speed}, problem=one)


def dense_check(plants: PlantFamily, schedule: Schedule, plan: Plan, *, every: int = 1) -> tuple[MarginCurve, ...]:
    """The plan's margins at the speeds of its dense check (every n-th), by exact algorithms on interpolated plants."""
    speeds = plan.speeds[::every]
    values = np.full((len(plan.requirements), len(speeds)), np.nan)
    for k, speed in enumerate(speeds):
        heed("the check of a schedule")
        one = plants.problem_at(float(speed)).with_requirements(plan.requirements)
        for i, v in enumerate(margin_verdicts(one, schedule.gains_at(float(speed)))):
            values[i, k] = np.nan if v.value is None else v.value
    return tuple(
        MarginCurve(name=r.name, sense=r.sense, limit=r.limit, unit=r.unit, speed=speeds, value=values[i])
        for i, r in enumerate(plan.requirements)
    )


def _failing(margins: Sequence[MarginCurve]) -> list[float]:
    """The worst speed of every stretch of speeds at which a margin fails."""
    out: list[float] = []
    for m in margins:
        miss = (m.value / m.limit - 1) * (1 if m.sense == "<=" else -1)
        miss = np.where(np.isnan(miss), np.inf, miss)
        bad = np.flatnonzero(miss > 0)
        for stretch in np.split(bad, np.flatnonzero(np.diff(bad) > 1) + 1) if len(bad) else []:
            out.append(float(m.speed[stretch[np.argmax(miss[stretch])]]))
    return sorted(set(out))


def _outside(problem: Problem, schedule: Schedule, plan: Plan) -> dict[str, float]:
    """The speed at which a parameter leaves its bounds by most, of each that does."""
    speeds = plan.speeds
    table = dict(zip(GAIN_NAMES, schedule.table(speeds).T, strict=True))
    over = {n: np.maximum(low - table[n], table[n] - high) for n, (low, high) in problem.bounds.items()}
    return {name: float(speeds[np.argmax(by)]) for name, by in over.items() if by.max() > 0}


def _at_cruise(problem: Problem, schedule: Schedule, first: Design, outcome: Outcome) -> Design:
    """The schedule's gains at the problem's own speed, judged by the exact measures."""
    gains = schedule.gains_at(problem.setting.speed)
    binding = [n for n in outcome.binding if "bound of" not in n]
    return given(problem, gains, starts=first.starts, binding=binding, seed=first.seed, solver=first.solver)


def _verified(problem, plan: Plan, schedule, judged: Design, margins, rounds, plants, first, began) -> ScheduledDesign:
    """The result, its worst speeds checked on exact plants."""
    exact = []
    for speed in sorted({m.worst[1] for m in margins}):
        one = problem.at({"speed_m_s": speed}).with_requirements(plan.requirements)
        exact.append((speed, margin_verdicts(one, schedule.gains_at(speed))))
    missed = [v for _, found in exact for v in found if not v.met]
    if missed:
        raise InfeasibleError(
            f"the schedule of {problem.name!r} fails on exact plants where it held on interpolated ones: "
            f"{in_words(missed)}. Sample the speeds at more nodes."
        )
    return ScheduledDesign(
        problem=problem, schedule=schedule, cruise=judged, margins=margins, exact=tuple(exact), rounds=rounds,
        plant_error=plants.error, single_cost=first.analysis.cost, seconds=monotonic() - began,
    )  # fmt: skip


def _words(margins: Sequence[MarginCurve]) -> str:
    return ", ".join(f"{m.name} {_value(m)} at {m.worst[1]:.4g} m/s" for m in margins)


def _value(m: MarginCurve) -> str:
    return "without value (unstable loop)" if np.isnan(m.worst[0]) else f"{m.worst[0]:.4g}"


def _unmet(problem: Problem, plan: Plan, margins, missed: Sequence[Verdict], outside) -> InfeasibleError:
    """What binds: margins and where, requirements at cruise, parameters at their bounds."""
    found = [
        Verdict(
            name=m.name, sense=m.sense, limit=m.limit, value=None if np.isnan(m.worst[0]) else m.worst[0], unit=m.unit,
            met=False, where=f"{m.worst[1]:.4g} m/s" + (", unstable loop" if np.isnan(m.worst[0]) else ""),
        )
        for m in margins
        if not m.met
    ]  # fmt: skip
    words = [in_words(found), in_words(missed, "cruise")]
    words += [f"{name} leaves its bounds of {problem.bounds[name]} at {v:.4g} m/s" for name, v in outside.items()]
    return InfeasibleError(
        f"no schedule of degree {plan.degree} over {plan.range[0]:g} … {plan.range[1]:g} m/s keeps the limits of "
        f"{problem.name!r}: {'; '.join(filter(None, words))}. Raise the degree, narrow the range or relax a limit."
    )
