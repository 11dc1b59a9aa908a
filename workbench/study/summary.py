"""What a study says in a few numbers: the share of rows that fail, and how each quantity is spread.

rows, limits --> failing rows and a confidence interval of their share;  quantiles of every quantity
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.result import Result, Row
from workbench.study.definition import Limit

LEVELS = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Failing(Result):
    """Rows that fail: without a figure, unstable, or beyond a limit.

    share of all rows, with the ends of its interval (None where rows are no random sample);  by : reason to rows
    """

    rows_in_all: int
    count: int
    share: float
    low: float | None
    high: float | None
    by: Mapping[str, int]

    def rows(self) -> list[Row]:
        return [
            ("rows", self.rows_in_all, ""),
            ("failing", self.count, ""),
            ("failing share", self.share, "1"),
            ("at least", self.low, "1"),
            ("at most", self.high, "1"),
            *((f"failing by {reason}", count, "") for reason, count in self.by.items()),
        ]


def failing(
    columns: Mapping[str, Sequence], errors: Sequence[str], limits: Mapping[Limit, np.ndarray | None], *, random: bool,
    confidence: float,
) -> tuple[Failing, np.ndarray]:  # fmt: skip
    """The failing rows, counted, and which they are (rows,).

    limits : to the rows (rows,) held against each, None for all
    The interval is Clopper and Pearson's for independent rows; a Latin hypercube or a Sobol' sequence scatters less.
    """
    n = len(errors)
    refused = np.array([bool(e) for e in errors], bool)
    reasons = {"no figures (refused or infeasible)": refused}
    stable = columns.get("stable")
    unstable = np.zeros(n, bool)
    if stable is not None:
        unstable = np.array([s is False for s in stable], bool)
        reasons["unstable"] = unstable
    for limit, held in limits.items():
        values = columns[limit.quantity]
        beyond = np.array([not limit.kept(v) for v in values], bool)
        reasons[f"{limit} missed"] = beyond & ~refused & ~unstable & (True if held is None else held)
    failed = np.logical_or.reduce(list(reasons.values())) if n else np.zeros(0, bool)
    count = int(failed.sum())
    low = high = None
    if random and n:
        from scipy.stats import binomtest

        ends = binomtest(count, n).proportion_ci(confidence, method="exact")
        low, high = float(ends.low), float(ends.high)
    return (
        Failing(
            rows_in_all=n, count=count, share=count / n if n else 0.0, low=low, high=high,
            by={reason: int(which.sum()) for reason, which in reasons.items()},
        ),
        failed,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Spread(Result):
    """How the values of one quantity are spread: mean, deviation and quantiles `LEVELS`, over rows that have one."""

    quantity: str
    count: int
    mean: float | None
    deviation: float | None
    quantiles: tuple[float, ...]

    def rows(self) -> list[Row]:
        return [
            ("quantity", self.quantity, ""),
            ("mean", self.mean, ""),
            ("deviation", self.deviation, ""),
            *((f"quantile {level:g}", q, "") for level, q in zip(LEVELS, self.quantiles, strict=False)),
        ]


def spread_of(quantity: str, values: np.ndarray) -> Spread:
    """Of the values (rows,) of a quantity, NaN where there is none."""
    kept = values[np.isfinite(values)]
    if not len(kept):
        return Spread(quantity=quantity, count=0, mean=None, deviation=None, quantiles=())
    return Spread(
        quantity=quantity, count=len(kept), mean=float(kept.mean()), deviation=float(kept.std()),
        quantiles=tuple(np.quantile(kept, LEVELS).tolist()),
    )  # fmt: skip
