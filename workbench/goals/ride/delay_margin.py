"""Which further dead time a current pattern bears."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated, count
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found, MarginRequirement, Screened, of_stable
from workbench.lti.margin import channel_margin


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternDelayMargin(MarginRequirement):
    """Each current pattern bears a dead time [s], the others closed.

    Source: guide, Definitions: Margins at break points.
    """

    kind, sense, unit = "delay margin", ">=", "s"
    keys = (Key("delay_margin_at_least_ms", "limit", 1e-3),)

    def steer(self, point: Evaluated) -> Rows:
        """Damping ratios of the loop with the dead time asked for, in each pattern's command in turn."""
        out = []
        for group in point.groups:
            found = group.delayed_damping(point.theta, self.asked_at(point.back_off), count(group))
            out.append((f"{self.name} of {group.subject.name}", found.value, found.gradient))
        return out

    def found(self, loop: Flown) -> Found:
        return [self.least(loop)]

    def least(self, loop: Flown) -> tuple[float, str]:
        return min(
            (channel_margin(*s.sensitivity(closed), channel=i).delay, f"{s.name}, pattern {i + 1}")
            for s, closed in loop.closed
            for i in range(len(s.commands))
        )

    def screened(self, many: Screened) -> np.ndarray:
        own = [c.only(many.stable).delay()[0] for c in many.closed] if len(many.stable) else [np.zeros(0)]
        return of_stable(many, np.min(own, axis=0))

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        return ("delay_margin",)
