"""What a law keeps in reserve: margins wherever the loop may break, variations and losses, sampling, other gaps.

    Setting, Gains --> break points, variations, sampled loops, loops frozen at gap offsets

What an engineer reads first. Each part has a file of its own; here they are put together and shown.
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
from workbench.result import Result, Row, figure

Table = tuple[str, tuple[str, ...], list[tuple[str, ...]]]  # title, columns, rows


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

    def _cells(self, b: BreakPoint) -> tuple[str, ...]:
        d = b.to_dict()
        name = f"{b.point}{f', {b.model}' if b.model else ''}{' (worst)' if b is self.worst_point else ''}"
        keys = ("gain_down", "gain_up", "phase_deg", "delay_ms", "disk")
        return name, *(figure(d.get(key)) for key in keys)

    def rows(self) -> list[Row]:
        point, varied = self.worst_point, self.weakest
        shown: list[Row] = []
        if point is not None:
            shown.append((f"smallest disk margin, at {point.point}", point.disk, "1"))
        if varied is not None:
            shown.append((f"least damping of a variation, {varied.name}", varied.damping, "1"))
        return shown

    def tables(self) -> list[Table]:
        """What an engineer reads first, as (title, columns, rows of strings)."""
        out: list[Table] = []
        if self.break_points:
            columns = ("break point", "gain down", "gain up", "phase [°]", "delay [ms]", "disk margin")
            out.append(("Margins, one point broken at a time", columns, [self._cells(b) for b in self.break_points]))
        if self.together:
            columns = ("signals", "gain down", "gain up", "phase [°]", "disk margin")
            rows = [(*cells[:4], cells[5]) for cells in map(self._cells, self.together)]
            out.append(("Margins, each signal with a factor of its own at once", columns, rows))
        if self.variations:
            rows = [
                (v.name, "survives" if v.stable else "UNSTABLE", figure(v.damping), figure(v.decay),
                 figure(v.peak_sensitivity))
                for v in self.variations
                if v.at_rest is None
            ]  # fmt: skip
            columns = ("variation", "loop", "damping", "decay [1/s]", "peak sensitivity")
            out.append(("Variations and failures", columns, rows))
        rows = [(v.name, *map(figure, v.at_rest)) for v in self.variations if v.at_rest is not None]
        if rows:
            columns = ("sensor", "gap at rest [m per unit]", "current at rest [1 per unit]")
            out.append(("What a sensor that is stuck or drifts does at rest", columns, rows))
        if self.sampled:
            groups = tuple(self.sampled[0].peak_sensitivity)
            rows = [
                (
                    f"{1e3 * s.sample_time:g} ms", f"{s.delay_samples:g}", figure(s.damping), figure(s.decay),
                    *(figure(s.peak_sensitivity[g]) for g in groups),
                )
                for s in self.sampled
            ]  # fmt: skip
            columns = ("sampled every", "delay [samples]", "damping", "decay [1/s]", *(f"peak S, {g}" for g in groups))
            out.append(("The loop as it is sampled", columns, rows))
        if self.frozen:
            rows = [(f"{f.heave:+.2f} m", f"{f.sway:+.2f} m", figure(f.damping), figure(f.decay)) for f in self.frozen]
            out.append(("The loop frozen at gap offsets", ("heave", "sway", "damping", "decay [1/s]"), rows))
        return out


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
