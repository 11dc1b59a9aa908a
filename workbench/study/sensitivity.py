"""How much each parameter moves each quantity, from the rows of a study, with confidence intervals.

    Sobol' design  --variance shares--> first- and total-order indices
    other samples  --regression-------> standardised coefficients, partial rank correlations

Rows without a value are left out and counted; where that depends on the parameters, the indices speak of the rest.
An index that the rows do not determine (two parameters that move together) is left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.result import Result, Row

RESAMPLES = 400  # of a bootstrap; its ends then scatter by a tenth of the interval
DRAWN = 1000  # rows in a resample of a regression; its ends are then brought to the size of all rows
VARIES = 1e-6  # relative; figures that differ less are the same but for how they were computed
# Share of a column's ranks that the other parameters leave, below which they leave nothing: rounding leaves 1e-14, and
# two neighbours that change places among a million rows leave 5e-9.
LEFT = 1e-11


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Index(Result):
    """One index of one parameter for one quantity: value, and the ends of its confidence interval."""

    quantity: str
    parameter: str
    kind: str  # "first order", "total order", "regression" or "rank correlation"
    value: float
    low: float
    high: float
    used: int  # rows, or base points of a Sobol' design

    def rows(self) -> list[Row]:
        return [(f"{self.quantity} by {self.parameter}, {self.kind}", self.value, "1")]


def sobol_indices(values: np.ndarray, count: int, *, confidence: float = 0.95, seed: int = 0):
    """First- and total-order indices of one quantity over a Sobol' design; None if it does not vary.

    Parameters
    ----------
    values : (count (d + 2),)
        In the order of `sampling.sample`: A, B, then A with one column of B; NaN where there is none.
    count : base points

    Returns
    -------
    (first, total, used) : two (d, 3) arrays of value, low, high; base points used

    Estimators: Saltelli et al., Computer Physics Communications 181 (2010) 259, Table 2 (b) and (f); intervals from a
    bootstrap over base points.
    """
    d = len(values) // count - 2
    table = np.asarray(values, float).reshape(d + 2, count)
    table = table[:, np.isfinite(table).all(axis=0)]
    used = table.shape[1]
    if used < 4 or not _varies(table):
        return None
    table = table - table[:2].mean()  # the estimators lose digits to a mean that is not zero

    def estimate(t: np.ndarray) -> np.ndarray:
        A, B, AB = t[0], t[1], t[2:]
        variance = t[:2].var()
        first = (B * (AB - A)).mean(axis=-1) / variance
        total = ((A - AB) ** 2).mean(axis=-1) / (2 * variance)
        return np.stack([first, total])

    rng = np.random.default_rng(seed)
    samples = np.array([estimate(table[:, rng.integers(0, used, used)]) for _ in range(RESAMPLES)])
    ends = np.nanquantile(samples, [(1 - confidence) / 2, (1 + confidence) / 2], axis=0)
    first, total = np.stack([estimate(table), ends[0], ends[1]], axis=-1)
    return first, total, used


def regression(samples: np.ndarray, values: np.ndarray, *, confidence: float = 0.95, seed: int = 0):
    """Standardised regression coefficients and partial rank correlations of some quantities; None if it cannot be said.

    samples : (rows, d);  values : (rows, q), each of which varies; no NaN in either
    Returns (coefficients (q, d, 3), rank correlations (q, d, 3), shares of the variance explained (q,)); NaN for what
    the rows do not determine.

    The first have bootstrap intervals, the second Fisher's: z = atanh r is normal with variance 1/(rows − d − 2).
    """
    from scipy.special import ndtri
    from scipy.stats import rankdata

    (n, d), q = samples.shape, values.shape[1]
    if n < d + 8 or not all(_varies(column) for column in samples.T):
        return None
    whole = np.column_stack([samples, values])
    whole = (whole - whole.mean(axis=0)) / whole.std(axis=0)
    coefficients = _from_moments(whole.T @ whole, np.zeros(d + q), n, d)
    left = whole[:, d:] - whole[:, :d] @ coefficients.T
    rng = np.random.default_rng(seed)
    small = min(n, DRAWN)
    drawn = []
    for _ in range(RESAMPLES):
        one = whole[rng.integers(0, n, small)]
        drawn.append(_from_moments(one.T @ one, one.sum(axis=0), small, d))
    ends = np.full((2, q, d), np.nan)
    if np.isfinite(coefficients).all():
        ends = np.nanquantile(drawn, [(1 - confidence) / 2, (1 + confidence) / 2], axis=0)
        ends = coefficients + (ends - coefficients) * np.sqrt(small / n)
    ranks = _partial(rankdata(whole, axis=0), d)
    reach = ndtri((1 + confidence) / 2) / np.sqrt(n - d - 2)
    z = np.arctanh(np.clip(ranks, -1 + 1e-15, 1 - 1e-15))  # ±1 where ranks are exactly determined
    return (
        np.stack([coefficients, *ends], axis=-1),
        np.stack([ranks, np.minimum(np.tanh(z - reach), ranks), np.maximum(np.tanh(z + reach), ranks)], axis=-1),
        1 - left.var(axis=0),
    )


def _from_moments(squares: np.ndarray, sums: np.ndarray, n: int, d: int) -> np.ndarray:
    """Standardised coefficients (q, d) from sums of products (d + q, d + q) and sums (d + q,); NaN if undetermined."""
    C = squares - np.outer(sums, sums) / n
    deviation = np.sqrt(np.maximum(np.diag(C), 0))
    if not deviation.all() or np.linalg.cond(C[:d, :d]) > 1e12:  # a resample of a few rows again and again
        return np.full((len(C) - d, d), np.nan)
    beta = np.linalg.solve(C[:d, :d], C[:d, d:])
    return (beta * deviation[:d, None] / deviation[d:]).T


def _partial(ranked: np.ndarray, d: int) -> np.ndarray:
    """(q, d): correlation of each parameter and each quantity, both freed of what the other parameters explain.

    ranked : (rows, d + q). By least squares, not from the inverse of the correlations, which is none where ranks are
    exactly determined. NaN where the others leave nothing of the parameter, 0 where they leave nothing of the quantity.
    """
    centred = ranked - ranked.mean(axis=0)
    R = np.asarray(np.linalg.qr(centred / np.linalg.norm(centred, axis=0), mode="r"))  # the same angles in d + q rows
    out = np.empty((R.shape[1] - d, d))
    for i in range(d):
        others = np.delete(R[:, :d], i, axis=1)
        wanted = R[:, [i, *range(d, R.shape[1])]]
        left = wanted - others @ np.linalg.lstsq(others, wanted, rcond=None)[0]
        size = np.linalg.norm(left, axis=0)
        if size[0] < LEFT:
            out[:, i] = np.nan
            continue
        there = size[1:] >= LEFT
        shared = left[:, 0] @ left[:, 1:] / (size[0] * np.where(there, size[1:], 1.0))
        out[:, i] = np.where(there, np.clip(shared, -1.0, 1.0), 0.0)  # clipped of its last digit
    return out


def _varies(values: np.ndarray) -> bool:
    return len(values) > 0 and bool(np.ptp(values) > VARIES * np.abs(values).max())


def indices(
    sampling: str, count: int, samples: np.ndarray, columns: dict[str, np.ndarray], parameters: Sequence[str],
    *, confidence: float = 0.95,
) -> tuple[Index, ...]:  # fmt: skip
    """Every index of every column (rows,) that varies; none for a single row."""
    out: list[Index] = []

    def add(quantity: str, kind: str, table: np.ndarray, used: int) -> None:
        for name, (value, low, high) in zip(parameters, table.tolist(), strict=True):
            if np.isfinite(value):
                one = Index(quantity=quantity, parameter=name, kind=kind, value=value, low=low, high=high, used=used)
                out.append(one)

    if sampling == "sobol":
        for quantity, values in columns.items():
            found = sobol_indices(values, count, confidence=confidence)
            if found is not None:
                first, total, used = found
                add(quantity, "first order", first, used)
                add(quantity, "total order", total, used)
        return tuple(out)
    alike: dict[bytes, list[str]] = {}  # quantities that are missing in the same rows go together
    for quantity, values in columns.items():
        known = np.isfinite(values)
        if _varies(values[known]):
            alike.setdefault(known.tobytes(), []).append(quantity)
    for together in alike.values():
        known = np.isfinite(columns[together[0]])
        fitted = regression(
            samples[known], np.column_stack([columns[q][known] for q in together]), confidence=confidence
        )
        if fitted is not None:
            for quantity, coefficients, ranks in zip(together, *fitted[:2], strict=True):
                add(quantity, "regression", coefficients, int(known.sum()))
                add(quantity, "rank correlation", ranks, int(known.sum()))
    return tuple(out)
