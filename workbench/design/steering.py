"""A problem as a smooth nonlinear programme: log J, constraints g >= 0, and their exact gradients.

    x (scaled free parameters) --> seventeen parameters --> measures of every group --> log J, g(x), Jacobians

Variables: gains divided by a typical size, logarithms of time constants. The two directions that change nothing are
taken out by the problem's fixed K_heave = K_sway = 1. Every constraint is relative to its limit: 0.01 is one per cent.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from workbench.analysis.reserve_loops import ReserveLoops
from workbench.compiled import Buffered
from workbench.control.gains import GAIN_NAMES, TIME_CONSTANTS, Gains
from workbench.design.measures import STEERING, Grid, GroupMeasures, static_error_function
from workbench.design.problem import Problem
from workbench.design.unseen import Calibrated, Unseen, Watched, unseen
from workbench.errors import InputError
from workbench.goals.goal import Rows
from workbench.goals.ride.cost import RideCost
from workbench.goals.ride.decay_rate import STABLE
from workbench.goals.ride.evaluated import Evaluated
from workbench.goals.ride.requirement import Requirement, strictest
from workbench.solve.smooth import Point

ROUNDING = 1e-9  # of the width of a bound: a logarithm and a product away from the gain as given
TYPICAL = {
    "K_h": 1.0, "K_hdot": 0.2, "K_hp": 1.0, "K_hpdot": 0.2,
    "K_zddot": 0.05, "K_zdot": 0.2, "K_yddot": 0.05, "K_ydot": 0.2,
    "K_heave": 1.0, "K_pitch": 1.0, "K_sway": 1.0, "K_roll": 2.0, "K_yaw": 3.0,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Measured:
    """Cost J and named constraint rows at one set of the seventeen parameters, with derivatives by them.

    cost_slope : (17,);  rows : name to (values (k,), derivatives (k, 17)), >= 0 where met, relative to the limit
    floors : of each of the rows, what no compromise takes it below
    """

    cost: float
    cost_slope: np.ndarray
    rows: Rows
    floors: tuple[float, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Programme:
    """The nonlinear programme of a problem: a value; `with_…` makes another that shares the compiled functions.

    Parameters
    ----------
    back_off : relative distance kept from every limit
    relaxation : multiple of the limits of what a search begins with a looser limit of
    grid : frequencies of the quadrature and of the sensitivity
    groups, static : measures of each group, with the frequencies watched beside the grid's; of rest. Made if left out
    factors : of mean squares by class: what the grid was off from an exact measure
    kept : loops beside the nominal one, made when a goal asks for them
    """

    problem: Problem
    back_off: float = 0.002
    relaxation: float = 1.0
    grid: Grid = STEERING
    groups: tuple[GroupMeasures, ...] = ()
    static: Buffered | None = None
    factors: Mapping[str, float] = field(default_factory=dict)
    kept: dict[str, ReserveLoops] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.groups:
            _check(self.problem)
            made = (
                GroupMeasures(self.problem.setting, s, self.grid, self.problem.fixed) for s in self.problem.subjects
            )
            object.__setattr__(self, "groups", tuple(made))
            object.__setattr__(self, "static", Buffered(static_error_function(self.problem.setting)))

    @cached_property
    def asked(self) -> dict[str, Requirement]:
        """Of each kind the strictest requirement; relaxed where it is one of those and the programme is."""
        found = strictest(self.problem.requirements)
        return {name: r.relaxed(self.relaxation) if r.relaxed_first else r for name, r in found.items()}

    @property
    def held(self) -> dict[str, Requirement]:
        """What has rows, in their order: a loop must be stable, whatever is asked."""
        return {STABLE.name: STABLE, **self.asked}

    @cached_property
    def ride_cost(self) -> RideCost:
        """The soft goal."""
        return next((g for g in self.problem.goals if isinstance(g, RideCost)), RideCost())

    @cached_property
    def free(self) -> list[int]:
        """Positions of the free parameters among the seventeen."""
        return [GAIN_NAMES.index(name) for name in self.problem.free]

    @cached_property
    def _log(self) -> np.ndarray:
        return np.array([GAIN_NAMES[k] in TIME_CONSTANTS for k in self.free])

    @cached_property
    def _typical(self) -> np.ndarray:
        return np.array([TYPICAL.get(GAIN_NAMES[k], 1.0) for k in self.free])

    @cached_property
    def _base(self) -> np.ndarray:
        return np.array([self.problem.fixed.get(name, 1.0) for name in GAIN_NAMES])

    def with_relaxed(self, factor: float) -> "Programme":
        """With limits a factor looser, of what a search begins so (for a homotopy); itself where nothing is."""
        relaxable = any(r.relaxed_first for r in self.problem.requirements)
        return replace(self, relaxation=factor) if relaxable else self

    def with_requirements(self, requirements: Sequence[Requirement]) -> "Programme":
        """With other limits of the same setting; what was added stays."""
        return replace(self, problem=self.problem.with_requirements(requirements), relaxation=1.0)

    def with_back_off(self, back_off: float) -> "Programme":
        """With another relative distance kept from every limit."""
        return replace(self, back_off=back_off)

    def with_added(self, unseen: Sequence[Unseen]) -> "Programme":
        """With more frequencies constrained and mean squares multiplied by more."""
        omega = [one.omega for one in unseen if isinstance(one, Watched)]
        factors = dict(self.factors)
        for one in unseen:
            if isinstance(one, Calibrated):
                factors[one.name] = one.factor * factors.get(one.name, 1.0)
        groups = tuple(group.watching(omega) for group in self.groups) if omega else self.groups
        return replace(self, groups=groups, factors=factors)

    def unseen(self, x: np.ndarray) -> tuple[Unseen, ...]:
        """What exact measures at x say is to be constrained and was not."""
        return self.unseen_at(self.theta(x))

    def unseen_at(self, theta: np.ndarray) -> tuple[Unseen, ...]:
        """The same at the seventeen parameters."""
        return unseen(self, theta)

    # ---- variables

    def theta(self, x: np.ndarray) -> np.ndarray:
        """The seventeen parameters at x."""
        theta = self._base.copy()
        theta[self.free] = np.where(self._log, np.exp(np.where(self._log, x, 0.0)), x * self._typical)
        return theta

    def gains(self, x: np.ndarray) -> Gains:
        """The same as a record."""
        return Gains(**dict(zip(GAIN_NAMES, self.theta(x).tolist(), strict=True)))

    def x(self, gains: Gains) -> np.ndarray:
        """The variables that stand for given gains, moved inside the bounds; what is fixed stays the problem's.

        First rescaled to the problem's fixed K_heave and K_sway where that leaves the loop as it is.
        """
        low, high = self.bounds()
        return np.clip(self._scaled(gains), low, high)

    def start(self, gains: Gains) -> np.ndarray:
        """The same of gains that a design is asked to start from: refused outside the bounds, not moved."""
        x, (low, high) = self._scaled(gains), self.bounds()
        room = ROUNDING * (high - low)
        for k in np.flatnonzero((x < low - room) | (x > high + room)):
            name = GAIN_NAMES[self.free[k]]
            raise InputError(
                f"{name} of the start must lie within its bounds {list(self.problem.bounds[name])}; got "
                f"{getattr(self._in_our_scale(gains), name):.6g}. Widen the bounds or give another start."
            )
        return np.clip(x, low, high)

    def _scaled(self, gains: Gains) -> np.ndarray:
        given = self._in_our_scale(gains).as_dict()
        values = np.array([given[GAIN_NAMES[k]] for k in self.free])
        return np.where(self._log, np.log(np.where(self._log, np.maximum(values, 1e-6), 1.0)), values / self._typical)

    def _in_our_scale(self, gains: Gains) -> Gains:
        """The same loop with the fixed values of the modal gains that may be chosen freely (`ModalLaw.references`)."""
        factor = {}
        for name in self.problem.law.references:
            own, wanted = getattr(gains, name), self.problem.fixed.get(name, 0.0)
            factor[name] = own / wanted if own * wanted > 0 else 1.0
        vertical = factor["K_heave"]
        return gains.rescaled(vertical=vertical, lateral=factor.get("K_sway", vertical))

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the variables."""
        limits = np.array([self.problem.bounds[GAIN_NAMES[k]] for k in self.free], float)
        scaled = np.where(
            self._log[:, None], np.log(np.where(self._log[:, None], limits, 1.0)), limits / self._typical[:, None]
        )
        return scaled[:, 0], scaled[:, 1]

    # ---- evaluation

    def at(self, x: np.ndarray) -> Point:
        """Objective log J, constraints and gradients at x."""
        measured, inner = self.measure(self.theta(x)), self.slope(x)
        names, values, jacobians = zip(*measured.rows, strict=True)
        return Point(
            float(np.log(measured.cost)),
            measured.cost_slope[self.free] / measured.cost * inner,
            np.concatenate(values),
            np.vstack([np.atleast_2d(j) for j in jacobians])[:, self.free] * inner,
            tuple(name for name, value in zip(names, values, strict=True) for _ in value),
            np.repeat(measured.floors, [len(value) for value in values]),
        )

    def growth(self, x: np.ndarray) -> float:
        """Largest real part of an eigenvalue at x [1/s]."""
        return self.abscissa(self.theta(x))

    def abscissa(self, theta: np.ndarray) -> float:
        """Largest real part of an eigenvalue [1/s]."""
        return float(max(np.linalg.eigvals(g.state_matrix(theta)).real.max() for g in self.groups))

    def slope(self, x: np.ndarray) -> np.ndarray:
        """(free,) derivative of each free parameter by its own variable, at x."""
        return np.where(self._log, self.theta(x)[self.free], self._typical)

    def measure(self, theta: np.ndarray) -> Measured:
        """Cost and constraint rows at the seventeen parameters, with their derivatives."""
        at = self.evaluated(theta)
        rows = [(row, r.floor(self.back_off)) for r in self.held.values() for row in r.steer(at)]
        return Measured(*self.ride_cost.cost(at), [row for row, _ in rows], tuple(floor for _, floor in rows))

    def evaluated(self, theta: np.ndarray) -> Evaluated:
        """Responses and mean squares at the seventeen parameters, and what else is asked of them."""
        responses = [group.responses(theta) for group in self.groups]
        squares: dict[str, float] = {}
        slopes: dict[str, np.ndarray] = {}
        for group, found in zip(self.groups, responses, strict=True):
            for name, value, slope in zip(group.classes, found.mean.value, found.mean.gradient, strict=True):
                factor = self.factors.get(name, 1.0)
                squares[name] = squares.get(name, 0.0) + factor * value
                slopes[name] = slopes.get(name, 0.0) + factor * slope
        return Evaluated(
            self.problem.setting, self.groups, theta, self.back_off, responses, squares, slopes, self.static, self.kept
        )


def _check(problem: Problem) -> None:
    """Refuses what cannot be designed."""
    if not problem.free:
        raise InputError(f"problem {problem.name!r} has no free parameter; free at least one gain.")
    if any(s.direct for s in problem.subjects):
        raise InputError(
            "a design needs the current-loop lag: without it the best acceleration feedback is infinitely fast; "
            "set current_lag_s in the data, 0.010 for example."
        )
    if problem.setting.guideway.correlation is not None:
        raise InputError(
            "a design takes irregularity types that are uncorrelated; got a correlation. "
            "Design without it, then 'analyse' with it."
        )
    for name in TIME_CONSTANTS:
        if problem.fixed.get(name, 1.0) <= 0:
            raise InputError(f"{name} must be positive in a design; got {problem.fixed[name]!r} s under [fixed].")
