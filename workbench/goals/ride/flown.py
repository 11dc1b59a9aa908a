"""A vehicle flown with given gains: what its requirements are judged on, each part computed once, when asked for."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from workbench.analysis.analysis import Analysis, analyse
from workbench.analysis.break_points import BreakPoint, break_points
from workbench.analysis.comfort_summary import ComfortSummary, comfort_summary
from workbench.analysis.setting import Setting
from workbench.analysis.variations import Varied, variations
from workbench.control import Gains
from workbench.control.loop import Subject
from workbench.lti.plant import Plant


@dataclass(frozen=True)
class Flown:
    """known : the analysis of these gains, where there is one already."""

    setting: Setting
    gains: Gains
    known: Analysis | None = field(default=None, repr=False)

    @cached_property
    def analysis(self) -> Analysis:
        """Modes, random response, static errors, peaks."""
        return self.known if self.known is not None else analyse(self.setting, self.gains)

    @cached_property
    def closed(self) -> list[tuple[Subject, Plant]]:
        """Each group of motion, and its closed loop."""
        return [(subject, subject.close(self.gains)) for subject in self.setting.subjects]

    @cached_property
    def poles(self) -> list[np.ndarray]:
        """Roots of each group."""
        return [closed.poles() for _, closed in self.closed]

    @cached_property
    def stable(self) -> bool:
        """Whether every root decays."""
        return all(poles.real.max() < 0 for poles in self.poles)

    @cached_property
    def break_points(self) -> tuple[BreakPoint, ...]:
        """Margins wherever the loop may be broken."""
        return break_points(self.setting, self.gains)

    @cached_property
    def variations(self) -> tuple[Varied, ...]:
        """The loop under variations and losses."""
        return variations(self.setting, self.gains)

    @cached_property
    def comfort(self) -> ComfortSummary:
        """Comfort figures, from spectra finer than an optimiser's grid."""
        return comfort_summary(self.setting, self.gains)
