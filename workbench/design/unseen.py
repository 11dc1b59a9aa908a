"""What exact measures say of a programme's solution that its grid did not see: what an exchange adds to the programme.

    Programme, theta --peaks of σ_max(S), worst places of ride masks--> Watched: frequencies
                     --exact mean squares--> Calibrated: factors on the grid's

So a smooth programme ends where the exact measures, which judge, are within its back-off of what steers it.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.goals.ride.flown import Flown

if TYPE_CHECKING:
    from workbench.design.steering import Programme

LOWEST = 0.1  # of the grid's lowest frequency, where responses are those at rest
SHARE = 0.5  # of the back-off that a measure may be off before it is mended


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
    loop = Flown(programme.problem.setting, Gains(**dict(zip(GAIN_NAMES, theta.tolist(), strict=True))))
    near = SHARE * programme.back_off
    omega = [w for r in programme.asked.values() for w in r.missed(loop, r.asked_at(near))]
    return (*_watched(programme, omega), *_calibrated(programme, theta, loop))


def _watched(programme: "Programme", omega: list[float]) -> list[Watched]:
    """Those of the frequencies that are not watched yet. For zero: one far below the grid's."""
    group = programme.groups[0]
    least = group.omega.min() * LOWEST
    places = dict.fromkeys(max(w, least) for w in omega)
    return [Watched(w) for w in places if not np.isclose(group.watched, w, rtol=1e-9, atol=0).any()]


def _calibrated(programme: "Programme", theta: np.ndarray, loop: Flown) -> list[Calibrated]:
    """Factors on the required mean squares that are off by more than a share of the back-off."""
    rests = [r for r in programme.asked.values() if r.rests_on_squares]
    if not rests:
        return []
    squares = programme.evaluated(theta).squares
    found = []
    for place, value in {k: v for r in rests for k, v in r.squares(loop.analysis).items()}.items():
        if value is not None and squares[place] > 0 and abs(value / squares[place] - 1) > SHARE * programme.back_off:
            found.append(Calibrated(place, value / squares[place]))
    return found
