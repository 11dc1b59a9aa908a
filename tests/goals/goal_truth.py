"""The value of every kind of goal by its definition, for the loops of `random_loops`.

Each entry: goal(case) -> Goal in the case's units, and truth(case) -> its value, from responses, poles and steps.
"""

import math

import numpy as np
from random_loops import Case

from workbench import goals as g

CHANNEL = {"inputs": "w", "outputs": "z"}


def _level(case: Case) -> float:
    """A middling gain of the channel, so that values lie near one."""
    return float(np.abs(case.T([0.7]))[0]) or case.size


def _rate(case: Case) -> float:
    return 1 / case.time


def _band(case: Case, low: float, high: float) -> tuple[float, float]:
    return low * _rate(case), high * _rate(case)


def _integrates(case: Case) -> bool:
    return case.name.startswith("integrator")


def _s(case: Case, omega) -> np.ndarray:
    """jω as continuous filters see it: by Tustin's rule on a sampled loop."""
    h = case.sample_time
    return 1j * (omega if h is None else 2 / h * np.tan(np.minimum(omega * h / 2, math.pi / 2 * (1 - 1e-15))))


def _filter(case: Case, top: float, bottom: float):
    """(s + top)/(s + bottom) in the case's time, and its magnitude over the case's own frequencies."""
    own = [1.0, top * _rate(case)], [1.0, bottom * _rate(case)]
    return own, lambda omega: np.abs(_complex(case, top, bottom, omega))


def _true(case: Case, top, bottom):
    """|top(jω)/bottom(jω)| over the case's own frequencies, and the same in its time."""
    rate, order = _rate(case), len(bottom) - len(top)
    own = [c * rate ** (k + order) for k, c in enumerate(top)], [c * rate**k for k, c in enumerate(bottom)]
    return own, lambda omega: np.abs(np.polyval(top, 1j * omega) / np.polyval(bottom, 1j * omega))


def _S(case: Case):
    return lambda omega: 1 / (1 + case.L(omega))


def _two_points(case: Case, omega):
    """S at u and y together (k, 2, 2): the loop of two gains in a ring."""
    G, K = case.parts(omega)
    unit, own = math.sqrt(case.size), 1 / math.sqrt(case.size)
    M = np.zeros((len(G), 2, 2), complex)
    M[:, 0, 1], M[:, 1, 0] = K * unit / own, G[:, 1, 1] * own / unit
    return np.linalg.inv(np.eye(2) - M)


def _mu(M) -> np.ndarray:
    """max ρ(Q M) over the one relative phase that counts."""
    best = np.zeros(len(M))
    for turn in np.exp(1j * np.linspace(0, 2 * math.pi, 181)):
        trace, product = M[:, 0, 0] + turn * M[:, 1, 1], turn * (M[:, 0, 0] * M[:, 1, 1] - M[:, 0, 1] * M[:, 1, 0])
        root = np.sqrt(trace**2 - 4 * product + 0j)
        best = np.maximum(best, np.maximum(np.abs(trace + root), np.abs(trace - root)) / 2)
    return best


def _sector(case: Case, Q, weight=None) -> float:
    values, vectors = np.linalg.eigh(Q)

    def size(omega):
        T = case.T(omega) * (1.0 if weight is None else weight(omega))
        graph = np.stack([T, np.ones_like(T)])
        parts = [np.abs(vectors[:, k] @ graph) * math.sqrt(abs(values[k])) for k in (0, 1)]
        return parts[1] / parts[0]

    return case.peak(size)


def _loop_shape(case: Case) -> float:
    """6 dB round 0.5/ω, between 0.1 and 2."""
    delta, c = 10**0.3, case
    low, high = 0.5 / delta, 0.5 * delta
    least = c.peak(lambda w: 0.5 / w / delta / np.abs(c.L(w)), [0.1, low * (1 - 1e-12)], 0.1, low)
    return max(least, c.peak(lambda w: np.abs(c.L(w)) / (0.5 / w * delta), [high * (1 + 1e-12), 2.0], high, 2.0))


def _delay(case: Case) -> float:
    """The smallest dead time at u over one unit of time, upside down; 0 where any is borne."""
    from scipy.optimize import brentq

    omega = case.grid()
    excess = np.abs(case.L(omega)) - 1
    worst = 0.0
    for k in np.flatnonzero(excess[1:] * excess[:-1] < 0):
        at = brentq(lambda w: float(np.abs(case.L([w]))[0]) - 1, omega[k], omega[k + 1], xtol=1e-14, rtol=1e-14)
        lag = np.angle(-case.L([at])[0]) % (2 * math.pi) or 2 * math.pi
        worst = max(worst, at / lag)
    return worst


def _s_plane(case: Case, poles: np.ndarray) -> np.ndarray:
    return poles if case.sample_time is None else np.log(poles.astype(complex)) / case.sample_time


def _damping(case: Case) -> float:
    poles = case.poles()
    poles = poles[np.abs(poles) <= 4]
    return float((2 + poles.real / np.abs(poles) / 0.1).max())


def _energy(case: Case, error, more) -> float:
    """√(1/π ∫ |E|² dω), per unit of time."""
    return math.sqrt(case.area(lambda omega: np.abs(error(omega)) ** 2, more) / math.pi)


def _reference(case: Case, order: int):
    """The transient of 1/(s + 1) under impulse, step or ramp, and of T less that, over the case's frequencies."""
    h = case.sample_time

    def R(omega):
        return 1 / (_s(case, omega) + 1)

    small = 1e-5
    T0 = float(case.T([1e-7]).real[0])
    T1 = float(case.T([small]).imag[0]) / small

    def drift(omega):
        return 1j * omega if h is None else (np.exp(1j * omega * h) - 1) / h

    def transient(G, G0, G1):
        if order == 0:
            return G
        if order == 1:
            return lambda omega: (G(omega) - G0) / drift(omega)
        return lambda omega: (G(omega) - G0 - G1 * drift(omega)) / drift(omega) ** 2

    own = transient(R, 1.0, -1.0)
    error = transient(lambda omega: case.T(omega) - R(omega), T0 - 1, T1 + 1)
    return own, error, T0 - 1, T1 + 1


def _complex(case: Case, top: float, bottom: float, omega):
    s = _s(case, omega)
    return (s + top) / (s + bottom)


def _step_tracking(case: Case) -> float:
    _, error, still, _ = _reference(case, 1)
    h = case.sample_time

    def rest(omega):  # of the reference against the step itself
        return (1 / (_s(case, omega) + 1) - 1) / (1j * omega if h is None else (np.exp(1j * omega * h) - 1) / h)

    return max(_energy(case, error, [1.0]) / (0.1 * _energy(case, rest, [1.0])), abs(still) / 0.01)


def _transient(case: Case, order: int) -> float:
    own, error, still, lag = _reference(case, order)
    values = [_energy(case, error, [1.0]) / (0.1 * _energy(case, own, [1.0]))]
    values += [abs(still) / 0.01] if order else []
    values += [abs(lag) / 0.01] if order == 2 else []  # static_error is in seconds: the goal below takes one unit
    return max(values)


def _overshoot(case: Case) -> float:
    high, low, _, end = case.step(0.0)
    return max((high if end > 0 else low) / end - 1, 0.0) / 0.2


def _settling(case: Case) -> float:
    peak, level = case.step(0.0), _level(case)
    late = case.step(5.0)
    return max(max(peak[2], abs(peak[3])) / level, max(late[2], abs(late[3])) / (0.3 * level))


def _drift(case: Case) -> float:
    """Rms under the density 1 |(s + 2)/(s + 0.2)|², one-sided per hertz, over a unit of time."""
    shape = _true(case, [1.0, 2.0], [1.0, 0.2])[1]
    return math.sqrt(case.area(lambda w: np.abs(case.T(w)) ** 2 * shape(w) ** 2, [0.2]) / (2 * math.pi))


CASES = {
    "Poles": (lambda c: g.Poles(damping=0.1, focus=(0.0, 4 * _rate(c))), _damping),
    "Poles, decay": (
        lambda c: g.Poles(decay=0.01 * _rate(c)), lambda c: float((1 + (0.01 + c.poles().real) / 0.01).max()),
    ),
    "ControllerPoles": (
        lambda c: g.ControllerPoles(frequency=2.0 * _rate(c)),
        lambda c: float(np.abs(_s_plane(c, np.linalg.eigvals(c.law[0]))).max(initial=0.0) / 2),
    ),
    "Gain": (lambda c: g.Gain(**CHANNEL, limit=_level(c)), lambda c: c.peak(lambda w: np.abs(c.T(w))) / _level(c)),
    "Gain, rolled off": (
        lambda c: g.Gain(**CHANNEL, limit=_true(c, [5 * _level(c)], [1.0, 1.0])[0], focus=_band(c, 0.1, 2.0)),
        lambda c: c.peak(lambda w: np.abs(c.T(w)) / _true(c, [5 * _level(c)], [1.0, 1.0])[1](w), [0.1, 2.0], 0.1, 2.0),
    ),
    "WeightedGain": (
        lambda c: g.WeightedGain(**CHANNEL, left=_filter(c, 3.0, 1.0)[0], right=1 / _level(c)),
        lambda c: c.peak(lambda w: np.abs(c.T(w)) * _filter(c, 3.0, 1.0)[1](w), [1.0, 3.0]) / _level(c),
    ),
    "Tracking": (
        lambda c: g.Tracking(**CHANNEL, response_time=2.0 * c.time, dc_error=0.1, peak_error=2.0),
        lambda c: c.peak(lambda w: np.abs(c.T(w) - 1) / _true(c, [2.0, 0.1], [1.0, 1.0])[1](w), [0.05, 1.0]),
    ),
    "Sensitivity": (lambda c: g.Sensitivity(points="u"), lambda c: c.peak(lambda w: np.abs(_S(c)(w))) / 2),
    "Rejection": (
        lambda c: g.Rejection(points="u", attenuation=_true(c, [0.01, 0.02], [1.0, 0.03])[0]),
        lambda c: c.peak(lambda w: np.abs(_S(c)(w)) * _true(c, [0.01, 0.02], [1.0, 0.03])[1](w), [0.03, 2.0]),
    ),
    "Rejection, for ever": (
        lambda c: g.Rejection(points="u", attenuation=_true(c, [0.01], [1.0, 0.0])[0]),
        lambda c: c.peak(lambda w: np.abs(_S(c)(w)) * 0.01 / w) if _integrates(c) else math.inf,
    ),
    "MinLoopGain": (
        lambda c: g.MinLoopGain(points="u", profile=2.0, focus=(0.2 * _rate(c), 0.3 * _rate(c))),
        lambda c: c.peak(lambda w: 2 / np.abs(c.L(w)), [0.2, 0.3], 0.2, 0.3),
    ),
    "MaxLoopGain": (
        lambda c: g.MaxLoopGain(points="u", profile=0.5, focus=(0.0, 2.9 * _rate(c))),
        lambda c: math.inf if _integrates(c) else c.peak(lambda w: np.abs(c.L(w)) / 0.5, [2.9], 0.0, 2.9),
    ),
    "LoopShape": (
        lambda c: g.LoopShape(points="u", crossover=0.5 * _rate(c), focus=(0.1 * _rate(c), 2.0 * _rate(c))),
        _loop_shape,
    ),
    "Margins": (
        lambda c: g.Margins(points="u", gain_db=6.0),
        lambda c: c.peak(lambda w: np.abs(_S(c)(w) - 0.5)) * 2 * (10**0.3 - 1) / (10**0.3 + 1),
    ),
    "Margins, of two": (
        lambda c: g.Margins(points=("u", "y"), gain_db=4.0),
        lambda c: c.peak(lambda w: _mu(_two_points(c, w) - np.eye(2) / 2)) * 2 * (10**0.2 - 1) / (10**0.2 + 1),
    ),
    "DelayMargin": (lambda c: g.DelayMargin(points="u", delay=c.time), _delay),
    "Passivity": (
        lambda c: g.Passivity(**CHANNEL, input_index=-_level(c), output_index=0.1 / _level(c)),
        lambda c: _sector(c, np.array([[0.2 / _level(c), -1.0], [-1.0, -2 * _level(c)]])),
    ),
    "WeightedPassivity": (
        lambda c: g.WeightedPassivity(**CHANNEL, left=_filter(c, 3.0, 1.0)[0], input_index=-_level(c)),
        lambda c: _sector(c, np.array([[0.0, -1.0], [-1.0, -2 * _level(c)]]), lambda w: _complex(c, 3.0, 1.0, w)),
    ),
    "ConicSector": (
        lambda c: g.ConicSector(**CHANNEL, sector=(-3 * _level(c), 2 * _level(c))),
        lambda c: _sector(c, np.array([[1.0, 0.5 * _level(c)], [0.5 * _level(c), -6 * _level(c) ** 2]])),
    ),
    "Spectrum": (
        lambda c: g.Spectrum(**CHANNEL, mask=_level(c) ** 2, density=_true(c, [1.0, 2.0], [1.0, 0.2])[0]),
        lambda c: c.peak(lambda w: np.abs(c.T(w)) * _true(c, [1.0, 2.0], [1.0, 0.2])[1](w), [0.2, 2.0]) / _level(c),
    ),
    "RmsLimit": (
        lambda c: g.RmsLimit(
            **CHANNEL, limit=_level(c) / math.sqrt(c.time), density=_true(c, [1.0, 2.0], [1.0, 0.2])[0]
        ),
        lambda c: _drift(c) / _level(c),
    ),
    "Variance": (
        lambda c: g.Variance(**CHANNEL, limit=_level(c) / math.sqrt(c.time)),
        lambda c: _energy(c, c.T, []) / _level(c),
    ),
    "WeightedVariance": (
        lambda c: g.WeightedVariance(**CHANNEL, left=_filter(c, 3.0, 1.0)[0], limit=_level(c) / math.sqrt(c.time)),
        lambda c: _energy(c, lambda w: np.abs(c.T(w)) * _filter(c, 3.0, 1.0)[1](w), [1.0]) / _level(c),
    ),
    "StepTracking": (
        lambda c: g.StepTracking(**CHANNEL, time_constant=c.time, gap=0.1, static_error=0.01), _step_tracking,
    ),
    "Transient": (
        lambda c: g.Transient(**CHANNEL, reference=([_rate(c)], [1.0, _rate(c)]), signal="impulse"),
        lambda c: _transient(c, 0),
    ),
    "Transient, of a step": (
        lambda c: g.Transient(**CHANNEL, reference=([_rate(c)], [1.0, _rate(c)]), signal="step"),
        lambda c: _transient(c, 1),
    ),
    "Overshoot": (lambda c: g.Overshoot(**CHANNEL, percent=20.0), _overshoot),
    "StepRejection": (
        lambda c: g.StepRejection(**CHANNEL, peak=_level(c), settling_time=5.0 * c.time, fraction=0.3), _settling,
    ),
}  # fmt: skip
