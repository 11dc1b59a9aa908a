"""The gains that a study varies: given ones, else the problem's approved ones; a schedule's at each row's own speed.

Study, Source --Given.of--> gains or schedule --at(speed)--> name to value
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from workbench.control.schedule import Schedule
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.study.definition import Study
from workbench.study.source import Source


@dataclass(frozen=True)
class Given:
    """Gains by name, and their schedule over speed where they have one; neither where nothing was given."""

    gains: Mapping[str, float] | None
    schedule: Schedule | None

    @classmethod
    def of(cls, study: Study, source: Source, problem: Problem) -> "Given":
        """The study's own, else the problem's folder's, else those that problem.py approves."""
        if study.gains is not None:
            return cls(study.gains, study.schedule)
        if source.approved is not None:
            return cls(source.approved, source.schedule)
        return cls(None if problem.approved is None else problem.approved.as_dict(), None)

    def at(self, speed: float) -> Mapping[str, float]:
        """Name to value at a speed [m/s]; a speed that a schedule does not reach is refused."""
        if self.schedule is not None:
            return self.schedule.gains_at(speed).as_dict()
        if self.gains is None:
            raise InputError('the problem has no approved gains to vary; give some with gains = "FILE".')
        return self.gains

    def identity(self) -> dict[str, Any]:
        """Everything of it that rows depend on, in JSON's types."""
        return {
            "gains": None if self.gains is None else dict(self.gains),
            "schedule": None if self.schedule is None else self.schedule.to_dict(),
        }
