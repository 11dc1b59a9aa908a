"""A vehicle's requirements judged: every value from the exact measures, with the place where it is tightest."""

from workbench.analysis.analysis import Analysis
from workbench.analysis.first_tables import Limits
from workbench.control import Gains
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.goals.ride.damping_ratio import DampingRatio
from workbench.goals.ride.decay_rate import DecayRate
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.peak_sensitivity import PeakSensitivity
from workbench.goals.ride.requirement import MarginRequirement, Requirement
from workbench.goals.verdict import Verdict


def verdicts(problem: Problem, analysis: Analysis, *, beside: bool | None = None) -> tuple[Verdict, ...]:
    """One verdict per requirement; the peak sensitivity gets one per group of motion.

    beside : True for reserves alone, which take longer than all the rest, False for the rest alone
    """
    loop = Flown(problem.setting, analysis.gains, analysis)
    asked = [r for r in problem.requirements if beside is None or r.beside == beside]
    return tuple(verdict for r in asked for verdict in r.judge(loop))


def margin_verdicts(problem: Problem, gains: Gains) -> tuple[Verdict, ...]:
    """Verdicts on requirements that need no random response, the worst group of each."""
    loop, out = Flown(problem.setting, gains), []
    for r in problem.requirements:
        if not isinstance(r, MarginRequirement):
            raise InputError(f"{r.name!r} needs the random response; ask `verdicts` for it.")
        out.append(r.margin(loop))
    return tuple(out)


def nominal_limits(problem: Problem) -> Limits:
    """What a problem asks of damping, decay and peak sensitivity of a vehicle's own loop, the strictest of each."""
    asked = {
        kind: [r.limit for r in problem.requirements if isinstance(r, Requirement) and r.kind == kind and not r.beside]
        for kind in (DampingRatio.kind, DecayRate.kind, PeakSensitivity.kind)
    }
    damping, decay, peaks = asked.values()
    return Limits(
        damping=max(damping, default=None), decay=max(decay, default=None), peak_sensitivity=min(peaks, default=None)
    )
