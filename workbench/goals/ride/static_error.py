"""How far accelerometers that read wrong move the vehicle at rest."""

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found, Place, Requirement


@dataclass(frozen=True, slots=True, kw_only=True)
class StaticGapError(Requirement):
    """The static change of a gap [m] under the worst signs of bias is at most this.

    Source: guide, Definitions: Static error.
    """

    sense, unit = "<=", "m"
    in_analysis = True
    places = {  # noqa: RUF012 (a mapping that nobody changes)
        "static gap error from bias": Place(Key("static_gap_error_at_most_mm", "limit", 1e-3), "gap"),
        "static lateral gap error from bias": Place(
            Key("static_lateral_gap_error_at_most_mm", "limit", 1e-3), "gap_lateral"
        ),
    }

    def steer(self, point: Evaluated) -> Rows:
        limit, static = self.asked_at(point.back_off), point.static[self.place.kind]
        return [(self.name, 1 - static.value / limit, -static.gradient / limit)]

    def found(self, loop: Flown) -> Found:
        return [(loop.analysis.static_error[self.place.kind], "worst coil set and signs of bias")]

    def quantities(self, groups: Sequence[str]) -> tuple[str, ...]:
        return (f"static_error.{self.place.kind}",)
