"""A guideway drawn at random: heights of A1…A4 along the distance, and what the coil sets meet of them.

    Roughness --seed--> heights (4, n) at equal spacing, periodic --speed, coil places--> inputs (2n, k) over time

Each line Ω_m = 2πm/length of the discrete Fourier transform gets an independent complex Gaussian amplitude with mean
square S(Ω_m)·ΔΩ, so the profile is Gaussian and stationary; the drawn length repeats itself. Between the points runs a
periodic cubic spline: rms error 0.6 % of the amplitude at wavelengths of 5 spacings, 0.08 % at 8.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from workbench.errors import InputError
from workbench.physics.guideway.irregularity import Positions, leads, patterns
from workbench.physics.guideway.roughness import Roughness
from workbench.physics.guideway.validity import check_speed

_POINTS_MAX = 2**22  # 130 MB of heights: above this a mistyped spacing is likelier than a wish


@dataclass(frozen=True, eq=False)
class Realisation:
    """Heights of the four types at x = 0, spacing, 2 spacing, …; the profile repeats after `length`."""

    spacing: float  # [m]
    heights: np.ndarray  # (4, n) [m]
    seed: int

    @property
    def length(self) -> float:
        """Distance after which the profile repeats [m]."""
        return self.spacing * self.heights.shape[1]

    @property
    def distance(self) -> np.ndarray:
        """(n,) places of the heights [m]."""
        return self.spacing * np.arange(self.heights.shape[1])

    def height(self, distance) -> np.ndarray:
        """Heights of A1…A4 [m] at distances [m], an array of any shape: (4, *shape)."""
        return self._spline(np.mod(np.asarray(distance, float), self.length))

    def pieces(self) -> np.ndarray:
        """(4, n, 4) coefficients of (x − x_i)⁰ … (x − x_i)³ between points i and i + 1, of each type; in metres."""
        return self._spline.c[::-1]

    def inputs(self, positions: Positions, speed: float, time) -> np.ndarray:
        """What the coil sets meet: (2n, k) [m] at times (k,) [s]; at t = 0 the foremost set is at x = 0.

        The rear sets meet the same guideway later, by the wheel base over the speed.
        """
        check_speed(speed)
        lead, pattern = leads(positions, speed), patterns(positions)
        heights = self.height(speed * (np.asarray(time, float) + lead[:, None]))  # (4, 2n, k)
        return np.einsum("nt,tnk->nk", pattern, heights)

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline

        closed = np.concatenate([self.heights, self.heights[:, :1]], axis=1)
        return CubicSpline(self.spacing * np.arange(closed.shape[1]), closed, axis=1, bc_type="periodic")


def realisation(
    roughness: Roughness,
    *,
    length: float,
    spacing: float,
    seed: int,
    speed: float | None = None,
    wavelength_min: float | None = None,
    wavelength_max: float | None = None,
) -> Realisation:
    """Draws one guideway.

    Parameters
    ----------
    roughness : spectra of the four types and their correlation
    length : distance after which it repeats, longest wavelength in it [m]
    spacing : between points [m]; wavelengths below two spacings are left out
    seed : of the random numbers; the same seed draws the same guideway
    speed : needed where a corner is given as a frequency [m/s]
    wavelength_min, wavelength_max : band of wavelengths drawn [m]; the rest is left smooth. Default: all the grid
    holds

    Returns
    -------
    Realisation
        Zero mean. Its mean square is Σ S(Ω_m)ΔΩ over the lines drawn, on the average over seeds.

    Raises
    ------
    InputError
        If the grid is impossible, the band empty, or a spectrum is asked outside its limits of validity.
    """
    if not (0 < spacing < np.inf and 8 * spacing <= length < np.inf):
        raise InputError(
            f"a realisation needs 0 < spacing and a length of at least 8 spacings; got spacing={spacing!r} m and "
            f"length={length!r} m. Lengthen it or refine the spacing."
        )
    n = round(length / spacing)
    if n > _POINTS_MAX:
        raise InputError(
            f"a realisation holds at most {_POINTS_MAX} points; got {n}. Shorten it or coarsen the spacing."
        )
    step = 2 * np.pi / (n * spacing)
    wavenumber = step * np.arange(n // 2 + 1)
    low = 2 * np.pi / wavelength_max if wavelength_max else step
    high = 2 * np.pi / wavelength_min if wavelength_min else np.pi / spacing
    # The line at zero is the mean, the one at π/spacing has no phase: both stay out. 1e-12: rounding of the band's
    # edges.
    drawn = (wavenumber >= low * (1 - 1e-12)) & (wavenumber <= high * (1 + 1e-12)) & (wavenumber > 0)
    drawn[-1] &= n % 2 == 1
    if not np.any(drawn):
        raise InputError(
            f"no line of the grid lies between wavelengths {wavelength_min!r} and {wavelength_max!r} m; the grid holds "
            f"{2 * spacing:g}…{n * spacing:g} m. Widen the band or lengthen the realisation."
        )
    lines = wavenumber[drawn]
    # density per rad/m from the one per hertz, so that a corner given in hertz needs the speed and nothing else does
    V = 1.0 if speed is None else speed
    _check_speed_given(roughness, speed)
    density = roughness.amplitude_psd(V * lines / (2 * np.pi), V) * V / (2 * np.pi)
    deviation = np.sqrt(np.diagonal(density, axis1=1, axis2=2).T * step)  # (4, lines): √(S ΔΩ)
    random = np.random.default_rng(seed)
    independent = random.standard_normal((2, 4, len(lines)))
    mixed = roughness.mixing() @ (independent[0] + 1j * independent[1])
    amplitudes = np.zeros((4, len(wavenumber)), complex)
    amplitudes[:, drawn] = deviation * mixed * (n / 2)  # height = Σ deviation (a cos − b sin), a and b of variance 1
    return Realisation(spacing=spacing, heights=np.fft.irfft(amplitudes, n, axis=1), seed=seed)


def _check_speed_given(roughness: Roughness, speed: float | None) -> None:
    if speed is None and any(getattr(s, "corner_frequency_hz", None) is not None for s in roughness.spectra):
        raise InputError(
            "a corner given as a frequency needs the speed; got speed=None. Give the vehicle's speed [m/s]."
        )
