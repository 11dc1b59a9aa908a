"""One nonlinear programme over many models: the same free numbers, every model's own constraints.

    x --chart--> seventeen parameters of each model --its Programme--> cost, constraints --chain rule--> by x

A chart says what the free numbers are: the gains themselves (`SharedChart`), or the coefficients of polynomials that
give them at each model's speed (`PolynomialChart`), which is linear: theta_k = base + Φ_k x. Cost: that of the first
model, the mean over models, or the worst, for which one more variable bounds the logarithm of each model's cost.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, Protocol, TypeVar

import numpy as np

from workbench.control.gains import GAIN_NAMES, TIME_CONSTANTS, Gains
from workbench.design.measures import STEERING, Grid
from workbench.design.problem import Problem
from workbench.design.steering import TYPICAL, Programme
from workbench.design.unseen import Unseen
from workbench.design.variation import Variant
from workbench.solve.smooth import Point

# Sensitivity nodes of a model that is looked at for its margins alone; peaks between them are added as they show.
MARGIN_GRID = Grid.over((0.05, 0.1, 0.2, 0.3, 0.45, 0.65, 0.9, 1.3, 1.8, 2.5, 3.5, 5.0, 7.0, 10.0, 16.0, 26.0, 60.0), 2)
TYPICAL_TAU = 0.3  # [s] of a coefficient of a time constant
BOUND_BACK_OFF = 1e-5  # of a bound's interval: more than six printed digits move a parameter
LOG_COST = 20.0  # the worst cost lies within e^±20


ChartT = TypeVar("ChartT", bound="Chart")


class Chart(Protocol):
    """Free numbers to the seventeen parameters of model k."""

    def theta(self, x: np.ndarray, k: int) -> np.ndarray:
        """(17,) parameters of model k."""
        ...

    def slope(self, x: np.ndarray, k: int) -> np.ndarray:
        """(17, n) derivatives of them."""
        ...

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of x."""
        ...

    def rows(self, x: np.ndarray) -> list[tuple[str, np.ndarray, np.ndarray]]:
        """Constraints of the chart's own: name, values (k,) >= 0, derivatives (k, n)."""
        ...


@dataclass(frozen=True, eq=False)
class SharedChart:
    """The gains themselves, the same for all models; each model's sensors scale them."""

    programme: Programme
    scales: tuple[np.ndarray, ...]

    def with_model(self, scale: np.ndarray) -> "SharedChart":
        """With one more model."""
        return SharedChart(self.programme, (*self.scales, scale))

    def theta(self, x: np.ndarray, k: int) -> np.ndarray:
        return self.scales[k] * self.programme.theta(x)

    def slope(self, x: np.ndarray, k: int) -> np.ndarray:
        out = np.zeros((len(GAIN_NAMES), len(x)))
        out[self.programme.free, np.arange(len(x))] = self.programme.slope(x)
        return self.scales[k][:, None] * out

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return self.programme.bounds()

    def rows(self, x: np.ndarray) -> list[tuple[str, np.ndarray, np.ndarray]]:
        return []


@dataclass(frozen=True, eq=False)
class PolynomialChart:
    """Gains and time constants as polynomials of t = (v − centre)/scale; x holds their coefficients over typical sizes.

    Entry (i, j) of x, row by row: coefficient of t^j of free parameter i. Bounds of the parameters hold at the speeds.
    """

    problem: Problem
    speeds: tuple[float, ...]
    centre: float
    scale: float
    degree: int

    @cached_property
    def free(self) -> list[int]:
        """Positions of the free parameters among the seventeen."""
        return [GAIN_NAMES.index(name) for name in self.problem.free]

    @cached_property
    def _typical(self) -> np.ndarray:
        names = self.problem.free
        return np.array([TYPICAL_TAU if n in TIME_CONSTANTS else TYPICAL.get(n, 1.0) for n in names])

    @cached_property
    def _base(self) -> np.ndarray:
        return np.array([self.problem.fixed.get(name, 0.0) for name in GAIN_NAMES])

    @cached_property
    def _limits(self) -> np.ndarray:
        return np.array([self.problem.bounds[name] for name in self.problem.free], float)

    @cached_property
    def _powers(self) -> list[np.ndarray]:
        return [self._power(v) for v in self.speeds]

    def with_speeds(self, speeds: Sequence[float]) -> "PolynomialChart":
        """With more models, at speeds."""
        return replace(self, speeds=(*self.speeds, *speeds))

    def _power(self, speed: float) -> np.ndarray:
        return ((speed - self.centre) / self.scale) ** np.arange(self.degree + 1)

    def theta(self, x: np.ndarray, k: int) -> np.ndarray:
        theta = self._base.copy()
        theta[self.free] = self._typical * (x.reshape(len(self.free), -1) @ self._powers[k])
        for name in TIME_CONSTANTS:  # a trial step may leave the bounds; filters of no time have no frequency response
            at = GAIN_NAMES.index(name)
            theta[at] = max(theta[at], 1e-3)
        return theta

    def slope(self, x: np.ndarray, k: int) -> np.ndarray:
        out = np.zeros((len(GAIN_NAMES), len(self.free), self.degree + 1))
        out[self.free, np.arange(len(self.free))] = self._typical[:, None] * self._powers[k]
        return out.reshape(len(GAIN_NAMES), -1)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        low, high = self._limits.T[:, :, None] / self._typical[None, :, None]
        reach = (high - low) * np.ones(self.degree)
        return np.hstack([low, -reach]).ravel(), np.hstack([high, reach]).ravel()

    def rows(self, x: np.ndarray) -> list[tuple[str, np.ndarray, np.ndarray]]:
        """Bounds at every speed, in units of the interval."""
        width = np.diff(self._limits, axis=1).ravel()
        out = []
        for power in self._powers:
            at = self._typical * (x.reshape(len(self.free), -1) @ power)
            slope = np.zeros((len(self.free), len(self.free), self.degree + 1))
            slope[np.arange(len(self.free)), np.arange(len(self.free))] = (self._typical / width)[:, None] * power
            slope = slope.reshape(len(self.free), -1)
            out.append(("lower bound of a parameter", (at - self._limits[:, 0]) / width - BOUND_BACK_OFF, slope))
            out.append(("upper bound of a parameter", (self._limits[:, 1] - at) / width - BOUND_BACK_OFF, -slope))
        return out

    def x(self, gains: Gains) -> np.ndarray:
        """The coefficients that hold given gains at every speed."""
        values = np.array([gains.as_dict()[GAIN_NAMES[k]] for k in self.free])
        out = np.zeros((len(self.free), self.degree + 1))
        out[:, 0] = np.clip(values, *self._limits.T) / self._typical
        return out.ravel()

    def coefficients(self, x: np.ndarray) -> dict[str, tuple[float, ...]]:
        """Name to coefficients of all seventeen parameters."""
        free = self._typical[:, None] * x.reshape(len(self.free), -1)
        out = {name: (float(self._base[i]), *(0.0,) * self.degree) for i, name in enumerate(GAIN_NAMES)}
        return {**out, **{GAIN_NAMES[k]: tuple(map(float, c)) for k, c in zip(self.free, free, strict=True)}}


@dataclass(frozen=True, slots=True)
class Member:
    """A model with its programme."""

    model: Variant
    programme: Programme


@dataclass(frozen=True, slots=True)
class OfMember:
    """What is added to the programme of one model."""

    member: int
    unseen: Unseen


@dataclass(frozen=True, eq=False, repr=False)
class Family(Generic[ChartT]):
    """The nonlinear programme of many models, a value; takes the place of `steering.Programme` in `solve`.

    members : models with their programmes, the nominal one first, whose requirements are the problem's own
    cost : of "nominal", "mean", "worst"
    """

    members: tuple[Member, ...]
    chart: ChartT
    cost: str
    back_off: float

    @classmethod
    def of(
        cls, nominal: Programme, models: Sequence[Variant], chart: ChartT, *, cost: str = "nominal", back_off: float
    ) -> "Family[ChartT]":
        """nominal : programme of the first model;  chart : of all of them"""
        first = Member(Variant(name="nominal", values={}, problem=nominal.problem), nominal)
        return cls((first,), chart, cost, back_off).with_models(models, chart)

    def with_models(self, models: Sequence[Variant], chart: ChartT) -> "Family[ChartT]":
        """With more models, and the chart that knows them."""
        return replace(self, members=(*self.members, *map(self._member, models)), chart=chart)

    def _member(self, model: Variant) -> Member:
        margins_alone = all(r.margin_alone for r in model.problem.requirements)
        grid = MARGIN_GRID if margins_alone and self.cost == "nominal" else STEERING
        return Member(model, Programme(model.problem, back_off=self.back_off, grid=grid))

    def _with(self, change: Callable[[int, Programme], Programme]) -> tuple[Member, ...]:
        return tuple(Member(m.model, change(k, m.programme)) for k, m in enumerate(self.members))

    # ---- what `solve` asks

    def with_relaxed(self, factor: float) -> "Family[ChartT]":
        """With every model's limits a factor looser, of what a search begins so."""
        members = self._with(lambda _, programme: programme.with_relaxed(factor))
        same = all(a.programme is b.programme for a, b in zip(members, self.members, strict=True))
        return self if same else replace(self, members=members)

    def with_back_off(self, back_off: float) -> "Family[ChartT]":
        """With another relative distance kept from every limit of every model."""
        members = self._with(lambda _, programme: programme.with_back_off(back_off))
        return replace(self, members=members, back_off=back_off)

    def unseen(self, x: np.ndarray) -> tuple[OfMember, ...]:
        """What exact measures of a model say is to be constrained and was not."""
        found = (m.programme.unseen_at(self.theta(x, k)) for k, m in enumerate(self.members))
        return tuple(OfMember(k, one) for k, each in enumerate(found) for one in each)

    def with_added(self, unseen: Sequence[OfMember]) -> "Family[ChartT]":
        """With that constrained."""
        own = {k: [one.unseen for one in unseen if one.member == k] for k in range(len(self.members))}
        return replace(self, members=self._with(lambda k, one: one.with_added(own[k]) if own[k] else one))

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the variables."""
        low, high = self.chart.bounds()
        return (np.append(low, -LOG_COST), np.append(high, LOG_COST)) if self.cost == "worst" else (low, high)

    def growth(self, x: np.ndarray) -> float:
        """Largest real part of an eigenvalue of any model [1/s]."""
        return max(m.programme.abscissa(self.theta(x, k)) for k, m in enumerate(self.members))

    def theta(self, x: np.ndarray, k: int = 0) -> np.ndarray:
        """The seventeen parameters of model k."""
        return self.chart.theta(self._chosen(x), k)

    def gains(self, x: np.ndarray, k: int = 0) -> Gains:
        """The same as a record."""
        return Gains(**dict(zip(GAIN_NAMES, self.theta(x, k).tolist(), strict=True)))

    def whole(self, z: np.ndarray) -> np.ndarray:
        """The variables of the programme from the chart's: with a bound on the worst cost where one is asked for."""
        if self.cost != "worst":
            return z
        costs = [m.programme.measure(self.chart.theta(z, k)).cost for k, m in enumerate(self.members)]
        return np.append(z, np.log(max(costs)))

    def chart_of(self, x: np.ndarray) -> np.ndarray:
        """The chart's variables of the programme's."""
        return self._chosen(x)

    def _chosen(self, x: np.ndarray) -> np.ndarray:
        return x[:-1] if self.cost == "worst" else x

    def at(self, x: np.ndarray) -> Point:
        """Objective and constraints at x."""
        x = np.asarray(x, float)
        z = self._chosen(x)
        names: list[str] = []
        floors: list[float] = []
        values, jacobians, logs, slopes = [], [], [], []
        for k, member in enumerate(self.members):
            inner = self.chart.slope(z, k)
            measured = member.programme.measure(self.chart.theta(z, k))
            logs.append(np.log(measured.cost))
            slopes.append(measured.cost_slope @ inner / measured.cost)
            for (name, value, slope), floor in zip(measured.rows, measured.floors, strict=True):
                value = np.atleast_1d(value)
                floors += [floor] * len(value)
                names += [name if k == 0 else f"{name} ({member.model.name})"] * len(value)
                values.append(value)
                jacobians.append(np.atleast_2d(slope) @ inner)
        for name, value, slope in self.chart.rows(z):
            names += [name] * len(value)
            values.append(value)
            jacobians.append(slope)
        value, jacobian = np.concatenate(values), np.vstack(jacobians)
        count = len(value) + (len(logs) if self.cost == "worst" else 0)
        low = np.append(floors, np.full(count - len(floors), -np.inf))
        if self.cost == "worst":
            value = np.append(value, x[-1] - np.array(logs))
            right = np.append(np.zeros(len(jacobian)), np.ones(len(logs)))
            jacobian = np.column_stack([np.vstack([jacobian, -np.array(slopes)]), right])
            names += ["worst cost"] * len(logs)
            return Point(float(x[-1]), np.append(np.zeros(len(z)), 1.0), value, jacobian, tuple(names), low)
        if self.cost == "mean":
            cost = np.exp(logs)
            share = cost / cost.sum()
            return Point(float(np.log(cost.mean())), share @ np.array(slopes), value, jacobian, tuple(names), low)
        return Point(float(logs[0]), slopes[0], value, jacobian, tuple(names), low)
