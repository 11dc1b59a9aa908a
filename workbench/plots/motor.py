"""Pictures of the motor: the report's Figures 4 to 20, force profiles, ripple, authority and efficiency.

Every function takes `ax=` or makes an Axes, draws, and returns it.
"""

from typing import Any

import numpy as np

from workbench.physics.motor.figures import Figure, figure
from workbench.physics.motor.section import Operation
from workbench.physics.motor.three_phase import ForceLines


def plot_figure(what: str | Figure, *, ax: Any = None):
    """A figure of the report's Appendix F by its number, or given data. Components of the report's figures 4 to 20."""
    data = figure(what) if isinstance(what, str) else what
    ax = _axes(ax)
    turned = data.unit == "rad"
    abscissa = np.degrees(data.values) if turned else data.values
    for curve in data.curves:
        ax.plot(abscissa, curve.values, label=f"{curve.label} [{curve.unit}]")
    ax.set_xlabel(f"{data.abscissa} [{'°' if turned else data.unit}]")
    ax.set_title(f"Figure {data.number}. {data.title}")
    ax.grid(True, alpha=0.3)
    ax.legend()
    return ax


def plot_ripple(lines: ForceLines, *, component: int = 2, ax: Any = None):
    """Amplitudes of one force or torque component over multiples of ω, the constant part left out."""
    ax = _axes(ax)
    ax.stem(lines.multiple[1:], lines.amplitude[1:, component])
    ax.set_xlabel("multiple of ω [1]")
    ax.set_ylabel("amplitude [N or N m]")
    ax.set_title("Ripple of a coil that keeps pace")
    return ax


def plot_authority(normal_rated: float, thrust_rated: float, thrust: float, *, ax: Any = None):
    """Circle of rated current in thrust and normal force [N] of one side, and what a demanded thrust leaves.

    Source: report, Appendix F, eqs. (11), (12): both share one current.
    """
    ax = _axes(ax)
    angle = np.linspace(0.0, 2 * np.pi, 181)
    ax.plot(thrust_rated * np.cos(angle), normal_rated * np.sin(angle), label="rated current")
    left = normal_rated * np.sqrt(np.clip(1 - (thrust / thrust_rated) ** 2, 0.0, None))
    ax.plot([thrust, thrust], [-left, left], label="left for the normal force")
    ax.set_xlabel("thrust [N]")
    ax.set_ylabel("normal force [N]")
    ax.legend()
    ax.grid(True, alpha=0.3)
    return ax


def plot_efficiency(operations: tuple[Operation, ...], *, ax: Any = None):
    """Efficiency and power factor of a winding section over its length."""
    ax = _axes(ax)
    lengths = [operation.section_length for operation in operations]
    ax.plot(lengths, [operation.efficiency for operation in operations], label="efficiency")
    ax.plot(lengths, [operation.power_factor for operation in operations], label="power factor")
    ax.set_xlabel("section length [m]")
    ax.set_ylabel("[1]")
    ax.set_ylim(0.0, 1.05)
    ax.legend()
    ax.grid(True, alpha=0.3)
    return ax


def _axes(ax: Any):
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots()[1]
