"""The search for the worst models of a variation under given gains.

    box --vertices, points inside--> screened at once --the worst of each requirement--> climb --> exact verdicts

A search is not a proof: `verify` proves boxes. What it found worst is told, model by model.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.analysis import analyse
from workbench.control import Gains
from workbench.design.problem import Problem
from workbench.design.screening import Screening
from workbench.design.variation import SENSORS, Box, Variant, Variation, sentence, variant_of
from workbench.design.verdict import margin_verdicts, verdicts
from workbench.goals.ride.requirement import Requirement
from workbench.goals.verdict import Verdict
from workbench.machine.budget import heed
from workbench.result import Result, Row

STEPS = (0.5, 0.2, 0.05)  # of the local search, in the unit cube
MOVES = 6  # of a climb with one length of step
CLIMBS = 2  # per requirement, from the worst models of the first look
NEAR = 0.05  # relative slack below which a requirement's worst corner is searched around


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Worst(Result):
    """The worst model found for one requirement."""

    verdict: Verdict
    values: Mapping[str, float]

    def rows(self) -> list[Row]:
        v = self.verdict
        return [(f"{v.name} {v.sense} {v.limit:g}", v.value, v.unit), ("at", sentence(self.values), "")]


class Search:
    """Finds the worst models of a variation under given gains; remembers plants between searches."""

    def __init__(self, problem: Problem, variation: Variation, seed: int = 0) -> None:
        self.problem, self.variation = problem, variation
        self.asked = variation.asked(problem)
        self._seed, self._plants, self._readings = seed, {}, {}
        self._screening = Screening(problem.setting) if all(r.margin_alone for r in self.asked) else None
        self.looked_at = 0

    def model(self, values: Mapping[str, float], name: str = "") -> Variant:
        """A model, its plant built once."""
        plant = _plant_key(values)
        if plant not in self._plants:
            self._plants[plant] = variant_of(self.problem, dict(plant), self.asked).problem
        return Variant(name=name or sentence(values), values=dict(values), problem=self._plants[plant])

    def verdicts(self, values: Mapping[str, float], gains: Gains) -> tuple[Verdict, ...]:
        """Exact verdicts on one model."""
        heed("a search for the worst model")
        return judged_model(self.model(values), gains)

    def shortfalls(self, each: Sequence[Mapping[str, float]], gains: Gains) -> np.ndarray:
        """(models, requirements) relative misses: screened where margins alone are asked for, exact otherwise."""
        self.looked_at += len(each)
        if self._screening is None:
            judged = [self.verdicts(values, gains) for values in each]
            return np.array([[shortfall(r, v) for r, v in zip(self.asked, one, strict=True)] for one in judged])
        models = [self.model(values) for values in each]
        return self._screening.shortfalls(self.asked, models, [self._reading(m) for m in models], gains)

    def _reading(self, model: Variant):
        plant = _plant_key(model.values)
        if plant not in self._readings:
            self._readings[plant] = Screening.readings(model.problem.setting)
        return self._readings[plant]

    def worst(self, gains: Gains) -> tuple[Worst, ...]:
        """The worst model of each requirement: named models, vertices, and a climb from the worst of them.

        The climb goes by screened values; the exact measures judge the named models and the worst few of each kind.
        """
        found = list(self.variation.models.values())
        self.looked_at = len(found)
        box = self.variation.box
        if box is not None:
            generator = np.random.default_rng(self._seed)
            corners = box.corners(generator)
            units = np.vstack([corners, generator.uniform(size=(2 * len(box.names), len(box.names)))])
            misses = self.shortfalls([box.at(u) for u in units], gains)
            for i in range(len(self.asked)):
                order = np.argsort(-misses[:, i], kind="stable")[:CLIMBS]
                found.append(box.at(units[order[0]]))
                found += [
                    box.at(self._climbed(box, units[k], misses[k, i], i, gains))
                    for k in order
                    if -NEAR < misses[k, i] < np.inf
                ]
        judged = [(self.verdicts(values, gains), values) for values in _distinct(found)]
        worst = [max(judged, key=lambda f: shortfall(r, f[0][i])) for i, r in enumerate(self.asked)]
        return tuple(Worst(verdict=f[0][i], values=f[1]) for i, f in enumerate(worst))

    def _climbed(self, box: Box, unit: np.ndarray, miss: float, i: int, gains: Gains) -> np.ndarray:
        """Where a climb towards a larger miss ends: the best of all moves of one parameter, with shrinking steps."""
        for step in STEPS:
            for _ in range(MOVES):
                moves = np.vstack([unit + step * np.eye(len(unit)), unit - step * np.eye(len(unit))]).clip(0.0, 1.0)
                moves = moves[np.abs(moves - unit).max(axis=1) > 0]
                misses = self.shortfalls([box.at(u) for u in moves], gains)[:, i]
                best = int(np.argmax(misses))
                if misses[best] <= miss:
                    break
                unit, miss = moves[best], misses[best]
                if not np.isfinite(miss):
                    return unit
        return unit


def _plant_key(values: Mapping[str, float]) -> tuple[tuple[str, float], ...]:
    """What of a model's values makes its plant."""
    return tuple(sorted((k, round(v, 12)) for k, v in values.items() if k not in SENSORS))


def _distinct(each: Sequence[Mapping[str, float]]) -> list[Mapping[str, float]]:
    out: list[Mapping[str, float]] = []
    for values in each:
        if not any(same_model(values, other) for other in out):
            out.append(values)
    return out


def judged_model(model: Variant, gains: Gains) -> tuple[Verdict, ...]:
    """One exact verdict for each of the model's requirements, its sensors reading as they do."""
    own, problem = model.gains(gains), model.problem
    if all(r.margin_alone for r in problem.requirements):
        return margin_verdicts(problem, own)
    each = verdicts(problem, analyse(problem.setting, own, model.name))
    return tuple(
        max((v for v in each if v.name == r.name), key=lambda v: shortfall(r, v)) for r in problem.requirements
    )


def shortfall(requirement: Requirement, verdict: Verdict) -> float:
    """By which fraction of its limit a verdict misses; infinite without a value."""
    return float("inf") if verdict.value is None else requirement.shortfall(verdict.value)


def same_model(one: Mapping[str, float], other: Mapping[str, float]) -> bool:
    """Whether two models have the same values."""
    return one.keys() == other.keys() and all(abs(one[k] - other[k]) < 1e-9 for k in one)


def in_words(worst: Sequence[Worst]) -> str:
    """What a search found, on one line."""
    parts = []
    for w in worst:
        value = "unstable" if w.verdict.value is None else f"{w.verdict.value:.4g}"
        parts.append(f"{w.verdict.name} {value} at {sentence(w.values)}")
    return "; ".join(parts)
