"""Loops of a vehicle at its current patterns, one broken with the others closed, as frequency responses.

    Setting, Gains --S = (I + L)⁻¹ at a group's patterns--> L_i = 1/S_ii − 1 --> LoopCurve

|1 + L_i| = 1/|S_ii| ≥ 1/σ_max(S), so that no curve enters the circle of radius 1/M around −1 where σ_max(S) ≤ M.
"""

from dataclasses import dataclass

import numpy as np

from workbench.analysis.setting import Setting
from workbench.control import Gains
from workbench.control.loop import Subject
from workbench.errors import InputError
from workbench.lti.realisation import frequency_response
from workbench.result import Result, Row

CURVE_HZ = (1e-3, 1e3)  # the curves have come to rest at both ends, for modes between 0.05 and 100 Hz
POINTS = 1201


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LoopCurve(Result):
    """One loop's frequency response: group and pattern it belongs to, frequencies (k,) [Hz], L_i (k,)."""

    group: str
    name: str
    frequency_hz: np.ndarray
    loop: np.ndarray

    @property
    def closest(self) -> tuple[float, float]:
        """Smallest distance from −1 on the frequencies, and where [Hz]."""
        distance = np.abs(1 + self.loop)
        k = int(np.argmin(distance))
        return float(distance[k]), float(self.frequency_hz[k])

    def rows(self) -> list[Row]:
        distance, where = self.closest
        return [
            ("group", self.group, ""),
            ("loop", self.name, ""),
            ("distance from −1", distance, "1"),
            ("at", where, "Hz"),
        ]


def loop_curves(setting: Setting, gains: Gains, frequency_hz: np.ndarray | None = None) -> tuple[LoopCurve, ...]:
    """The loops at every pattern of every group, 0.001 … 1000 Hz unless given.

    Of four coil sets a group's first pattern moves front and rear together, its second one against the other.
    """
    f = np.geomspace(*CURVE_HZ, POINTS) if frequency_hz is None else np.asarray(frequency_hz, float)
    curves = []
    for subject in setting.subjects:
        closed = subject.close(gains)
        if closed.poles().real.max() >= 0:
            raise InputError(f"the loops of {subject.name} must be stable when closed; they are not. Change the gains.")
        S = frequency_response(*subject.sensitivity(closed), 2 * np.pi * f)
        for i in range(S.shape[1]):
            curves.append(
                LoopCurve(group=subject.name, name=_name(subject, i), frequency_hz=f, loop=1 / S[:, i, i] - 1)
            )
    return tuple(curves)


def _name(subject: Subject, pattern: int) -> str:
    """What a pattern moves: an actuator, or coil sets front and rear together or against each other."""
    law, column = subject.law, subject.patterns[:, pattern]
    driven = [k for k, weight in enumerate(column[law.count :]) if weight]
    if driven:
        return law.actuators[driven[0] // 2].name.replace("_", " ")
    stations = {x: weight for (x, y), weight in zip(law.positions, column, strict=False) if y > 0}  # right-hand sets
    if len(stations) != 2 or not all(stations.values()):
        return f"pattern {pattern + 1}"
    front, rear = (stations[x] for x in sorted(stations, reverse=True))
    return "front and rear together" if front * rear > 0 else "front against rear"
