"""What a gain schedule must cover: speeds, margins, the degree of its polynomials."""

from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.goals.ride.requirement import Requirement, margin_kinds


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """What a schedule must cover.

    range : speeds [m/s], the problem's own (cruise) among them;  degree : of the polynomials
    points : speeds tuned at first;  dense : speeds of the check, equally spaced
    requirements : margins kept at every speed, of `margin_kinds()`
    """

    range: tuple[float, float]
    requirements: tuple[Requirement, ...]
    degree: int = 2
    points: int = 5
    dense: int = 209

    def __post_init__(self) -> None:
        low, high = self.range
        if not 0 < low < high < float("inf"):
            raise InputError(f"a schedule's range must rise from a positive speed; got {self.range!r} m/s.")
        if not (0 <= self.degree <= 6 and 2 <= self.points <= 60 and self.dense >= self.points):
            raise InputError(
                "a schedule takes degree 0 … 6, 2 … 60 points and at least as many speeds of the check; "
                f"got {self.degree}, {self.points} and {self.dense}."
            )
        odd = [r.name for r in self.requirements if not r.margin_alone]
        if odd or not self.requirements:
            raise InputError(
                f"a schedule asks every speed for some of: {', '.join(margin_kinds())}; got {', '.join(odd) or 'none'}."
            )

    @property
    def speeds(self) -> np.ndarray:
        """Of the dense check [m/s]."""
        return np.linspace(*self.range, self.dense)
