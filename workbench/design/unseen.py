"""What exact measures say of a programme's solution that its grid did not see: what an exchange adds to the programme.

    Programme, theta --peaks of σ_max(S), worst places of ride masks--> Watched: frequencies
                     --exact mean squares--> Calibrated: factors on the grid's

So a smooth programme ends where the exact measures, which judge, are within its back-off of what steers it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from workbench.analysis.analysis import Analysis, analyse
from workbench.analysis.comfort_summary import comfort_summary
from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.design.problem import Problem
from workbench.design.requirement import MOTOR_CURRENT, RIDE_MASKS
from workbench.lti.norm import peak_gain

if TYPE_CHECKING:
    from workbench.design.steering import Programme

LOWEST = 0.1  # of the grid's lowest frequency, where responses are those at rest
SHARE = 0.5  # of the back-off that a measure may be off before it is mended

# Requirement to the mean squares it rests on: class of the steering measures, and its exact value
_SQUARES: dict[str, dict[str, Callable[[Analysis], float | None]]] = {
    **{
        name: {f"{word}, {end}": lambda a, kind=kind, end=end: _squared(a.rms[kind][end]) for end in ends}
        for word, kind in (("gap", "gap"), ("lateral gap", "gap_lateral"))
        for name, ends in (
            (f"rms {word}, front", ("front",)),
            (f"rms {word}, rear", ("rear",)),
            (f"peak {word} change", ("front", "rear")),
        )
    },
    "sum of mean square currents": {"currents": lambda a: a.sum_alpha_squared},
    MOTOR_CURRENT: {
        "motor d": lambda a: _in_rated(a, "rms_d"),
        "motor q": lambda a: _in_rated(a, "rms_q"),
    },
}


@dataclass(frozen=True, slots=True)
class Watched:
    """A frequency at which sensitivity and densities are constrained from now on."""

    omega: float  # [rad/s]


@dataclass(frozen=True, slots=True)
class Calibrated:
    """A factor on the mean square of a class: what the grid was off from the exact measure."""

    name: str
    factor: float


Unseen = Watched | Calibrated


def unseen(programme: "Programme", theta: np.ndarray) -> tuple[Unseen, ...]:
    """What is to be added to a programme, from exact measures at one theta; nothing from an unstable loop."""
    if programme.abscissa(theta) >= 0:
        return ()
    gains = Gains(**dict(zip(GAIN_NAMES, theta.tolist(), strict=True)))
    omega = [*_sensitivities(programme, gains), *_densities(programme, gains)]
    return (*_watched(programme, omega), *_calibrated(programme, theta, gains))


def exact_peaks(problem: Problem, gains: Gains) -> list[tuple[int, float, float]]:
    """(group number, frequency [rad/s], σ_max(S)) at the exact peak of each group; nothing for an unstable one."""
    out = []
    for number, subject in enumerate(problem.subjects):
        closed = subject.close(gains)
        if closed.poles().real.max() < 0:
            peak = peak_gain(*subject.sensitivity(closed))
            if np.isfinite(peak.frequency):
                out.append((number, peak.frequency, peak.upper))
    return out


def _sensitivities(programme: "Programme", gains: Gains) -> list[float]:
    """Frequencies [rad/s] of peaks above what steers."""
    limit = programme.sensitivity_limit
    if not limit:
        return []
    most = limit * (1 - SHARE * programme.back_off)
    return [omega for _, omega, value in exact_peaks(programme.problem, gains) if value > most]


def _densities(programme: "Programme", gains: Gains) -> list[float]:
    """Frequencies [rad/s] where a density exceeds its mask by more than it may, the worst of every point."""
    asked = {RIDE_MASKS[name]: limit for name, limit in programme.limits.items() if name in RIDE_MASKS}
    if not asked:
        return []
    points = comfort_summary(programme.problem.setting, gains).points
    most = {direction: limit * (1 - SHARE * programme.back_off) for direction, limit in asked.items()}
    return [2 * np.pi * p.mask_frequency_hz for p in points if p.mask_ratio > most.get(p.ride.direction, np.inf)]


def _watched(programme: "Programme", omega: list[float]) -> list[Watched]:
    """Those of the frequencies that are not watched yet. For zero: one far below the grid's."""
    group = programme.groups[0]
    least = group.omega.min() * LOWEST
    places = dict.fromkeys(max(w, least) for w in omega)
    return [Watched(w) for w in places if not np.isclose(group.watched, w, rtol=1e-9, atol=0).any()]


def _calibrated(programme: "Programme", theta: np.ndarray, gains: Gains) -> list[Calibrated]:
    """Factors on the required mean squares that are off by more than a share of the back-off."""
    wanted = {place: exact for name in programme.limits for place, exact in _SQUARES.get(name, {}).items()}
    if not wanted:
        return []
    analysis, squares = analyse(programme.problem.setting, gains), programme.evaluated(theta).squares
    found = []
    for place, exact in wanted.items():
        value = exact(analysis)
        if value is not None and squares[place] > 0 and abs(value / squares[place] - 1) > SHARE * programme.back_off:
            found.append(Calibrated(place, value / squares[place]))
    return found


def _squared(value: float | None) -> float | None:
    return None if value is None else value**2


def _in_rated(a: Analysis, axis: str) -> float | None:
    """Mean square of a motor current in rated currents."""
    value = None if a.motor is None else getattr(a.motor, axis)
    return None if value is None or a.motor is None else (value / a.motor.rated_current) ** 2
