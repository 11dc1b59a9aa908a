"""A problem as a smooth nonlinear programme: log J, constraints g >= 0, and their exact gradients.

    x (scaled free parameters) --> seventeen parameters --> measures of every group --> log J, g(x), Jacobians

Variables: gains divided by a typical size, logarithms of time constants. The two directions that change nothing are
taken out by the problem's fixed K_heave = K_sway = 1. Every constraint is relative to its limit: 0.01 is one per cent.
"""

from dataclasses import dataclass

import numpy as np

from workbench.analysis.analysis import COST_POINTS
from workbench.analysis.comfort_summary import mask_for
from workbench.analysis.motor import current_at_3_sigma, slope_at_3_sigma
from workbench.constants import GRAVITY
from workbench.control.gains import GAIN_NAMES, TIME_CONSTANTS, Gains
from workbench.design.measures import GAPS, MOTOR_SQUARES, STEERING, Grid, GroupMeasures, static_error_function
from workbench.design.problem import Problem
from workbench.design.requirement import MOTOR_CURRENT, RIDE_MASKS
from workbench.errors import InputError

COST_SCALE = 1e4  # J = 10⁴ Σ mean squares in g²
TYPICAL = {
    "K_h": 1.0, "K_hdot": 0.2, "K_hp": 1.0, "K_hpdot": 0.2,
    "K_zddot": 0.05, "K_zdot": 0.2, "K_yddot": 0.05, "K_ydot": 0.2,
    "K_heave": 1.0, "K_pitch": 1.0, "K_sway": 1.0, "K_roll": 2.0, "K_yaw": 3.0,
}  # fmt: skip
SLOWEST = 4  # eigenvalues per group whose damping and decay are constrained: the others are far from the limits
SENSED_HZ = (0.02, 60.0)  # grid nodes at which the sensitivity is constrained; it tends to 1 outside
STABLE_DECAY = 1e-3  # [1/s] required even where no decay rate is asked for
PEAK_SIGMAS = 3.0
DELAY_BACK_OFF = 1.15  # integrated signals and the other pattern shorten what the direct gain alone would bear
MASK_BACK_OFF = 0.02  # a density between two nodes may exceed both by a per cent


@dataclass(frozen=True, slots=True)
class Point:
    """The programme at one x: objective log J, constraints g >= 0 with names, gradients."""

    objective: float
    slope: np.ndarray
    constraints: np.ndarray
    jacobian: np.ndarray
    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Measured:
    """Cost J and named constraint rows at one set of the seventeen parameters, with derivatives by them.

    cost_slope : (17,);  rows : name to (values (k,), derivatives (k, 17)), >= 0 where met, relative to the limit
    """

    cost: float
    cost_slope: np.ndarray
    rows: list[tuple[str, np.ndarray, np.ndarray]]


class Programme:
    """The nonlinear programme of a problem; evaluations are remembered, since solvers ask in turn.

    grid : frequencies of the quadrature and of the sensitivity
    """

    def __init__(
        self, problem: Problem, *, back_off: float = 0.002, sensitivity_limit: float | None = None,
        grid: Grid = STEERING,
    ) -> None:  # fmt: skip
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
        self.problem = problem
        self.groups = [GroupMeasures(problem.setting, s, grid) for s in problem.subjects]
        self.free = [GAIN_NAMES.index(name) for name in problem.free]
        self._log = np.array([GAIN_NAMES[k] in TIME_CONSTANTS for k in self.free])
        self._typical = np.array([TYPICAL.get(GAIN_NAMES[k], 1.0) for k in self.free])
        self._base = np.array([problem.fixed.get(name, 1.0) for name in GAIN_NAMES])
        self._static = static_error_function(problem.setting)
        self.limits = {r.name: r.limit for r in problem.requirements}
        self.back_off = back_off
        self.sensitivity_limit = sensitivity_limit or self.limits.get("peak sensitivity")
        self._sensed = [
            (g.omega >= 2 * np.pi * SENSED_HZ[0]) & (g.omega <= 2 * np.pi * SENSED_HZ[1]) for g in self.groups
        ]
        states = [
            (s.plant, k) for s in problem.subjects for k, n in enumerate(s.plant.states) if n.startswith("current of")
        ]
        self._fastest_current = max((-plant.A[k, k] for plant, k in states), default=np.inf)
        self._known: tuple[bytes, Point] | None = None
        self.evaluations = 0

    def with_sensitivity(self, limit: float) -> None:
        """Changes the bound on the peak sensitivity (for a homotopy)."""
        self.sensitivity_limit = limit
        self._known = None

    def set_back_off(self, back_off: float) -> None:
        """Changes the relative distance kept from every limit."""
        self.back_off = back_off
        self._known = None

    def watch(self, group: int, omega: float) -> None:
        """Constrains the sensitivity of a group at one more frequency [rad/s]."""
        self.groups[group].watch([omega])
        self._known = None

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
        """The variables that stand for given gains, moved inside the bounds."""
        values = np.array([gains.as_dict()[GAIN_NAMES[k]] for k in self.free])
        scaled = np.where(self._log, np.log(np.where(self._log, np.maximum(values, 1e-6), 1.0)), values / self._typical)
        low, high = self.bounds()
        return np.clip(scaled, low, high)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the variables."""
        limits = np.array([self.problem.bounds[GAIN_NAMES[k]] for k in self.free], float)
        scaled = np.where(
            self._log[:, None], np.log(np.where(self._log[:, None], limits, 1.0)), limits / self._typical[:, None]
        )
        return scaled[:, 0], scaled[:, 1]

    # ---- evaluation

    def at(self, x: np.ndarray) -> Point:
        """Objective, constraints and gradients at x."""
        key = np.asarray(x, float).tobytes()
        if self._known is None or self._known[0] != key:
            self._known = (key, self._evaluate(np.asarray(x, float)))
        return self._known[1]

    def growth(self, x: np.ndarray) -> float:
        """Largest real part of an eigenvalue at x [1/s]."""
        return self.abscissa(self.theta(x))

    def abscissa(self, theta: np.ndarray) -> float:
        """Largest real part of an eigenvalue [1/s]."""
        return float(max(np.linalg.eigvals(g.state_matrix(theta)).real.max() for g in self.groups))

    def slope(self, x: np.ndarray) -> np.ndarray:
        """(free,) derivative of each free parameter by its own variable, at x."""
        return np.where(self._log, self.theta(x)[self.free], self._typical)

    def _evaluate(self, x: np.ndarray) -> Point:
        self.evaluations += 1
        measured, inner = self.measure(self.theta(x)), self.slope(x)
        names, values, jacobians = zip(*measured.rows, strict=True)
        return Point(
            float(np.log(measured.cost)),
            measured.cost_slope[self.free] / measured.cost * inner,
            np.concatenate(values),
            np.vstack([np.atleast_2d(j) for j in jacobians])[:, self.free] * inner,
            tuple(name for name, value in zip(names, values, strict=True) for _ in value),
        )

    def measure(self, theta: np.ndarray) -> Measured:
        """Cost and constraint rows at the seventeen parameters, with their derivatives."""
        squares: dict[str, float] = {}
        slopes: dict[str, np.ndarray] = {}
        rows: list[tuple[str, np.ndarray, np.ndarray]] = []
        for number, group in enumerate(self.groups):
            mean, peak = group.responses(theta)
            for name, value, slope in zip(group.classes, mean.value, mean.gradient, strict=True):
                squares[name] = squares.get(name, 0.0) + value
                slopes[name] = slopes.get(name, 0.0) + slope
            rows += self._pole_rows(group, theta)
            rows += self._delay_rows(group, theta)
            if self.sensitivity_limit:
                kept = np.concatenate(
                    [self._sensed[number], np.ones(len(peak.value) - len(self._sensed[number]), bool)]
                )
                limit = (self.sensitivity_limit * (1 - self.back_off)) ** 2
                name = f"peak sensitivity of {group.subject.name}"
                rows.append((name, 1 - peak.value[kept] / limit, -peak.gradient[kept] / limit))
        rows += self._square_rows(squares, slopes)
        rows += self._mask_rows()
        static, static_slope = (m.full() for m in self._static(theta))
        rows += self._static_rows(squares, slopes, static.ravel(), static_slope)

        felt = [name for name in squares if name.startswith("acceleration") and name.rsplit(", ", 1)[1] in COST_POINTS]
        cost = COST_SCALE / GRAVITY**2 * sum(squares[name] for name in felt)
        cost_slope = COST_SCALE / GRAVITY**2 * sum(slopes[name] for name in felt)
        return Measured(float(cost), np.asarray(cost_slope), rows)

    def _pole_rows(self, group: GroupMeasures, theta: np.ndarray):
        values, slopes = group.eigenvalues(theta)
        upper = np.flatnonzero(values.imag >= 0)
        values, slopes = values[upper], slopes[upper]
        size = np.abs(values)
        decay = max(self.limits.get("decay rate", 0.0) * (1 + self.back_off), STABLE_DECAY)
        count = min(
            SLOWEST, (group.size + 1) // 2
        )  # there are at least so many upper eigenvalues, however many are real
        slow = np.argsort(-values.real)[:count]
        rows = [(f"decay rate of {group.subject.name}", -values.real[slow] / decay - 1, -slopes.real[slow] / decay)]
        asked = self.limits.get("damping ratio")
        if asked:
            asked *= 1 + self.back_off
            ratio = -values.real / size
            d_ratio = (
                -slopes.real / size[:, None] + (values.real / size**3)[:, None] * (values.conj()[:, None] * slopes).real
            )
            worst = np.argsort(ratio)[:count]
            rows.append((f"damping ratio of {group.subject.name}", ratio[worst] / asked - 1, d_ratio[worst] / asked))
        return rows

    def _square_rows(self, squares, slopes):
        rows = []
        for name in GAPS:
            limit = self.limits.get(f"rms {name}")
            if limit:
                limit = (limit * (1 - self.back_off)) ** 2
                rows.append((f"rms {name}", np.array([1 - squares[name] / limit]), -slopes[name] / limit))
        limit = self.limits.get("sum of mean square currents")
        if limit:
            limit *= 1 - self.back_off
            rows.append(
                (
                    "sum of mean square currents",
                    np.array([1 - squares["currents"] / limit]),
                    -slopes["currents"] / limit,
                )
            )
        limit = self.limits.get(MOTOR_CURRENT)
        if limit:
            limit *= 1 - self.back_off
            point, both = self.problem.setting.motor, [squares[name] for name in MOTOR_SQUARES]
            by = slope_at_3_sigma(point, *both)
            slope = sum(part * slopes[name] for part, name in zip(by, MOTOR_SQUARES, strict=True))
            rows.append((MOTOR_CURRENT, np.array([1 - current_at_3_sigma(point, *both) / limit]), -slope / limit))
        return rows

    def _delay_rows(self, group: GroupMeasures, theta: np.ndarray):
        """Direct gain of each pattern against that at which L = M/(1 + jωT) bears just the dead time asked for."""
        limit = self.limits.get("delay margin")
        if not limit:
            return []
        lag = 1 / self._fastest_current
        most = direct_gain_bearing(limit * DELAY_BACK_OFF, lag)
        gain = group.direct(theta)
        return [(f"delay margin of {group.subject.name}", 1 - gain.value / most, -gain.gradient / most)]

    def _mask_rows(self):
        """Acceleration densities over the ride mask, at the grid's nodes that the mask covers."""
        rows = []
        for name, direction in RIDE_MASKS.items():
            limit = self.limits.get(name)
            if not limit:
                continue
            mask = mask_for(direction)
            f = self.groups[0].omega / (2 * np.pi)
            inside = (f >= mask.frequency_hz[0]) & (f <= mask.frequency_hz[-1])
            allowed = mask.psd(f[inside])[:, None] * limit * (1 - MASK_BACK_OFF)
            axis = "acceleration " + {"vertical": "z", "lateral": "y"}[direction]
            total: dict[str, tuple[np.ndarray, np.ndarray]] = {}
            for group in self.groups:
                for place, density in group.densities().items():
                    if place.startswith(axis):
                        value, slope = total.get(place, (0.0, 0.0))
                        total[place] = value + density.value[inside], slope + density.gradient[inside]
            rows += [(f"{name} at {place}", 1 - v / allowed[:, 0], -d / allowed) for place, (v, d) in total.items()]
        return rows

    def _static_rows(self, squares, slopes, static, static_slope):
        rows = []
        for word, part in (("gap", slice(0, 2)), ("lateral gap", slice(2, 4))):
            limit = self.limits.get(f"static {word} error from bias")
            if limit:
                limit *= 1 - self.back_off
                rows.append((f"static {word} error from bias", 1 - static[part] / limit, -static_slope[part] / limit))
            limit = self.limits.get(f"peak {word} change")
            if limit:
                limit *= 1 - self.back_off
                names = GAPS[part]
                rms = np.array([np.sqrt(squares[n]) for n in names])
                slope = np.array([slopes[n] for n in names]) / (2 * rms[:, None])
                value = static[part] + PEAK_SIGMAS * rms
                rows.append(
                    (f"peak {word} change", 1 - value / limit, -(static_slope[part] + PEAK_SIGMAS * slope) / limit)
                )
        return rows


def direct_gain_bearing(delay: float, lag: float) -> float:
    """The gain M at which L = M/(1 + jωT) has the given delay margin [s]: (π − atan x) T/x with x = √(M² − 1)."""
    from scipy.optimize import brentq

    x = brentq(lambda x: (np.pi - np.arctan(x)) * lag / x - delay, 1e-6, 1e6)
    return float(np.hypot(1.0, x))
