"""The smooth measures that steer an optimiser, with exact gradients by the seventeen parameters.

    per group:  kernel mapped over a frequency grid  -->  mean squares, σ_max(S)² at every node
                eigenvalues of the state matrix      -->  damping ratios, decay rates
                the loop at rest                     -->  static gap change from accelerometer bias

Mean squares here are quadratures over a grid, peaks are maxima over its nodes: they steer. What a design reports comes
from `analysis`, by other algorithms.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from workbench.analysis.response import WEIGHTS, exciting_types, point_acceleration, seen_guideway, spectrum_of
from workbench.analysis.ride import weight
from workbench.analysis.setting import Setting
from workbench.compiled import Buffered
from workbench.control.gains import GAIN_NAMES
from workbench.control.law import VERTICAL_CHANNELS
from workbench.control.loop import Subject
from workbench.design.delayed import Delayed
from workbench.design.kernel import Shape, kernel, plant_column
from workbench.design.noise import mean_squares
from workbench.goals.ride.evaluated import Responses, Values, gap_rows
from workbench.goals.ride.motor_current import MOTOR_SQUARES
from workbench.lti.eigen import eigen
from workbench.lti.signals import numbered
from workbench.machine.budget import heed
from workbench.physics.guideway.irregularity import TYPES, phasors

ABSOLUTE_SMOOTHING = 1e-6  # [m/(m/s²)] in √(x² + ε²): 2e-8 m of 10 mm, far below any digit of a limit
ENDS = ("front", "rear")
MOTOR_CURRENTS = ("current_motor_d_right", "current_motor_q_right")
GAPS = tuple(f"{kind}, {end}" for kind in ("gap", "lateral gap") for end in ENDS)


@dataclass(frozen=True, slots=True)
class Grid:
    """Frequency nodes [Hz] with quadrature weights [Hz] (Gauss–Legendre panels, equal in log f)."""

    frequency_hz: np.ndarray
    weight_hz: np.ndarray

    @classmethod
    def over(cls, edges_hz: Sequence[float], order: int) -> "Grid":
        """`order` nodes between each two neighbouring edges."""
        x, w = np.polynomial.legendre.leggauss(order)
        low, high = np.log(edges_hz[:-1])[:, None], np.log(edges_hz[1:])[:, None]
        f = np.exp((high + low) / 2 + (high - low) / 2 * x)
        return cls(f.ravel(), (f * w * (high - low) / 2).ravel())


# dense where modes and comfort weights lie; beyond 8 Hz the wheel base makes fringes 8 Hz apart
STEERING = Grid.over(
    (
        1e-5,
        1e-3,
        0.02,
        0.07,
        0.14,
        0.25,
        0.4,
        0.6,
        0.85,
        1.2,
        1.7,
        2.4,
        3.4,
        4.8,
        6.8,
        9.5,
        12.5,
        16,
        20,
        26,
        34,
        60,
        300,
    ),
    5,
)


class GroupMeasures:
    """Measures of one group of a setting.

    fixed : parameters that stay as they are; a filter whose gain is fixed at zero is left out, as the law leaves it out
    """

    def __init__(
        self, setting: Setting, subject: Subject, grid: Grid = STEERING, fixed: Mapping[str, float] | None = None
    ) -> None:
        self.subject = subject
        self.types = exciting_types(setting, subject)
        plant, law = subject.plant, subject.law
        self._outputs, self._scale = _output_rows(setting, subject, grid.frequency_hz)
        rows = tuple(len(rows) for _, rows in self._outputs)
        self.shape = Shape(subject.channels, subject.patterns.shape[1], len(self.types), rows, law.split)
        self.columns = subject.patterns.T @ law.path_columns()[:, list(self.shape.paths)]
        self.measure = law.measurement_matrix()[subject.modal_rows]
        # mean square of class c = Σ_k quadrature[c, k] · value[c, k]; the roughness is inside the values
        self.quadrature = self._scale * grid.weight_hz
        self.omega = 2 * np.pi * grid.frequency_hz
        self._kernel = self._mapped(setting, self.omega)
        self._setting = setting
        theta = ca.SX.sym("theta", len(GAIN_NAMES))
        A = subject.dynamics(theta)
        self._kept = [*range(len(plant.A)), *(len(plant.A) + k for k in _kept_filters(subject, fixed or {}))]
        self.size = len(self._kept)
        A = A[self._kept, self._kept]
        self._dynamics = _with_slope("dynamics", theta, A)
        self._matrix = Buffered(ca.Function("state_matrix", [theta], [ca.densify(A)]))
        self.watched = np.zeros(0)

    @property
    def classes(self) -> list[str]:
        """Names of the mean squares, in order."""
        return [name for name, _ in self._outputs]

    @property
    def nodes(self) -> np.ndarray:
        """Frequencies [rad/s] of sensitivities and densities: the grid's, then those watched."""
        return np.concatenate([self.omega, self.watched])

    def watching(self, omega: Sequence[float]) -> "GroupMeasures":
        """The same measures with sensitivity and densities at more frequencies [rad/s] besides the grid's."""
        more = copy(self)
        more.watched = np.unique(np.concatenate([self.watched, np.asarray(omega, float)]))
        more._watched_kernel = self._mapped(self._setting, more.watched)
        return more

    def responses(self, theta: np.ndarray) -> Responses:
        """Mean squares, sensitivities and densities."""
        heed("a design")
        value, jacobian = self._evaluate(theta, self._kernel)
        square = np.einsum("ck,kc->c", self.quadrature, value[:, :-1])
        slope = np.einsum("ck,kcj->cj", self.quadrature, jacobian[:, :-1])
        watched = [self._evaluate(theta, self._watched_kernel)] if len(self.watched) else []
        # new arrays: the kernel's own are overwritten by the next evaluation
        value, jacobian = (np.concatenate(part) for part in zip((value, jacobian), *watched, strict=True))
        densities = {
            name: Values(value[:, c], jacobian[:, c])
            for c, name in enumerate(self.classes)
            if name.startswith("acceleration")
        }
        return Responses(Values(square, slope), Values(value[:, -1], jacobian[:, -1]), densities)

    def state_matrix(self, theta: np.ndarray) -> np.ndarray:
        """State matrix of the group's closed loop."""
        heed("a design")
        return self._matrix(theta)[0]

    def eigenvalues(self, theta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues (n,) of the closed loop and their derivatives (n, 17), complex."""
        A, slope = self._dynamics(theta)
        found = eigen(A)
        return found.values, found.slopes(slope)

    def delayed_damping(self, theta: np.ndarray, dead_time: float, count: int) -> Values:
        """The `count` smallest damping ratios with a dead time [s] in each pattern's command in turn."""
        A, slope = self._dynamics(theta)
        commands, commands_slope = self._commanded(theta)
        return Values(*self._delayed.damping(A, slope, commands, commands_slope, dead_time, count))

    @cached_property
    def _commanded(self) -> Buffered:
        theta = ca.SX.sym("theta", len(GAIN_NAMES))
        return _with_slope("commanded", theta, self.subject.commanded(theta)[:, self._kept])

    @cached_property
    def _delayed(self) -> Delayed:
        plant = self.subject.plant
        inputs = plant.B[:, plant.index("inputs", self.subject.commands)]
        return Delayed(np.pad(inputs, ((0, self.size - len(inputs)), (0, 0))))

    def noise(self, theta: np.ndarray, outputs: Sequence[str]) -> Values:
        """Mean squares of named outputs of the plant under the sensors' white noise, exact."""
        A, slope = self._dynamics(theta)
        B, B_slope = self._noisy(theta)
        plant = self.subject.plant
        C = np.zeros((len(outputs), self.size))
        C[:, : len(plant.A)] = plant.C[plant.index("outputs", outputs)]
        return Values(*mean_squares(A, _tensor(A, slope), B, _tensor(B, B_slope), C))

    @cached_property
    def _noisy(self) -> Buffered:
        theta = ca.SX.sym("theta", len(GAIN_NAMES))
        gap, acceleration = self._setting.sensor_noise
        # a one-sided density S per hertz is white noise of two-sided intensity S²/2
        density = np.repeat([gap, gap, acceleration, acceleration], self.subject.law.count) / np.sqrt(2.0)
        B = ca.mtimes(self.subject.noise_inputs(theta)[self._kept, :], ca.diag(ca.DM(density)))
        return _with_slope("noisy", theta, B)

    def _mapped(self, setting: Setting, omega: np.ndarray) -> Buffered:
        one = kernel(self.shape)
        mapped = one.map(f"{one.name()}_at_{len(omega)}", "serial", len(omega), [0], [])
        return Buffered(mapped, {1: omega[None, :], 2: self._columns(setting, omega)})

    def _evaluate(self, theta: np.ndarray, function: Buffered) -> tuple[np.ndarray, np.ndarray]:
        """(K, classes + 1) values and (K, classes + 1, 17) derivatives."""
        value, jacobian = function(theta)
        blocks = jacobian.T.reshape(value.shape[1], len(GAIN_NAMES), value.shape[0])
        return value.T, blocks.transpose(0, 2, 1)

    def _columns(self, setting: Setting, omega: np.ndarray) -> np.ndarray:
        plant, law, subject = self.subject.plant, self.subject.law, self.subject
        response = plant.response(omega)
        u = plant.index("inputs", subject.commands)
        y = plant.index("outputs", law.sensors)
        chosen = [TYPES.index(t) for t in self.types]
        density = np.column_stack(
            [spectrum_of(setting, t).psd_frequency(omega / (2 * np.pi), setting.speed) for t in self.types]
        )
        wave = phasors(setting.sets, setting.speed, omega)[:, :, chosen] * np.sqrt(density)[:, None, :]
        winds = seen_guideway(setting, plant, omega, response, wave)
        rows = np.vstack([rows for _, rows in self._outputs])
        out = []
        for at, P in enumerate(response):
            into, wind = P[:, u], winds[at]
            out.append(
                plant_column(self.columns, self.measure @ into[y], self.measure @ wind[y], rows @ wind, rows @ into)
            )
        return np.column_stack(out)


def _output_rows(setting: Setting, subject: Subject, frequency_hz: np.ndarray):
    """Classes of outputs: (name, rows (k, outputs)) and what scales their densities at each frequency, (classes, K)."""
    plant = subject.plant
    names = plant.outputs
    classes: list[tuple[str, np.ndarray]] = []
    scale = []
    for direction, weighting in WEIGHTS.items():
        felt = weight(weighting).magnitude(frequency_hz) ** 2
        for point, place in setting.points.items():
            row = point_acceleration(names, place, direction)
            if np.abs(row @ _moves(plant)).max() > 0:
                classes.append((f"acceleration {direction}, {point}", row[None, :]))
                scale.append(felt)
    first, last = setting.ends
    for kind, name in (("gap", "gap"), ("gap_lateral", "lateral gap")):
        for end, i in (("front", first), ("rear", last)):
            classes.append((f"{name}, {end}", _unit(names, [f"{kind}_{i + 1}"])))
            scale.append(np.ones_like(frequency_hz))
    classes.append(("currents", _unit(names, numbered("current", subject.law.count))))
    scale.append(np.ones_like(frequency_hz))
    if setting.motor is not None:
        # both sides carry the same mean squares, since the law drives them in opposite directions
        for name, current in zip(MOTOR_SQUARES, MOTOR_CURRENTS, strict=True):
            classes.append((name, _unit(names, [current])))
            scale.append(np.ones_like(frequency_hz))
    return classes, np.array(scale)


def _moves(plant) -> np.ndarray:
    return np.hstack([plant.C, plant.D])


def _unit(names: Sequence[str], wanted: Sequence[str]) -> np.ndarray:
    rows = np.zeros((len(wanted), len(names)))
    for i, name in enumerate(wanted):
        rows[i, names.index(name)] = 1.0
    return rows


def static_error_function(setting: Setting) -> ca.Function:
    """theta -> static gap changes (order of `gap_rows`, gaps first) from accelerometer bias, worst signs, smoothed."""
    theta = ca.SX.sym("theta", len(GAIN_NAMES))
    gaps = [name for names in gap_rows(setting).values() for name in names]
    total = ca.SX.zeros(len(gaps), 2 * setting.law.count)
    for subject in setting.subjects:
        total = total + _static_response(subject, theta, gaps)
    error = ca.sum2(ca.sqrt(total**2 + ABSOLUTE_SMOOTHING**2)) * setting.accelerometer_bias
    return ca.Function("static_error", [theta], [error, ca.densify(ca.jacobian(error, theta))])


def _static_response(subject: Subject, theta, gaps: Sequence[str]):
    """(gaps, 2n): static change of each gap per unit bias of each accelerometer [m/(m/s²)], symbolic."""
    plant, law = subject.plant, subject.law
    n = law.count
    P = plant.response([0.0])[0].real
    u, y = plant.index("inputs", subject.commands), plant.index("outputs", law.sensors)
    rows = plant.index("outputs", gaps)
    K = subject.static_gain(theta)
    G = ca.DM(P[np.ix_(y, u)])
    S = ca.inv(ca.SX.eye(len(u)) - ca.mtimes(K, G))
    return ca.mtimes([ca.DM(P[np.ix_(rows, u)]), S, K[:, 2 * n :]])


def _kept_filters(subject: Subject, fixed: Mapping[str, float]) -> list[int]:
    """Positions in the group's `modal_rows` of the filters whose gain is not fixed at zero."""
    kinds = (("K_hdot", "K_hpdot"), ("K_zdot", "K_ydot"))
    names = [pair[channel >= VERTICAL_CHANNELS] for pair in kinds for channel in subject.channels]
    return [k for k, name in enumerate(names) if fixed.get(name, 1.0) != 0]


def _with_slope(name: str, theta: ca.SX, matrix: ca.SX) -> Buffered:
    """theta -> a matrix and its derivative (entries column by column, 17)."""
    slope = ca.densify(ca.jacobian(ca.vec(matrix), theta))
    return Buffered(ca.Function(name, [theta], [ca.densify(matrix), slope]))


def _tensor(matrix: np.ndarray, slope: np.ndarray) -> np.ndarray:
    """(rows, columns, 17) of a derivative whose entries stand column by column."""
    return slope.reshape(*matrix.shape[::-1], -1).transpose(1, 0, 2)
