"""What is read of a flight: accelerations, gaps and currents at named places, and how the accelerations are felt.

    rates, deviations, currents (k, b, …) --Reader--> series (k, b, s) --squares over time--> figures

The names are those of `analysis.Analysis.rms`, so that both can be laid side by side.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.analysis.response import WEIGHTING
from workbench.analysis.ride import weight
from workbench.simulation.exponential import Stretch
from workbench.simulation.history import point_row
from workbench.simulation.rig import Rig

ENDS = ("front", "rear")
UNITS = {"acceleration_z": "m/s²", "acceleration_y": "m/s²", "gap": "m", "gap_lateral": "m", "current": "of main coil"}
Places = Mapping[str, tuple[float, float, float]]


def usual_places(rig: Rig) -> dict[str, tuple[float, float, float]]:
    """Centre of gravity, front and rear, (x, y, z) from the centre of gravity [m]."""
    return {"cg": (0.0, 0.0, 0.0), "front": (rig.vehicle.front, 0.0, 0.0), "rear": (-rig.vehicle.rear, 0.0, 0.0)}


def end_commands(rig: Rig) -> dict[str, int]:
    """The command of a foremost and of a hindmost right-hand coil set."""
    right = [(x, i) for i, (x, y) in enumerate(rig.vehicle.command_positions) if y > 0]
    return dict(zip(ENDS, (max(right)[1], min(right)[1]), strict=True))


@dataclass(frozen=True)
class Reader:
    """Series of a rig's flights: accelerations at places, mean gap changes and currents of both ends.

    places : name to (x, y, z) from the centre of gravity [m]
    """

    rig: Rig
    places: Places

    @cached_property
    def names(self) -> tuple[tuple[str, str], ...]:
        """Quantity and place of each series."""
        ends = [(quantity, end) for quantity in ("gap", "gap_lateral", "current") for end in ENDS]
        return (*((quantity, place) for quantity in WEIGHTING for place in self.places), *ends)

    @cached_property
    def _matrix(self) -> np.ndarray:
        """(series, 5 + 3n + m) from accelerations, deviations set by set, currents."""
        n, m = self.rig.vehicle.count, len(self.rig.resting)
        out = np.zeros((len(self.names), 5 + 3 * n + m))
        ends = end_commands(self.rig)
        for row, (quantity, place) in zip(out, self.names, strict=True):
            if quantity in WEIGHTING:
                row[:5] = point_row(self.places[place], quantity[-1])
            elif quantity == "current":
                row[5 + 3 * n + ends[place]] = 1.0
            else:
                sets = list(self.rig.vehicle.groups[ends[place]])
                row[[5 + 3 * i + ("gap", "gap_lateral").index(quantity) for i in sets]] = 1 / len(sets)
        return out

    @cached_property
    def _resting(self) -> np.ndarray:
        """Of deviations, where the vehicle rests."""
        return self.rig.point.deviation.ravel("F")

    def series(self, stretch: Stretch) -> tuple[np.ndarray, np.ndarray]:
        """(k, b, s) of the linear and of the nonlinear flights, changes from rest."""
        m = len(self.rig.resting)
        linear = stretch.linear_rate[:, :, 5:10], stretch.linear_deviation, stretch.linear[:, :, 10 : 10 + m]
        flown = stretch.rate[:, :, 5:10], stretch.deviation - self._resting, stretch.state[:, :, 10 : 10 + m]
        one, other = (np.concatenate(parts, axis=2) @ self._matrix.T for parts in (linear, flown))
        return one, other

    @cached_property
    def felt(self) -> dict[str, list[int]]:
        """The weighting of accelerations to the series it belongs to: those at the three places of the cost."""
        at = usual_places(self.rig)
        return {
            weighting: [self.names.index((quantity, place)) for place in at if place in self.places]
            for quantity, weighting in WEIGHTING.items()
        }


def digital_weight(name: str, step: float) -> np.ndarray:
    """(4 or 3, 6) second-order sections of a frequency weighting at a step [s], by Tustin; as scipy.signal.sosfilt."""
    from scipy.signal import bilinear

    rows = []
    for frequency_hz, quality, (b0, b1, b2) in weight(name).sections:
        omega = 2 * np.pi * frequency_hz
        above, below = [b2 / omega**2, b1 / omega, b0], [1 / omega**2, 1 / (quality * omega), 1.0]
        rows.append(np.concatenate(bilinear(above, below, fs=1 / step)))  # pyright: ignore[reportCallIssue]
    return np.array(rows)
