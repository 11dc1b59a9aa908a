"""What a law keeps in reserve: margins wherever the loop may break, variations and losses, sampling, other gaps.

    Setting, Gains --> break points, variations, sampled loops, loops frozen at gap offsets

What an engineer reads first. Each part has a file of its own; `first_tables` shows them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.analysis.analysis import unfiltered
from workbench.analysis.break_points import break_points, together
from workbench.analysis.frozen import Frozen, frozen
from workbench.analysis.sampled_cases import CASES, SampledCase, sampled_cases
from workbench.analysis.setting import Setting
from workbench.analysis.variations import Varied, variations
from workbench.control import Gains
from workbench.lti.break_point import BreakPoint
from workbench.result import Result, Row


@dataclass(frozen=True, kw_only=True, repr=False)
class Reserves(Result):
    """Margins at break points, variations and losses, sampled loops, frozen loops; empty where nothing can be said.

    together : margins of several signals at once, each with a factor of its own
    """

    break_points: tuple[BreakPoint, ...]
    variations: tuple[Varied, ...]
    sampled: tuple[SampledCase, ...]
    frozen: tuple[Frozen, ...]
    together: tuple[BreakPoint, ...] = ()

    def to_dict(self) -> dict[str, list[dict]]:
        """The keys of `analyse --json`."""
        return {
            name: [one.to_dict() for one in getattr(self, name)]
            for name in ("break_points", "together", "variations", "sampled", "frozen")
        }

    @property
    def worst_point(self) -> BreakPoint | None:
        """The break point of the smallest disk margin."""
        return min(self.break_points, key=lambda b: b.disk, default=None)

    @property
    def weakest(self) -> Varied | None:
        """The variation of the least damping."""
        return min(self.variations, key=lambda v: v.damping, default=None)

    def rows(self) -> list[Row]:
        point, varied = self.worst_point, self.weakest
        shown: list[Row] = []
        if point is not None:
            shown.append((f"smallest disk margin, at {point.point}", point.disk, "1"))
        if varied is not None:
            shown.append((f"least damping of a variation, {varied.name}", varied.damping, "1"))
        return shown


NOTHING = Reserves(break_points=(), variations=(), sampled=(), frozen=())


def reserves(
    setting: Setting,
    gains: Gains,
    *,
    sampled: Sequence[tuple[float, float]] = (),
) -> Reserves:
    """Everything that can be said of a law's reserves; nothing of one whose rate is not filtered.

    Margins of an unstable loop mean nothing and are left out.

    sampled : sample times [s] and delays [samples] besides `CASES`
    """
    if unfiltered(gains):
        return NOTHING
    stable = all(s.close(gains).poles().real.max() < 0 for s in setting.subjects)
    return Reserves(
        break_points=break_points(setting, gains) if stable else (),
        together=together(setting, gains) if stable else (),
        variations=variations(setting, gains),
        sampled=sampled_cases(setting, gains, (*CASES, *sampled)),
        frozen=frozen(setting, gains),
    )
