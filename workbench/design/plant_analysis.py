"""What given values do to the loops of a plant of one's own: poles, verdicts, margins of every loop.

    Problem, values --loop of each model--> poles, damping, decay;  goals --judge--> verdicts;  stable --> margins

What an unstable loop does not have (margins, peaks) is absent from the record's dictionary, not null.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from workbench.analysis.plant_reserves import sampled_cases, variations
from workbench.analysis.reserves import Reserves
from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.design.loop_margins import LoopMargins, loop_margins
from workbench.design.problem import Problem
from workbench.design.record import Design, checked_values, given
from workbench.errors import InputError
from workbench.machine.threads import one_thread
from workbench.result import Result, Row, figure, plain

PASSED = 1e-9  # |z| of a pole that is a delay gone by
REAL = 1e-9  # imaginary part over modulus below which a pole counts as real


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LoopPoles(Result):
    """Poles of one model's loop.

    poles : (k,) in s [rad/s], in z if sampled; with dead times those that are located, the rightmost among them
    damping, decay : least damping ratio [1] and decay [1/s], of log(z)/h if sampled
    """

    model: str
    stable: bool
    poles: np.ndarray
    damping: float
    decay: float
    sample_time: float | None = None

    @property
    def continuous(self) -> np.ndarray:
        """(k,) in s; of a sampled loop log(z)/h of those that have not passed."""
        h = self.sample_time
        return self.poles if h is None else np.log(self.poles[np.abs(self.poles) > PASSED]) / h

    def columns(self) -> tuple[str, ...]:
        return ("Re s [1/s]", "Im s [rad/s]", "frequency [Hz]", "damping")

    def table(self) -> list[tuple[str, ...]]:
        """One row a pole or pair, as text."""
        shown = [s for s in self.continuous if s.imag >= -REAL * abs(s)]
        return [
            (figure(float(s.real)), figure(float(abs(s.imag))), figure(float(abs(s)) / (2 * np.pi)),
             figure(float(-s.real / abs(s)) if abs(s) else 0.0))
            for s in shown
        ]  # fmt: skip

    def rows(self) -> list[Row]:
        return [
            ("model", self.model, ""), ("stable", self.stable, ""),
            ("smallest damping ratio", self.damping, ""), ("slowest decay", self.decay, "1/s"),
        ]  # fmt: skip


@dataclass(frozen=True, kw_only=True, repr=False)
class PlantAnalysis(Result):
    """The loops of a problem at given values.

    whole : whether margins and reserves, computed when first looked at, are asked for
    """

    design: Design
    loops: tuple[LoopPoles, ...]
    whole: bool = True

    @cached_property
    def margins(self) -> LoopMargins | None:
        """None where a loop is unstable or nobody asks for them."""
        if not (self.whole and self.stable):
            return None
        with one_thread():
            return loop_margins(self.design.problem.loops, self.design.structure.controller())

    @cached_property
    def reserves(self) -> Reserves | None:
        """Margins, variations, sampled loops; None where nobody asks for them."""
        if not self.whole:
            return None
        problem, found = self.design.problem, self.margins
        loops, structure = problem.loops, self.design.structure
        with one_thread():
            return Reserves(
                break_points=found.points if found else (), together=found.together if found else (),
                variations=variations(loops, structure.controller()),
                sampled=sampled_cases(loops, structure, problem.own_sampling), frozen=(),
            )  # fmt: skip

    @property
    def stable(self) -> bool:
        """Whether the loop of every model is."""
        return all(loop.stable for loop in self.loops)

    def to_dict(self) -> dict[str, Any]:
        """Problem, values, poles of each model, verdicts; margins and peak sensitivity where there are any."""
        problem = self.design.problem
        document: dict[str, Any] = {
            "problem": problem.name, "title": problem.title, "values": plain(dict(self.design.values)),
            "stable": self.stable, "damping": plain(min(loop.damping for loop in self.loops)),
            "decay": plain(min(loop.decay for loop in self.loops)), "models": [plain(loop) for loop in self.loops],
            "requirements": [v.to_dict() for v in self.design.verdicts],
        }  # fmt: skip
        if self.margins is not None:
            peaks = [m.peak_sensitivity.upper for m in (*self.margins.single, *self.margins.joint)]
            document["peak_sensitivity"] = max(peaks)
            document["margins"] = self.margins.to_dict()
        if self.reserves is not None:
            document |= {name: found for name, found in self.reserves.to_dict().items() if name != "frozen"}
        return document

    def rows(self) -> list[Row]:
        worst = min(self.loops, key=lambda loop: loop.damping)
        return [
            ("stable", self.stable, ""),
            ("smallest damping ratio", worst.damping, ""),
            ("slowest decay", min(loop.decay for loop in self.loops), "1/s"),
            *((f"{v.name} {v.sense} {v.limit:g}", v.value, v.unit) for v in self.design.verdicts),
            *self.design.structure_rows(),
        ]

    def tables(self) -> list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
        """Poles and margins as (title, columns, rows of strings)."""
        out = [(f"Poles of {loop.model}", loop.columns(), loop.table()) for loop in self.loops]
        return out if self.margins is None else [*out, ("Margins and peak sensitivities", *self.margins.table())]


def plant_analysis(
    problem: Problem, values: Mapping[str, float] | None = None, *, margins: bool = True
) -> PlantAnalysis:
    """The loops at values of the parameters; the approved ones, or else the structure's own, where some are left out.

    margins : whether to look for them, which takes longer than all the rest

    Raises
    ------
    InputError
        For a parameter that is not known, or values with which no loop is closed.
    """
    start = problem.approved if isinstance(problem.approved, Mapping) else {}
    with one_thread():
        found = given(problem, {**start, **checked_values(values)})
        return analysis_of(found, margins=margins)


def analysis_of(design: Design, *, margins: bool = True) -> PlantAnalysis:
    """The same of a design."""
    loops, K = design.problem.loops, design.structure.controller()
    poles = tuple(loop_poles(loop, K) for loop in loops)
    return PlantAnalysis(design=design, loops=poles, whole=margins)


def loop_poles(loop: Loop, K: Controller) -> LoopPoles:
    """Poles of one loop, the slowest first."""
    poles, h = np.asarray(loop.poles(K), complex), loop.sample_time
    if not np.isfinite(poles).all():
        raise InputError(f"the loop of {loop.name!r} must have finite poles; its matrices overflow. Check the values.")
    lasting = poles if h is None else np.log(poles[np.abs(poles) > PASSED]) / h
    size = np.abs(lasting)
    damping = np.where(size > 0, (0.0 - lasting.real) / np.where(size > 0, size, 1.0), 0.0)
    order = np.argsort(-poles.real if h is None else -np.abs(poles), kind="stable")
    return LoopPoles(
        model=loop.name, stable=loop.unstable_poles(K) == 0, poles=poles[order],
        damping=float(damping.min(initial=1.0)), decay=float((0.0 - lasting.real).min(initial=np.inf)), sample_time=h,
    )  # fmt: skip
