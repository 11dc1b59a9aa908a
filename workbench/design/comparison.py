"""Designs side by side: what each costs, keeps and draws.

(problem, gains) of each --exact analysis--> Comparison: one column per problem, None where a figure does not apply
"""

from collections.abc import Sequence
from dataclasses import dataclass

from workbench.analysis.analysis import Analysis, analyse
from workbench.control import Gains
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.result import Result, Row, figure


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


def compare(cases: Sequence[tuple[Problem, Gains | None]]) -> Comparison:
    """The exact figures of several problems side by side, each under given gains; under its approved ones for None.

    Raises
    ------
    InputError
        If there are no problems, or gains are neither given nor approved.
    """
    if not cases:
        raise InputError("a comparison needs at least one problem; got none.")
    analyses = []
    for problem, gains in cases:
        chosen = gains or problem.approved
        if chosen is None:
            raise InputError(
                f"problem {problem.name!r} has no approved gains to compare; give some, or design it first."
            )
        analyses.append(analyse(problem.setting, chosen, problem.name))
    each = [_figures(a) for a in analyses]
    names = dict.fromkeys(key for one in each for key in one)
    return Comparison(
        problems=tuple(a.problem for a in analyses),
        figures=tuple(
            Compared(quantity=q, unit=unit, values=tuple(one.get((q, unit)) for one in each)) for q, unit in names
        ),
    )


def _figures(a: Analysis) -> dict[tuple[str, str], float | None]:
    """(quantity, unit) to value."""
    out: dict[tuple[str, str], float | None] = {
        ("cost J", ""): a.cost,
        ("smallest damping ratio", "1"): a.damping,
        ("decay rate", "1/s"): a.decay,
    }
    out |= {(f"peak sensitivity, {g}", "1"): None if p is None else p.upper for g, p in a.peak_sensitivity.items()}
    for kind, word in (("gap", "gap"), ("gap_lateral", "lateral gap")):
        out |= {(f"rms {word}, {end}", "m"): v for end, v in a.rms[kind].items()}
        out[f"static {word} error from bias", "m"] = a.static_error[kind]
    out["sum of mean square coil currents", "1"] = a.sum_alpha_squared
    out |= {(f"coil power, {k}", "W"): v for k, v in a.control_power_w.items()}
    if a.motor is not None:
        out |= {(name, unit): value for name, value, unit in a.motor.rows()}
    return out
