"""Picture of a trade-off: the best cost over one limit, and the chosen design on it."""

from workbench.design.tradeoff import TradeOff
from workbench.errors import InputError

SCALES = {"m": ("mm", 1e3)}  # units that read better in a picture


def plot_tradeoff(curve: TradeOff, *, chosen: tuple[float, float] | None = None, link: str = "", ax=None):
    """Best cost J over the limit of one quantity; limits without a design are marked on the axis; returns the Axes.

    chosen : (limit or value [SI], cost) of a design to mark
    link : address that the designs' points refer to in an SVG, with {} for the number among the curve's limits
    """
    pairs = sorted(
        (limit, cost, number)
        for number, (limit, cost) in enumerate(zip(curve.limits, curve.costs, strict=True))
        if cost is not None
    )
    if not pairs:
        raise InputError(
            f"a trade-off needs at least one limit with a design; none of {len(curve.limits)} has one. Widen them."
        )
    if ax is None:
        import matplotlib.pyplot as plt

        ax = plt.subplots()[1]
    unit, factor = SCALES.get(curve.unit, (curve.unit, 1.0))
    x, y, numbers = zip(*pairs, strict=True)
    ax.plot([factor * v for v in x], y, "o-", label="best design found")
    if link:
        points = ax.scatter([factor * v for v in x], y, s=130, alpha=0.25, zorder=3, color="C0")
        points.set_urls([link.format(k) if curve.gains[k] is not None else None for k in numbers])
    failed = [factor * limit for limit, cost in zip(curve.limits, curve.costs, strict=True) if cost is None]
    if failed:
        ax.plot(failed, [min(y)] * len(failed), "x", color="C3", label="no design found")
    if chosen is not None:
        ax.plot([factor * chosen[0]], [chosen[1]], "s", mfc="none", ms=9, color="C1", label="this design")
    ax.set(
        xlabel=f"limit of {curve.quantity} [{unit}]",
        ylabel="ride cost J [10⁻⁴ g²]",
        title="Ride against " + curve.quantity,
    )
    ax.grid(True, lw=0.5, alpha=0.4)
    ax.legend(frameon=False)
    return ax
