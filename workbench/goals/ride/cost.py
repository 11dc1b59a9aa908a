"""The ride cost: the sum of the weighted mean squares of what passengers feel, to be made small."""

from dataclasses import dataclass

import numpy as np

from workbench.analysis.analysis import Analysis
from workbench.analysis.response import COST_POINTS, COST_SCALE
from workbench.constants import GRAVITY
from workbench.errors import InputError
from workbench.goals.goal import Goal, Rows
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.verdict import Verdict

FELT = tuple(f"acceleration {axis}, {point}" for axis in ("z", "y") for point in COST_POINTS)


@dataclass(frozen=True, slots=True, kw_only=True)
class RideCost(Goal):
    """J = 10⁴ Σ of six mean squares in g², vertical and lateral, at cg, front and rear.

    Source: guide, Definitions: Cost.

    limit : a cost that counts as met; none, since it is made as small as the requirements allow
    """

    kind, unit, corners = "ride cost", "10⁻⁴ g²", False

    limit: float = float("inf")

    def _usual_name(self) -> str:
        return self.kind

    def __post_init__(self) -> None:
        if self.hard:
            raise InputError("the ride cost is made small, it cannot be hard; limit the gaps or currents instead.")
        if not self.limit > 0:
            raise InputError(f"the limit of the ride cost must be positive; got {self.limit!r}. Leave it out.")
        Goal.__post_init__(self)

    def cost(self, point: Evaluated) -> tuple[float, np.ndarray]:
        """J and its derivatives (17,)."""
        felt = [name for name in FELT if name in point.squares]
        value = COST_SCALE / GRAVITY**2 * sum(point.squares[name] for name in felt)
        slope = COST_SCALE / GRAVITY**2 * sum(point.slopes[name] for name in felt)
        return float(value), np.asarray(slope)

    def steer(self, point: Evaluated) -> Rows:
        """−log J, which grows as the ride gets better, above its limit where there is one."""
        value, slope = self.cost(point)
        over = np.log(self.limit) if np.isfinite(self.limit) else 0.0
        return [(self.name, np.array([over - np.log(value)]), -slope[None] / value)]

    def of(self, analysis: Analysis) -> float | None:
        """J by exact measures; None where there is none."""
        return analysis.cost

    def judge(self, loop: Flown) -> tuple[Verdict, ...]:
        cost = self.of(loop.analysis)
        return (self.said(cost, "cg, front and rear" if cost is not None else "no response"),)

    def said(self, cost: float | None, where: str, method: str = "") -> Verdict:
        """The verdict on a cost; None is never met."""
        return Verdict(
            name=self.name, sense=self.sense, limit=self.limit, value=cost, unit=self.unit,
            met=cost is not None and cost <= self.limit, where=where, method=method,
        )  # fmt: skip
