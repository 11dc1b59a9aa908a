"""Pictures of a gain schedule: parameters and margins over the speed."""

from collections.abc import Sequence

import numpy as np

from workbench.control.gains import GAIN_NAMES, TIME_CONSTANTS
from workbench.control.schedule import Schedule
from workbench.design.scheduled import MarginCurve
from workbench.errors import InputError

PARTS = {  # what is drawn together: title, unit, names
    "filters": ("Filter gains over their value at the highest speed", "1",
                tuple(n for n in GAIN_NAMES[:12] if n not in TIME_CONSTANTS)),
    "time constants": ("Time constants", "s", TIME_CONSTANTS),
    "modal": ("Modal gains over their value at the highest speed", "1", GAIN_NAMES[12:]),
}  # fmt: skip
STYLES = ("-", "--", "-.", ":")


def plot_scheduled_gains(schedule: Schedule, part: str = "filters", *, ax=None):
    """One part of the seventeen parameters over the speed; returns the Axes.

    part : "filters", "modal" (both as multiples of the value at the highest speed) or "time constants" [s]; parameters
    that do not change are left out
    """
    if part not in PARTS:
        raise InputError(f"a part of the gains must be one of {', '.join(PARTS)}; got {part!r}.")
    title, unit, names = PARTS[part]
    ax = _axes(ax)
    low, high = schedule.range
    speed = np.linspace(low, high, 201)
    table = dict(zip(GAIN_NAMES, schedule.table(speed).T, strict=True))
    drawn = [n for n in names if np.ptp(table[n]) > 0]
    for k, name in enumerate(drawn):
        value = table[name] if unit == "s" or table[name][-1] == 0 else table[name] / table[name][-1]
        ax.plot(speed, value, STYLES[k // 4 % len(STYLES)], label=name)
    ax.set(xlabel="speed [m/s]", ylabel=f"{'τ [s]' if unit == 's' else 'relative'}", title=title, xlim=(low, high))
    return _finished(ax)


def plot_margins_over_speed(margins: Sequence[MarginCurve], *, ax=None):
    """Every margin over its limit, so that above 1 is met, over the speed; returns the Axes.

    A quantity that must not exceed its limit is drawn as limit over value.
    """
    if not margins:
        raise InputError("a picture of margins needs at least one; got none.")
    ax = _axes(ax)
    for k, m in enumerate(margins):
        share = m.value / m.limit if m.sense == ">=" else m.limit / m.value
        ax.plot(m.speed, share, STYLES[k % len(STYLES)], label=m.name)
    ax.axhline(1.0, color="C3", lw=1)
    low, high = float(margins[0].speed[0]), float(margins[0].speed[-1])
    ax.set(xlabel="speed [m/s]", ylabel="margin over limit (1 is just met)", title="Margins over speed",
           xlim=(low, high))  # fmt: skip
    return _finished(ax)


def _axes(ax):
    import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained")[1] if ax is None else ax


def _finished(ax):
    ax.grid(True, lw=0.5, alpha=0.4)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(frameon=False, ncols=2, fontsize="small")
    return ax
