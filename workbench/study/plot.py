"""Pictures of a study: how a quantity is spread, how it follows a parameter, what moves it, which designs are best."""

from collections.abc import Sequence

import numpy as np

from workbench.errors import InputError
from workbench.study.definition import Limit
from workbench.study.sensitivity import Index

MOST_POINTS = 250  # drawn of a scatter: enough for the eye, and small in a file
BINS = 24


def plot_histogram(values, name: str, *, limits: Sequence[Limit] = (), ax=None):
    """Rows over the value of one quantity, values (rows,) with NaN where there is none, and its limits; the Axes."""
    values = _finite(values, name)
    ax = _axes(ax)
    ax.hist(values, bins=_edges(values), color="C0", alpha=0.8)
    for limit in limits:
        ax.axvline(limit.value, color="C3", lw=1.2, ls="--", label=f"limit {limit.sense} {limit.value:g}")
    if limits:
        ax.legend(frameon=False)
    ax.set(xlabel=name, ylabel="rows", title=name)
    return ax


def histogram(values) -> tuple[np.ndarray, np.ndarray]:
    """(counts, edges) of the bars that `plot_histogram` draws."""
    kept = np.asarray(values, float)
    kept = kept[np.isfinite(kept)]
    counts, edges = np.histogram(kept, bins=_edges(kept))
    return counts, edges


def plot_scatter(x, y, names: tuple[str, str], *, failed=None, limits: Sequence[Limit] = (), ax=None):
    """A quantity over a parameter, one point per row (every k-th where there are many), failing rows apart; the Axes.

    x, y : (rows,), NaN where there is none;  failed : (rows,) bool
    """
    x, y = np.asarray(x, float), np.asarray(y, float)
    failed = np.zeros(len(x), bool) if failed is None else np.asarray(failed, bool)
    shown = np.isfinite(x) & np.isfinite(y)
    if not shown.any():
        raise InputError(f"a scatter of {names[1]!r} needs rows with a value; none has one.")
    rows = thinned(np.flatnonzero(shown))
    ax = _axes(ax)
    for which, colour, label in ((~failed, "C0", "kept"), (failed, "C3", "failing")):
        own = rows[which[rows]]
        if len(own):
            ax.plot(x[own], y[own], "o", ms=3, mew=0, alpha=0.6, color=colour, label=label)
    for limit in limits:
        ax.axhline(limit.value, color="C3", lw=1.2, ls="--")
    ax.set(xlabel=names[0], ylabel=names[1], title=f"{names[1]} over {names[0]}")
    ax.grid(True, lw=0.5, alpha=0.4)
    ax.legend(frameon=False)
    return ax


def thinned(rows: np.ndarray) -> np.ndarray:
    """Every k-th of the rows, so that at most `MOST_POINTS` are left."""
    return rows[:: max(1, -(-len(rows) // MOST_POINTS))]


def plot_sensitivity(indices: Sequence[Index], *, ax=None):
    """Bars of the indices of one quantity, one group per parameter, strongest on top, with intervals; the Axes."""
    if not indices:
        raise InputError("a picture of sensitivity needs at least one index; got none.")
    kinds = list(dict.fromkeys(i.kind for i in indices))
    strength: dict[str, float] = {}
    for i in indices:
        strength[i.parameter] = max(strength.get(i.parameter, 0.0), abs(i.value))
    order = sorted(strength, key=lambda name: strength[name])
    ax = _axes(ax)
    height = 0.8 / len(kinds)
    for k, kind in enumerate(kinds):
        own = {i.parameter: i for i in indices if i.kind == kind}
        at = [order.index(name) + 0.4 - height * (k + 0.5) for name in own]
        value = [i.value for i in own.values()]
        reach = [[max(i.value - i.low, 0.0) for i in own.values()], [max(i.high - i.value, 0.0) for i in own.values()]]
        ax.barh(at, value, height, xerr=reach, color=f"C{k}", ecolor="C5", label=kind)
    ax.axvline(0, color="black", lw=0.8)
    ax.set_yticks(range(len(order)), order)
    ax.set(title=f"What moves {indices[0].quantity}", xlabel="index")
    ax.legend(frameon=False)
    return ax


def plot_front(x, y, names: tuple[str, str], best, *, ax=None):
    """Designs over two objectives; those that no other design beats in all objectives are filled; the Axes.

    x, y : (rows,);  best : (rows,) bool
    """
    x, y, best = np.asarray(x, float), np.asarray(y, float), np.asarray(best, bool)
    ax = _axes(ax)
    for which, style, label in ((~best, {"mfc": "none"}, "beaten by another"), (best, {}, "on the front")):
        if (which & np.isfinite(x) & np.isfinite(y)).any():
            ax.plot(x[which], y[which], "o", color="C0", label=label, **style)
    ax.set(xlabel=names[0], ylabel=names[1], title=f"{names[1]} against {names[0]}")
    ax.grid(True, lw=0.5, alpha=0.4)
    ax.legend(frameon=False)
    return ax


def _finite(values, name: str) -> np.ndarray:
    values = np.asarray(values, float)
    kept = values[np.isfinite(values)]
    if not len(kept):
        raise InputError(f"a histogram of {name!r} needs rows with a value; none has one.")
    return kept


def _edges(values: np.ndarray) -> np.ndarray:
    """Bars between the 0.5 % and 99.5 % quantiles, the outermost taking in the rest, so one wild row hides none."""
    low, high = np.quantile(values, [0.005, 0.995])
    if not high > low:
        reach = max(abs(low) * 1e-3, 1e-12)
        low, high = low - reach, high + reach
    edges = np.linspace(low, high, BINS + 1)
    edges[0], edges[-1] = min(edges[0], values.min()), max(edges[-1], values.max())
    return edges


def _axes(ax):
    if ax is None:
        import matplotlib.pyplot as plt

        ax = plt.subplots()[1]
    return ax
