"""Picture of a design: every goal against its limit, one small axes per goal.

goal of a gain, a margin, a density --> its measure over frequency, 1 the limit
any other goal                      --> a bar: value over limit, 1 the limit
"""

import math
import textwrap

import numpy as np

from workbench.design.record import Design
from workbench.errors import InputError
from workbench.goals.margin import DiskMeasure
from workbench.goals.measure import Bound
from workbench.goals.peak import Axis, PeakMeasure
from workbench.goals.verdict import Verdict

COLUMNS = 3
WIDTH = 48  # characters of a line under an axes
POINTS = 400  # of a curve
AROUND = 100.0  # a curve reaches so far below the slowest and above the fastest pole


def plot_goals(design: Design, *, axes=None):
    """Every verdict of a plant of one's own, one axes each; returns the Axes.

    axes : as many Axes as verdicts, in any shape; a new figure if left out

    Over frequency where the goal looks at one, else a bar; 1 is the limit, a full line for a hard goal. A thin line
    reaches to the certified end of a value's bracket. What has no value (an unstable loop) is written, not drawn.
    """
    count = len(design.verdicts)
    if axes is None:
        import matplotlib.pyplot as plt

        rows, columns = -(-count // COLUMNS), min(count, COLUMNS)
        axes = plt.subplots(rows, columns, figsize=(3.6 * columns, 2.2 * rows), squeeze=False, layout="constrained")[1]
    flat = list(axes.ravel()) if hasattr(axes, "ravel") else list(axes) if hasattr(axes, "__len__") else [axes]
    if len(flat) < count or (len(flat) >= count + COLUMNS):
        raise InputError(
            f"plot_goals must have one axes per goal ({count}); got {len(flat)}. Leave axes out for a figure."
        )
    for unused in flat[count:]:
        unused.set_axis_off()
    hard = {goal.name: goal.hard for goal in design.problem.goals}
    for ax, verdict in zip(flat, design.verdicts, strict=False):
        must = hard.get(verdict.name, True)
        _drawn(ax, design, verdict, "C2" if verdict.met else "C3" if must else "C1", "-" if must else "--")
        ax.set_title(f"{verdict.name} ({'hard' if must else 'soft'})", fontsize=9, loc="left")
        value = "no value" if verdict.value is None else f"{verdict.value:.3g} {verdict.unit}".removesuffix(" 1")
        said = f"{value}, {verdict.sense} {verdict.limit:g}: {'met' if verdict.met else 'not met'}"
        ax.set_xlabel(f"{said}\n{textwrap.fill(verdict.where, WIDTH)}", fontsize=7)
    return axes


def plot_design(design: Design):
    """The Figure of a design: a vehicle's overview, else its goals."""
    if design.problem.flies:
        from workbench.plots.overview import plot_overview

        return plot_overview(design)
    from matplotlib.figure import Figure

    count = len(design.verdicts)
    rows, columns = -(-count // COLUMNS), min(count, COLUMNS)
    figure = Figure(figsize=(3.6 * columns, 2.2 * rows), layout="constrained")
    plot_goals(design, axes=figure.subplots(rows, columns, squeeze=False))
    return figure


def _drawn(ax, design: Design, verdict: Verdict, colour: str, limit: str) -> None:
    """The curve of a goal over frequency, or a bar of its value over its limit."""
    curve = _curve(design, verdict)
    if curve is not None:
        ax.semilogx(*curve, color=colour, lw=1)
        ax.axhline(1.0, color="black", ls=limit, lw=1)
        ax.set_ylim(0, 1.2 * max(1.0, float(np.nanmax(curve[1]))))
        return
    ends = [_share(verdict, value) for value in (verdict.value, verdict.upper)]
    shown = ends[0] if ends[0] is not None else 0.0
    ax.barh([0], [shown], height=0.5, color=colour)
    if ends[0] is not None and ends[1] is not None and ends[1] != ends[0]:
        ax.plot(ends, [0, 0], color="black", lw=1)
    ax.axvline(1.0, color="black", ls=limit, lw=1)
    ax.set(xlim=(0, 1.15 * max(1.0, shown)), ylim=(-0.6, 0.6), yticks=[])


def _share(verdict: Verdict, value: float | None) -> float | None:
    """A value over its limit, turned over where more is better: up to 1 is met."""
    if value is None or not math.isfinite(value) or verdict.limit == 0 or value == 0:
        return None
    return value / verdict.limit if verdict.sense == "<=" else verdict.limit / value


def _curve(design: Design, verdict: Verdict) -> tuple[np.ndarray, np.ndarray] | None:
    """Frequencies [rad/s] and the goal's measure there; None for goals of another kind and loops without value."""
    goal = next((goal for goal in design.problem.goals if goal.name == verdict.name), None)
    loop = next((loop for loop in design.problem.loops if loop.name == verdict.model), None)
    if goal is None or loop is None or verdict.value is None:
        return None
    measure = _frequency_measure(goal.bind(loop))
    if measure is None:
        return None
    K = design.structure.controller()
    poles = np.abs(loop.poles(K))
    poles, h = poles[poles > 0], loop.sample_time
    ends = [1e-2, 1e2] if h is not None or not len(poles) else [poles.min() / AROUND, poles.max() * AROUND]
    low, high = (ends[0], ends[1]) if h is None else (1e-4 * math.pi / h, math.pi / h)
    omega = np.geomspace(max(low, measure.band[0]), min(high, measure.band[1]), POINTS)
    return omega, measure.shape.size(Axis.of(omega, h), measure.channel.response(K, omega))


def _frequency_measure(bound: Bound) -> PeakMeasure | None:
    measure = bound.measure.peak if isinstance(bound.measure, DiskMeasure) else bound.measure
    return measure if isinstance(measure, PeakMeasure) else None
