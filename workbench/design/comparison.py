"""Designs side by side: what each costs, keeps and draws.

(problem, values) of each --exact analysis--> Comparison: one column each, None where a figure does not apply
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from workbench.analysis.analysis import Analysis, analyse
from workbench.control import Gains
from workbench.design.plant_analysis import plant_analysis
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.result import Result, Row, figure

Values = Gains | Mapping[str, float]
Figures = dict[tuple[str, str], float | None]  # (quantity, unit) to value


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Compared(Result):
    """One quantity over the problems; SI units."""

    quantity: str
    unit: str
    values: tuple[float | None, ...]

    def rows(self) -> list[Row]:
        return [(self.quantity, ", ".join(figure(v) for v in self.values), self.unit)]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Comparison(Result):
    """Quantities of several problems under their gains.

    problems : names;  figures : one entry per quantity, values in the order of the problems
    """

    problems: tuple[str, ...]
    figures: tuple[Compared, ...]

    def columns(self) -> tuple[str, ...]:
        """Heads of the table."""
        return ("quantity", *self.problems, "unit")

    def table(self) -> list[tuple[str, ...]]:
        """Rows of strings under `columns()`."""
        return [(f.quantity, *(figure(v) for v in f.values), f.unit) for f in self.figures]

    def to_frame(self):
        """The figures as a pandas.DataFrame: one row per quantity, one column per problem."""
        import pandas as pd

        rows = [(f.quantity, *f.values, f.unit) for f in self.figures]
        return pd.DataFrame(rows, columns=list(self.columns()))

    def rows(self) -> list[Row]:
        return [
            (f"{f.quantity}, {name}", v, f.unit)
            for f in self.figures
            for name, v in zip(self.problems, f.values, strict=True)
        ]


def compare(cases: Sequence[tuple[Problem, Values | None]], names: Sequence[str] | None = None) -> Comparison:
    """The exact figures of several problems side by side, each under given values; under its approved ones for None.

    names : of the columns; the problems' if left out

    Raises
    ------
    InputError
        If there are no problems, two columns have one name, or a vehicle's gains are neither given nor approved.
    """
    if not cases:
        raise InputError("a comparison needs at least one problem; got none.")
    heads = tuple(problem.name for problem, _ in cases) if names is None else tuple(names)
    if names is not None and len(set(heads)) != len(cases):
        raise InputError(f"each column of a comparison must have a name of its own; got {', '.join(heads)}.")
    each = [_vehicle(problem, values) if problem.flies else _plant(problem, values) for problem, values in cases]
    quantities = dict.fromkeys(key for one in each for key in one)
    return Comparison(
        problems=heads,
        figures=tuple(
            Compared(quantity=q, unit=unit, values=tuple(one.get((q, unit)) for one in each)) for q, unit in quantities
        ),
    )


def _vehicle(problem: Problem, gains: Values | None) -> Figures:
    chosen = gains or problem.approved
    if chosen is None:
        raise InputError(f"problem {problem.name!r} has no approved gains to compare; give some, or design it first.")
    chosen = chosen if isinstance(chosen, Gains) else Gains.from_mapping(chosen)
    return _figures(analyse(problem.setting, chosen, problem.name))


def _plant(problem: Problem, values: Values | None) -> Figures:
    """Verdicts, poles, margins and parameters of a plant of one's own."""
    given = values.as_dict() if isinstance(values, Gains) else values
    found = plant_analysis(problem, given)
    out: Figures = {
        ("smallest damping ratio", "1"): min(loop.damping for loop in found.loops),
        ("decay rate", "1/s"): min(loop.decay for loop in found.loops),
    }
    out |= {(v.name, v.unit): v.value for v in found.design.verdicts}
    if found.margins is not None:
        single = found.margins.single
        out["peak sensitivity", "1"] = max(m.peak_sensitivity.upper for m in single)
        out["gain margin up", "1"] = min(m.channel.gain_up for m in single)
        out["gain margin down", "1"] = max(m.channel.gain_down for m in single)
        out["phase margin", "rad"] = min(m.channel.phase for m in single)
        out["delay margin", "s"] = min(m.channel.delay for m in single)
        out["disk margin", "1"] = min(m.disk.lower for m in single)
    return out | {(name, unit): value for name, value, unit in found.design.structure_rows()}


def _figures(a: Analysis) -> Figures:
    """(quantity, unit) to value."""
    out: Figures = {("cost J", ""): a.cost, ("smallest damping ratio", "1"): a.damping, ("decay rate", "1/s"): a.decay}
    out |= {(f"peak sensitivity, {g}", "1"): None if p is None else p.upper for g, p in a.peak_sensitivity.items()}
    for kind, word in (("gap", "gap"), ("gap_lateral", "lateral gap")):
        out |= {(f"rms {word}, {end}", "m"): v for end, v in a.rms[kind].items()}
        out[f"static {word} error from bias", "m"] = a.static_error[kind]
    out["sum of mean square coil currents", "1"] = a.sum_alpha_squared
    out |= {(f"coil power, {k}", "W"): v for k, v in a.control_power_w.items()}
    if a.motor is not None:
        out |= {(name, unit): value for name, value, unit in a.motor.rows()}
    return out
