"""Picture of a tuning: every goal wanted against what was reached, one small axes per goal."""

import math
import textwrap

from workbench.design.tuner.result import Tuning
from workbench.errors import InputError

COLUMNS = 3
WIDTH = 48  # characters of a line under an axes


def plot_goals(tuning: Tuning, *, axes=None):
    """Every goal's exact value as a bar against 1, the wanted value, one axes per goal; returns the Axes.

    axes : as many Axes as goals, in any shape; a new figure if left out

    A thin line reaches to the certified upper bound where there is one; the cross is the smooth value that steered.
    Values beyond the axes (an unstable loop) are written, not drawn.
    """
    count = len(tuning.goals)
    if axes is None:
        import matplotlib.pyplot as plt

        rows, columns = -(-count // COLUMNS), min(count, COLUMNS)
        axes = plt.subplots(rows, columns, figsize=(3.6 * columns, 1.7 * rows), squeeze=False, layout="constrained")[1]
        flat = list(axes.ravel())
        for unused in flat[count:]:
            unused.set_axis_off()
        flat = flat[:count]
    else:
        flat = list(axes.ravel()) if hasattr(axes, "ravel") else list(axes) if hasattr(axes, "__len__") else [axes]
    if len(flat) != count:
        raise InputError(
            f"plot_goals must have one axes per goal ({count}); got {len(flat)}. Leave axes out for a figure."
        )
    for ax, goal in zip(flat, tuning.goals, strict=True):
        finite = math.isfinite(goal.value)
        shown = max(goal.value, 0.0) if finite else 0.0
        colour = "C2" if goal.met else ("C3" if goal.hard else "C1")
        ax.barh([0], [shown], height=0.5, color=colour)
        if finite and math.isfinite(goal.smooth):
            ax.plot([goal.smooth], [0], "x", color="black", ms=5)
        if finite and math.isfinite(goal.upper) and goal.upper > goal.value:
            ax.plot([goal.value, goal.upper], [0, 0], color="black", lw=1)
        ax.axvline(1.0, color="black", ls="--" if not goal.hard else "-", lw=1)
        ax.set(xlim=(0, 1.15 * max(1.0, shown)), ylim=(-0.6, 0.6), yticks=[])
        ax.set_title(f"{goal.name} ({'hard' if goal.hard else 'soft'})", fontsize=9, loc="left")
        value = f"{goal.value:.3g}" if finite else "no value"
        where = textwrap.fill(goal.where(), WIDTH)
        ax.set_xlabel(f"{value}: {'met' if goal.met else 'not met'}\n{where}", fontsize=7)
    return axes if axes is not None else flat
