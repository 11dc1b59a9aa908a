"""Frequencies worth looking at: made from poles and corners, so that no resonance falls between two of them.

    poles --special--> |p|, |Im p|, resonance      --spread--> points per decade around and between
    poles, corners --seeds--> a rising grid of a band, three widths around every resonance

All [rad/s], in the plane the poles are given in.
"""

import math

import numpy as np

NEIGHBOURS = {  # of a resonance, in widths |Re p|, and points per decade in between
    "sparse": (np.zeros(1), 3),  # where the Hamiltonian checks
    "normal": (np.array([-8, -4, -2, -1, -0.5, 0, 0.5, 1, 2, 4, 8]), 8),
    "dense": (np.linspace(-10, 10, 81), 80),
}


def resonance(poles: np.ndarray) -> np.ndarray:
    """Where |1/(s − p)(s − p*)| peaks, √(Im² p − Re² p), 0 for damped ones; the shape of the poles."""
    return np.sqrt(np.maximum(np.abs(poles) ** 2 - 2 * poles.real**2, 0))


def special(poles: np.ndarray) -> np.ndarray:
    """|p|, |Im p| and the resonance of every pole, (3 k,)."""
    return np.concatenate([np.abs(poles), np.abs(poles.imag), resonance(poles)])


def spread(poles: np.ndarray, count: int) -> np.ndarray:
    """`count` frequencies in equal ratios over the decades of the poles and around them; 1 without poles."""
    size = np.abs(poles)
    size = size[size > 0]
    return np.geomspace(size.min() / 10, size.max() * 10, count) if len(size) else np.ones(1)


def around(poles: np.ndarray) -> np.ndarray:
    """0, each pole's natural and resonance frequency, and points between and around them; few, for inner loops."""
    points = special(poles)
    points = np.unique(points[points > 0])
    if len(points) == 0:
        return np.zeros(1)
    apart = points[np.r_[True, np.diff(points) > 1e-3 * points[:-1]]]
    between = np.sqrt(apart[1:] * apart[:-1])
    ends = [apart[0] / 30, apart[0] / 5, 5 * apart[-1], 30 * apart[-1]]
    return np.concatenate([[0.0], points, between, ends])


def seeds(poles: np.ndarray, corners: np.ndarray, band: tuple[float, float], density: str = "normal") -> np.ndarray:
    """Frequencies (k,) in the band, sorted: around every resonance, at every corner, and spread in between.

    `density` is a key of `NEIGHBOURS`. The ends of the band belong to it; 0 and ∞ where it has no other end.
    """
    near, count = NEIGHBOURS[density]
    poles = poles[np.isfinite(poles) & (poles.imag >= 0)]
    size = np.abs(poles)
    around = (poles.imag[:, None] + np.abs(poles.real)[:, None] * near).ravel()
    scale = np.concatenate([size[size > 0], corners[(corners > 0) & np.isfinite(corners)]])
    scale = np.concatenate([scale, [end for end in band if 0 < end < math.inf]])
    scale = scale if len(scale) else np.ones(1)
    low, high = max(scale.min() / 100, band[0]), min(scale.max() * 100, band[1])
    spread = np.geomspace(low, high, 8 + math.ceil(count * math.log10(high / low))) if high > low else np.zeros(0)
    points = np.concatenate([around, size, corners, spread])
    points = points[(points > band[0]) & (points < band[1])]
    return np.unique(np.concatenate([[band[0]], points, [band[1]]]))
