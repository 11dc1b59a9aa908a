"""What every limit costs: the multipliers of a vehicle's programme at given gains, in units of its cost J.

    programme, gains --rows at their limits--> multipliers of log J --the same rows, limits stricter--> dJ by each limit

To first order: where many limits meet, another set of them binds after a small step, and the step gains less.
Source: the conditions of Karush, Kuhn and Tucker at the optimum (`solve.smooth.stationarity`); the envelope theorem.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.control import Gains
from workbench.design.steering import Programme
from workbench.goals.goal import Rows
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.requirement import Requirement
from workbench.result import Result, Row
from workbench.solve.smooth import Point, stationarity

STEP = 1e-3  # of a limit, by which it is made stricter to see how far its rows fall
NEAR = 0.6  # of the distance kept from limits, within which a row is at it: an exchange leaves half of it open


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Multiplier(Result):
    """What one limit costs.

    where : the row that pulls most;  per_percent : dJ of a limit stricter by 1 % of itself;  per_unit : by one `unit`
    """

    name: str
    limit: float
    unit: str
    where: str
    per_percent: float
    per_unit: float

    def rows(self) -> list[Row]:
        return [
            (self.name, self.limit, self.unit),
            ("cost of 1 % of it", self.per_percent, "of J"),
            ("cost of a unit", self.per_unit, f"of J per {self.unit}"),
        ]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Multipliers(Result):
    """What the limits of a design cost, the dearest first.

    unexplained : share of the gradient of log J that limits and bounds leave: 0 at a local optimum, 1 where none binds
    """

    each: tuple[Multiplier, ...]
    unexplained: float

    def rows(self) -> list[Row]:
        return [
            *((f"{m.name}, at {m.where}", m.per_percent, "of J per 1 %") for m in self.each),
            ("gradient unexplained", self.unexplained, "share"),
        ]


def multipliers(programme: Programme, gains: Gains, distances: Sequence[float]) -> Multipliers:
    """The multipliers at gains that a search ended with, at one of some relative distances from every limit.

    The distance is the one whose rows explain most of the gradient.
    """
    programme = programme.with_added(programme.unseen(programme.x(gains)))
    found = [_at(programme.with_back_off(distance), gains) for distance in distances]
    return min(found, key=lambda m: m.unexplained)


def _at(programme: Programme, gains: Gains) -> Multipliers:
    x = programme.x(gains)
    point, at = programme.at(x), programme.evaluated(programme.theta(x))
    near = np.flatnonzero(np.abs(point.constraints) < NEAR * programme.back_off)
    found, left = stationarity(point, x, *programme.bounds(), active=near)
    size = float(np.linalg.norm(point.slope))
    cost, start, each = float(np.exp(point.objective)), 0, []
    for r in programme.held.values():
        rows = r.steer(at)
        count = sum(len(values) for _, values, _ in rows)
        share = found[start : start + count]
        if share.any():
            each.append(_priced(r, share, point, start, cost * _fall(r, rows, at) / STEP))
        start += count
    return Multipliers(each=tuple(sorted(each, key=lambda m: -m.per_percent)), unexplained=left / size if size else 0.0)


def _fall(r: Requirement, rows: Rows, at: Evaluated) -> np.ndarray:
    """How far the rows of a requirement fall where its limit is stricter by `STEP` of itself."""
    stricter = replace(r, limit=r.asked_at(STEP)).steer(at)
    return np.concatenate([before - after for (_, before, _), (_, after, _) in zip(rows, stricter, strict=True)])


def _priced(r: Requirement, share: np.ndarray, point: Point, start: int, fall: np.ndarray) -> Multiplier:
    by_limit = share * fall  # of each row: dJ by the logarithm of the limit
    total = float(by_limit.sum())
    return Multiplier(
        name=r.name, limit=r.limit, unit=r.unit, where=point.names[start + int(np.argmax(by_limit))],
        per_percent=total / 100, per_unit=total / r.limit,
    )  # fmt: skip
