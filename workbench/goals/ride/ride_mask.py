"""How near the floor's acceleration comes to a comfort boundary at any frequency."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.analysis.comfort_summary import mask_for
from workbench.analysis.setting import Setting
from workbench.errors import InputError
from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found, Place, Requirement

AXES = {"vertical": "acceleration z", "lateral": "acceleration y"}  # classes of measures by direction of a mask


@dataclass(frozen=True, slots=True, kw_only=True)
class RideMask(Requirement):
    """Acceleration densities over the ride mask are at most this at every point and frequency of the mask."""

    sense, unit = "<=", "1"
    places = {  # noqa: RUF012 (a mapping that nobody changes)
        "vertical ride mask ratio": Place(Key("vertical_ride_mask_ratio_at_most", "limit"), direction="vertical"),
        "lateral ride mask ratio": Place(Key("lateral_ride_mask_ratio_at_most", "limit"), direction="lateral"),
    }

    def check(self, problem: str, setting: Setting) -> None:
        Requirement.check(self, problem, setting)
        aside = any(y != 0 for _, y, _ in setting.points.values())
        if not self.place.lateral and set(setting.groups) == {"sway_roll_yaw"} and not aside:
            raise InputError(
                f"{self.name!r} can be required only where a point of the ride moves up and down; problem {problem!r} "
                f"looks at {', '.join(setting.groups)}. Add the group heave_pitch or a point beside the middle, or "
                "drop the requirement."
            )

    def steer(self, point: Evaluated) -> Rows:
        """At the nodes that the mask covers; densities of all groups add up."""
        mask, axis = mask_for(self.place.direction), AXES[self.place.direction]
        hertz = point.groups[0].nodes / (2 * np.pi)
        ends = mask.frequency_hz[0], mask.frequency_hz[-1]
        inside = (hertz >= ends[0] * (1 - 1e-12)) & (hertz <= ends[1] * (1 + 1e-12))  # an end that is watched is inside
        allowed = mask.psd(np.clip(hertz[inside], *ends)) * self.asked_at(point.back_off)
        total: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        for found in point.responses:
            for place, density in found.densities.items():
                if place.startswith(axis):
                    value, slope = total.get(place, (0.0, 0.0))
                    total[place] = value + density.value[inside], slope + density.gradient[inside]
        return [(f"{self.name} at {place}", 1 - v / allowed, -d / allowed[:, None]) for place, (v, d) in total.items()]  # pyright: ignore[reportIndexIssue]

    def missed(self, loop: Flown, most: float) -> Iterable[float]:
        points = [p for p in loop.comfort.points if p.ride.direction == self.place.direction]
        return [2 * np.pi * p.mask_frequency_hz for p in points if p.mask_ratio > most]

    def found(self, loop: Flown) -> Found:
        """From spectra finer than the optimiser's grid."""
        return [loop.comfort.worst_ratio(self.place.direction)]

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        return (f"ride_mask_ratio.{self.place.direction}",)
