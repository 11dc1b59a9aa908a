"""A design: the structure's parameters with a verdict on every goal.

problem, values --given--> Design: verdicts by the exact measures; a vehicle's analysis beside them
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from workbench.analysis.analysis import Analysis, analyse
from workbench.analysis.break_points import break_points, together
from workbench.control import Gains
from workbench.control.structure.structure import Structure
from workbench.design.loop_margins import LoopMargins, loop_margins
from workbench.design.loop_verdict import loop_verdicts
from workbench.design.multipliers import Multipliers
from workbench.design.problem import Problem
from workbench.design.valley import Valley, valley_of
from workbench.design.verdict import verdicts
from workbench.errors import InputError
from workbench.exits import through
from workbench.goals.verdict import Verdict
from workbench.result import Result, Row, plain

DIGITS = 6  # significant digits of a parameter as printed; the rounded values are what is verified
FINER = (DIGITS, 9, 12, 17)  # more where rounding crosses a limit


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Start(Result):
    """One start: its number, the cost reached, the largest relative violation, evaluations, and the solver's words.

    cost : J of a vehicle; the largest soft goal otherwise
    """

    number: int
    cost: float
    violation: float
    evaluations: int
    message: str

    def rows(self) -> list[Row]:
        return [
            ("start", self.number, ""),
            ("cost J", self.cost, ""),
            ("violation", self.violation, "relative"),
            ("evaluations", self.evaluations, ""),
        ]


@dataclass(frozen=True, kw_only=True, repr=False)
class Design(Result):
    """Parameters of a problem's structure, with the evidence.

    values : every parameter by name, rounded as printed where rounded ones meet the hard goals
    verdicts : one on every goal, by the exact measures of these values
    starts : how each start ended;  binding : goals at their limits;  seed, solver : how to get there again
    analysis : exact measures of a vehicle; None for a plant of one's own
    multipliers : what every limit costs, where a search for one set of gains of one vehicle ended here
    """

    problem: Problem
    values: Mapping[str, float]
    verdicts: tuple[Verdict, ...]
    starts: tuple[Start, ...] = ()
    binding: tuple[str, ...] = ()
    seed: int = 0
    solver: str = "given"
    analysis: Analysis | None = None
    multipliers: Multipliers | None = None

    @property
    def valley(self) -> Valley | None:
        """Which way a vehicle's lateral signals act on sway and roll: a word and a sentence; None where none do."""
        return valley_of(self.problem, self.gains) if self.problem.flies else None

    @property
    def flown(self) -> Analysis:
        """A vehicle's analysis; refused where the plant is another."""
        if self.analysis is None:
            raise InputError(f"this asks for a vehicle; problem {self.problem.name!r} controls a plant of its own.")
        return self.analysis

    @property
    def gains(self) -> Gains:
        """The seventeen gains of a vehicle's modal law."""
        if not self.problem.flies:
            raise InputError(
                f"the seventeen gains belong to a vehicle; problem {self.problem.name!r} tunes "
                f"{', '.join(self.values)}. Take values."
            )
        return Gains.from_mapping(self.values)

    @property
    def requirements(self) -> tuple[Verdict, ...]:
        """The verdicts, under the name that data files and tables use."""
        return self.verdicts

    @property
    def met(self) -> bool:
        """Whether every goal, soft ones too, is met."""
        return all(v.met for v in self.verdicts)

    @property
    def structure(self) -> Structure:
        """The problem's structure, its values those of the design."""
        return self.problem.structure.with_values(self.values)

    def margins(self) -> LoopMargins:
        """What every break point of every loop bears: one at a time, and all inputs or outputs at once."""
        found = loop_margins(self.problem.loops, self.structure.controller())
        if not self.problem.flies:
            return found
        setting, gains = self.problem.setting, self.gains
        return replace(found, points=break_points(setting, gains), together=together(setting, gains))

    def table(self) -> Any:
        """The gain table, with proofs: `.write(path)`, `.export("c", path)`."""
        return through("table")(self)

    def plot(self) -> Any:
        """A matplotlib Figure: every goal against its limit, over frequency or time; a vehicle's overview."""
        return through("plot")(self)

    def to_dict(self) -> dict[str, Any]:
        """A vehicle's figures, or name and values of another plant; with verdicts, starts and what binds."""
        document = (
            {"problem": self.problem.name, "values": plain(dict(self.values)), "seed": self.seed, "solver": self.solver}
            if self.analysis is None
            else self.analysis.to_dict()
        )
        document["requirements"] = [v.to_dict() for v in self.verdicts]
        document["starts"] = [s.to_dict() for s in self.starts]
        document["binding"] = list(self.binding)
        if self.valley is not None:
            document["valley"] = self.valley.word
        if self.multipliers is not None:
            document["multipliers"] = [m.to_dict() for m in self.multipliers.each]
            document["multipliers_unexplained"] = self.multipliers.unexplained
        return document

    def structure_rows(self) -> list[Row]:
        """Every parameter with its unit."""
        known = {p.name: p.unit for p in self.problem.structure.parameters}
        return [(name, value, known[name]) for name, value in self.values.items()]

    def rows(self) -> list[Row]:
        cost: list[Row] = [] if self.analysis is None else [("cost J", self.analysis.cost, "")]
        return [
            ("problem", self.problem.name, ""),
            *cost,
            *([("valley", self.valley.word, "")] if self.valley else []),
            ("requirements met" if self.problem.flies else "goals met", self.met, ""),
            *((f"{v.name} {v.sense} {v.limit:g}", v.value, v.unit) for v in self.verdicts),
            *self.structure_rows(),
        ]


def checked_values(values: Gains | Mapping[str, float] | None) -> Mapping[str, float]:
    """Values by name, none where none are given; refused where they are something else."""
    if values is None or isinstance(values, Gains):
        return {} if values is None else values.as_dict()
    if not isinstance(values, Mapping):
        raise InputError(f"values must map names of parameters to numbers; got a {type(values).__name__}. Give a dict.")
    return values


def given(
    problem: Problem, values: Gains | Mapping[str, float], *, analysis: Analysis | None = None,
    starts: Sequence[Start] = (), binding: Sequence[str] = (), seed: int = 0, solver: str = "given",
) -> Design:  # fmt: skip
    """Values from anywhere, judged as a design's are, whether they meet the goals or not.

    values : gains of a vehicle; of another plant any of the parameters, the rest as in the structure
    analysis : of these gains, if it is at hand already;  solver : who found them, in a word
    """
    if not problem.flies:
        whole = problem.structure_at(checked_values(values)).values()
        judged = loop_verdicts(problem, whole)
    else:
        gains = values if isinstance(values, Gains) else Gains.from_mapping(values)
        analysis = analyse(problem.setting, gains, problem.name) if analysis is None else analysis
        whole, judged = gains.as_dict(), verdicts(problem, analysis)
    return Design(
        problem=problem, values=whole, verdicts=judged, starts=tuple(starts), binding=tuple(binding), seed=seed,
        solver=solver, analysis=analysis,
    )  # fmt: skip


def printed(
    problem: Problem, values: Mapping[str, float], *, starts: Sequence[Start], binding: Sequence[str], seed: int,
    solver: str,
) -> Design:  # fmt: skip
    """`given` of values with as few digits as still meet every hard goal; of a plant of one's own."""
    hard, bounds = {goal.name for goal in problem.goals if goal.hard}, problem.bounds
    for digits in FINER:
        short = {name: _rounded(value, digits, bounds.get(name)) for name, value in values.items()}
        design = given(problem, short, starts=starts, binding=binding, seed=seed, solver=solver)
        if all(v.met for v in design.verdicts if v.name in hard):
            break
    return design


def _rounded(value: float, digits: int, bounds: tuple[float, float] | None) -> float:
    """A value to so many significant digits, within its bounds."""
    short = float(f"{value:.{digits}g}")
    return short if bounds is None else min(max(short, bounds[0]), bounds[1])
