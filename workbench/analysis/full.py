"""An analysis with its margins: one channel broken at a time, all channels perturbed at once.

Setting, Gains --> Analysis;  loop at the current commands --> margins of each α_i, multiloop disk margin
                              loop at the modal signals   --> margins of each K_i q_i^c
                              loop at the sensors         --> margins of each reading that the law uses
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from workbench.analysis.analysis import Analysis, analyse
from workbench.analysis.break_points import at_commands, at_modal_signals
from workbench.analysis.comfort_summary import ComfortSummary, comfort_summary
from workbench.analysis.reserves import Reserves, reserves
from workbench.analysis.setting import Setting, group_model
from workbench.control import Gains
from workbench.control.loop import GROUPS, subject
from workbench.control.structure.loop import Loop
from workbench.control.structure.space import modal_law
from workbench.control.structure.structure import Structure
from workbench.lti.disk import DiskMargin, disk_margin
from workbench.lti.margin import ChannelMargin, channel_margin
from workbench.lti.realisation import Realisation
from workbench.result import Result, Row, figure, plain


@dataclass(frozen=True, kw_only=True, repr=False)
class FullAnalysis(Result):
    """An analysis, and what takes longer, computed when first asked for.

    setting : what was looked at;  sampled : (sample time [s], delay in samples) of the problem's own
    """

    analysis: Analysis
    setting: Setting = field(compare=False)
    sampled: tuple[tuple[float, float], ...] = ()

    @property
    def responds(self) -> bool:
        """Whether the loop is stable and its rates are filtered: others have no margins and no ride."""
        return self.analysis.stable and self.analysis.cost is not None

    @cached_property
    def _commands(self) -> Realisation:
        return at_commands(self.setting, self.analysis.gains)

    @cached_property
    def current_margins(self) -> tuple[ChannelMargin, ...]:
        """One α_i broken, the others closed; empty where there are no margins, as all of these."""
        names = [name.replace("_", " ") for name in self.setting.law.currents] if self.responds else []
        return tuple(channel_margin(*self._commands, channel=i, name=name) for i, name in enumerate(names))

    @cached_property
    def modal_margins(self) -> tuple[ChannelMargin, ...]:
        """One K_i q_i^c broken."""
        if not self.responds:
            return ()
        modal, names = at_modal_signals(self.setting, self.analysis.gains)
        return tuple(channel_margin(*modal, channel=i, name=name) for i, name in enumerate(names))

    @cached_property
    def sensor_margins(self) -> tuple[ChannelMargin, ...]:
        """One reading broken, the others kept; those that no gain uses are left out."""
        return _at_sensors(self.setting, self.analysis.gains) if self.responds else ()

    @cached_property
    def disk(self) -> DiskMargin | None:
        """All current commands perturbed at once, balanced disks."""
        return disk_margin(*self._commands) if self.responds else None

    @cached_property
    def comfort(self) -> ComfortSummary | None:
        """Ride figures at every point."""
        return comfort_summary(self.setting, self.analysis.gains) if self.responds else None

    @cached_property
    def reserves(self) -> Reserves:
        """Break points, variations and failures, sampled and frozen loops."""
        return reserves(self.setting, self.analysis.gains, sampled=self.sampled)

    def to_dict(self) -> dict[str, Any]:
        """The analysis' figures, with `margins` added."""
        document = self.analysis.to_dict()
        document["margins"] = {
            "current": plain(self.current_margins),
            "modal": plain(self.modal_margins),
            "sensor": plain(self.sensor_margins),
            "disk": None
            if self.disk is None
            else {
                "lower": self.disk.lower,
                "upper": self.disk.upper,
                "frequency_hz": self.disk.frequency / (2 * np.pi),
            },
        }
        document["comfort"] = None if self.comfort is None else self.comfort.to_dict()
        if self.analysis.nonlinear is not None:
            document["nonlinear"] = plain(self.analysis.nonlinear)
        return document

    def rows(self) -> list[Row]:
        disk = [] if self.disk is None else [("disk margin, guaranteed", self.disk.lower, "1")]
        return [*self.analysis.rows(), *disk]

    def tables(self) -> list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
        """The ride at every point as (title, columns, rows of strings)."""
        if self.comfort is None:
            return []
        columns = ("place", "direction", "rms", "below 1 Hz", "weighted", "Wf", "Sperling", "PSD / boundary")
        rows = []
        for p in self.comfort.points:
            r = p.ride
            figures = (r.rms, r.rms_below_1_hz, r.rms_weighted, r.rms_motion_sickness, p.sperling, p.mask_ratio)
            rows.append((p.point, r.direction, *map(figure, figures)))
        title = "Ride, accelerations in m/s²; boundary: ISO 2631:1974 reduced comfort, 1 h (unverified values)"
        return [(title, columns, rows)]


def full_analysis(
    setting: Setting, gains: Gains, name: str = "", *, sampled: Sequence[tuple[float, float]] = ()
) -> FullAnalysis:
    """The exact measures of a setting under given gains, margins included.

    sampled : sample times [s] and delays [samples] that are looked at besides the usual ones
    """
    return FullAnalysis(analysis=analyse(setting, gains, name), setting=setting, sampled=tuple(sampled))


def _at_sensors(setting: Setting, gains: Gains) -> tuple[ChannelMargin, ...]:
    """Margins of each sensor's loop, in the whole vehicle where all its motions are looked at, else in its group."""
    law, found = setting.law, []
    structure = Structure(modal_law(law, gains))
    K = structure.controller()
    whole = set(setting.groups) == set(GROUPS)
    for group in (subject(setting.plant, law, "all"),) if whole else setting.subjects:
        S = Loop(group_model(group, law), structure).sensitivity(law.sensors).system(K)
        each = (channel_margin(*S, channel=i, name=name.replace("_", " ")) for i, name in enumerate(law.sensors))
        found += [m for m in each if math.isfinite(m.gain_up) or m.gain_down or math.isfinite(m.phase)]
    return tuple(found)
