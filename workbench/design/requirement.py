"""What a design must satisfy: named limits on quantities of an analysis.

Each quantity is read from an `Analysis`, that is from the exact measures, when a requirement is judged; the optimiser
steers by smooth measures of the same name (`design.measures`).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

from workbench.errors import InputError, unknown_name
from workbench.goals.verdict import CLOSE_ENOUGH, Verdict, shortfall

MOTOR_CURRENT = "motor current at mean + 3σ"
# name: (sense, unit, key in data files, factor from the key's unit to SI)
QUANTITIES = {
    "damping ratio": (">=", "1", "damping_ratio_at_least", 1.0),
    "decay rate": (">=", "1/s", "decay_rate_at_least_per_s", 1.0),
    "peak sensitivity": ("<=", "1", "peak_sensitivity_at_most", 1.0),
    "delay margin": (">=", "s", "delay_margin_at_least_ms", 1e-3),
    "rms gap, front": ("<=", "m", "rms_gap_front_at_most_mm", 1e-3),
    "rms gap, rear": ("<=", "m", "rms_gap_rear_at_most_mm", 1e-3),
    "rms lateral gap, front": ("<=", "m", "rms_lateral_gap_front_at_most_mm", 1e-3),
    "rms lateral gap, rear": ("<=", "m", "rms_lateral_gap_rear_at_most_mm", 1e-3),
    "sum of mean square currents": ("<=", "1", "sum_alpha_squared_at_most", 1.0),
    "static gap error from bias": ("<=", "m", "static_gap_error_at_most_mm", 1e-3),
    "static lateral gap error from bias": ("<=", "m", "static_lateral_gap_error_at_most_mm", 1e-3),
    "peak gap change": ("<=", "m", "peak_gap_change_at_most_mm", 1e-3),
    "peak lateral gap change": ("<=", "m", "peak_lateral_gap_change_at_most_mm", 1e-3),
    "vertical ride mask ratio": ("<=", "1", "vertical_ride_mask_ratio_at_most", 1.0),
    "lateral ride mask ratio": ("<=", "1", "lateral_ride_mask_ratio_at_most", 1.0),
    MOTOR_CURRENT: ("<=", "A", "motor_current_at_most_a", 1.0),
}
RIDE_MASKS = {"vertical ride mask ratio": "vertical", "lateral ride mask ratio": "lateral"}  # name to direction
STABLE_DECAY = 1e-3  # [1/s] kept by a design even where no decay rate is asked for


@dataclass(frozen=True, slots=True)
class Requirement:
    """One limit: the quantity must be >= or <= limit (SI units)."""

    name: str
    limit: float
    hard: ClassVar[bool] = True
    corners: ClassVar[bool] = False  # it steers by many smooth rows

    def __post_init__(self) -> None:
        if self.name not in QUANTITIES:
            raise unknown_name("requirement", self.name, QUANTITIES)
        if not 0 < self.limit < float("inf"):
            raise InputError(f"the limit of {self.name!r} must be positive and finite; got {self.limit!r}.")

    @property
    def sense(self) -> str:
        """ ">=" or "<="."""
        return QUANTITIES[self.name][0]

    @property
    def unit(self) -> str:
        """SI unit of limit and value."""
        return QUANTITIES[self.name][1]

    def shortfall(self, value: float) -> float:
        """By which fraction of the limit a value misses it; negative or zero where it is met."""
        return shortfall(self.sense, self.limit, value)


def strictest(requirements: Iterable[Requirement]) -> dict[str, float]:
    """Name to limit: of several on one quantity the one that implies the others."""
    out: dict[str, float] = {}
    for r in requirements:
        known = out.get(r.name, r.limit)
        out[r.name] = min(known, r.limit) if r.sense == "<=" else max(known, r.limit)
    return out


def judge(requirement: Requirement, value: float | None, where: str) -> Verdict:
    """The verdict on one value; None (an unstable loop, an unfiltered rate) is never met, and `where` says why."""
    met = value is not None and requirement.shortfall(value) <= CLOSE_ENOUGH
    return Verdict(
        name=requirement.name, sense=requirement.sense, limit=requirement.limit, value=value,
        unit=requirement.unit, met=met, where=where,
    )  # fmt: skip
