"""The measures of a design as a user of python-control or NumPy would compute them: values only, no derivatives.

    parameters --close the loop--> frequency response of the whole vehicle --> mean squares, σ_max(S), static errors
                               --> eigenvalues                             --> damping, decay

Same frequency nodes, same quadrature weights and same quantities as `design.measures`, so the values must agree to
rounding. Four ways to the response differ: python-control by signal names, python-control by a linear fractional
transformation, our closed loop's vectorised response, and NumPy with everything that does not depend on the gains
computed beforehand.
"""

from dataclasses import dataclass

import numpy as np

from workbench.analysis.response import point_acceleration
from workbench.analysis.ride import weight
from workbench.constants import GRAVITY
from workbench.control import GAIN_NAMES, Gains
from workbench.control.law import VERTICAL_CHANNELS
from workbench.control.loop.closed import close
from workbench.control.loop.group import GROUPS, group
from workbench.design.measures import GAPS, STEERING, GroupMeasures
from workbench.design.problem import Problem
from workbench.design.steering import COST_SCALE, SENSED_HZ
from workbench.lti import Plant
from workbench.lti.signals import COORDINATES, numbered
from workbench.physics.guideway.irregularity import phasors

FELT = (("z", "Wk"), ("y", "Wd"))


@dataclass(frozen=True, slots=True)
class Measured:
    """Mean squares by name, σ_max(S) (2, K), static errors (4,) [m], eigenvalues (n,)."""

    squares: dict[str, float]
    peaks: np.ndarray
    static: np.ndarray
    poles: np.ndarray

    @property
    def cost(self) -> float:
        """J."""
        return COST_SCALE / GRAVITY**2 * sum(v for k, v in self.squares.items() if k.startswith("acceleration"))

    def vector(self) -> np.ndarray:
        """Everything whose derivatives a gradient method needs; log J and the mean squares come first."""
        ratio = -self.poles.real / np.abs(self.poles)
        worst = [self.poles.real.max(), ratio.min()]
        return np.concatenate(
            [[np.log(self.cost)], list(self.squares.values()), self.static, worst, self.peaks.ravel()]
        )


class Reduction:
    """From the response of the whole vehicle to the measures of a design."""

    def __init__(self, problem: Problem) -> None:
        self.problem, setting = problem, problem.setting
        self.law, self.plant = problem.law, setting.plant
        n = self.law.count
        self.frequency_hz = STEERING.frequency_hz
        self.omega = np.concatenate([[0.0], 2 * np.pi * self.frequency_hz])
        ends = [setting.ends[0] + 1, setting.ends[1] + 1]
        self.waves = numbered("zeta", n) + numbered("eta", n)
        self.outputs = [f"{c}_acceleration" for c in COORDINATES]
        self.outputs += [f"{kind}_{i}" for kind in ("gap", "gap_lateral") for i in ends] + numbered("current", n)
        self.biases = [s for s in self.law.sensors if s.startswith("acceleration")]
        self.rows, self.weights, self.names = self._classes(setting)
        density = np.column_stack([s.psd_frequency(self.frequency_hz, setting.speed) for s in setting.guideway.spectra])
        self.wave = phasors(self.law.positions, setting.speed, self.omega[1:]) * np.sqrt(density)[:, None, :]
        self.patterns = np.stack([group(name, self.law.positions).patterns for name in GROUPS])

    def _classes(self, setting):
        """Rows (r, p) over the outputs, quadrature weights (r, K) and the name of the mean square each row adds to."""
        unit, first = np.eye(len(self.outputs)), len(COORDINATES)
        rows, weights, names = [], [], []
        for direction, kind in FELT:
            felt = weight(kind).magnitude(self.frequency_hz) ** 2 * STEERING.weight_hz
            for point, place in setting.points.items():
                rows.append(point_acceleration(self.outputs, place, direction))
                weights.append(felt)
                names.append(f"acceleration {direction}, {point}")
        for name, row in zip((*GAPS, *["currents"] * self.law.count), unit[first:], strict=True):
            rows.append(row)
            weights.append(STEERING.weight_hz)
            names.append(name)
        return np.array(rows), np.array(weights), names

    def measured(self, to_types, to_commands, to_biases, poles) -> Measured:
        """From responses: outputs to types of irregularity with their density (K, p, 4), commands to command errors
        (K, 4, 4), gaps to biases at rest (4, 8)."""
        seen = self.rows @ to_types
        each = (self.weights * (seen.real**2 + seen.imag**2).sum(axis=2).T).sum(axis=1)
        squares = dict.fromkeys(self.names, 0.0)
        for name, value in zip(self.names, each.tolist(), strict=True):
            squares[name] += value
        projected = self.patterns.transpose(0, 2, 1)[:, None] @ to_commands @ self.patterns[:, None]
        peaks = np.linalg.svd(projected, compute_uv=False)[..., 0]
        static = np.abs(to_biases).sum(axis=1) * self.problem.setting.accelerometer_bias
        return Measured(squares, peaks, static, poles)

    def split(self, response: np.ndarray):
        """The three responses, of one with outputs (outputs, commands) and inputs (waves, command errors, biases)."""
        p, w, u = len(self.outputs), len(self.waves), self.law.count
        at_rest = response[0][len(COORDINATES) : len(COORDINATES) + 4, w + u :].real
        return response[1:, :p, :w] @ self.wave, response[1:, p:, w : w + u], at_rest


class ByNames(Reduction):
    """python-control: `interconnect` joins plant, law and error sums by signal names; the system is then called."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        import control

        commands, biases = list(self.law.commands), self.biases
        self.vehicle = self.plant.to_control()
        self.sums = [control.summing_junction([f"law_{c}", f"error_{c}"], c) for c in commands]
        self.sums += [control.summing_junction([b, f"error_{b}"], f"read_{b}") for b in biases]
        self.inlets = self.waves + [f"error_{c}" for c in commands] + [f"error_{b}" for b in biases]

    def __call__(self, theta: np.ndarray) -> Measured:
        import control

        gains = Gains(**dict(zip(GAIN_NAMES, theta.tolist(), strict=True)))
        sensors = [f"read_{s}" if s in self.biases else s for s in self.law.sensors]
        law = control.ss(*self.law.numeric(gains), inputs=sensors, outputs=[f"law_{c}" for c in self.law.commands])
        closed = control.interconnect(
            [self.vehicle, law, *self.sums], inputs=self.inlets, outputs=self.outputs + list(self.law.commands),
            check_unused=False,
        )  # fmt: skip
        response = closed(1j * self.omega).transpose(2, 0, 1)
        return self.measured(*self.split(response), closed.poles())


class ByFraction(Reduction):
    """python-control, the leanest way found: `lft` of a plant with its error inputs prepared beforehand."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        import control

        plant, law = self.plant, self.law
        u, w = plant.index("inputs", law.commands), plant.index("inputs", self.waves)
        z, y = plant.index("outputs", self.outputs), plant.index("outputs", law.sensors)
        biased = np.array([[float(s == b) for b in self.biases] for s in law.sensors])
        p, nw, nu, nb = len(z), len(w), len(u), len(self.biases)
        B = np.hstack([plant.B[:, w], plant.B[:, u], np.zeros((len(plant.A), nb)), plant.B[:, u]])
        C = np.vstack([plant.C[z], np.zeros((nu, len(plant.A))), plant.C[y]])
        D = np.zeros((len(C), B.shape[1]))
        D[:p] = np.hstack([plant.D[np.ix_(z, w)], plant.D[np.ix_(z, u)], np.zeros((p, nb)), plant.D[np.ix_(z, u)]])
        D[p : p + nu, nw : nw + nu] = D[p : p + nu, -nu:] = np.eye(nu)
        D[p + nu :] = np.hstack([plant.D[np.ix_(y, w)], plant.D[np.ix_(y, u)], biased, plant.D[np.ix_(y, u)]])
        self.prepared = control.ss(plant.A, B, C, D)

    def __call__(self, theta: np.ndarray) -> Measured:
        import control

        gains = Gains(**dict(zip(GAIN_NAMES, theta.tolist(), strict=True)))
        closed = self.prepared.lft(control.ss(*self.law.numeric(gains)))
        return self.measured(*self.split(closed(1j * self.omega).transpose(2, 0, 1)), closed.poles())


class ByPlant(Reduction):
    """Our closed loop and its vectorised frequency response: one batched NumPy solve over all frequencies."""

    def __call__(self, theta: np.ndarray) -> Measured:
        gains = Gains(**dict(zip(GAIN_NAMES, theta.tolist(), strict=True)))
        inputs = self.waves + [f"error_{c}" for c in self.law.commands] + [f"error_{b}" for b in self.biases]
        closed: Plant = close(self.plant, self.law, gains).system
        seen = closed.select(inputs=inputs, outputs=self.outputs + list(self.law.commands))
        return self.measured(*self.split(seen.response(self.omega)), closed.poles())


class ByHand(Reduction):
    """NumPy at its best: what does not depend on the gains beforehand, then 4×4 matrices at all frequencies."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        plant, law = self.plant, self.law
        u, w = plant.index("inputs", law.commands), plant.index("inputs", self.waves)
        z, y = plant.index("outputs", self.outputs), plant.index("outputs", law.sensors)
        P, measure = plant.response(self.omega), law.measurement_matrix()
        self.measured_by_command = measure @ P[:, y][:, :, u]
        self.measured_by_type = measure @ P[1:, y][:, :, w] @ self.wave
        self.output_by_command, self.output_by_type = P[:, z][:, :, u], P[1:, z][:, :, w] @ self.wave
        self.measured_by_bias = measure @ np.array([[float(s == b) for b in self.biases] for s in law.sensors])
        self.columns = law.command_columns()
        self.groups = [GroupMeasures(problem.setting, s) for s in problem.subjects]  # for their state matrices
        self.vertical = np.arange(5) < VERTICAL_CHANNELS

    def __call__(self, theta: np.ndarray) -> Measured:
        g = dict(zip(GAIN_NAMES, theta.tolist(), strict=True))
        s = 1j * self.omega[:, None]
        factors = np.array([g["K_heave"], g["K_pitch"], g["K_sway"] - g["K_roll"], g["K_sway"], g["K_yaw"]])
        gap = np.where(
            self.vertical,
            g["K_h"] + g["K_hdot"] * s / (1 + g["tau_h"] * s),
            g["K_hp"] + g["K_hpdot"] * s / (1 + g["tau_hp"] * s),
        )
        acceleration = np.where(
            self.vertical,
            g["K_zddot"] + g["K_zdot"] * g["tau_z"] / (1 + g["tau_z"] * s),
            g["K_yddot"] + g["K_ydot"] * g["tau_y"] / (1 + g["tau_y"] * s),
        )
        law = np.concatenate([(factors * h)[:, None] * self.columns for h in (gap, acceleration)], axis=2)
        S = np.linalg.inv(np.eye(self.law.count) - law @ self.measured_by_command)
        to_types = self.output_by_type + self.output_by_command[1:] @ (S[1:] @ (law[1:] @ self.measured_by_type))
        gaps = slice(len(COORDINATES), len(COORDINATES) + 4)
        at_rest = (self.output_by_command[0, gaps] @ S[0] @ law[0] @ self.measured_by_bias).real
        poles = np.concatenate([np.linalg.eigvals(one.state_matrix(theta)) for one in self.groups])
        return self.measured(to_types, S[1:], at_rest, poles)


def slack(problem: Problem, m: Measured) -> np.ndarray:
    """Slack of every requirement relative to its limit; negative where it is missed."""
    limits = {r.name: r.limit for r in problem.requirements}
    sensed = (STEERING.frequency_hz >= SENSED_HZ[0]) & (STEERING.frequency_hz <= SENSED_HZ[1])
    ratio = -m.poles.real / np.abs(m.poles)
    found = [
        ratio.min() / limits["damping ratio"] - 1,
        -m.poles.real.max() / limits["decay rate"] - 1,
        1 - m.peaks[:, sensed].max() / limits["peak sensitivity"],
        1 - m.squares["currents"] / limits["sum of mean square currents"],
        1 - m.static[:2].max() / limits["static gap error from bias"],
        1 - m.static[2:].max() / limits["static lateral gap error from bias"],
    ]
    found += [1 - np.sqrt(m.squares[name]) / limits[f"rms {name}"] for name in GAPS]
    return np.array(found)


ROUTES = (ByNames, ByFraction, ByPlant, ByHand)
