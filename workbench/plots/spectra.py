"""Pictures of a vehicle's response spectra: accelerations against comfort limits, gaps, currents.

analysis.spectra.Spectra --> plot_acceleration, plot_gap, plot_current
"""

from collections.abc import Sequence

import numpy as np

from workbench.analysis.comfort import Mask
from workbench.analysis.spectra import Spectra
from workbench.constants import GRAVITY
from workbench.errors import unknown_name
from workbench.plots.ride import plot_acceleration_psd

DECADES = 5.0  # of density shown below the highest value: the rest is what notches fall to
SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
ROOM = 100.0  # above it, for the legend


def plot_acceleration(spectra: Spectra, direction: str, *, masks: Sequence[Mask] = (), ax=None):
    """Acceleration at every point, "vertical" or "lateral", and limits beside it; returns the Axes."""
    quantity = {"vertical": "acceleration_z", "lateral": "acceleration_y"}.get(direction)
    if quantity is None:
        raise unknown_name("direction", direction, ("vertical", "lateral"))
    densities = {place: (spectra.frequency_hz, density) for place, density in spectra.of(quantity).items()}
    ax = plot_acceleration_psd(densities, masks=masks, low_hz=spectra.low_hz, high_hz=spectra.high_hz, ax=_axes(ax))
    highest = max(float(density.max()) for _, density in densities.values()) / GRAVITY**2
    limits = [limit for mask in masks for limit in mask.g2_per_hz]
    _finish(ax, f"{direction.capitalize()} acceleration", highest, max([highest, *limits]))
    return ax


def plot_gap(spectra: Spectra, direction: str, *, ax=None):
    """Gap change at the foremost and hindmost coil sets, "vertical" or "lateral"; returns the Axes."""
    quantity = {"vertical": "gap", "lateral": "gap_lateral"}.get(direction)
    if quantity is None:
        raise unknown_name("direction", direction, ("vertical", "lateral"))
    return _plot(spectra, quantity, f"{'Lateral gap' if direction == 'lateral' else 'Gap'} change", "[m²/Hz]", ax)


def plot_current(spectra: Spectra, *, ax=None):
    """Control current over main-coil current at the foremost and hindmost coil sets; returns the Axes."""
    return _plot(spectra, "current", "Control current over main-coil current", "[1/Hz]", ax)


def _plot(spectra: Spectra, quantity: str, title: str, unit: str, ax):
    ax = _axes(ax)
    values = spectra.of(quantity)
    for place, density in values.items():
        ax.loglog(spectra.frequency_hz, density, label=place)
    highest = max(float(density.max()) for density in values.values())
    ax.set(xlabel="frequency [Hz]", ylabel=f"density {unit}", xlim=(spectra.low_hz, spectra.high_hz))
    ax.grid(True, which="major", lw=0.4)
    _finish(ax, title, highest, highest)
    return ax


def _axes(ax):
    if ax is None:
        import matplotlib.pyplot as plt

        ax = plt.subplots()[1]
    return ax


def _finish(ax, title: str, highest: float, top: float) -> None:
    """Title, legend above the curves, as many decades as matter; ticks as plain text, quick to set and to search."""
    from matplotlib.ticker import FuncFormatter, NullFormatter, NullLocator

    ax.set_title(title)
    if highest > 0:
        ax.set_ylim(highest * 10**-DECADES, top * ROOM)
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.yaxis.set_major_formatter(
        FuncFormatter(lambda value, _: "10" + str(round(np.log10(value))).translate(SUPERSCRIPT))
    )
    ax.yaxis.set_minor_locator(NullLocator())
    ax.legend(frameon=False, loc="upper left", ncols=2)
