"""Whether gains keep their margins on the computer that will run them: the law sampled at the problem's sample time.

gains --discretise--> sampled law --with the exact vehicle of each group--> damping, decay, peak sensitivity --> kept?
"""

from workbench.analysis.sampled import sampled_loop
from workbench.control import Gains
from workbench.control.discrete import discretise
from workbench.design.problem import Problem
from workbench.errors import InputError


def kept_sampled(problem: Problem, gains: Gains) -> bool:
    """Whether every requirement that a sampled loop can answer holds there too; yes of a law that cannot be sampled."""
    if problem.sample_time is None:
        return True
    law = problem.law
    try:
        sampled = discretise(law, gains, problem.sample_time)
        loops = [
            sampled_loop(s.plant, s.sampled(sampled), s.commands, law.sensors, reserve=False) for s in problem.subjects
        ]
    except InputError:
        return True
    found = [(r, r.sampled(loop)) for r in problem.requirements for loop in loops]
    return all(loop.stable for loop in loops) and all(v is None or r.shortfall(v) <= 0 for r, v in found)
