"""A goal held against an exact value: what was asked, what is, whether it is met, and where it is tightest."""

from dataclasses import dataclass, field

from workbench.goals.promise import Sense
from workbench.result import Result, Row

CLOSE_ENOUGH = 1e-9  # relative; a value at its limit to nine digits is met
OWN = {"absent": True}  # of a field that a record leaves out where it says nothing


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Verdict(Result):
    """One goal, judged.

    name, sense, limit, unit : what was asked, in the goal's own unit
    value : exact, in that unit; None where there is none (an unstable loop), and `where` says why
    upper : the unfavourable end of the value's bracket, where the method gives a bracket; it decides
    model, method : of a plant of one's own: on which of its models the value was found, and how
    """

    name: str
    sense: Sense
    limit: float
    value: float | None
    unit: str
    met: bool
    where: str
    model: str = field(default="", metadata=OWN)
    method: str = field(default="", metadata=OWN)
    upper: float | None = field(default=None, metadata=OWN)

    def rows(self) -> list[Row]:
        return [
            ("requirement", f"{self.name} {self.sense} {self.limit:g}", self.unit),
            ("value", self.value, self.unit),
            ("met", self.met, ""),
            ("where", self.where, ""),
        ]

    def sentence(self) -> str:
        """How the requirement misses, for a person."""
        value = "no value" if self.value is None else f"{self.value:.4g} {self.unit}".removesuffix(" 1")
        return (
            f"{self.name!r} must be {self.sense} {self.limit:g} {self.unit}".removesuffix(" 1")
            + f"; best found {value} ({self.where})"
        )


def shortfall(sense: str, limit: float, value: float) -> float:
    """By which fraction of its limit a value misses it; negative or zero where it is met."""
    gap = value / limit - 1.0
    return gap if sense == "<=" else -gap
