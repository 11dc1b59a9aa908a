"""A vehicle flown with given gains: what its requirements are judged on, each part computed once, when asked for."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from workbench.analysis.analysis import Analysis, analyse
from workbench.analysis.break_points import BreakPoint, break_points, together
from workbench.analysis.change import Change
from workbench.analysis.comfort_summary import ComfortSummary, comfort_summary
from workbench.analysis.setting import Setting
from workbench.analysis.variations import Closed, closed
from workbench.control import Gains
from workbench.control.loop import Subject
from workbench.lti.plant import Plant


@dataclass(frozen=True)
class Flown:
    """known : the analysis of these gains, where there is one already."""

    setting: Setting
    gains: Gains
    known: Analysis | None = field(default=None, repr=False)
    _changed: dict[Change, Closed] = field(default_factory=dict, init=False, repr=False)

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
    def together(self) -> tuple[BreakPoint, ...]:
        """Margins of several signals at once, each with a factor of its own."""
        return together(self.setting, self.gains)

    def changed(self, change: Change) -> Closed:
        """The loop under one change: its roots, and its peaks where they are asked for, which take most of the time."""
        alike = change.alike
        if alike not in self._changed:
            self._changed[alike] = closed(self.setting, self.gains, alike)
        return self._changed[alike]

    @cached_property
    def comfort(self) -> ComfortSummary:
        """Comfort figures, from spectra finer than an optimiser's grid."""
        return comfort_summary(self.setting, self.gains)
