"""Pictures of roughness and ride: guideway spectra, acceleration densities and third octaves against their limits.

Each function draws into `ax` (or a new figure) and returns the Axes. Nothing here computes a criterion: that is
`analysis.ride` and `analysis.comfort`.
"""

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from workbench.analysis.comfort import Boundary, Mask
from workbench.analysis.density import Psd, value
from workbench.analysis.ride import ThirdOctaves
from workbench.constants import GRAVITY
from workbench.errors import InputError
from workbench.physics.guideway.spectrum import Spectrum

if TYPE_CHECKING:
    from matplotlib.axes import Axes

UNVERIFIED = " (unverified)"
STYLES = ("--", ":", "-.", (0, (1, 4)))  # of limits, in turn


def plot_acceleration_psd(
    psds: Mapping[str, Psd],
    *,
    masks: Sequence[Mask] = (),
    low_hz: float = 0.1,
    high_hz: float = 50.0,
    ax: "Axes | None" = None,
) -> "Axes":
    """Acceleration densities in g²/Hz against comfort masks, both axes logarithmic.

    Parameters
    ----------
    psds : label to density [(m/s²)²/Hz], function or (frequency_hz, psd); arrays are drawn at their own points
    masks : limits, drawn in broken black lines over their own range; "(unverified)" where their numbers are not checked
    low_hz, high_hz : frequency axis [Hz]
    """
    _check_band(low_hz, high_hz)
    ax = _axes(ax)
    grid = np.geomspace(low_hz, high_hz, 600)
    for label, psd in psds.items():
        f = grid if callable(psd) else np.asarray(psd[0], float)
        density = value(psd, f) / GRAVITY**2
        shown = (f >= low_hz) & (f <= high_hz) & (density > 0)  # a zero has no place on a logarithmic axis
        ax.loglog(f[shown], density[shown], label=label)
    for mask, style in zip(masks, cycle(STYLES)):
        name = mask.name + ("" if mask.verified else UNVERIFIED)
        ax.loglog(mask.frequency_hz, mask.g2_per_hz, color="black", ls=style, lw=1, label=name)
    ax.set(xlabel="frequency [Hz]", ylabel="acceleration density [g²/Hz]", xlim=(low_hz, high_hz))
    return _finished(ax)


def plot_third_octaves(
    bands: Mapping[str, ThirdOctaves], *, boundaries: Sequence[Boundary] = (), ax: "Axes | None" = None
) -> "Axes":
    """Rms acceleration per one-third octave against boundaries, both axes logarithmic; bands are steps."""
    ax = _axes(ax)
    half = 10**0.05
    for label, spectrum in bands.items():
        f = spectrum.frequency_hz
        ax.stairs(spectrum.rms, np.append(f / half, f[-1] * half), baseline=None, label=label, lw=1.5)
    for limit, style in zip(boundaries, cycle(STYLES)):
        name = limit.name + ("" if limit.verified else UNVERIFIED)
        ax.loglog(limit.frequency_hz, limit.limit, color="black", ls=style, lw=1, label=name)
    ax.set(
        xscale="log", yscale="log", xlabel="frequency [Hz]", ylabel="rms acceleration per one-third octave [m/s²]"
    )  # fmt: skip
    return _finished(ax)


def plot_roughness(
    spectra: Mapping[str, Spectrum],
    *,
    wavelength_min: float = 1.0,
    wavelength_max: float = 1000.0,
    ax: "Axes | None" = None,
) -> "Axes":
    """Roughness spectra S(Ω) over wavelength, long waves left; each only where it is valid.

    Parameters
    ----------
    spectra : label to spectrum; a corner given as a frequency needs `at_speed(V)` first
    wavelength_min, wavelength_max : axis [m]
    """
    _check_band(wavelength_min, wavelength_max)
    ax = _axes(ax)
    for label, spectrum in spectra.items():
        shortest, longest = wavelength_min, wavelength_max
        if not spectrum.extrapolate:
            shortest = max(shortest, spectrum.wavelength_min or 0.0)
            longest = min(longest, spectrum.wavelength_max or np.inf)
        if not shortest < longest:
            raise InputError(
                f"spectrum {label!r} must be valid somewhere on the axis; got {shortest:.4g} to {longest:.4g} m. "
                "Widen wavelength_min…wavelength_max, or leave it out."
            )
        wavelength = np.geomspace(shortest, longest, 400)
        wavelength[0], wavelength[-1] = shortest, longest
        name = label + ("" if spectrum.verified else UNVERIFIED)
        ax.loglog(wavelength, spectrum.psd(2 * np.pi / wavelength), label=name)
    ax.set(xlabel="wavelength [m]", ylabel="roughness S(Ω) [m²/(rad/m)]", xlim=(wavelength_max, wavelength_min))
    return _finished(ax)


def _axes(ax: "Axes | None") -> "Axes":
    import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained")[1] if ax is None else ax


def _finished(ax: "Axes") -> "Axes":
    ax.grid(True, which="major", lw=0.4)
    if ax.get_legend_handles_labels()[0]:
        ax.legend(fontsize="small")
    return ax


def _check_band(low: float, high: float) -> None:
    if not 0 < low < high < np.inf:
        raise InputError(f"an axis needs 0 < lower end < upper end; got {low!r} and {high!r}. Give both, lower first.")
