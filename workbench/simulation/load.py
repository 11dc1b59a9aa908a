"""What happens to a vehicle on its way: loads that come on, gusts, a coil set that fails.

Loads are (force down, pitch moment, force right, roll moment, yaw moment) about the centre of gravity [N, N m], beside
those of the operating point. `at(time)` takes times (k,) [s] and gives (5, k).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from workbench.errors import InputError


class Load(Protocol):
    """Loads over time."""

    def at(self, time: np.ndarray) -> np.ndarray:
        """(5, k) loads at times (k,) [s]."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadStep:
    """A load (5,) that comes on at `start` [s] and stays."""

    load: tuple[float, ...]
    start: float = 0.0

    def __post_init__(self) -> None:
        _check_load("LoadStep", self.load)

    def at(self, time: np.ndarray) -> np.ndarray:
        """0 before the start, the load from then on."""
        return np.outer(self.load, np.asarray(time) >= self.start)


@dataclass(frozen=True, slots=True, kw_only=True)
class Gust:
    """A load that rises to its peak (5,) and falls again as (1 − cos)/2, within `duration` [s] of `start` [s]."""

    peak: tuple[float, ...]
    start: float
    duration: float

    def __post_init__(self) -> None:
        _check_load("Gust", self.peak)
        if not 0 < self.duration < np.inf:
            raise InputError(
                f"Gust.duration must be positive and finite; got {self.duration!r} s. Use LoadStep for a lasting load."
            )

    def at(self, time: np.ndarray) -> np.ndarray:
        """The gust's loads."""
        share = np.clip((np.asarray(time, float) - self.start) / self.duration, 0.0, 1.0)
        return np.outer(self.peak, (1 - np.cos(2 * np.pi * share)) / 2)


@dataclass(frozen=True, slots=True, kw_only=True)
class Failure:
    """A coil set (counted from 1) that loses a share of its forces at `start` [s]."""

    lost_set: int
    start: float = 0.0
    share: float = 1.0

    def __post_init__(self) -> None:
        if not 0 <= self.share <= 1:
            raise InputError(
                f"Failure.share must lie between 0 and 1; got {self.share!r}. 1 loses the set's whole force."
            )

    def strength(self, time: np.ndarray, before: np.ndarray) -> np.ndarray:
        """(n, k) what each coil set keeps of its forces, `before` (n,) without the failure."""
        if self.lost_set not in range(1, len(before) + 1):
            raise InputError(
                f"Failure.lost_set must be 1 … {len(before)}, as the coil sets are named; got {self.lost_set!r}."
            )
        out = np.repeat(before[:, None], len(time), axis=1)
        out[self.lost_set - 1, np.asarray(time) >= self.start] *= 1 - self.share
        return out


def _check_load(name: str, load: tuple[float, ...]) -> None:
    if len(load) != 5 or not np.all(np.isfinite(load)):
        raise InputError(f"{name} needs five finite loads (force down, pitch, force right, roll, yaw); got {load!r}.")
