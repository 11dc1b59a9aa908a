"""Pictures of the drag law, the power it costs, and speed schedules. Thrust in kN, power in MW."""

import numpy as np

from workbench.physics.propulsion.drag import DragCurves
from workbench.physics.propulsion.schedule import SpeedSchedule


def plot_drag(curves: DragCurves, *, ax=None):
    """Magnetic, aerodynamic and total drag over speed; returns the Axes."""
    import matplotlib.pyplot as plt

    ax = plt.subplots()[1] if ax is None else ax
    ax.plot(curves.speed, curves.magnetic / 1e3, "--", color="tab:blue", label="magnetic")
    ax.plot(curves.speed, curves.aerodynamic / 1e3, "--", color="tab:orange", label="aerodynamic")
    ax.plot(curves.speed, curves.drag / 1e3, color="black", label="total")
    ax.set(xlabel="speed [m/s]", ylabel="drag [kN]", title="Drag against speed", ylim=(0, None))
    ax.legend()
    return ax


def plot_power(curves: DragCurves, *schedules: SpeedSchedule, ax=None):
    """Power against drag at steady speed, and the thrust power of any schedules, over speed; returns the Axes."""
    import matplotlib.pyplot as plt

    ax = plt.subplots()[1] if ax is None else ax
    ax.plot(curves.speed, curves.power / 1e6, color="black", label="steady speed")
    for schedule in schedules:
        label = f"{schedule.method}: {schedule.time:.0f} s, {schedule.distance / 1e3:.1f} km"
        ax.plot(schedule.speeds, schedule.powers / 1e6, label=label)
    ax.set(xlabel="speed [m/s]", ylabel="power [MW]", title="Power against speed", ylim=(0, None))
    ax.legend()
    return ax


def plot_schedule(schedule: SpeedSchedule, *, ax=None):
    """Speed over time, coloured by the limit that holds where the method knows it; returns the Axes."""
    import matplotlib.pyplot as plt

    ax = plt.subplots()[1] if ax is None else ax
    colours = {"acceleration": "tab:blue", "thrust": "tab:orange", "power": "tab:red"}
    for stretch in schedule.stretches:
        inside = (schedule.speeds >= stretch.initial_speed) & (schedule.speeds <= stretch.final_speed)
        ax.plot(
            schedule.times[inside],
            schedule.speeds[inside],
            color=colours[stretch.limit],
            label=f"{stretch.limit} limit",
        )
    if not schedule.stretches:
        ax.plot(schedule.times, schedule.speeds, color="black", label=schedule.method)
    ax.set(
        xlabel="time [s]", ylabel="speed [m/s]", xlim=(0, float(np.max(schedule.times))),
        title=f"{schedule.peak_power / 1e6:.3f} MW peak, {schedule.distance / 1e3:.1f} km",
    )  # fmt: skip
    ax.legend()
    return ax
