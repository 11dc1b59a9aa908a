"""An analysis with its margins: one channel broken at a time, all channels perturbed at once.

Setting, Gains --> Analysis;  loop at the current commands --> margins of each α_i, multiloop disk margin
                              loop at the modal signals   --> margins of each K_i q_i^c
                              loop at the sensors         --> margins of each reading that the law uses
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.analysis.analysis import Analysis, analyse
from workbench.analysis.break_points import at_commands, at_modal_signals
from workbench.analysis.comfort_summary import ComfortSummary, comfort_summary
from workbench.analysis.setting import Setting, group_model
from workbench.control import Gains
from workbench.control.loop import GROUPS, subject
from workbench.control.structure.loop import Loop
from workbench.control.structure.space import modal_law
from workbench.control.structure.structure import Structure
from workbench.lti.disk import DiskMargin, disk_margin
from workbench.lti.margin import ChannelMargin, channel_margin
from workbench.result import Result, Row, figure, plain


@dataclass(frozen=True, kw_only=True, repr=False)
class FullAnalysis(Result):
    """An analysis, and margins where the loop is stable (empty otherwise).

    current_margins : one α_i broken, the others closed;  modal_margins : one K_i q_i^c broken
    sensor_margins : one reading broken, the others kept; those that no gain uses are left out
    disk : all current commands perturbed at once, balanced disks
    comfort : ride figures at every point
    """

    analysis: Analysis
    current_margins: tuple[ChannelMargin, ...]
    modal_margins: tuple[ChannelMargin, ...]
    sensor_margins: tuple[ChannelMargin, ...]
    disk: DiskMargin | None
    comfort: ComfortSummary | None

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
        return document

    def rows(self) -> list[Row]:
        disk = [] if self.disk is None else [("disk margin, guaranteed", self.disk.lower, "1")]
        return [*self.analysis.rows(), *disk]

    def tables(self) -> list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
        """Margin tables as (title, columns, rows of strings)."""
        columns = ("channel", "gain down", "gain up", "phase [°]", "delay [ms]")
        out = []
        for title, margins in (
            ("Margins, one current command broken", self.current_margins),
            ("Margins, one modal signal broken", self.modal_margins),
            ("Margins, one sensor broken", self.sensor_margins),
        ):
            if margins:
                out.append((title, columns, [m.cells() for m in margins]))
        if self.comfort is not None:
            columns = ("place", "direction", "rms", "below 1 Hz", "weighted", "Wf", "Sperling", "PSD / boundary")
            rows = []
            for p in self.comfort.points:
                r = p.ride
                figures = (r.rms, r.rms_below_1_hz, r.rms_weighted, r.rms_motion_sickness, p.sperling, p.mask_ratio)
                rows.append((p.point, r.direction, *map(figure, figures)))
            title = "Ride, accelerations in m/s²; boundary: ISO 2631:1974 reduced comfort, 1 h (unverified values)"
            out.append((title, columns, rows))
        return out


def full_analysis(setting: Setting, gains: Gains, name: str = "") -> FullAnalysis:
    """The exact measures of a setting under given gains, margins included."""
    analysis = analyse(setting, gains, name)
    if not analysis.stable or analysis.cost is None:
        none = {"current_margins": (), "modal_margins": (), "sensor_margins": ()}
        return FullAnalysis(analysis=analysis, **none, disk=None, comfort=None)
    whole = at_commands(setting, gains)
    modal, channels = at_modal_signals(setting, gains)
    names = [name.replace("_", " ") for name in setting.law.currents]
    return FullAnalysis(
        analysis=analysis,
        current_margins=tuple(channel_margin(*whole, channel=i, name=name) for i, name in enumerate(names)),
        modal_margins=tuple(channel_margin(*modal, channel=i, name=c) for i, c in enumerate(channels)),
        sensor_margins=_at_sensors(setting, gains),
        disk=disk_margin(*whole),
        comfort=comfort_summary(setting, gains),
    )  # fmt: skip


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
