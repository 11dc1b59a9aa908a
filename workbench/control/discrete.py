"""The control law as a digital controller runs it: ten first-order filters, discretised by Tustin's rule.

    s → (2/T)(z − 1)/(z + 1) turns a low-pass 1/(1 + τs) into     low-pass = s + g (u − s),  s⁺ = s + 2g (u − s)
    with g = T/(T + 2τ), so each filter is                        output = direct·u + memory·s

    sensors --measurement--> 10 modal signals --filters--> 5 filtered channels --resolution--> commands

No prewarping. The state s is the low-pass signal itself: a constant input is passed exactly, in single precision too.
Source: guide, Definitions: Discretisation; filters: `control.filters`.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.control.gains import GAIN_NAMES, Gains
from workbench.control.law import CHANNELS, VERTICAL_CHANNELS, ModalLaw
from workbench.errors import InputError
from workbench.result import Result, Row


def low_pass_gain(tau, sample_time):
    """g of a low-pass with time constant tau [s], elementwise: its answer at once to a new sample [1]."""
    return sample_time / (sample_time + 2 * tau)


def discrete_gap(K, K_dot, tau, sample_time):
    """K + K_dot s/(1 + τs) as (advance, direct, memory): s⁺ = s + advance (u − s), output = direct u + memory s."""
    rate = 2 * K_dot / (sample_time + 2 * tau)
    return 2 * low_pass_gain(tau, sample_time), K + rate, -rate


def discrete_acceleration(K_ddot, K_dot, tau, sample_time):
    """K_ddot + K_dot τ/(1 + τs) as (advance, direct, memory), used as those of `discrete_gap`."""
    g = low_pass_gain(tau, sample_time)
    return 2 * g, K_ddot + K_dot * tau * g, K_dot * tau * (1 - g)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DiscreteLaw(Result):
    """A sampled control law for n coil sets.

    sample_time : T [s];  channels : names of the ten filters, five of gaps, five of accelerations
    measurement : (10, 4n) modal signals from the sensors
    resolution : (commands, 5) commands from the filtered channels
    advance, direct, memory : (10,) filter coefficients; advance and memory are zero where a filter is not needed
    step_bound : (10,) how far a filter's step response can be from the continuous one, at any sample
    """

    sample_time: float
    channels: tuple[str, ...]
    measurement: np.ndarray
    resolution: np.ndarray
    advance: np.ndarray
    direct: np.ndarray
    memory: np.ndarray
    step_bound: np.ndarray

    def transfer_functions(self) -> tuple[np.ndarray, np.ndarray]:
        """Numerators and denominators (10, 2) in rising powers of 1/z; every denominator starts with 1."""
        pole = 1 - self.advance
        numerator = np.column_stack([self.direct, self.advance * self.memory - self.direct * pole])
        return numerator, np.column_stack([np.ones_like(pole), -pole])

    def state_space(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(A, B, C, D) of s⁺ = A s + B sensors, commands = C s + D sensors, with ten states."""
        both = np.hstack([self.resolution, self.resolution])
        A, B = np.diag(1 - self.advance), self.advance[:, None] * self.measurement
        return A, B, both * self.memory, (both * self.direct) @ self.measurement

    def to_control(self):
        """The whole law as a python-control StateSpace in discrete time, sensors to commands."""
        import control

        return control.ss(*self.state_space(), self.sample_time)

    def commands(self, sensors) -> np.ndarray:
        """Commands (k, commands) for sensor samples (k, 4n), from filters at rest."""
        from scipy.signal import lfilter

        u = np.asarray(sensors, float)
        if u.ndim != 2 or u.shape[1] != self.measurement.shape[1]:
            raise InputError(
                f"sensors must have shape (samples, {self.measurement.shape[1]}); got {u.shape}. One column per sensor."
            )
        modal = u @ self.measurement.T
        filtered = np.column_stack(
            [lfilter(b, a, x) for b, a, x in zip(*self.transfer_functions(), modal.T, strict=True)]
        )
        return (filtered[:, :5] + filtered[:, 5:]) @ self.resolution.T

    def command_step_bound(self) -> np.ndarray:
        """(commands, 4n): how far a command's response to a sensor's unit step can be from the continuous law's."""
        filtered = self.step_bound[:, None] * np.abs(self.measurement)
        return np.abs(self.resolution) @ (filtered[:5] + filtered[5:])

    def rows(self) -> list[Row]:
        numerator, denominator = self.transfer_functions()
        rows: list[Row] = [("sample time", self.sample_time, "s")]
        for name, (b0, b1), (_, a1) in zip(self.channels, numerator, denominator, strict=True):
            rows.append((name, f"({b0:.6g} {b1:+.6g}/z)/(1 {a1:+.6g}/z)", "1"))
        return rows


def discretise(law: ModalLaw, gains: Gains, sample_time: float) -> DiscreteLaw:
    """The law at a sample time [s], every filter by Tustin's rule without prewarping.

    A filter whose rate gain is zero passes its signal on and keeps no state.

    Raises
    ------
    InputError
        If sample_time is not positive, or exceeds a time constant that is in use: the bound on the step response holds
        up to there, and a filter that fast cannot be told from none. A rate without filter (time constant 0) included.

    The step bound. Of a unit step the low-pass gives 1 − (1−g) p^k, p = (2τ−T)/(2τ+T), at the samples kT instead of
    1 − e^{−kx}, x = T/τ: too much by e^{−kx} − (1−g) p^k = g e^{−kx} + (1−g)(e^{−kx} − p^k). For x ≤ 4/3,
    0 ≤ e^{−x} − p ≤ x³/12 and so e^{−kx} − p^k ≤ k e^{−(k−1)x} x³/12 ≤ e^{x−1} x²/12; together at most x/2 = T/2τ. It
    is met at the first sample: the trapezoidal rule takes a step half a sample early.
    """
    if not 0 < sample_time < float("inf"):
        raise InputError(f"the sample time must be positive and finite [s]; got {sample_time!r}. Give 0.001 for 1 kHz.")
    kept = law.kept_filters(gains)
    g, T, w = gains, sample_time, 5 - VERTICAL_CHANNELS
    kinds = [
        ("tau_h", g.tau_h, g.K_h, g.K_hdot, discrete_gap, VERTICAL_CHANNELS),
        ("tau_hp", g.tau_hp, g.K_hp, g.K_hpdot, discrete_gap, w),
        ("tau_z", g.tau_z, g.K_zddot, g.K_zdot, discrete_acceleration, VERTICAL_CHANNELS),
        ("tau_y", g.tau_y, g.K_yddot, g.K_ydot, discrete_acceleration, w),
    ]
    coefficients: list[tuple[float, float, float, float]] = []
    for name, tau, position, rate, rule, count in kinds:
        used = rate != 0 and (tau > 0 or rule is discrete_gap)
        if used and sample_time > tau:
            raise InputError(
                f"the sample time must be at most the filter's time constant {name} = {tau:g} s; got {sample_time:g} s."
                " Sample faster, or give the filter a longer time constant."
            )
        size = abs(rate) / tau if rule is discrete_gap and used else abs(rate) * tau
        one = (*rule(position, rate, tau, T), size * T / (2 * tau)) if used else (0.0, position, 0.0, 0.0)
        coefficients += [one] * count
    advance, direct, memory, bound = np.array(coefficients).T
    theta = ca.DM([getattr(g, name) for name in GAIN_NAMES])
    assert np.array_equal(np.flatnonzero(advance), kept)  # the same filters have a state here as in continuous time
    return DiscreteLaw(
        sample_time=float(sample_time),
        channels=tuple(f"{kind} filter of {channel}" for kind in ("gap", "acceleration") for channel in CHANNELS),
        measurement=law.measurement_matrix(), resolution=ca.DM(law.resolution(theta)).full(),
        advance=advance, direct=direct, memory=memory, step_bound=bound,
    )  # fmt: skip
