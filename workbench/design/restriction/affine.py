"""A loop whose controller is affine in its parameters, at frequencies: every limited gain as Y W⁻¹, Y and W affine too.

problem --hard goals: limits of gains; soft goal: an integrated error--> Affine --at frequencies--> Rows: Y, W, limit

With the controller K pulled out of the loop, z = P11 w + P12 v, e = P21 w + P22 v, v = K e. Where P21 is square and
invertible (w is pushed at every input of the controller, one each) the channel from w to z is

    T = [P11 P21⁻¹ (I − P22 K) + P12 K] [P21⁻¹ (I − P22 K)]⁻¹

so sensitivities and what follows them are of that form; where P12 is (z are all of the controller's outputs, or what
they move), the same holds of the transposed channel. Dead times and samples are exact.

Source: Boyd, Hast & Åström, Int. J. Robust Nonlinear Control 26 (2016) 1718.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from workbench.control.structure.structure import Structure
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.goals.gain import GainShape
from workbench.goals.goal import Goal
from workbench.goals.integrated_error import SlopeAtRest
from workbench.goals.peak import Axis, PeakMeasure
from workbench.lti.delay import LinedSystem
from workbench.lti.weight import Filter

COUNT = 3000  # dense frequencies
BELOW, ABOVE = 1e-3, 1e2  # of the slowest rate of plant and controller, of the fastest: where they begin and end
AT_REST = 1e-7  # of the slowest rate: where the limit at rest is taken
SAME = 1e-9  # relative size of what must be zero: rounding of responses
CURE = "Leave method out for a tuner that takes any goal."
START = 0.2  # of the slowest rate: integral action of the start, slow for any plant of like time constants


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """One limited gain at frequencies: σ_max((Y0 + Σ x_i Y_i) (W0 + Σ x_i W_i)⁻¹) ≤ limit.

    omega, limit : (k,);  W : (k, 1 + n, p, p), Y : (k, 1 + n, q, p), the constant part first
    """

    name: str
    omega: np.ndarray
    limit: np.ndarray
    W: np.ndarray
    Y: np.ndarray

    def take(self, chosen) -> "Rows":
        """Some of the frequencies."""
        return Rows(self.name, self.omega[chosen], self.limit[chosen], self.W[chosen], self.Y[chosen])

    def shares(self, x: np.ndarray) -> np.ndarray:
        """σ_max over its limit at each frequency, (k,)."""
        return np.linalg.svd(at(self.Y, x) @ np.linalg.inv(at(self.W, x)), compute_uv=False)[:, 0] / self.limit

    def logarithms(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """log of the shares (k,) and their gradients (k, n).

        A singular value that stands alone has the gradient Re u*(dY − H dW) W⁻¹ v, H = Y W⁻¹.
        """
        inverse = np.linalg.inv(at(self.W, x))
        H = at(self.Y, x) @ inverse
        u, s, vh = np.linalg.svd(H)
        left, right = u[:, :, 0].conj(), np.einsum("kab,kb->ka", inverse, vh[:, 0].conj())
        slope = np.einsum("ka,kiab,kb->ki", left, self.Y[:, 1:], right, optimize=True)
        slope = slope - np.einsum("ka,kab,kibc,kc->ki", left, H, self.W[:, 1:], right, optimize=True)
        return np.log(s[:, 0] / self.limit), slope.real / s[:, :1]


def at(parts: np.ndarray, x: np.ndarray) -> np.ndarray:
    """The affine matrix (k, a, b) of parts (k, 1 + n, a, b) at x (n,)."""
    return np.einsum("i,kiab->kab", np.r_[1.0, x], parts)


def suited(problem: Problem) -> bool:
    """Whether a problem can be solved by restriction."""
    if all(goal.hard for goal in problem.goals) or len(problem.systems) != 1:
        return False
    try:
        Affine(problem)
    except InputError:
        return False
    return True


@dataclass(frozen=True)
class Affine:
    """A problem that restriction can solve: one model, limits of gains, one integrated error to be made small."""

    problem: Problem

    def __post_init__(self) -> None:
        problem = self.problem
        if len(problem.systems) != 1:
            raise InputError(
                f"restriction takes one model; problem {problem.name!r} has {len(problem.systems)}. {CURE}"
            )
        if not (problem.structure.names and self.limited and self._soft):
            raise InputError(f"restriction needs free parameters and a hard limit of a gain. {CURE}")
        self._check_affine()
        _ = self.integral, self.dense

    def _measure(self, goal: Goal):
        return goal.bind(self.problem.loops[0]).measure

    @cached_property
    def _soft(self) -> tuple[Goal, SlopeAtRest]:
        """The integrated error, and how it is measured."""
        soft = [goal for goal in self.problem.goals if not goal.hard]
        measures = [self._measure(goal) for goal in soft]
        if len(soft) != 1 or not isinstance(measures[0], SlopeAtRest):
            raise InputError(
                f"restriction makes one integrated error small; the soft goals of {self.problem.name!r} are "
                f"{', '.join(g.name for g in soft) or 'none'}. {CURE}"
            )
        return soft[0], measures[0]

    @property
    def structure(self) -> Structure:
        return self.problem.structure  # pyright: ignore[reportReturnType]

    @cached_property
    def limited(self) -> tuple[tuple[Goal, PeakMeasure, GainShape], ...]:
        """The hard goals with what they measure; refused where one is no limit of a gain."""
        found = []
        for goal in (goal for goal in self.problem.goals if goal.hard):
            measure = self._measure(goal)
            if not (isinstance(measure, PeakMeasure) and isinstance(measure.shape, GainShape)):
                raise InputError(f"restriction takes hard goals that limit gains; {goal.name!r} does not. {CURE}")
            found.append((goal, measure, measure.shape))
        return tuple(found)

    def _check_affine(self) -> None:
        """Refuses a controller that is not affine in its parameters."""
        omega = self._rates()[0] * np.array([0.3, 3.0])
        basis, box = self.basis(omega), self.structure.bounds
        x = np.clip(np.random.default_rng(0).normal(size=len(box)), *box.T)
        own = self.structure.controller(x).response(omega, self._sample_time)
        if not np.abs(own - at(basis, x)).max() <= 1e-6 * np.abs(own).max():  # not a number where zero is none
            raise InputError(
                "restriction needs a controller that is affine in its free parameters (gains); "
                f"{', '.join(self.structure.names)} do not all enter so. Hold time constants, or leave method out."
            )

    @property
    def _sample_time(self) -> float | None:
        return self.problem.loops[0].sample_time

    def basis(self, omega: np.ndarray) -> np.ndarray:
        """The controller's parts (k, 1 + n, inputs of the plant, outputs of the plant) at (k,) [rad/s]."""
        zero, h = np.zeros(len(self.structure.names)), self._sample_time
        constant = self.structure.controller(zero).response(omega, h)
        parts = [self.structure.controller(e).response(omega, h) - constant for e in np.eye(len(zero))]
        return np.stack([constant, *parts], axis=1)

    def rows(self, number: int, omega: np.ndarray) -> Rows:
        """One limited gain at frequencies within its focus."""
        goal, measure, shape = self.limited[number]
        low, high = measure.band
        omega = omega[(omega >= low) & (omega <= high)]
        axis = Axis.of(omega, self._sample_time)
        Y, W = self._divided(measure.channel, omega)
        if shape.minus is not None:
            Y = Y - Filter(shape.minus).response(axis.filters)[:, None] @ W
        Y = Y if shape.left is None else shape.left.response(axis.filters)[:, None] @ Y
        W = W if shape.right is None else np.linalg.inv(shape.right.response(axis.filters))[:, None] @ W
        limit = shape.profile.magnitude(axis.omega) ** float(-shape.power)
        return Rows(goal.name, omega, limit, W, Y)

    def _divided(self, channel, omega: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Y and W (k, 1 + n, …) of a channel."""
        f = channel.exact
        p = len(f.C1)
        C, late, h = np.concatenate([f.C1, f.C2]), channel.lines.dead_times, self._sample_time
        by_w = LinedSystem(f.A, f.B1, C, np.concatenate([f.D11, f.D21]), late, h).response(omega)
        by_v = LinedSystem(f.A, f.B2, C, np.concatenate([f.D12, f.D22]), late, h).response(omega)
        P11, P12, P21, P22 = by_w[:, :p], by_v[:, :p], by_w[:, p:], by_v[:, p:]
        K = self.basis(omega)
        if P21.shape[1] != P21.shape[2] or (np.linalg.cond(P21) > 1 / SAME).any():
            if P12.shape[1] != P12.shape[2] or (np.linalg.cond(P12) > 1 / SAME).any():
                raise InputError(
                    f"restriction takes channels that begin at every input of the controller or end at every output of "
                    f"it; that from {', '.join(channel.inputs)} to {', '.join(channel.outputs)} does not. {CURE}"
                )
            P11, P12, P21, P22 = (P.swapaxes(-1, -2) for P in (P11, P21, P12, P22))
            K = K.swapaxes(-1, -2)
        inverse = np.linalg.inv(P21)
        W = -(inverse @ P22)[:, None] @ K
        W[:, 0] += inverse
        through = P12 - P11 @ inverse @ P22
        through = np.where(np.abs(through) > SAME * (np.abs(P12) + np.abs(P11 @ inverse @ P22)), through, 0.0)
        Y = through[:, None] @ K
        Y[:, 0] += P11 @ inverse
        return Y, W

    @cached_property
    def integral(self) -> np.ndarray:
        """(n, p, p): the integrated error is the inverse of Σ x_i integral_i, in units of its goal's limit."""
        goal, measure = self._soft
        omega = AT_REST * self._rates()[:1]
        Y, W = self._divided(measure.channel, omega)
        if Y.shape[-1] != Y.shape[-2] or np.abs(Y[0, 1:]).max() > SAME * np.abs(Y[0, 0]).max():
            raise InputError(
                "the integrated error must be that of what is fed back, after a step at the plant's outputs or inputs; "
                f"got the channel from {', '.join(goal.inputs)} to {', '.join(goal.outputs)}. {CURE}"
            )
        M = (1j * omega[0] * W[0, 1:] @ np.linalg.inv(Y[0, 0])).real
        return M * measure.limit

    def objective(self, x: np.ndarray) -> float:
        """The integrated error over its limit; infinite without integral action."""
        smallest = float(np.linalg.svd(np.tensordot(x, self.integral, 1), compute_uv=False)[-1])
        return 1 / smallest if smallest > 0 else math.inf

    def sizes(self, x: np.ndarray) -> np.ndarray:
        """Unit of each parameter, (n,): unknowns of like effect suit the solvers, in whatever units they are given.

        Its own size, or a tenth of what has the effect of the strongest on W where it is nearly zero.
        """
        rows = self.dense[0]
        effect = np.abs(rows.W[:, 1:] @ np.linalg.inv(at(rows.W, x))[:, None]).max(axis=(0, 2, 3))
        return np.maximum(np.abs(x), 0.1 * np.max(np.abs(x) * effect) / effect)

    def _rates(self) -> np.ndarray:
        """Slowest and fastest rate [1/s] of the plant's poles, dead times and the controller's poles."""
        loop, h = self.problem.loops[0], self._sample_time
        plant, own = np.linalg.eigvals(loop.model.plant.A), self.structure.controller().poles()
        times = np.array([line.dead_time for line in loop.model.lines])

        def rates(poles: np.ndarray) -> np.ndarray:
            inside = poles if h is None else np.log(np.where(poles == 0, 1e-12, poles).astype(complex)) / h
            return np.abs(inside)[np.abs(inside) > 1e-9 * np.abs(inside).max(initial=0.0)]

        slow = [*rates(plant), *(1 / times)] or [*rates(own)] or [1.0]
        return np.array([min(slow), max([*slow, *rates(own)])])

    @cached_property
    def dense(self) -> tuple[Rows, ...]:
        """Every limited gain at dense frequencies."""
        slow, fast = self._rates()
        end = fast * ABOVE if self._sample_time is None else math.pi / self._sample_time * (1 - 1e-6)
        omega = np.geomspace(min(slow * BELOW, end / 10), end, COUNT)
        return tuple(self.rows(k, omega) for k in range(len(self.limited)))

    def unstable(self, x: np.ndarray) -> bool:
        """Whether the loop is not stable, dead times exact."""
        return self.problem.loops[0].unstable_poles(self.structure.controller(x)) != 0

    def worst(self, x: np.ndarray) -> float:
        """Largest share of a limit at the dense frequencies."""
        return max(float(rows.shares(x).max()) for rows in self.dense)

    def start(self, *, within: bool = True) -> np.ndarray:
        """The structure's own values if they are stable and within the limits; else slow integral action.

        within : whether that must keep the limits too

        With K = (ε/s) X and the loop's −(integral part) Hurwitz, every small enough ε > 0 is stable. Where the
        structure lacks places, the least-squares fit of the inverse is taken.
        """
        own = self.structure.start
        if math.isfinite(self.objective(own)) and not self.unstable(own) and self.worst(own) < 1:
            return own
        columns = self.integral.reshape(len(self.integral), -1).T
        direction = np.linalg.lstsq(columns, np.eye(self.integral.shape[-1]).ravel(), rcond=None)[0]
        if np.linalg.eigvals(np.tensordot(direction, self.integral, 1)).real.min(initial=1.0) <= 1e-9:
            raise InputError(
                "integral action must be possible with the structure's places: no gains were found for which every "
                "eigenvalue of P(0) K_I has a positive real part. Free more places of the integral gains."
            )
        low, high = self.structure.bounds.T
        size = START * self._rates()[0] * self._soft[1].limit
        for _ in range(20):
            x = np.clip(size * direction, low, high)
            if not self.unstable(x) and (not within or self.worst(x) < 0.99):
                return x
            size /= 2
        raise InputError(
            f"the limits must leave room for slow integral action; those of {self.problem.name!r} do not. Raise them, "
            "free more places of the integral gains, or start from values that keep the limits."
        )
