"""The design of one row, with everything that its problem asks for.

    problem --[variation]--> gains for many models;  --[schedule]--> gains over speed;  --neither--> one set of gains

The same choice as `workbench design` makes; of a variation and a schedule together a row at a speed of its own takes
the variation, and any other is refused.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from workbench.control import Gains
from workbench.design.design import Design, design, refine
from workbench.design.problem import Problem
from workbench.design.robust import robust_design
from workbench.design.scheduled import schedule_design
from workbench.physics.vehicle import varied
from workbench.study.definition import Study


@dataclass(frozen=True)
class Designed:
    """A design, and the whole that it is a part of: itself, a design for many models, or a schedule."""

    design: Design
    whole: Any


def designed(problem: Problem, study: Study, start: Gains | None, *, one_speed: bool) -> Designed:
    """The design of a problem; from `start` where one is given, else from the study's random starts.

    one_speed : leave the problem's schedule out

    Raises
    ------
    InfeasibleError
        If something asked for cannot be met.
    """
    seeded = {"starts": study.starts, "seed": study.seed}
    if not one_speed:
        problem.check_one_way("leave one of them out of the problem")
    if problem.variation is not None:
        robust = robust_design(problem, start=start) if start is not None else robust_design(problem, **seeded)
        return Designed(robust.design, robust)
    alone = refine(problem, start) if start is not None else design(problem, **seeded)
    if problem.plan is None or one_speed:
        return Designed(alone, alone)
    scheduled = schedule_design(problem, cruise=alone)
    return Designed(scheduled.cruise, scheduled)


def with_factors(problem: Problem, factors: Mapping[str, float]) -> Problem:
    """The problem of a vehicle with other masses, inertias and forces; so are all vehicles that it varies into.

    factors : as `vehicle.varied` takes them
    """
    if not factors:
        return problem
    changed = problem.with_vehicle(varied(problem.vehicle, **factors))
    elsewhere = problem.vehicle_models.elsewhere
    if elsewhere is None:
        return changed

    def there(values: Mapping[str, float]):
        both = {name: factor * values.get(name, 1.0) for name, factor in factors.items()}
        return elsewhere({**values, **both})

    return changed.with_models(replace(changed.vehicle_models, elsewhere=there))
