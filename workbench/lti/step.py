"""Step responses of a stable system of one input and output: extrema, and the derivative at an instant.

x' = A x + B, y = C x + D   windows of instants: states by doubling --> sign changes of y' --> Newton
y(t) = [C 0] exp([A B; 0 0] t) [0; 1] + D                           --> gradient by the exponential's derivative
"""

import math
from dataclasses import dataclass, field

import numpy as np

from workbench.lti.exponential import advanced
from workbench.lti.modes import largest, step_response
from workbench.lti.realisation import EPS, Realisation, balanced, state_scale

DOUBLINGS = 10  # 1024 instants in a window
GROWTH = 8  # of the next window's spacing
LIFETIMES = 8.0  # of the slowest pole: what is left then is 3e-4 of its part
MOST_WINDOWS = 24
MOST_SAMPLES = 20_000  # of a sampled response looked at one by one; a longer one's largest are found by its modes
NEWTON = 8  # steps; three bring a bracket of a hundredth of a period to rounding
CHOSEN = 6  # extrema refined, the largest first


@dataclass(frozen=True, slots=True)
class Steps:
    """The unit step response of a stable system (1 input, 1 output), from rest; states in units that balance it."""

    system: Realisation
    sample_time: float | None
    final: float = field(init=False)
    rounding: float = field(init=False)  # of `final`

    def __post_init__(self) -> None:
        final, rounding = final_value(self.system, sampled=self.sample_time is not None)
        A, B, C, D = balanced(*self.system)
        level = np.linalg.norm(A) / np.linalg.norm(B) if A.any() and B.any() else 1.0  # [A B; 0 0] of one size
        object.__setattr__(self, "system", Realisation(A, B * level, C / level, D))
        object.__setattr__(self, "final", final)
        object.__setattr__(self, "rounding", rounding)

    def extrema(self, begin: float) -> tuple[np.ndarray, np.ndarray]:
        """Instants and values: `begin`, and the largest local extrema after it, of either sign."""
        return self._sampled_extrema(begin) if self.sample_time is not None else self._extrema(begin)

    def horizon(self) -> float:
        """[s] after which nothing new happens."""
        return LIFETIMES / -float(np.linalg.eigvals(self.system.A).real.max()) if len(self.system.A) else 0.0

    def states(self, t: float, before: np.ndarray) -> np.ndarray:
        """The state (n,) a time t after `before`, continuous; t may be negative."""
        A, B, *_ = self.system
        turn, pushed = advanced(A, B, t)
        return turn @ before + pushed[:, 0]

    def _extrema(self, begin: float) -> tuple[np.ndarray, np.ndarray]:
        A, B, C, D = self.system
        n = len(A)
        if n == 0:
            return np.array([begin]), np.array([D[0, 0]])
        first = self.states(begin, np.zeros(n))
        times, values = [begin], [float((C @ first)[0] + D[0, 0])]
        spacing, end = 0.1 / float(np.abs(np.linalg.eigvals(A)).max()), max(self.horizon(), begin * 1.5)
        brackets: list[tuple[float, float, float, np.ndarray]] = []
        start, reached = 0.0, np.zeros(n)
        for _ in range(MOST_WINDOWS):
            power = np.eye(n + 1)
            power[:n, :n], power[:n, n:] = advanced(A, B, spacing)
            states = np.r_[reached, 1.0][:, None]
            for _ in range(DOUBLINGS):
                states = np.hstack([states, power @ states])
                power = power @ power
            instants = start + spacing * np.arange(states.shape[1])
            slope = (C @ (A @ states[:n] + B))[0]
            y = (C @ states[:n])[0] + D[0, 0]
            turn = np.flatnonzero((slope[1:] > 0) != (slope[:-1] > 0))
            for k in turn:
                if instants[k + 1] > begin:
                    size = max(abs(y[k]), abs(y[k + 1]))
                    brackets.append((float(size), float(instants[k]), float(instants[k + 1]), states[:n, k]))
            start, reached = float(instants[-1]), states[:n, -1]
            if start >= end:
                break
            spacing *= GROWTH
        for _, low, high, state in sorted(brackets, key=lambda bracket: -bracket[0])[:CHOSEN]:
            t, x = self._turning(low, high, state)
            if t > begin:
                times.append(t)
                values.append(float((C @ x)[0] + D[0, 0]))
        return np.array(times), np.array(values)

    def _turning(self, low: float, high: float, state: np.ndarray) -> tuple[float, np.ndarray]:
        """The zero of y' between two instants and the state there, from that at the first: Newton, kept inside."""
        A, B, C, _ = self.system
        rising = (C @ (A @ state + B[:, 0]))[0] > 0
        last, x = low, state
        t = (low + high) / 2
        for _ in range(NEWTON):
            x, last = self.states(t - last, x), t
            rate = A @ x + B[:, 0]
            slope, bend = float((C @ rate)[0]), float((C @ (A @ rate))[0])
            if (slope > 0) == rising:
                low = t
            else:
                high = t
            new = t - slope / bend if bend else math.nan
            if not low <= new <= high:
                new = (low + high) / 2
            if abs(new - t) <= 1e-12 * max(abs(t), high - low):
                break
            t = new
        return last, x

    def _sampled_extrema(self, begin: float) -> tuple[np.ndarray, np.ndarray]:
        h = float(self.sample_time or 1.0)
        first = first_sample(begin, h)
        if self._samples(first) > MOST_SAMPLES:
            response = step_response(self.system, h)
            found = [largest(response, first, sign) for sign in (1, -1)]
            at = np.unique([first, *(bracket.time for bracket in found if math.isfinite(bracket.time))])
            return at * h, response.at(at)
        y = self.sequence(first)[first:]
        inside = np.flatnonzero((np.abs(y[1:-1]) >= np.abs(y[:-2])) & (np.abs(y[1:-1]) >= np.abs(y[2:]))) + 1
        chosen = inside[np.argsort(-np.abs(y[inside]))][:CHOSEN]
        at = np.r_[0, chosen]
        return (first + at) * h, y[at]

    def _samples(self, least: int) -> int:
        """How many samples reach beyond `least` and the horizon."""
        A = self.system.A
        slowest = float(np.abs(np.linalg.eigvals(A)).max(initial=0.0))
        return least + 3 + len(A) + (math.ceil(LIFETIMES / -math.log(slowest)) if slowest > 0 else 0)

    def sequence(self, least: int) -> np.ndarray:
        """y_0, y_1, … by doubling, at least so many beyond the horizon and `least`."""
        A, B, C, D = self.system
        n, count = len(A), self._samples(least)
        if n == 0:
            return np.full(count, D[0, 0])
        whole = np.eye(n + 1)
        whole[:n, :n], whole[:n, n:] = A, B
        states = np.r_[np.zeros(n), 1.0][:, None]
        while states.shape[1] < count:
            states = np.hstack([states, whole @ states])
            whole = whole @ whole
        return (C @ states[:n])[0] + D[0, 0]


def first_sample(begin: float, sample_time: float) -> int:
    """The first sample at or after an instant; one before it by a rounding is it."""
    return math.ceil(begin / sample_time * (1 - 4 * EPS))


def final_value(system: Realisation, dead_times: np.ndarray | None = None, *, sampled: bool = False):
    """What a unit step leads the output to, and how much of that the solution's rounding may be.

    Rows with a dead time are delay lines. The bound follows every entry through the linear system (Skeel), so it is
    the same in any units of the states.
    """
    A, B, C, D = balanced(*system) if dead_times is None else system
    n = len(A)
    rest = np.eye(n) if sampled else np.diag((np.zeros(n) if dead_times is None else dead_times > 0).astype(float))
    if n == 0:
        return float(D[0, 0]), 0.0
    N = rest - A
    inverse = np.linalg.inv(N)
    x = np.linalg.solve(N, B)
    size = np.abs(C) @ (np.abs(inverse) @ (np.abs(N) @ np.abs(x) + np.abs(B))) + np.abs(D)
    return float((C @ x + D)[0, 0]), 2 * (n + 1) * EPS * float(size[0, 0])


def step_gradient(system: Realisation, t: float, sample_time: float | None):
    """Gradients of y(t) (or of y(∞)) with respect to A, B, C, D.

    With M = [A B; 0 0] and y = cᵀ e^{Mt} b: ∂y = ⟨t L(Mᵀt, c bᵀ), ∂M⟩, L the derivative of the exponential.
    """
    A, B, C, _ = system
    n = len(A)
    D_part = np.ones((1, 1))
    if n == 0:
        return np.zeros_like(A), np.zeros_like(B), np.zeros_like(C), D_part
    N = A if sample_time is None else A - np.eye(n)
    if math.isinf(t):
        forward, sight = np.linalg.solve(N, B), np.linalg.solve(N.T, C.T)
        return sight @ forward.T, -sight, -forward.T, D_part
    whole = np.zeros((n + 1, n + 1))
    whole[:n, :n], whole[:n, n:] = A, B
    out = np.r_[C[0], 0.0]
    if sample_time is not None:
        whole[n, n] = 1.0
        gradient, last = _power_gradient(whole, out, round(t / sample_time))
    else:
        from scipy.linalg import expm_frechet

        scale = np.r_[state_scale(A), 1.0]  # the derivative is formed in balanced coordinates
        balanced = whole / scale[:, None] * scale
        start = np.zeros(n + 1)
        start[n] = 1.0
        exponential, gradient = expm_frechet(balanced.T * t, np.outer(out * scale, start))
        gradient = t * gradient / scale[:, None] * scale
        last = exponential.T[:, n] * scale
    return gradient[:n, :n], gradient[:n, n:], last[None, :n], D_part


def _power_gradient(M: np.ndarray, out: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
    """The gradient of outᵀ M^k b (b the last unit vector) by M, Σ_i (M^i)ᵀ out (M^{k−1−i} b)ᵀ, and M^k b.

    Both stand in the power k of [Mᵀ, out bᵀ; 0, Mᵀ], which takes log k products.
    """
    n = len(M)
    whole = np.block([[M.T, np.outer(out, np.eye(n)[-1])], [np.zeros((n, n)), M.T]])
    power = np.linalg.matrix_power(whole, k)
    return power[:n, n:], power[n:, n:].T[:, -1]
