"""One nonlinear programme over many models: the same free numbers, every model's own constraints.

    x --chart--> seventeen parameters of each model --its Programme--> cost, constraints --chain rule--> by x

A chart says what the free numbers are: the gains themselves (`SharedChart`), or the coefficients of polynomials that
give them at each model's speed (`PolynomialChart`), which is linear: theta_k = base + Φ_k x. Cost: that of the first
model, the mean over models, or the worst, for which one more variable bounds the logarithm of each model's cost.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from workbench.control.gains import GAIN_NAMES, TIME_CONSTANTS, Gains
from workbench.design.measures import Grid
from workbench.design.model import STABILITY, Model
from workbench.design.problem import Problem
from workbench.design.steering import TYPICAL, Point, Programme

# Sensitivity nodes of a model that is looked at for its margins alone; peaks between them are added as they show.
MARGIN_GRID = Grid.over((0.05, 0.1, 0.2, 0.3, 0.45, 0.65, 0.9, 1.3, 1.8, 2.5, 3.5, 5.0, 7.0, 10.0, 16.0, 26.0, 60.0), 2)
TYPICAL_TAU = 0.3  # [s] of a coefficient of a time constant
BOUND_BACK_OFF = 1e-5  # of a bound's interval: more than six printed digits move a parameter
LOG_COST = 20.0  # the worst cost lies within e^±20


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


class SharedChart:
    """The gains themselves, the same for all models; each model's sensors scale them."""

    def __init__(self, programme: Programme, scales: Sequence[np.ndarray]) -> None:
        self._programme, self._scales = programme, list(scales)

    def add(self, scale: np.ndarray) -> None:
        """One more model."""
        self._scales.append(scale)

    def theta(self, x: np.ndarray, k: int) -> np.ndarray:
        return self._scales[k] * self._programme.theta(x)

    def slope(self, x: np.ndarray, k: int) -> np.ndarray:
        out = np.zeros((len(GAIN_NAMES), len(x)))
        out[self._programme.free, np.arange(len(x))] = self._programme.slope(x)
        return self._scales[k][:, None] * out

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return self._programme.bounds()

    def rows(self, x: np.ndarray) -> list[tuple[str, np.ndarray, np.ndarray]]:
        return []


class PolynomialChart:
    """Gains and time constants as polynomials of t = (v − centre)/scale; x holds their coefficients over typical sizes.

    Entry (i, j) of x, row by row: coefficient of t^j of free parameter i. Bounds of the parameters hold at the speeds.
    """

    def __init__(self, problem: Problem, speeds: Sequence[float], centre: float, scale: float, degree: int) -> None:
        self.centre, self.scale, self.degree = centre, scale, degree
        self.free = [GAIN_NAMES.index(name) for name in problem.free]
        self._typical = np.array([TYPICAL_TAU if n in TIME_CONSTANTS else TYPICAL.get(n, 1.0) for n in problem.free])
        self._base = np.array([problem.fixed.get(name, 0.0) for name in GAIN_NAMES])
        self._limits = np.array([problem.bounds[name] for name in problem.free], float)
        self._powers = [self._power(v) for v in speeds]

    def add(self, speed: float) -> None:
        """One more model, at a speed."""
        self._powers.append(self._power(speed))

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

    model: Model
    programme: Programme


class Family:
    """The nonlinear programme of many models; takes the place of `steering.Programme` in `solve`."""

    def __init__(
        self, nominal: Programme, models: Sequence[Model], chart: Chart, *, cost: str = "nominal", back_off: float
    ) -> None:
        """nominal : programme of the first model, whose requirements are the problem's own."""
        self.cost, self.back_off, self._chart = cost, back_off, chart
        self.limits = nominal.limits
        self.members = [Member(Model(name="nominal", values={}, problem=nominal.problem), nominal)]
        for model in models:
            self.add(model)
        self._known: tuple[bytes, Point] | None = None
        self.evaluations = 0

    def add(self, model: Model) -> None:
        """One more model; the chart must know it already."""
        margins_alone = self.cost == "nominal" and {r.name for r in model.problem.requirements} <= set(STABILITY)
        grid = {"grid": MARGIN_GRID} if margins_alone else {}
        self.members.append(Member(model, Programme(model.problem, back_off=self.back_off, **grid)))
        self._known = None

    # ---- what `solve` asks

    def with_sensitivity(self, limit: float) -> None:
        """Changes the bound on the peak sensitivity: of the first model to this, of the others in proportion."""
        factor = limit / self.limits["peak sensitivity"]
        for member in self.members:
            wanted = member.programme.limits.get("peak sensitivity")
            if wanted:
                member.programme.with_sensitivity(wanted * factor)
        self._known = None

    def set_back_off(self, back_off: float) -> None:
        """Changes the relative distance kept from every limit, of every model."""
        self.back_off = back_off
        for member in self.members:
            member.programme.set_back_off(back_off)
        self._known = None

    def exchange(self, x: np.ndarray) -> bool:
        """Whether exact measures of a model say that something is to be constrained that was not; then it is."""
        self._known = None
        added = [m.programme.exchange_at(self.theta(x, k)) for k, m in enumerate(self.members)]
        return any(added)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the variables."""
        low, high = self._chart.bounds()
        return (np.append(low, -LOG_COST), np.append(high, LOG_COST)) if self.cost == "worst" else (low, high)

    def growth(self, x: np.ndarray) -> float:
        """Largest real part of an eigenvalue of any model [1/s]."""
        return max(m.programme.abscissa(self.theta(x, k)) for k, m in enumerate(self.members))

    def theta(self, x: np.ndarray, k: int = 0) -> np.ndarray:
        """The seventeen parameters of model k."""
        return self._chart.theta(self._chosen(x), k)

    def gains(self, x: np.ndarray, k: int = 0) -> Gains:
        """The same as a record."""
        return Gains(**dict(zip(GAIN_NAMES, self.theta(x, k).tolist(), strict=True)))

    def whole(self, z: np.ndarray) -> np.ndarray:
        """The variables of the programme from the chart's: with a bound on the worst cost where one is asked for."""
        if self.cost != "worst":
            return z
        costs = [m.programme.measure(self._chart.theta(z, k)).cost for k, m in enumerate(self.members)]
        return np.append(z, np.log(max(costs)))

    def chart_of(self, x: np.ndarray) -> np.ndarray:
        """The chart's variables of the programme's."""
        return self._chosen(x)

    def at(self, x: np.ndarray) -> Point:
        """Objective and constraints at x."""
        x = np.asarray(x, float)
        if self._known is None or self._known[0] != x.tobytes():
            self._known = (x.tobytes(), self._evaluate(x))
        return self._known[1]

    # ---- evaluation

    def _chosen(self, x: np.ndarray) -> np.ndarray:
        return x[:-1] if self.cost == "worst" else x

    def _evaluate(self, x: np.ndarray) -> Point:
        self.evaluations += 1
        z = self._chosen(x)
        names: list[str] = []
        values, jacobians, logs, slopes = [], [], [], []
        for k, member in enumerate(self.members):
            inner = self._chart.slope(z, k)
            measured = member.programme.measure(self._chart.theta(z, k))
            logs.append(np.log(measured.cost))
            slopes.append(measured.cost_slope @ inner / measured.cost)
            for name, value, slope in measured.rows:
                value = np.atleast_1d(value)
                names += [name if k == 0 else f"{name} ({member.model.name})"] * len(value)
                values.append(value)
                jacobians.append(np.atleast_2d(slope) @ inner)
        for name, value, slope in self._chart.rows(z):
            names += [name] * len(value)
            values.append(value)
            jacobians.append(slope)
        value, jacobian = np.concatenate(values), np.vstack(jacobians)
        if self.cost == "worst":
            value = np.append(value, x[-1] - np.array(logs))
            right = np.append(np.zeros(len(jacobian)), np.ones(len(logs)))
            jacobian = np.column_stack([np.vstack([jacobian, -np.array(slopes)]), right])
            names += ["worst cost"] * len(logs)
            return Point(float(x[-1]), np.append(np.zeros(len(z)), 1.0), value, jacobian, tuple(names))
        if self.cost == "mean":
            cost = np.exp(logs)
            share = cost / cost.sum()
            return Point(float(np.log(cost.mean())), share @ np.array(slopes), value, jacobian, tuple(names))
        return Point(float(logs[0]), slopes[0], value, jacobian, tuple(names))
