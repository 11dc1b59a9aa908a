"""Comfort indices of the railways, from the density of a stationary Gaussian acceleration.

    Sperling   Wz = (∫ B²(f) S(f) df)^(1/6.67), 0.5 … 30 Hz, acceleration in cm/s²
    EN 12299   N_MV = 6 √(a_xP95² + a_yP95² + a_zP95²), 95th percentiles of 5-second weighted rms values

Both were made for measured time histories. What stands here for the percentile: over a window of T = 5 s the mean
square of a Gaussian process has a mean and a variance that follow exactly from the density; its distribution is taken
as the gamma distribution with these two moments (the percentile is then right to 1 % for a sprung mass well damped and
1.5 % for one with damping 0.02, both at 0.6 Hz, by simulation). The standard takes the percentile of the 60 values
of one ride, which scatters about ours, and windows of a filtered record, whose beginning the filter still shapes.
"""

from dataclasses import dataclass

import numpy as np

from workbench.analysis.comfort import criteria, step_of_scale
from workbench.analysis.density import Psd, band, samples, value
from workbench.analysis.ride import Direction, rms, weight
from workbench.errors import InputError, unknown_name
from workbench.result import Result, Row

WINDOW = 5.0  # T [s], EN 12299


def sperling_comfort_weight(frequency_hz, direction: Direction = "vertical"):
    """B(f) [(cm/s²)⁻¹ up to the scale's power] of Sperling's ride comfort, elementwise (scalar, array, DM, SX).

    Source: two public codes agree.
    """
    f = frequency_hz
    k = {"vertical": 0.588, "lateral": 0.737}.get(direction)
    if k is None:
        raise unknown_name("direction", str(direction), ("vertical", "lateral"))
    return (
        k * ((1.911 * f**2 + (0.25 * f**2) ** 2) / ((1 - 0.277 * f**2) ** 2 + (1.563 * f - 0.0368 * f**3) ** 2)) ** 0.5
    )


def sperling_quality_weight(frequency_hz):
    """B(f) of Sperling's ride quality, which judges the vehicle and not the passenger; elementwise."""
    f = frequency_hz
    top = (1 - 0.056 * f**2) ** 2 + (0.645 * f) ** 2 * 3.55 * f**2
    bottom = ((1 - 0.252 * f**2) ** 2 + (1.547 * f - 0.00444 * f**3) ** 2) * (1 + 3.55 * f**2)
    return 1.14 * (top / bottom) ** 0.5


def sperling(psd: Psd, direction: Direction, *, quality: bool = False) -> float:
    """Sperling's index Wz [1] of an acceleration density [(m/s²)²/Hz], over 0.5 … 30 Hz (or the array's part of it).

    The word that belongs to it: step_of_scale("sperling", Wz).

    Examples
    --------
    >>> print(f"{sperling((np.array([1.0, 10.0]), np.array([0.01, 0.01])), 'vertical'):.2f}")
    2.48
    """
    low, high = (0.5, 30.0) if callable(psd) else np.clip(band(psd, None, None), 0.5, 30.0)
    f, width, density = samples(psd, float(low), float(high))
    B = sperling_quality_weight(f) if quality else sperling_comfort_weight(f, direction)
    return float((1e4 * width @ (B**2 * density)) ** (1 / 6.67))  # 1e4: (m/s²)² in (cm/s²)²


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MeanComfort(Result):
    """EN 12299's mean comfort index from densities."""

    index: float  # N_MV [1]
    word: str
    percentiles: tuple[float, float, float]  # longitudinal, lateral, vertical 95 % of 5-s weighted rms [m/s²]
    rms: tuple[float, float, float]  # weighted rms of the whole ride [m/s²]
    verified: bool

    def rows(self) -> list[Row]:
        """Index, word and percentiles."""
        axes = zip(("longitudinal", "lateral", "vertical"), self.percentiles, strict=True)
        return [
            ("N_MV", self.index, ""),
            ("comfort", self.word, ""),
            *((f"{name} 95th percentile", value, "m/s²") for name, value in axes),
            ("scale verified", self.verified, ""),
        ]


def mean_comfort(
    vertical: Psd, lateral: Psd, longitudinal: Psd | None = None, *, vertical_weighting: str = "Wb"
) -> MeanComfort:
    """N_MV of a ride whose floor accelerations are stationary and Gaussian.

    Parameters
    ----------
    vertical, lateral, longitudinal : [(m/s²)²/Hz]; no longitudinal acceleration: None
    vertical_weighting : "Wb" (ISO 8041-1) or "Wb_en12299"; horizontally Wd

    Source: comfort.toml, block en_12299 (unverified).
    """
    parts = ((longitudinal, "Wd"), (lateral, "Wd"), (vertical, vertical_weighting))
    felt = [(0.0, 0.0) if psd is None else percentile_of_windows(psd, weighting) for psd, weighting in parts]
    index = 6 * float(np.sqrt(sum(high**2 for _, high in felt)))
    x, y, z = felt
    return MeanComfort(
        index=index,
        word=step_of_scale("en_12299", index),
        percentiles=(x[1], y[1], z[1]),
        rms=(x[0], y[0], z[0]),
        verified=criteria()["en_12299"]["verified"],
    )


def percentile_of_windows(
    psd: Psd, weighting: str | None, *, window: float = WINDOW, probability: float = 0.95
) -> tuple[float, float]:
    """Rms of a stationary Gaussian acceleration, and the percentile of its rms over windows, both weighted [m/s²].

    The mean square over a window T has the variance (4/T) ∫₀^T (1 − τ/T) R(τ)² dτ with the autocovariance R; a gamma
    distribution with that mean and variance gives the percentile.
    """
    from scipy.special import gammaincinv

    if not 0 < window < np.inf or not 0 < probability < 1:
        raise InputError(
            f"a percentile needs window > 0 [s] and 0 < probability < 1; got {window!r}, {probability!r}. Give those."
        )
    sigma = rms(psd, weighting)
    if sigma == 0:
        return 0.0, 0.0
    R, step = _autocovariance(psd, weighting, window)
    R = R * (sigma**2 / R[0])  # the uniform grid's σ² misses that of `rms` by its resolution
    tau = step * np.arange(len(R))
    variance = 4 / window * np.trapezoid((1 - tau / window) * R**2, tau)
    freedom = 2 * sigma**4 / variance
    # a χ² percentile of that many degrees of freedom, per degree
    return sigma, float(sigma * np.sqrt(2 * gammaincinv(freedom / 2, probability) / freedom))


def _autocovariance(psd: Psd, weighting: str | None, window: float) -> tuple[np.ndarray, float]:
    """R(τ) for τ = 0, step, … ≤ window, by a cosine transform of the density's means over narrow bins.

    Bins of 1/(32 T) make the transform repeat after 32 T, long after R has died away in the bins' own resolution.
    """
    low, high = band(psd, None, None)
    width = 1 / (32 * window)
    if high / width > 2**20:
        raise InputError(
            f"a window must hold at most {2**15} periods of the highest frequency; got {window:g} s up to {high:g} Hz. "
            "Shorten it or end the PSD lower."
        )
    count = int(2 ** np.ceil(np.log2(high / width)))
    centre = width * np.arange(1, count + 1)  # bin k runs from (k − ½) to (k + ½) widths
    node = np.concatenate([centre - width / 12**0.5, centre + width / 12**0.5])  # two Gauss points per bin
    inside = (node >= low) & (node <= high)
    density = np.zeros_like(node)
    density[inside] = value(psd, node[inside])
    if weighting is not None:
        density[inside] *= weight(weighting).magnitude(node[inside]) ** 2
    mean = density.reshape(2, -1).mean(axis=0)
    # R(τ_j) = Σ_k mean_k width cos(2πk j/(2·count)): a real inverse FFT of length 2·count
    R = np.fft.irfft(np.concatenate([[0.0], mean * width]), 2 * count) * count
    step = 1 / (2 * count * width)
    return R[: int(window / step) + 1], step
