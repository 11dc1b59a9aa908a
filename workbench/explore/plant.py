"""An exploration of a plant of one's own: values of the structure's parameters, pinned designs, a picture.

PlantSession(problem) --move, optimise, pin, undo--> PlantSession;  .snapshot --PlantPicture--> PNG
"""

from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from math import isfinite
from pathlib import Path
from typing import Any

from workbench.analysis.first_tables import MarkedTable, first_rows, first_tables
from workbench.analysis.loop_curve import LoopCurve
from workbench.design.design import design
from workbench.design.loop_margins import LoopMargins
from workbench.design.plant_analysis import PlantAnalysis, plant_analysis
from workbench.design.plant_curves import StepCurve, open_loop, step_curve
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.explore.session import STATE, Exploration
from workbench.plots.loop import plot_poles, plot_steps
from workbench.plots.nyquist import plot_nyquist
from workbench.result import Row

SIZE = (11.4, 6.4)  # inches, at
DPI = 84
STARTS, SECONDS = 1, 20.0  # of "optimise from here"


@dataclass(frozen=True, kw_only=True)
class PlantShot:
    """All that one position of the sliders shows; no curves where a loop is unstable."""

    analysis: PlantAnalysis
    loops: tuple[LoopCurve, ...]
    steps: tuple[StepCurve, ...]

    @property
    def met(self) -> bool:
        """Whether every loop is stable and every hard goal is met."""
        hard = {goal.name for goal in self.analysis.design.problem.goals if goal.hard}
        return self.stable and all(v.met for v in self.analysis.design.verdicts if v.name in hard)

    @property
    def stable(self) -> bool:
        """Whether every loop is stable."""
        return self.analysis.stable

    @property
    def first(self) -> tuple[list[Row], tuple[MarkedTable, ...]]:
        """What is read first: the smallest figures, and the tables; they take longer than all the rest."""
        kept = self.analysis.reserves
        return ([], ()) if kept is None else (first_rows(kept), first_tables(kept))

    @property
    def complete(self) -> bool:
        """Whether every verdict is known."""
        return True

    @property
    def margins(self) -> LoopMargins | None:
        """Margins, where they have been asked for."""
        return self.analysis.__dict__.get("margins")

    def shown(self) -> list[Row]:
        """Figures beside each other in the panel's table."""
        rows = [row for row in self.analysis.rows() if row[0] not in self.analysis.design.values]
        if self.margins is not None:
            rows += [("disk margin", min(m.disk.lower for m in self.margins.single), "")]
        return rows


@dataclass(frozen=True, slots=True)
class PlantPin:
    """A design to come back to."""

    name: str
    values: Mapping[str, float]
    shot: PlantShot


class PlantSession(Exploration):
    """What the explorer of a plant holds; every button is one of its methods.

    problem : Problem;  values : of some parameters, to start from; the approved or the structure's own if left out
    """

    def __init__(self, problem: Problem, values: Mapping[str, float] | None = None) -> None:
        self.problem = problem
        self.values = dict(plant_analysis(problem, values, margins=False).design.values)
        self.begun = dict(self.values)
        self.pins: dict[str, PlantPin] = {}
        self.past: list[dict[str, float]] = []
        self._shot: PlantShot | None = None

    @property
    def groups(self) -> dict[str, tuple[str, ...]]:
        """The sliders: parameters that may move, and those that are held."""
        parameters = self.problem.structure.parameters
        free = tuple(p.name for p in parameters if p.free)
        held = tuple(p.name for p in parameters if not p.free)
        return {title: names for title, names in (("free parameters", free), ("held parameters", held)) if names}

    def held(self, name: str) -> float:
        """The present value of a slider."""
        return self.values[name]

    def unit(self, name: str) -> str:
        """Its unit."""
        return self.problem.structure.parameter(name).unit or "1"

    def interval(self, name: str) -> tuple[float, float] | None:
        """Where it may move: within its bounds, if these are near enough to be of use."""
        p = self.problem.structure.parameter(name)
        size = abs(self.values[name])
        return (p.low, p.high) if isfinite(p.high - p.low) and p.high - p.low <= 20 * size else None

    def logarithmic(self, name: str) -> bool:
        """Whether it moves by factors: what is positive by its bounds, as time constants are."""
        return self.problem.structure.parameter(name).low > 0 and self.values[name] > 0

    def move(self, name: str, value: float) -> None:
        """Changes one value; `undo` goes back. One that its bounds do not allow is refused."""
        p = self.problem.structure.parameter(name)
        if not p.low <= value <= p.high:
            raise InputError(f"{name} must lie within [{p.low:g}, {p.high:g}]; got {value:g}. Widen the bounds.")
        self._to({**self.values, name: float(value)})

    def restart(self) -> None:
        """Back to where the exploration began."""
        self._to(dict(self.begun))

    def undo(self) -> None:
        """Back to the values before the last change; nothing if there are none."""
        if self.past:
            self.values, self._shot = self.past.pop(), None

    def optimise(self) -> str:
        """The best values near the present ones, and how good they are in a word; refusals change nothing."""
        found = design(self.problem, start=self._free(), starts=STARTS, seconds=SECONDS)
        self._to(dict(found.values))
        return f"optimised: {'every goal met' if found.met else 'every hard goal met'}"

    def _free(self) -> dict[str, float]:
        return {name: self.values[name] for name in self.problem.free}

    def _to(self, values: dict[str, float]) -> None:
        if values != self.values:
            self.past.append(self.values)
            self.values, self._shot = values, None

    @property
    def snapshot(self) -> PlantShot:
        """Everything shown at the present values."""
        if self._shot is None:
            self._shot = _shot(self.problem, self.values)
        return self._shot

    def pin(self, name: str = "") -> PlantPin:
        """Keeps the present design under a name; an old one of that name is replaced."""
        name = name.strip() or f"design {len(self.pins) + 1}"
        self.pins[name] = PlantPin(name, dict(self.values), self.snapshot)
        return self.pins[name]

    def write_table(self, path: Path | str) -> Path:
        """The present design as a gain table."""
        self.snapshot.analysis.design.table().write(Path(path))
        return Path(path)

    def to_dict(self) -> dict[str, Any]:
        """What `save` writes and `load` reads."""
        pins = [{"name": p.name, "values": dict(p.values)} for p in self.pins.values()]
        return {"format": STATE, "problem": self.problem.name, "values": self.values, "pins": pins}

    def load(self, path: Path | str) -> None:
        """Takes up a saved exploration of the same problem; refused whole where it is none, or holds what cannot be."""
        document = self._saved(path, self.problem.name)
        pins = document.get("pins", [])
        if not isinstance(pins, list) or not all(isinstance(p, dict) for p in pins):
            raise InputError(f"the pins of {path} must be objects with name and values; got {str(pins)[:40]}.")
        fresh = PlantSession(self.problem)
        for entry in pins:
            fresh.values, fresh._shot = {**fresh.begun, **_numbers(self.problem, entry.get("values"), path)}, None
            fresh.pin(str(entry.get("name", "")))
        values = {**fresh.begun, **_numbers(self.problem, document.get("values"), path)}
        self.values, self.pins, self.past, self._shot = values, fresh.pins, [], None


def _numbers(problem: Problem, found: Any, path) -> dict[str, float]:
    if not isinstance(found, dict):
        raise InputError(f"{path} must hold values as an object of names and numbers; got {str(found)[:40]}.")
    for name, value in found.items():
        p = problem.structure.parameter(name)
        if not isinstance(value, int | float) or isinstance(value, bool) or not p.low <= value <= p.high:
            raise InputError(
                f"{name} in {path} must be a number within [{p.low:g}, {p.high:g}]; got {str(value)[:40]}."
            )
    return {name: float(value) for name, value in found.items()}


def _shot(problem: Problem, values: Mapping[str, float]) -> PlantShot:
    found = plant_analysis(problem, values)
    if not found.stable:
        return PlantShot(analysis=found, loops=(), steps=())
    K, loops, steps = found.design.structure.controller(), [], []
    for loop in problem.loops:
        loops += [open_loop(loop, K, point) for point in loop.commands]
        for source in loop.exogenous[:1]:
            try:
                steps += [step_curve(loop, K, source, seen) for seen in (loop.model.outputs, loop.commands)]
            except InputError:  # a step that does not come to rest in time is not drawn
                continue
    return PlantShot(analysis=found, loops=tuple(loops), steps=tuple(steps))


class PlantPicture:
    """The figure of one position of the sliders: steps of what is measured and commanded, loops, poles."""

    def png(self, now: PlantShot, pinned: PlantShot | None = None) -> bytes:
        """The picture as PNG; the pinned design's steps and loops are dashed behind."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        drawn = Figure(figsize=SIZE, dpi=DPI, facecolor="white")
        (measured, commanded), (loops, poles) = drawn.subplots(2, 2)
        drawn.subplots_adjust(left=0.07, right=0.985, bottom=0.08, top=0.94, wspace=0.2, hspace=0.34)
        for shot in (pinned, now):
            if shot is None:
                continue
            for ax, curves in ((measured, shot.steps[::2]), (commanded, shot.steps[1::2])):
                for curve in curves:
                    plot_steps(curve, ax=ax)
            if shot.loops:
                plot_nyquist(shot.loops, peak_sensitivity=_peak(now), ax=loops)
            if shot is pinned:
                for ax in (measured, commanded, loops):
                    for line in ax.lines:
                        line.set(linestyle=":", alpha=0.6)
        found = [p for loop in now.analysis.loops for p in loop.continuous]
        plot_poles(found, damping=min(loop.damping for loop in now.analysis.loops), ax=poles)
        stream = BytesIO()
        FigureCanvasAgg(drawn).print_png(stream)
        return stream.getvalue()


def _peak(shot: PlantShot) -> float | None:
    return None if shot.margins is None else max(m.peak_sensitivity.upper for m in shot.margins.single)
