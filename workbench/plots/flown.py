"""Picture of nonlinear flight: each figure of the ride over the linear one, with its error."""

from typing import TYPE_CHECKING

import numpy as np

from workbench.simulation.flown import Flights

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_flown(flown: Flights, *, ax: "Axes | None" = None) -> "Axes":
    """Ratios nonlinear over linear with bars of two standard errors; hours and contacts per hour in the title."""
    import matplotlib.pyplot as plt

    ax = plt.subplots(layout="constrained", figsize=(6.4, 4.2))[1] if ax is None else ax
    at = np.arange(len(flown.figures))[::-1]
    ratio, error = ([getattr(f, name) for f in flown.figures] for name in ("ratio", "standard_error"))
    ax.axvline(1.0, color="0.6", lw=1)
    ax.errorbar(ratio, at, xerr=2 * np.nan_to_num(np.array(error)), fmt="o", ms=4, capsize=3, color="tab:blue")
    rate = flown.contacts_per_hour
    ax.set(
        yticks=at, yticklabels=[f.name for f in flown.figures], xlabel="nonlinear over linear, ± 2 standard errors",
        title=f"{flown.hours:.3g} h flown, {rate.value:.3g} contacts per hour ({rate.low:.2g} … {rate.high:.2g})",
    )  # fmt: skip
    ax.title.set_fontsize("medium")
    ax.grid(axis="x", color="0.9")
    return ax
