"""Step responses of a stable system of one input and output: extrema, and the derivative at an instant.

x' = A x + B, y = C x + D   windows of instants: states by doubling --> sign changes of y' --> Newton
y(t) = [C 0] exp([A B; 0 0] t) [0; 1] + D                           --> gradient by the exponential's derivative
"""

import math
from dataclasses import dataclass, field

import numpy as np

from workbench.analysis.realisation import Realisation, state_scale

DOUBLINGS = 10  # 1024 instants in a window
GROWTH = 8  # of the next window's spacing
LIFETIMES = 8.0  # of the slowest pole: what is left then is 3e-4 of its part
MOST_WINDOWS = 24
MOST_SAMPLES = 200_000  # of a sampled response
NEWTON = 8  # steps; three bring a bracket of a hundredth of a period to rounding
CHOSEN = 6  # extrema refined, the largest first


@dataclass(frozen=True, slots=True)
class Steps:
    """The unit step response of a stable system (1 input, 1 output), from rest."""

    system: Realisation
    sample_time: float | None
    final: float = field(init=False)

    def __post_init__(self) -> None:
        A, B, C, D = self.system
        N = A if self.sample_time is None else A - np.eye(len(A))
        value = D[0, 0] - (C @ np.linalg.solve(N, B))[0, 0] if len(A) else D[0, 0]
        object.__setattr__(self, "final", float(value))

    def extrema(self, begin: float) -> tuple[np.ndarray, np.ndarray]:
        """Instants and values: `begin`, and the largest local extrema after it, of either sign."""
        return self._sampled_extrema(begin) if self.sample_time is not None else self._extrema(begin)

    def horizon(self) -> float:
        """[s] after which nothing new happens."""
        return LIFETIMES / -float(np.linalg.eigvals(self.system.A).real.max()) if len(self.system.A) else 0.0

    def states(self, t: float, before: np.ndarray) -> np.ndarray:
        """The state (n,) a time t after `before`, continuous; t may be negative."""
        from scipy.linalg import expm

        A, B, *_ = self.system
        n = len(A)
        whole = np.zeros((n + 1, n + 1))
        whole[:n, :n], whole[:n, n:] = A, B
        return (expm(whole * t) @ np.r_[before, 1.0])[:n]

    def _extrema(self, begin: float) -> tuple[np.ndarray, np.ndarray]:
        from scipy.linalg import expm

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
            whole = np.zeros((n + 1, n + 1))
            whole[:n, :n], whole[:n, n:] = A, B
            power = expm(whole * spacing)
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
        first = math.ceil(begin / h - 1e-9)
        y = self.sequence(first)[first:]
        inside = np.flatnonzero((np.abs(y[1:-1]) >= np.abs(y[:-2])) & (np.abs(y[1:-1]) >= np.abs(y[2:]))) + 1
        chosen = inside[np.argsort(-np.abs(y[inside]))][:CHOSEN]
        at = np.r_[0, chosen]
        return (first + at) * h, y[at]

    def sequence(self, least: int) -> np.ndarray:
        """y_0, y_1, … by doubling, at least so many beyond the horizon and `least`."""
        A, B, C, D = self.system
        n = len(A)
        if n == 0:
            return np.full(least + 3, D[0, 0])
        slowest = float(np.abs(np.linalg.eigvals(A)).max())
        count = least + 3 + (math.ceil(LIFETIMES / -math.log(slowest)) if slowest > 0 else n)
        whole = np.eye(n + 1)
        whole[:n, :n], whole[:n, n:] = A, B
        states = np.r_[np.zeros(n), 1.0][:, None]
        while states.shape[1] < min(count, MOST_SAMPLES):
            states = np.hstack([states, whole @ states])
            whole = whole @ whole
        return (C @ states[:n])[0] + D[0, 0]


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
    """The gradient of outᵀ M^k b (b the last unit vector) by M, Σ_i (M^i)ᵀ out (M^{k−1−i} b)ᵀ, and M^k b."""
    forward = [np.eye(len(M))[-1]]
    for _ in range(k):
        forward.append(M @ forward[-1])
    gradient, back = np.zeros_like(M), out
    for i in range(k):
        gradient += np.outer(back, forward[k - 1 - i])
        back = M.T @ back
    return gradient, forward[k]


def ode_extrema(steps: Steps, begin: float) -> tuple[np.ndarray, np.ndarray, str]:
    """Extrema by integrating the differential equation (LSODA, tolerance 1e-9); sampled: by the recursion."""
    A, B, C, D = steps.system
    if steps.sample_time is not None:
        h, count = steps.sample_time, len(steps.sequence(math.ceil(begin / steps.sample_time)))
        x, y = np.zeros(len(A)), []
        for _ in range(count):
            y.append(float((C @ x)[0] + D[0, 0]))
            x = A @ x + B[:, 0]
        first = math.ceil(begin / h - 1e-9)
        return np.arange(first, count) * h, np.array(y[first:]), "recursion, sample by sample"
    from scipy.integrate import solve_ivp

    if len(A) == 0:
        return np.array([begin]), np.array([D[0, 0]]), "static"
    end = max(steps.horizon(), begin * 1.5)

    def slope(t, x):
        return (C @ (A @ x + B[:, 0]))[0]

    found = solve_ivp(
        lambda t, x: A @ x + B[:, 0], (0.0, end), np.zeros(len(A)), method="LSODA", jac=lambda t, x: A,
        rtol=1e-9, atol=1e-12, events=slope, dense_output=True,
    )  # fmt: skip
    turning = np.asarray(found.t_events[0])
    times = np.unique(np.r_[begin, turning[turning > begin], found.t[found.t > begin]])
    states = found.sol(times)
    return times, (C @ states)[0] + D[0, 0], "differential equation integrated, tolerance 1e-9"
