"""Ride comfort at every point of a vehicle: weighted and unweighted rms, indices, distance to a boundary.

    Setting, Gains --response spectra at one point--> figures of `ride`, Sperling's index, ratio to a PSD mask; N_MV

Wk alone makes a ride at 0.6 Hz look trivial: the rms below 1 Hz stands beside it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.analysis.comfort import Boundary, Mask, boundary, worst_ratio
from workbench.analysis.density import Psd
from workbench.analysis.rail_comfort import mean_comfort, sperling
from workbench.analysis.ride import Ride, ride
from workbench.analysis.setting import Setting
from workbench.analysis.spectra import response_spectra
from workbench.control import Gains
from workbench.result import Result, Row, plain

EXPOSURE = "1 h"
BAND_HZ = (0.01, 100.0)
NODES = 1201  # 300 a decade: a hundredth of the width of the sharpest mode allowed
DIRECTIONS = {"z": "vertical", "y": "lateral"}


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class PointComfort(Result):
    """Comfort at one point in one direction: the figures of `ride`, Sperling's index, the worst ratio to the mask."""

    point: str
    ride: Ride
    sperling: float
    mask_ratio: float
    mask_frequency_hz: float

    def rows(self) -> list[Row]:
        return [
            *((f"{self.point}, {name}", value, unit) for name, value, unit in self.ride.rows()),
            (f"{self.point}, Sperling index", self.sperling, "1"),
            (f"{self.point}, PSD over boundary", self.mask_ratio, "1"),
        ]


@dataclass(frozen=True, kw_only=True, repr=False)
class ComfortSummary(Result):
    """Comfort at every point and direction.

    boundary : names of the boundaries the mask ratios refer to, by direction (ISO 2631:1974 values, unverified)
    """

    points: tuple[PointComfort, ...]
    boundary: Mapping[str, str]
    _felt: Mapping[str, tuple[Psd, Psd]]  # vertical and lateral at each point that has both

    @cached_property
    def mean_comfort(self) -> Mapping[str, float]:
        """EN 12299's mean comfort index N_MV at each point that feels both directions."""
        return {point: mean_comfort(*both).index for point, both in self._felt.items()}

    def to_dict(self) -> dict[str, object]:
        return {**plain(self), "mean_comfort": plain(self.mean_comfort)}

    def worst_ratio(self, direction: str) -> tuple[float, str]:
        """Largest ratio of a PSD to the boundary in one direction, and where."""
        worst = max((p for p in self.points if p.ride.direction == direction), key=lambda p: p.mask_ratio)
        return worst.mask_ratio, f"{worst.point}, {worst.mask_frequency_hz:.3g} Hz"

    def rows(self) -> list[Row]:
        return [
            *(row for p in self.points for row in p.rows()),
            *((f"{k}, N_MV", v, "1") for k, v in self.mean_comfort.items()),
        ]


def mask_for(direction: str) -> Mask:
    """The mask that ride requirements and summaries refer to: ISO 2631:1974 reduced comfort, one hour."""
    limit: Boundary = boundary(EXPOSURE, direction)
    return limit.mask()


def comfort_summary(setting: Setting, gains: Gains) -> ComfortSummary:
    """Comfort figures of a stable vehicle, from spectra on 0.01 … 100 Hz.

    Directions in which no group of the setting moves are left out; N_MV needs both.
    """
    spectra = response_spectra(setting, gains, np.geomspace(*BAND_HZ, NODES))
    masks = {direction: mask_for(direction) for direction in DIRECTIONS.values()}
    points, felt = [], {}
    for axis, direction in DIRECTIONS.items():
        for point, density in spectra.of(f"acceleration_{axis}").items():
            if not density.any():
                continue
            psd = (spectra.frequency_hz, density)
            felt[point, direction] = psd
            found = worst_ratio(psd, masks[direction])
            points.append(
                PointComfort(
                    point=point, ride=ride(psd, direction), sperling=sperling(psd, direction),
                    mask_ratio=found.ratio, mask_frequency_hz=found.frequency_hz,
                )
            )  # fmt: skip
    both = [p for p in setting.points if (p, "vertical") in felt and (p, "lateral") in felt]
    return ComfortSummary(
        points=tuple(points),
        boundary={direction: mask.name for direction, mask in masks.items()},
        _felt={p: (felt[p, "vertical"], felt[p, "lateral"]) for p in both},
    )
