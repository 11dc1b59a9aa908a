"""Random loops over twelve decades of time and signals, and the truth about each by plain formulas.

    modes, integrators, twins, companion forms, dead time, sampling --> Case: matrices in units of one
                       --other units--> the Loop and controller that goals are judged on
                       --frequency by frequency, step by step--> `Case.T`, `S`, `poles`, `peak`, `area`, `step`

Nothing here uses the workbench's own algorithms: responses are solved for one frequency at a time, peaks are looked for
around every pole and refined, energies are integrals over frequency, step responses sums over small steps.
"""

import math
from dataclasses import dataclass, field
from functools import reduce
from operator import mul

import control
import numpy as np
from goal_cases import loop_of, plant
from scipy.linalg import block_diag, expm
from scipy.optimize import minimize_scalar

from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop

BLOCK = 2**16  # instants of a step response at a time
KINDS = ("plain", "integrator", "twin", "light", "companion", "delay", "sampled", "defective")
SAMPLED = ("sampled", "fine")
HARDER = ("lighter", "late", "fine")  # damping of 1e-4, dead time with light modes, samples of 1e-4


@dataclass(frozen=True)
class Case:
    """A closed loop: plant from (w, u) to (z, y), controller from y to u, in units of one; and the units."""

    name: str
    plant: tuple  # A, B (n, 2), C (2, n), D (2, 2) with no way from u to y at once
    law: tuple  # A, B, C, D of u = K y
    dead_time: float  # of u
    sample_time: float | None
    time: float  # of one unit of time [s]
    size: float  # of one unit of z over one of w
    known: dict = field(default_factory=dict, compare=False)

    def loop(self) -> tuple[Loop, Controller]:
        """What the goals see, in its own units."""
        A, B, C, D = self.plant
        rate = 1 / self.time if self.sample_time is None else 1.0
        units = np.array([1.0, math.sqrt(self.size)])  # of w, u; z and y likewise
        out = np.array([self.size, 1 / math.sqrt(self.size)])
        C, D = C * out[:, None], D * out[:, None] / units
        system = plant(A * rate, B * rate / units, C, D, inputs=["w", "u"], outputs=["z", "y"])
        h = None if self.sample_time is None else self.sample_time * self.time
        delays = {"input_delay": {"u": self.dead_time * self.time}} if self.dead_time else {}
        order = len(self.law[0])
        loop = loop_of(system, controls=["u"], measured=["y"], order=order, sample_time=h, **delays)
        Ak, Bk, Ck, Dk = self.law
        gain = units[1] / out[1]
        return loop, Controller(Ak * rate, Bk * rate, Ck * gain, Dk * gain)

    def parts(self, omega) -> tuple[np.ndarray, ...]:
        """Plant (k, 2, 2) with the dead time and controller (k,), at (k,) [rad per unit of time]."""
        omega = np.atleast_1d(np.asarray(omega, float))
        key = omega.tobytes()
        if key in self.known:
            return self.known[key]
        s = 1j * omega if self.sample_time is None else np.exp(1j * omega * self.sample_time)
        G, K = _solved(*self.plant, s), _solved(*self.law, s)[:, 0, 0]
        late = np.exp(-1j * omega * self.dead_time)
        found = self.known[key] = G * np.stack([np.ones_like(late), late], axis=1)[:, None, :], K
        return found

    def T(self, omega) -> np.ndarray:
        """From w to z (k,), in its own units of size."""
        G, K = self.parts(omega)
        return self.size * (G[:, 0, 0] + G[:, 0, 1] * K / (1 - G[:, 1, 1] * K) * G[:, 1, 0])

    def L(self, omega) -> np.ndarray:
        """The loop gain at u (k,)."""
        G, K = self.parts(omega)
        return -G[:, 1, 1] * K

    def closed(self) -> tuple[np.ndarray, ...]:
        """A, B, C, D from w to z; a dead time as Padé fractions of fourth order for a fifth of it each."""
        A, B, C, D = self.plant
        Ak, Bk, Ck, Dk = self.law
        if self.dead_time:
            part = control.ss(control.tf(*control.pade(self.dead_time / 5, 4)))
            late = reduce(mul, [part] * 5)
            Ap, Bp, Cp, Dp = late.A, late.B, late.C, late.D  # behind the controller
            Bk, Ak, Ck, Dk = (
                np.vstack([Bk, Bp @ Dk]), np.block([[Ak, np.zeros((len(Ak), len(Ap)))], [Bp @ Ck, Ap]]),
                np.hstack([Dp @ Ck, Cp]), Dp @ Dk,
            )  # fmt: skip
        Bw, Bu, Cz, Cy = B[:, :1], B[:, 1:], C[:1], C[1:]
        return (
            np.block([[A + Bu @ Dk @ Cy, Bu @ Ck], [Bk @ Cy, Ak]]), np.vstack([Bw + Bu @ Dk * D[1, 0], Bk * D[1, 0]]),
            self.size * np.hstack([Cz + D[0, 1] * Dk @ Cy, D[0, 1] * Ck]),
            self.size * (D[:1, :1] + D[0, 1] * Dk * D[1, 0]),
        )  # fmt: skip

    def poles(self) -> np.ndarray:
        """In the s plane, per unit of time; those with dead time approximately."""
        poles = np.linalg.eigvals(self.closed()[0]).astype(complex)
        return poles if self.sample_time is None else np.log(poles[np.abs(poles) > 1e-12]) / self.sample_time

    def stable(self) -> bool:
        """By the poles, which stay well off the axis."""
        return bool(self.poles().real.max() < 0)

    def top(self) -> float:
        """The end of the frequency axis."""
        return math.inf if self.sample_time is None else math.pi / self.sample_time

    def grid(self, more=()) -> np.ndarray:
        """Frequencies (k,) that no peak hides between."""
        poles = np.concatenate([self.poles(), *(np.linalg.eigvals(part[0]) for part in (self.plant, self.law))])
        if self.sample_time is not None:
            poles = self.poles()
        sizes = np.r_[np.abs(poles)[np.abs(poles) > 1e-9], np.atleast_1d(more)]
        near = (poles.imag[:, None] + np.abs(poles.real)[:, None] * np.linspace(-6, 6, 61)).ravel()
        spread = np.geomspace(1e-5 * sizes.min(), 1e5 * sizes.max(), 1500)
        ripples = np.linspace(0, 40 / self.dead_time, 1500) if self.dead_time else ()
        omega = np.unique(np.r_[near, np.abs(poles), spread, ripples, more])
        omega = omega[(omega > 0) & (omega < self.top())]
        return omega if math.isinf(self.top()) else np.r_[omega, self.top()]

    def peak(self, size, more=(), low: float = 0.0, high: float = math.inf) -> float:
        """The supremum of size(ω) over [low, high]."""
        omega = self.grid(more)
        inside = omega[(omega > low) & (omega < high)]
        omega = np.unique(np.r_[[low] if low else [], inside, [high] if high < self.top() else []])
        values = size(omega)
        best = float(values.max())
        tops = np.flatnonzero((values >= np.r_[-1, values[:-1]]) & (values >= np.r_[values[1:], -1]))
        for k in tops[np.argsort(-values[tops])][:12]:
            a, b = omega[max(k - 1, 0)], omega[min(k + 1, len(omega) - 1)]
            for _ in range(7):  # each zoom leaves a tenth: 1e-7 of the first gap, its square in a smooth value
                fine = np.linspace(a, b, 21)
                sizes = size(fine)
                best, top = max(best, float(sizes.max())), int(np.argmax(sizes))
                a, b = fine[max(top - 1, 0)], fine[min(top + 1, 20)]
        return best

    def area(self, size, more=(), low: float = 0.0, high: float = math.inf) -> float:
        """∫ size(ω) dω over [low, high], which must fall like 1/ω² or faster."""
        poles = np.r_[self.poles(), np.asarray(more, complex) * -1]
        steps = 2.0 ** np.arange(-2, 9)
        near = (poles.imag[:, None] + np.abs(poles.real)[:, None] * np.r_[-steps, 0, steps]).ravel()
        sizes = np.abs(poles)[np.abs(poles) > 1e-9]
        spread = np.geomspace(1e-4 * sizes.min(), 1e4 * sizes.max(), 200)
        ripples = np.linspace(0, 60 / self.dead_time, 60) if self.dead_time else ()
        end = min(high, self.top())
        nodes = np.unique(np.r_[low, near, spread, ripples, [end] if math.isfinite(end) else []])
        nodes = nodes[(nodes >= low) & (nodes <= end)]
        x, w = np.polynomial.legendre.leggauss(16)
        middle, half = (nodes[1:] + nodes[:-1]) / 2, (nodes[1:] - nodes[:-1]) / 2
        total = float((size((middle[:, None] + half[:, None] * x).ravel()).reshape(-1, 16) @ w) @ half)
        if math.isinf(end):  # in 1/ω
            v = (1 + x) / 2 / nodes[-1]
            total += float((size(1 / v) / v**2) @ w) / 2 / nodes[-1]
        return total

    def step(self, begin: float) -> tuple[float, float, float, float]:
        """The largest and the smallest of the unit step response from `begin` on, the largest size, and its end."""
        A, B, C, D = self.closed()
        n = len(A)
        if self.sample_time is None:
            end = float((D - C @ np.linalg.solve(A, B))[0, 0])
            slowest, fastest = -np.linalg.eigvals(A).real.max(), np.abs(self.plant_poles()).max()
            dt = 0.05 / fastest
            first, count = max(begin - dt, 0.0), math.ceil((16 / slowest + begin) / dt) + 8
            whole = np.block([[A, B], [np.zeros((1, n + 1))]])
            step, state = expm(whole * dt), expm(whole * first) @ np.eye(n + 1)[n]
        else:
            end = float((D + C @ np.linalg.solve(np.eye(n) - A, B))[0, 0])
            first = math.ceil(begin / self.sample_time - 1e-6)
            slowest = -math.log(np.abs(np.linalg.eigvals(A)).max())
            step, count, dt = np.block([[A, B], [np.zeros((1, n)), np.eye(1)]]), math.ceil(16 / slowest) + 8, 1.0
            state = np.linalg.matrix_power(step, first) @ np.eye(n + 1)[n]
        row = np.r_[C[0], D[0]]
        states, power = state[:, None], step
        while states.shape[1] < min(count, BLOCK):
            states, power = np.hstack([states, power @ states]), power @ power
        values = []
        for block in range(math.ceil(count / states.shape[1])):
            k = block * states.shape[1] + np.arange(states.shape[1])
            y = row @ states
            inside = first + dt * k >= begin - (1e-6 if dt == 1.0 else 0.0)
            if self.sample_time is not None:
                values += [float(y[inside].max(initial=-np.inf)), float(y[inside].min(initial=np.inf))]
            elif inside.any():
                values += [self._turning(whole, row, states[:, i], dt, max(-dt, begin - first - dt * k[i]), sign)
                           for sign in (1, -1) for i in self._highest(np.where(inside, sign * y, -np.inf))]  # fmt: skip
            states = power @ states
        values = [v for v in values if math.isfinite(v)]
        if self.sample_time is None and begin:
            values.append(float((row @ expm(whole * begin))[n]))
        return max(values), min(values), max(abs(v) for v in values), end

    @staticmethod
    def _highest(y: np.ndarray) -> np.ndarray:
        """The highest few crests of samples: between them the highest may be one whose samples are not."""
        crest = np.flatnonzero((y >= np.r_[-np.inf, y[:-1]]) & (y >= np.r_[y[1:], -np.inf]) & np.isfinite(y))
        return crest[np.argsort(-y[crest])][:6]

    @staticmethod
    def _turning(whole, row, state, dt, low, sign) -> float:
        """The largest (sign 1) or smallest of a response beside a state, by its slope's zero."""
        found = minimize_scalar(
            lambda t: -sign * float(row @ expm(whole * t) @ state), bounds=(low, dt), method="bounded",
            options={"xatol": 1e-8 * dt},
        )  # fmt: skip
        return -sign * found.fun

    def plant_poles(self) -> np.ndarray:
        """Of plant and controller, open."""
        return np.r_[np.linalg.eigvals(self.plant[0]), np.linalg.eigvals(self.law[0]), [1.0]]


def _solved(A, B, C, D, s) -> np.ndarray:
    if len(A) == 0:
        return np.broadcast_to(D.astype(complex), (len(s), *D.shape))
    return D + C @ np.linalg.solve(s[:, None, None] * np.eye(len(A)) - A, np.broadcast_to(B, (len(s), *B.shape)))


def random_case(kind: str, seed: int, *, stable: bool = True) -> Case:
    """A loop of a kind; unstable if so wanted, by a gain turned up."""
    random = np.random.default_rng([(KINDS + HARDER).index(kind), seed])
    lightest = {"light": 5e-3, "twin": 2e-2, "defective": 0.15, "lighter": 1e-4, "late": 1e-2}.get(kind, 0.05)
    blocks = [np.array([[-rate]]) for rate in random.uniform(0.3, 2.0, size=random.integers(1, 3))]
    for _ in range(random.integers(1, 3)):
        omega, zeta = random.uniform(0.4, 3.0), lightest * 10 ** random.uniform(0, 0.7)
        mode = np.array([[0.0, omega], [-omega, -2 * zeta * omega]])
        blocks.append(mode)
        if kind == "twin":
            blocks.append(mode * (1 + 10.0 ** random.uniform(-9, -3)))
        elif kind == "defective":
            blocks[-1] = np.block([[mode, 0.3 * np.eye(2)], [np.zeros((2, 2)), mode]])
    A = block_diag(*blocks)
    n = len(A)
    B, C = random.standard_normal((n, 2)), random.standard_normal((2, n))
    if kind == "companion":
        bottom = np.poly(A)
        W = np.vstack([np.linalg.matrix_power(A.T, k) @ C[0] for k in range(n)])  # rows of the observability matrix
        A, B, C = W @ A @ np.linalg.inv(W), W @ B, C @ np.linalg.inv(W)
        A = np.vstack([np.eye(n)[1:], -bottom[:0:-1]])
    else:
        turn = np.linalg.qr(random.standard_normal((n, n)))[0]
        A, B, C = turn @ A @ turn.T, turn @ B, C @ turn.T
    order = int(random.integers(0, 3))
    Ak = -np.diag(random.uniform(0.5, 3.0, size=order))
    law = [Ak, random.standard_normal((order, 1)), random.standard_normal((1, order)), random.standard_normal((1, 1))]
    h = 10.0 ** random.uniform(*((-2.5, -0.5) if kind == "sampled" else (-5, -3))) if kind in SAMPLED else None
    if h is not None:
        M = expm(np.block([[A, B], [np.zeros((2, n + 2))]]) * h)
        A, B = M[:n, :n], M[:n, n:]
        law[0], law[1] = expm(Ak * h), law[1] * h
    D = np.zeros((2, 2))
    dead_time = float(random.uniform(0.1, 1.5)) if kind in ("delay", "late") else 0.0
    units = 10.0 ** random.uniform(-6, 6), 10.0 ** random.uniform(-4, 4)

    def made(size: float, law_) -> Case:
        Ak, Bk, Ck, Dk = law_
        return Case(f"{kind}-{seed}", (A, B, C, D), (Ak, Bk, size * Ck, size * Dk), dead_time, h, *units)

    open_ = made(1.0, law)
    loudest = float(np.abs(open_.L(open_.grid())).max())
    if kind == "integrator":  # in the controller: slow enough for the phase of what is before it
        still = (D - C @ np.linalg.solve(A, B))[1, 1] if h is None else 1.0
        law = [np.zeros((1, 1)), np.eye(1), np.array([[-0.05 / still]]), np.array([[-0.1 / loudest]])]
        size = 1.0
        while not made(size, law).stable():
            size /= 2
        return made(size, law)
    if stable:
        return made(0.6 / loudest, law)  # by the small gain theorem, dead time or not
    size = 4 / loudest
    while made(size, law).poles().real.max() < 0.05:
        size *= -1.7
    return made(size, law)
