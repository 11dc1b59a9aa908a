"""The tables that an engineer reads first, made once for terminal, page and panel.

    Reserves (, NonlinearRide, Limits) --cells: worst of each column, what does not hold--> MarkedTable each

Margins where the loop may break; what survives what; the loop as it is sampled; contacts and the ride with forces that
bend; the loop away from the nominal gaps. What is empty is left out, of a vehicle as of a plant of one's own.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from string import digits

from workbench.analysis.frozen import Frozen
from workbench.analysis.nonlinear_ride import NonlinearRide
from workbench.analysis.reserves import Reserves
from workbench.analysis.sampled_cases import SampledCase
from workbench.analysis.variations import Varied
from workbench.lti.break_point import BreakPoint
from workbench.result import Row, figure

ALIKE = 1e-6  # relative: values of a column that are worst together, as those of a right and a left coil set
NAMED = 3  # of those that do not survive; the rest is counted


@dataclass(frozen=True, slots=True)
class Cell:
    """Text of a table's cell; worst : of its column;  bad : it does not hold."""

    text: str
    worst: bool = False
    bad: bool = False

    @property
    def marked(self) -> str:
        """The text alone, its marks as signs."""
        return f"▸{self.text}" if self.worst else self.text


@dataclass(frozen=True, slots=True)
class MarkedTable:
    """A table whose first column names the row; words : what it says in one line."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    words: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What a problem asks of its nominal loop, where it does: damping [1], decay [1/s], peak sensitivity [1]."""

    damping: float | None = None
    decay: float | None = None
    peak_sensitivity: float | None = None


def first_tables(
    reserves: Reserves, ride: NonlinearRide | None = None, limits: Limits | None = None
) -> tuple[MarkedTable, ...]:
    """The tables in the order in which they are read."""
    changed = [v for v in reserves.variations if v.at_rest is None]
    resting = [v for v in reserves.variations if v.at_rest is not None]
    made = (
        _margins("Margins, one point broken at a time", reserves.break_points),
        _margins("Margins, each signal with a factor of its own", reserves.together),
        _failures(changed),
        _sampled(reserves.sampled, limits or Limits()),
        _ride(ride),
        _frozen(reserves.frozen),
        _resting(resting),
    )
    return tuple(table for table in made if table is not None)


def first_rows(reserves: Reserves, ride: NonlinearRide | None = None) -> list[Row]:
    """The smallest figure of each table: name and place, value, unit."""
    shown: list[Row] = []
    if reserves.break_points:
        b = min(reserves.break_points, key=lambda b: b.disk)
        shown.append((f"smallest disk margin, {b.point}", b.disk, "1"))
    if reserves.variations:
        v = min(reserves.variations, key=lambda v: v.damping)
        shown.append((f"least damping under a change, {v.name}", v.damping, "1"))
    cases = [c for c in reserves.sampled if c.damping is not None]
    if cases:
        c = min(cases, key=lambda c: c.damping or 0.0)
        shown.append((f"least damping as sampled, {_period(c)}", c.damping, "1"))
    poses = [f for f in reserves.frozen if f.damping is not None]
    if poses:
        f = min(poses, key=lambda f: f.damping or 0.0)
        shown.append((f"least damping at a gap offset, {f.heave:+.2f} m, {f.sway:+.2f} m", f.damping, "1"))
    if ride is not None:
        shown += [("contacts per hour, expected", ride.contacts_per_hour, "1/h")]
        shown += [("nonlinear over linear cost", ride.cost_ratio, "1")]
    return shown


def _margins(title: str, points: Sequence[BreakPoint]) -> MarkedTable | None:
    if not points:
        return None
    late = not all(math.isnan(b.delay) for b in points)  # several signals at once have no delay in common
    rows = []
    for b in points:
        cells = [b.gain_down, b.gain_up, math.degrees(b.phase), *([1e3 * b.delay] if late else []), b.disk]
        name = f"{b.point}, {b.model}" if b.model else b.point
        rows.append([Cell(name), *(Cell(figure(value if math.isfinite(value) else None)) for value in cells)])
    measures: list[Callable[[BreakPoint], float]] = [
        lambda b: -b.gain_down if b.gain_down else math.inf, lambda b: b.gain_up, lambda b: b.phase,
        *([lambda b: b.delay] if late else []), lambda b: b.disk,
    ]  # fmt: skip
    for column, measure in enumerate(measures, 1):
        _mark(rows, column, [measure(b) for b in points])
    columns = ("break point", "gain down", "gain up", "phase [°]", *(["delay [ms]"] if late else []), "disk")
    return MarkedTable(title, columns, _together(rows))


def _failures(variations: Sequence[Varied]) -> MarkedTable | None:
    if not variations:
        return None
    lost = [v.name for v in variations if not v.stable]
    words = f"All {len(variations)} are survived." if not lost else f"{len(lost)} of {len(variations)} are unstable: "
    words += f"{', '.join(lost[:NAMED])}{' …' if len(lost) > NAMED else ''}" if lost else ""
    rows = [
        [Cell(v.name, bad=not v.stable), Cell("survives" if v.stable else "UNSTABLE", bad=not v.stable),
         Cell(figure(v.damping)), Cell(figure(v.decay)), Cell(figure(v.peak_sensitivity))]
        for v in variations
    ]  # fmt: skip
    _mark(rows, 2, [v.damping for v in variations])
    _mark(rows, 3, [v.decay for v in variations])
    _mark(rows, 4, [math.inf if v.peak_sensitivity is None else -v.peak_sensitivity for v in variations])
    columns = ("change or failure", "loop", "damping", "decay [1/s]", "peak S")
    return MarkedTable("What survives what", columns, _together(rows), words)


def _sampled(cases: Sequence[SampledCase], limits: Limits) -> MarkedTable | None:
    if not cases:
        return None
    groups, rows, kept = tuple(cases[0].peak_sensitivity), [], 0
    for c in cases:
        fails = [_misses(c.damping, limits.damping), _misses(c.decay, limits.decay)]
        peaks = [c.peak_sensitivity[g] for g in groups]
        fails += [p is None or (limits.peak_sensitivity is not None and p > limits.peak_sensitivity) for p in peaks]
        unstable = c.decay is None or c.decay <= 0
        word = "UNSTABLE" if unstable else "missed" if any(fails) else "kept"
        kept += word == "kept"
        figures = [Cell(figure(v), bad=bad) for v, bad in zip((c.damping, c.decay, *peaks), fails, strict=True)]
        rows.append([Cell(_period(c)), Cell(word, bad=word != "kept"), *figures])
    asked = [
        f"{name} {sense} {limit:g}"
        for name, sense, limit in (
            ("damping", "≥", limits.damping), ("decay", "≥", limits.decay), ("peak S", "≤", limits.peak_sensitivity)
        )
        if limit is not None
    ]  # fmt: skip
    words = f"{kept} of {len(cases)} keep {', '.join(asked) or 'stability'}."
    columns = ("sampled every", "verdict", "damping", "decay [1/s]", *(f"peak S {g.replace('_', ' ')}" for g in groups))
    return MarkedTable("The loop as it is sampled", columns, tuple(map(tuple, rows)), words)


def _misses(value: float | None, limit: float | None) -> bool:
    return value is None or value <= 0 or (limit is not None and value < limit)


def _period(case: SampledCase) -> str:
    samples = f"{case.delay_samples:g} sample{'' if case.delay_samples == 1 else 's'}"
    return f"{1e3 * case.sample_time:g} ms, {samples} late" if case.delay_samples else f"{1e3 * case.sample_time:g} ms"


def _ride(ride: NonlinearRide | None) -> MarkedTable | None:
    if ride is None:
        return None
    rows = [[Cell("ride cost J [10⁻⁴ g²]"), *map(Cell, map(figure, (ride.cost / ride.cost_ratio, ride.cost))),
             Cell(figure(ride.cost_ratio))]]  # fmt: skip
    rows += [
        [Cell(f"rms {f.name} [{f.unit}]"), Cell(figure(f.linear)), Cell(figure(f.nonlinear)), Cell(figure(f.ratio))]
        for f in ride.figures
    ]
    _mark(rows, 3, [-ride.cost_ratio, *(-f.ratio for f in ride.figures)])
    words = (
        f"{ride.contacts_per_hour:.2g} contacts an hour expected; nearest {ride.where}, "
        f"{figure(1e3 * ride.distance)} mm or {ride.sigmas:.1f} standard deviations away on average."
    )
    return MarkedTable(
        "Ride with forces that bend", ("", "linear", "nonlinear", "ratio"), tuple(map(tuple, rows)), words
    )


def _frozen(poses: Sequence[Frozen]) -> MarkedTable | None:
    """One row a heave, the damping at each sway beside each other."""
    if not poses:
        return None
    heaves, sways = (sorted({getattr(f, name) for f in poses}) for name in ("heave", "sway"))
    at = {(f.heave, f.sway): f for f in poses}
    rows = [[Cell(f"{heave:+.2f} m"), *(_pose(at.get((heave, sway))) for sway in sways)] for heave in heaves]
    flat = [(row, 1 + k, f.damping) for row, h in enumerate(heaves) for k, s in enumerate(sways)
            if (f := at.get((h, s))) and f.damping is not None]  # fmt: skip
    least = min((damping for *_, damping in flat), default=math.nan)
    for row, column, damping in flat:
        if damping <= least + ALIKE * abs(least):
            rows[row][column] = replace(rows[row][column], worst=True)
    columns = ("heave", *(f"damping at sway {s:+.2f} m" for s in sways))
    lost = sum(f.decay is not None and f.decay <= 0 for f in poses)
    unflown = sum(f.decay is None for f in poses)
    words = f"{lost} of {len(poses)} are unstable" if lost else f"All {len(poses) - unflown} are stable"
    words += f"; {unflown} cannot be flown." if unflown else "."
    return MarkedTable("The loop frozen at gap offsets", columns, tuple(map(tuple, rows)), words)


def _resting(variations: Sequence[Varied]) -> MarkedTable | None:
    rows = [[Cell(v.name), *(Cell(figure(value)) for value in v.at_rest or ())] for v in variations]
    if not rows:
        return None
    columns = ("sensor", "gap at rest [m per unit]", "current at rest [1 per unit]")
    return MarkedTable("What a sensor that is stuck or drifts does at rest", columns, _together(rows))


def _pose(pose: Frozen | None) -> Cell:
    if pose is None:
        return Cell(figure(None))
    return Cell(figure(pose.damping), bad=pose.decay is not None and pose.decay <= 0)


def _together(rows: Sequence[Sequence[Cell]]) -> tuple[tuple[Cell, ...], ...]:
    """Neighbours that show the same figures, as a right and a left coil set do, in one row under both names."""
    out: list[list[Cell]] = []
    for row in rows:
        first = out[-1][0].text if out else ""
        stem = row[0].text.rstrip(digits)
        alike = out and stem[-1:] in (":", "_") and first.split(", ")[0].rstrip(digits) == stem != row[0].text
        if alike and [c.text for c in out[-1][1:]] == [c.text for c in row[1:]]:
            out[-1] = [replace(out[-1][0], text=f"{first}, {row[0].text.removeprefix(stem)}"), *out[-1][1:]]
        else:
            out.append(list(row))
    return tuple(map(tuple, out))


def _mark(rows: list[list[Cell]], column: int, badness: Sequence[float]) -> None:
    """Marks the smallest of a column, and what is alike to it; nothing where all are alike or nothing limits."""
    least = min(badness)
    alike = [value <= least + ALIKE * abs(least) for value in badness]
    if all(alike):
        return
    for row, worst in zip(rows, alike, strict=True):
        row[column] = replace(row[column], worst=worst)
