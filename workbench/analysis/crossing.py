"""How often a vehicle touches its guideway: level crossings of the distance between coil edges and guideway.

    mean, variance, variance of the rate of a distance --Rice--> expected crossings of zero per hour

    ν = (1/2π) (σ_rate/σ) exp(−m²/2σ²)        Source: S. O. Rice, Bell System Technical Journal 24 (1945) 46

Assumption: the distance is Gaussian, with the mean and variance of the bent loop. A vehicle that loses its damping
while it rides high or low (flutter) touches more often; no crossing rate foresees that, damping at gap offsets does.
The rate is that of the distance averaged over the time in which a coil's length passes, since a wall without a shortest
wavelength is crossed infinitely often.
"""

from dataclasses import dataclass

import numpy as np

from workbench.analysis.closure import SIGNALS, Passage, own
from workbench.analysis.setting import Setting

PASSES = 20  # coil lengths' frequencies V/L up to which the guideway's own rate is summed
SURFACES = ("floor", "wall")


@dataclass(frozen=True)
class Contacts:
    """Of the n sets' distances from floor and wall, each at the edge that touches most often.

    distance, sigma : (n, 2) mean and standard deviation [m];  logarithm : (n, 2) of the rate ν [1/s]
    row : (n, 2, 3) the distance by Δh, Δh', φ;  speed : (n, 2) variance of its rate [m²/s²]
    smooth : (K,) what of a density at each frequency counts in that [1/s²]
    """

    distance: np.ndarray
    sigma: np.ndarray
    logarithm: np.ndarray
    row: np.ndarray
    speed: np.ndarray
    smooth: np.ndarray

    @property
    def per_hour(self) -> float:
        """Expected contacts in an hour, sets and surfaces added."""
        return float(np.exp(self.logarithm_per_hour))

    @property
    def logarithm_per_hour(self) -> float:
        """Its logarithm, which does not vanish for a vehicle that never touches."""
        return float(np.logaddexp.reduce(self.logarithm.ravel()) + np.log(3600))

    @property
    def worst(self) -> tuple[int, int]:
        """Which set, and floor (0) or wall (1), touches most often."""
        found = np.unravel_index(int(np.argmax(self.logarithm)), self.logarithm.shape)
        return int(found[0]), int(found[1])

    @staticmethod
    def named(coil_set: int, surface: int) -> str:
        """One of them, in words."""
        return f"{SURFACES[surface]}, set {coil_set + 1}"


def crossings(setting: Setting, found: Passage) -> Contacts:
    """Rates at which the distances reach zero."""
    loop, bend, n = found.loop, found.loop.bend, found.loop.sets
    f = np.arange(len(loop.wind)) / loop.duration
    smooth = _rate_passed(f, bend.length / setting.speed)
    between = loop.mean_squares(smooth[:, None, None] * found.after.spectrum.real).reshape(n, SIGNALS, n, SIGNALS)
    distance = bend.clear + np.einsum("isej,ij->ise", bend.edges, found.after.mean[:, :3])
    spread = [
        np.einsum("isej,ijk,isek->ise", bend.edges, part[:, :3, :3], bend.edges)
        for part in (found.covariance, own(between))
    ]
    spread[1] += np.einsum("isej,ij->ise", bend.edges[..., :2] ** 2, _beyond(setting, f[-1], bend.length))
    with np.errstate(divide="ignore"):
        logarithm = 0.5 * np.log(spread[1] / spread[0]) - np.log(2 * np.pi) - distance**2 / (2 * spread[0])
    logarithm = np.where(distance > 0, logarithm, np.inf)
    worst = np.argmax(logarithm, axis=2)[..., None]

    def there(values: np.ndarray) -> np.ndarray:
        return np.take_along_axis(values, worst, axis=2)[..., 0]

    row = np.take_along_axis(bend.edges, worst[..., None], axis=2)[:, :, 0]
    return Contacts(there(distance), np.sqrt(there(spread[0])), there(logarithm), row, there(spread[1]), smooth)


def _rate_passed(frequency_hz: np.ndarray, time: float) -> np.ndarray:
    """ω² of a rate, times what averaging over a time [s] leaves of it."""
    return (2 * np.pi * frequency_hz * np.sinc(frequency_hz * time)) ** 2


def _beyond(setting: Setting, lowest_hz: float, length: float) -> np.ndarray:
    """(n, 2) variance of the guideway's rate under each set above a frequency, of ζ and η [m²/s²]."""
    n = len(setting.sets)
    f = np.linspace(lowest_hz, PASSES * setting.speed / length, 4001)
    density = np.array([np.diag(one).real for one in setting.guideway.input_psd(f, setting.speed, setting.sets)])
    passed = _rate_passed(f, length / setting.speed)[:, None] * density
    return np.trapezoid(passed, f, axis=0).reshape(2, n).T
