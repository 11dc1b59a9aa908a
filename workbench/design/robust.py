"""Gains for many models at once: the worst ones are searched, added and designed for, until none fails.

    nominal valleys --> gains that hold at every model so far --round--> search: vertices, seeded local search (exact)
                          ^---------- the worst model of each requirement that fails is added ----------'

The nominal vehicle keeps every requirement of the problem; every model keeps what the variation asks for. A search is
not a proof: `verify` proves boxes. What it found worst is told, model by model.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from time import monotonic

import numpy as np

from workbench.analysis.analysis import analyse
from workbench.control import Gains
from workbench.design.brought import ITERATIONS, LAST
from workbench.design.design import Design, Start, design, finished, given, rounded
from workbench.design.effort import check_starts
from workbench.design.family import Family, SharedChart
from workbench.design.problem import Problem
from workbench.design.refusal import in_words, miss, unstable
from workbench.design.solve import cost, finish
from workbench.design.starts import (
    BACK_OFFS,
    CUT_SHORT,
    FINISHED,
    distinct,
    jobs_of,
    relaxed_starts,
    time_after,
)
from workbench.design.steering import Programme
from workbench.design.variation import Variant, Variation, sentence
from workbench.design.verdict import verdicts
from workbench.design.worst import Search, Worst, judged_model, same_model
from workbench.design.worst import in_words as worst_in_words
from workbench.errors import InfeasibleError, InputError
from workbench.goals.verdict import Verdict
from workbench.machine.budget import keeping
from workbench.machine.threads import one_thread
from workbench.result import Result, Row, figure
from workbench.solve.exchange import Found, exchange
from workbench.solve.smooth import Options, Outcome, least_violation, minimise

BACK_OFF = BACK_OFFS[1]  # relative distance kept from every limit: what a model between two of the set may exceed
ROUNDS = 12
NOMINAL_SHARE = 0.3  # of a budget's rest, for what the nominal vehicle alone would cost
HOMOTOPY = (1.5, 1.2, 1.0)


@dataclass(frozen=True, kw_only=True, repr=False)
class RobustDesign(Result):
    """Gains that keep their margins at every model that was found, with the evidence.

    design : of the nominal vehicle;  worst : worst model of each requirement, over everything looked at
    visited : models in the set that the gains were tuned for;  looked_at : models evaluated by the last search
    rounds : of exchange;  nominal_cost : J of the best gains for the nominal vehicle alone
    """

    problem: Problem
    variation: Variation
    design: Design
    worst: tuple[Worst, ...]
    visited: tuple[Mapping[str, float], ...]
    looked_at: int
    rounds: int
    nominal_cost: float | None
    seconds: float

    def to_dict(self):
        """The nominal design's figures, with models and worst cases."""
        document = self.design.to_dict()
        document["models"] = [dict(v) for v in self.visited]
        document["worst_models"] = [{**w.verdict.to_dict(), "model": dict(w.values)} for w in self.worst]
        document["models_looked_at"] = self.looked_at
        document["exchange_rounds"] = self.rounds
        document["cost_of_the_best_nominal_gains"] = self.nominal_cost
        return document

    def rows(self) -> list[Row]:
        return [
            ("cost J", self.design.flown.cost, ""),
            ("cost J of the best nominal gains", self.nominal_cost, ""),
            ("models designed for", len(self.visited), ""),
            ("models looked at", self.looked_at, ""),
            *(row for w in self.worst for row in w.rows()),
        ]


def robust_design(
    problem: Problem, variation: Variation | None = None, *, starts: int = 16, seed: int = 0, solver: str = "slsqp",
    workers: int = 1, start: Gains | None = None, on_start: Callable[[Start], None] | None = None,
    on_round: Callable[[int, str], None] | None = None, time_budget: float = 900.0,
) -> RobustDesign:  # fmt: skip
    """Gains that meet a problem's requirements and keep what a variation asks for, wherever it was looked.

    Parameters
    ----------
    variation : the problem's own if left out
    start : gains to start from instead of `starts` random ones; never refused, nor worsened, where they keep everything
    on_round : called after each round with its number and what the search said
    time_budget : [s] after which no new round starts

    Raises
    ------
    InfeasibleError
        If no gains keep everything: names the worst requirement and its model.
    InputError
        If there is nothing to vary, or the problem cannot be designed.
    """
    variation = variation or problem.variation
    if variation is None:
        raise InputError(f"problem {problem.name!r} names no variation; give one, or describe it under [variation].")
    if start is None:
        check_starts(starts)
    began = monotonic()
    with one_thread():
        programme = Programme(problem, back_off=BACK_OFF)
        search = Search(problem, variation, seed)
        beside = any(r.beside for r in problem.requirements)
        if start is None and beside:
            first = design(problem, starts=starts, seed=seed, method=solver, workers=workers, on_start=on_start)
            near = [] if problem.gains is None else [programme.x(problem.gains)]
            candidates, log, nominal = [*near, programme.start(first.gains)], first.starts, first.flown.cost
            all_ended = len(log) == starts
        elif start is None:
            outcomes, log = relaxed_starts(problem, jobs_of(problem, starts, seed, solver, None), workers, on_start)
            candidates = [o.x for o in distinct(outcomes)[:FINISHED]]
            all_ended = len(log) == starts
            with keeping(time_after(all_ended).share(NOMINAL_SHARE)):
                nominal = _nominal_cost(problem, candidates, log, seed, solver)
        else:
            candidates, log, nominal, all_ended = [programme.start(start)], (), None, True
        family = Family.of(
            programme, (), SharedChart(programme, (np.ones(17),)), cost=variation.cost, back_off=BACK_OFF
        )
        family = _with(family, [search.model(values, name) for name, values in variation.models.items()])
        tuner = _Tuner(family, search, on_round, began + time_budget)
        best = tuner.as_it_is(candidates[0]) if beside or start is not None else None
        try:
            with keeping(time_after(all_ended)):
                for x in candidates:
                    best = tuner.improved(x, best)
        except CUT_SHORT:
            if best is None:
                raise
        if best is None:
            raise tuner.refusal()
        gains, outcome, worst = best
        return RobustDesign(
            problem=problem, variation=variation, design=_judged(problem, gains, outcome, log, seed, solver),
            worst=worst, visited=tuple(m.model.values for m in tuner.family.members[1:]), looked_at=search.looked_at,
            rounds=tuner.rounds, nominal_cost=nominal, seconds=monotonic() - began,
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Searched:
    """Gains and the worst models found for them: those that fail, and what the nominal vehicle misses."""

    gains: Gains
    worst: tuple[Worst, ...]
    own: tuple[Verdict, ...]

    @property
    def failing(self) -> list[Worst]:
        """The worst models that fail."""
        return [w for w in self.worst if not w.verdict.met]


_Best = tuple[Gains, Outcome, tuple[Worst, ...]]
_Held = Family[SharedChart]


class _Tuner:
    """Tunes, searches, adds; what one candidate added is held for the next."""

    def __init__(self, family: _Held, search: Search, on_round, deadline: float) -> None:
        self.family, self.search = family, search
        self._on_round, self._deadline = on_round, deadline
        self.rounds = 0
        self._late = False
        self._closest: tuple[float, Verdict, Mapping[str, float], tuple[Worst, ...]] | None = None
        self._unstable: tuple[float, Verdict] | None = None

    def as_it_is(self, x: np.ndarray) -> _Best | None:
        """A candidate's own gains, if they hold everywhere; None if not."""
        z = self.family.whole(x)
        seen = self._searched(rounded(self.family.gains(z)))
        if seen.failing or seen.own:
            return None
        objective = self.family.at(z).objective
        return seen.gains, Outcome(z, objective, 0.0, (), "as given", 0, {}, float("nan")), seen.worst

    def improved(self, x: np.ndarray, best: _Best | None) -> _Best | None:
        """The better of `best` and what this candidate leads to."""
        if self._over():
            return best

        def solve(held: _Held, last: Outcome | None) -> Outcome:
            z, factors = (x, HOMOTOPY) if last is None else (held.chart_of(last.x), (1.0,))
            outcome, self.family = self._finished(held, held.whole(z), factors)
            dearer = best is not None and (not outcome.feasible or cost(outcome) > cost(best[1]))
            return outcome if dearer or outcome.feasible else self._repaired(outcome)

        found: list[_Searched] = []
        done = exchange(
            self.family, solve, lambda _, outcome: self._judged(outcome, best, found),
            lambda _held, _answer, added: self._with(added), rounds=ROUNDS, expired=self._over,
        )  # fmt: skip
        return (found[-1].gains, done.answer, found[-1].worst) if done.settled else best

    def _finished(self, held: _Held, z: np.ndarray, factors: Sequence[float]) -> tuple[Outcome, _Held]:
        """A solution at the limits; with goals of other loops in linear steps first (`design.brought`)."""
        if not any(r.beside for r in self.search.problem.requirements):
            return finish(held, z, factors)
        return finish(held, minimise(held, z, Options("slp", iterations=ITERATIONS)).x, (1.0,), options=LAST)

    def _over(self) -> bool:
        self._late = bool(self.rounds) and monotonic() > self._deadline
        return self._late

    def _judged(self, outcome: Outcome, best: _Best | None, found: list[_Searched]) -> Found[Mapping[str, float]]:
        """What is to be added to what was tuned for: the worst models that fail and are not among it."""
        family = self.family
        if best is not None and (not outcome.feasible or cost(outcome) > cost(best[1])):
            return Found(False, stop="not better than what is at hand")
        if family.growth(outcome.x) >= 0:
            self._grown(outcome.x)
            return Found(False, stop="a loop is unstable")
        seen = self._searched(rounded(family.gains(outcome.x)))
        found.append(seen)
        if not seen.failing and not seen.own:
            return Found(True)
        if not outcome.feasible:
            return Found(False, stop="more models ask for more")
        fresh: list[Mapping[str, float]] = []
        for values in (w.values for w in seen.failing):
            known = [*(m.model.values for m in family.members), *fresh]
            fresh += [] if any(same_model(values, other) for other in known) else [values]
        return Found(False, tuple(fresh))

    def _with(self, added: tuple[Mapping[str, float], ...]) -> _Held:
        """The family with more models; with more distance from every limit where no model is new."""
        if added:
            return _with(self.family, [self.search.model(values) for values in added])
        return self.family.with_back_off(3 * self.family.back_off)

    def _repaired(self, outcome: Outcome) -> Outcome:
        """A minimum from the point that violates least, where that one is feasible; else that point."""
        least = least_violation(self.family, outcome.x)
        if not least.feasible:
            return least
        again = minimise(self.family, least.x)
        return again if again.feasible else least

    def _searched(self, gains: Gains) -> _Searched:
        """The worst models, and what the nominal vehicle misses; what misses least is remembered."""
        self.rounds += 1
        own = tuple(v for v in _exact(self.search.problem, gains) if not v.met)
        seen = _Searched(gains, self.search.worst(gains), own)
        if self._on_round:
            self._on_round(self.rounds, worst_in_words(seen.worst))
        missed = [(w.verdict, w.values) for w in seen.failing] + [(v, {}) for v in own]
        if missed:
            verdict, values = max(missed, key=lambda m: miss(m[0]))
            if self._closest is None or miss(verdict) < self._closest[0]:
                self._closest = (miss(verdict), verdict, values, seen.worst)
        return seen

    def _grown(self, x: np.ndarray) -> None:
        """Remembers the model whose loop grows fastest, of the candidate whose fastest grows least."""
        growths = [m.programme.abscissa(self.family.theta(x, k)) for k, m in enumerate(self.family.members)]
        worst = int(np.argmax(growths))
        if self._unstable is None or growths[worst] < self._unstable[0]:
            name = self.family.members[worst].model.name
            self._unstable = (growths[worst], unstable(-growths[worst], name))

    def refusal(self) -> InfeasibleError:
        """What missed by least, where, and what the same gains reach."""
        name = self.search.problem.name
        if self._closest is None and self._unstable is not None:
            return InfeasibleError(
                f"no gains of {name!r} keep their limits at every model: {self._unstable[1].sentence()}. "
                "Narrow the intervals or relax a limit."
            )
        if self._closest is None:
            return InfeasibleError(f"the time budget ended before any gains of {name!r} were judged; give more time.")
        _, verdict, values, worst = self._closest
        reached = ", ".join(
            f"{w.verdict.name} {figure(w.verdict.value)} {w.verdict.unit}".removesuffix(" 1")
            for w in worst
            if w.verdict.value is not None
        )
        tried = "the time budget ended before" if self._late else "no"
        keep = "kept" if self._late else "keep"
        return InfeasibleError(
            f"{tried} gains of {name!r} {keep} their limits at every model: {in_words([verdict], sentence(values))}. "
            f"These gains reach everywhere: {reached}. "
            "Narrow the intervals or relax the limit for the models."
        )


def _with(family: _Held, models: Sequence[Variant]) -> _Held:
    chart = family.chart
    for model in models:
        chart = chart.with_model(model.scale)
    return family.with_models(models, chart)


def _exact(problem: Problem, gains: Gains) -> tuple[Verdict, ...]:
    return verdicts(problem, analyse(problem.setting, gains, problem.name))


def _nominal_cost(problem: Problem, candidates, log, seed: int, solver: str) -> float | None:
    """J of the best gains for the nominal vehicle alone; None if its requirements cannot be met."""
    programme = Programme(problem, back_off=BACK_OFFS[0])
    try:
        return finished(problem, programme, candidates, tuple(log), seed, solver).flown.cost
    except InfeasibleError:
        return None


def _judged(problem: Problem, gains: Gains, outcome: Outcome, log, seed: int, solver: str) -> Design:
    return given(problem, gains, starts=log, binding=outcome.binding, seed=seed, solver=solver)


__all__ = ["RobustDesign", "Search", "Worst", "judged_model", "robust_design"]
