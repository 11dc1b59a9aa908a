"""A vehicle's requirements judged: every value from the exact measures, with the place where it is tightest."""

from workbench.analysis.analysis import Analysis
from workbench.control import Gains
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import MarginRequirement
from workbench.goals.verdict import Verdict


def verdicts(problem: Problem, analysis: Analysis) -> tuple[Verdict, ...]:
    """One verdict per requirement; the peak sensitivity gets one per group of motion."""
    loop = Flown(problem.setting, analysis.gains, analysis)
    return tuple(verdict for r in problem.requirements for verdict in r.judge(loop))


def margin_verdicts(problem: Problem, gains: Gains) -> tuple[Verdict, ...]:
    """Verdicts on requirements that need no random response, the worst group of each."""
    loop, out = Flown(problem.setting, gains), []
    for r in problem.requirements:
        if not isinstance(r, MarginRequirement):
            raise InputError(f"{r.name!r} needs the random response; ask `verdicts` for it.")
        out.append(r.margin(loop))
    return tuple(out)
