"""Pictures of a plant's loops: Bode diagrams with their margins, step responses, poles."""

from collections.abc import Sequence

import numpy as np

from workbench.analysis.loop_curve import LoopCurve
from workbench.design.plant_curves import StepCurve
from workbench.design.plant_simulation import PlantSimulation
from workbench.simulation.response import Response


def plot_bode(curve: LoopCurve, *, gain_frequencies: Sequence[float] = (), phase_frequencies=(), axes=None):
    """Size [dB] and phase [°] of a loop over frequency [Hz], margins marked at their frequencies; returns two Axes.

    gain_frequencies, phase_frequencies : [rad/s] where gain and phase margins bind
    """
    import matplotlib.pyplot as plt

    above, below = plt.subplots(2, 1, sharex=True, layout="constrained")[1] if axes is None else axes
    phase = np.degrees(np.unwrap(np.angle(curve.loop)))
    phase -= 360 * np.round((phase[0] + 90) / 360)
    above.semilogx(curve.frequency_hz, 20 * np.log10(np.maximum(np.abs(curve.loop), 1e-300)), color="C0")
    below.semilogx(curve.frequency_hz, phase, color="C0")
    for ax, marks, colour in ((above, gain_frequencies, "C3"), (below, phase_frequencies, "C1")):
        for omega in marks:
            ax.axvline(omega / (2 * np.pi), color=colour, ls=":", lw=1)
    above.axhline(0.0, color=above.spines["left"].get_edgecolor(), lw=0.6)
    for ax in (above, below):
        ax.grid(True, lw=0.5, alpha=0.4)
    above.set(ylabel="|L| [dB]", title=f"Loop at {curve.name}, {curve.group}")
    below.set(ylabel="phase [°]", xlabel="frequency [Hz]")
    return above, below


def plot_steps(curve: StepCurve | Response, *, ax=None):
    """Responses of the outputs to what happens at the input, over time; returns the Axes."""
    import matplotlib.pyplot as plt

    ax = plt.subplots()[1] if ax is None else ax
    sampled, unit = isinstance(curve, Response) and curve.sample_time is not None, isinstance(curve, StepCurve)
    drawn = {"drawstyle": "steps-post"} if sampled else {}
    for name, column in zip(curve.outputs, curve.values.T, strict=True):
        ax.plot(curve.time, column, label=name, **drawn)
    ax.grid(True, lw=0.5, alpha=0.4)
    ax.set(xlabel="time [s]", title=f"{'Unit step at ' if unit else ''}{curve.input}, {curve.model}")
    ax.legend(frameon=False)
    return ax


def plot_simulation(simulation: PlantSimulation):
    """Histories of every model's loop, each output in a row of its own scale; returns the Figure."""
    import matplotlib.pyplot as plt

    names, models = simulation.responses[0].outputs, simulation.responses
    figure, rows = plt.subplots(
        len(names), len(models), sharex="col", squeeze=False, layout="constrained",
        figsize=(max(5.0, 3.6 * len(models)), 1.2 + 1.7 * len(names)),
    )  # fmt: skip
    for k, response in enumerate(models):
        style = "default" if response.sample_time is None else "steps-post"
        for ax, name in zip(rows[:, k], names, strict=True):
            ax.plot(response.time, response[name], drawstyle=style, color="C0")
            ax.grid(True, lw=0.5, alpha=0.4)
            ax.set(ylabel=name)
        rows[0, k].set(title=f"{response.model}: {response.input}"[:60])
        rows[-1, k].set(xlabel="time [s]")
    return figure


def plot_poles(poles: Sequence[complex], *, damping: float | None = None, ax=None):
    """Poles in the upper half of the s plane, the stability limit, and a ray of the least damping; returns the Axes."""
    import matplotlib.pyplot as plt

    ax = plt.subplots()[1] if ax is None else ax
    shown = np.array([p for p in poles if p.imag >= -1e-9 * abs(p)])
    ax.plot(shown.real, np.abs(shown.imag), "x", color="C0")
    ax.axvline(0.0, color=ax.spines["left"].get_edgecolor(), lw=0.6)
    if damping is not None and 0 < damping < 1 and len(shown):
        top = np.abs(shown.imag).max()
        ax.plot([0.0, -top * damping / np.sqrt(1 - damping**2)], [0.0, top], "--", color="C3", lw=1,
                label=f"damping {damping:.3g}")  # fmt: skip
        ax.legend(frameon=False)
    ax.grid(True, lw=0.5, alpha=0.4)
    ax.set(xlabel="Re s [1/s]", ylabel="Im s [rad/s]", title="Poles")
    return ax
