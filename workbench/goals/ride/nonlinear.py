"""The ride with forces that bend: its cost, to be made small, and the contacts that level crossings expect.

Evaluated --closure on a grid, its adjoint--> J, log of contacts per hour, gradients --Flown--> judged by another route

Neither is proved: a table states them.
"""

from dataclasses import dataclass

import numpy as np

from workbench.analysis.analysis import Analysis
from workbench.analysis.nonlinear_ride import FINER, BentLoop, bends
from workbench.analysis.setting import Setting
from workbench.errors import InputError
from workbench.goals.goal import Rows
from workbench.goals.key import Key
from workbench.goals.ride.cost import RideCost
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.requirement import Found
from workbench.goals.ride.reserve import Reserve
from workbench.goals.verdict import Verdict

NO_RIDE = 10.0  # times the linear cost where the bent ride does not last: a search turns back
FAR = -10.0  # of a row, there


@dataclass(frozen=True, slots=True, kw_only=True)
class NonlinearRideCost(RideCost):
    """J of the ride with forces that bend, by statistical linearisation to second order.

    Judged on 16 drawn guideways, each beside the linear ride over it: a ratio with a standard error.

    Source: guide, Definitions: Cost; Nonlinear ride.
    """

    kind = "nonlinear ride cost"
    beside = True

    def check(self, problem: str, setting: Setting) -> None:
        refuse_straight(self.kind, problem, setting)

    def cost(self, point: Evaluated) -> tuple[float, np.ndarray]:
        """J and its derivatives (17,)."""
        value, slope = RideCost.cost(self, point)
        if point.bent.found is None:
            return NO_RIDE * value, NO_RIDE * slope
        return value + point.bent.cost_change, slope + point.bent.cost_slope

    def of(self, analysis: Analysis) -> float | None:
        return None if analysis.nonlinear is None else analysis.nonlinear.cost

    def judge(self, loop: Flown) -> tuple[Verdict, ...]:
        linear = loop.analysis.cost
        drawn = None if linear is None else BentLoop(loop.setting, loop.gains).drawn()
        if linear is None or drawn is None or drawn.rides < 2:
            return (self.said(None, "no response" if linear is None else "no guideway's ride settles", ""),)
        where = f"± {linear * drawn.error[0]:.2g}, {drawn.lost} rides that do not settle left out"
        return (self.said(linear * float(drawn.ratio[0]), where, f"{drawn.rides} drawn guideways"),)


@dataclass(frozen=True, slots=True, kw_only=True)
class ContactsPerHour(Reserve):
    """Contacts of coils with the guideway that level crossings of Gaussian distances expect in an hour, at most.

    Judged by the same closure on a grid of twice the period and half the step. Flutter adds to it what it does not
    foresee: ask for damping at gap offsets beside it.

    Source: guide, Definitions: Nonlinear ride.
    """

    kind, sense, unit = "contacts per hour", "<=", "1/h"
    keys = (Key("at_most", "limit"),)

    def _usual_name(self) -> str:
        return self.kind

    def looked_at(self) -> str:
        return "coils and guideway"

    def check(self, problem: str, setting: Setting) -> None:
        Reserve.check(self, problem, setting)
        refuse_straight(self.kind, problem, setting)

    def rows_of(self, point: Evaluated) -> Rows:
        at, limit = point.bent, self.asked_at(point.back_off)
        if at.found is None:
            return [(self.name, np.array([FAR]), np.zeros((1, len(point.theta))))]
        return [(self.name, np.array([np.log(limit) - at.contacts.logarithm_per_hour]), -at.contacts_slope[None])]

    def found(self, loop: Flown) -> Found:
        at = BentLoop(loop.setting, loop.gains, FINER)
        if at.found is None:
            return [(None, "the bent ride does not last")]
        coil_set, surface = at.contacts.worst
        return [(at.contacts.per_hour, at.contacts.named(coil_set, surface))]


def refuse_straight(what: str, problem: str, setting: Setting) -> None:
    """Refuses a goal on forces that bend where none do, or where not all motions are looked at."""
    if not bends(setting):
        raise InputError(
            f"{what!r} needs all groups of motion of a vehicle whose force law bends; problem {problem!r} looks at "
            f"{', '.join(setting.groups)}. Look at heave_pitch and sway_roll_yaw, with the law of the coils."
        )
