"""Many flights side by side: the linear loop by its matrix exponential, what the linear model leaves out by quadrature.

    x′ = A x + B e + r(x, e)      r: the equations of motion less their linear part at rest
    guideway: one cubic per step --> linear flight, exactly
    departure d from it --e^{Ah}, r as a line in time: predicted from two nodes, corrected once--> nonlinear flight

A step asks for one evaluation of the equations, whatever the loop's poles: it is of second order in what r changes
during a step, and exact where r is nothing. Both flights meet the same guideways, so their ratio has little scatter.

Source: Hochbruck & Ostermann, Acta Numerica 19 (2010) 209, sections 2.4 and 2.6 (exponential multistep methods).
"""

from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from workbench.compiled import Buffered, compile_function
from workbench.errors import InputError
from workbench.physics.vehicle.assembly import law_function
from workbench.simulation.period import SHORT_LAW, motion, resting_state
from workbench.simulation.rig import Rig

POSE_AND_VELOCITY = 10  # states before the currents
ACCELERATION = slice(5, 10)  # in a rate
ROUNDING = 1e-14  # of the largest entry of a row


@dataclass(frozen=True, slots=True)
class Stretch:
    """Steps of b flights: departure from rest, of the linear flight and of the nonlinear one.

    linear, state : (k, b, N) at the ends of the steps;  linear_rate, rate : (k, b, N) their time derivatives
    linear_deviation, deviation : (k, b, 3n) gap change, lateral gap change [m], roll [rad] of each set in turn
    distance : (k, b, 2n) of the filaments of each set from floor, then wall, in turn [m]; of the nonlinear flight
    """

    linear: np.ndarray
    state: np.ndarray
    linear_rate: np.ndarray
    rate: np.ndarray
    linear_deviation: np.ndarray
    deviation: np.ndarray
    distance: np.ndarray


@dataclass(frozen=True, slots=True)
class Place:
    """Where b flights are: linear departure from rest, departure of the nonlinear flight from it, r now and before."""

    linear: np.ndarray
    departure: np.ndarray
    now: np.ndarray
    before: np.ndarray

    def joined(self, which: np.ndarray) -> "Place":
        """The flights marked (b,) put onto their linear ones."""
        keep = ~which[:, None]
        return Place(self.linear, *(np.where(keep, part, 0.0) for part in (self.departure, self.now, self.before)))


@dataclass(frozen=True)
class Exponential:
    """The integrator of a rig at a step [s]; continuous laws only."""

    rig: Rig
    step: float
    _maps: dict[int, Buffered] = field(default_factory=dict, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if self.rig.sample_time is not None:
            raise InputError(
                "flights side by side need the continuous law; got a sample time. Leave it out, or use simulate."
            )
        if not 0 < self.step < np.inf:
            raise InputError(f"the step must be positive and finite; got {self.step!r} s.")

    @cached_property
    def _motion(self) -> ca.Function:
        return motion(self.rig)

    @property
    def _short(self) -> bool:
        """Whether the equations are written out as straight-line code; a long law is better called than repeated."""
        return law_function(self.rig.vehicle.force_law).n_instructions() < SHORT_LAW

    @cached_property
    def _slopes(self) -> tuple[np.ndarray, ...]:
        """Derivatives of the rate and of the deviations by state, surface, its rate and loads, at rest."""
        rest, n = resting_state(self.rig), self.rig.vehicle.count
        given = [
            ca.MX.sym(name, size) for name, size in (("x", len(rest)), ("z", 2 * n), ("rate", 2 * n), ("loads", 5))
        ]
        flow, deviation, _ = self._motion(*given)
        wanted = [ca.jacobian(f, v) for f in (flow, ca.vec(deviation)) for v in given]
        return tuple(M.full() for M in ca.Function("slopes", given, wanted)(rest, 0.0, 0.0, 0.0))

    @property
    def A(self) -> np.ndarray:
        """(N, N) of the linear loop."""
        return self._slopes[0]

    @cached_property
    def _weights(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """e^{Ah}, h φ1, h φ2, and (4, 2n, N) what the cubics of the surfaces add to a state (rows) in a step."""
        h, (A, B, B_rate, *_) = self.step, self._slopes
        phi = phi_functions(h * A, 4)
        powers = [1.0, 1.0, 2.0, 6.0]  # ∫ e^{hA(1−s)} sᵏ ds = k! φ_{k+1}
        surface = [h * powers[k] * phi[k + 1] @ B + (powers[k] * phi[k] @ B_rate if k else 0) for k in range(4)]
        return phi[0].T, h * phi[1].T, h * phi[2].T, np.array([S.T for S in surface])

    @cached_property
    def _residual(self) -> ca.Function:
        """Function (2N + 4n: predicted departure from rest and r, surface, its rate) -> corrected r, deviations,
        distances in one column.

        The correction to the state is h φ2 of the one to r. What currents change of r is taken along in it, to first
        order: near the guideway that is the stiff part of the equations, and a step need not resolve it.
        """
        rest, n, N = resting_state(self.rig), self.rig.vehicle.count, len(self.A)
        given = ca.MX.sym("given", 2 * N + 4 * n)
        x, expected, surface, rate = ca.vertsplit(given, [0, N, 2 * N, 2 * N + 2 * n, 2 * N + 4 * n])
        currents = slice(POSE_AND_VELOCITY, POSE_AND_VELOCITY + self.rig.law.count)
        alpha = ca.MX.sym("alpha", self.rig.law.count)
        departed = ca.vertcat(x[: currents.start], alpha, x[currents.stop :])
        flow, deviation, distance = self._motion(ca.DM(rest) + departed, surface, rate, 0.0)
        r = flow - ca.mtimes(_sparse(np.hstack(self._slopes[:3])), ca.vertcat(departed, surface, rate))
        # currents act by accelerations, and what follows from those is as at rest
        follows = _sparse(self._slopes[3] @ np.linalg.inv(self._slopes[3][ACCELERATION]))
        by_current = ca.jacobian(r[ACCELERATION], alpha)
        back = _sparse(self._weights[2].T[currents])
        lever = ca.DM.eye(alpha.shape[0]) - ca.mtimes(ca.mtimes(back, follows), by_current)
        corrected = r + ca.mtimes(follows, ca.mtimes(by_current, _solved(lever, ca.mtimes(back, r - expected))))
        found = ca.vertcat(corrected, ca.vec(deviation), ca.vec(distance))
        whole = ca.Function("whole", [given, alpha], [ca.densify(found)])
        function = ca.Function("residual", [given], [whole(given, given[currents])])
        return compile_function(function.expand("residual", {"cse": True}) if self._short else function)

    def start(self, flights: int) -> Place:
        """So many flights at rest."""
        still = np.zeros((flights, len(self.A)))
        return Place(still, still, still, still)

    def fly(self, place: Place, cubics: np.ndarray) -> tuple[Place, Stretch]:
        """Some steps of b flights from where they are.

        cubics : (k, b, 2n, 4) [m] what the coil sets meet in each step as Σ cubic · sʲ, s from 0 to 1 in the step

        A flight that leaves the range of the equations is not a number from there on; the others do not mind.
        """
        E, hphi1, hphi2, surface = self._weights
        (k, b), N = cubics.shape[:2], len(self.A)
        end = cubics.sum(axis=3), cubics @ np.array([0.0, 1.0, 2.0, 3.0]) / self.step
        met = np.tensordot(cubics, surface, axes=([2, 3], [1, 0]))
        given = np.concatenate([np.zeros((k, b, 2 * N)), *end], axis=2)
        linear, state = np.empty((k, b, N)), np.empty((k, b, N))
        values = np.empty((k, b, self._residual.size1_out(0)))
        equations = self._mapped(b)
        now, before, departure, course = place.now, place.before, place.departure, place.linear
        with np.errstate(all="ignore"):
            for i in range(k):
                course = np.add(course @ E, met[i], out=linear[i])
                change = now - before
                departure = departure @ E + now @ hphi1 + change @ hphi2
                np.add(course, departure, out=given[i, :, :N])
                np.add(now, change, out=given[i, :, N : 2 * N])
                values[i] = equations(given[i].T)[0].T
                before, now = now, values[i, :, :N]
                departure = departure + (now - before - change) @ hphi2
                np.add(course, departure, out=state[i])
            stretch = self._read(linear, state, given[:, :, 2 * N :], values)
        return Place(course, departure, now, before), stretch

    def _mapped(self, flights: int) -> Buffered:
        if flights not in self._maps:
            self._maps[flights] = Buffered(self._residual.map(flights))
        return self._maps[flights]

    def _read(self, linear, state, outside, values) -> Stretch:
        """Rates at the corrected states: linear part there, r where it was predicted."""
        N, sets = len(self.A), 3 * self.rig.vehicle.count
        flow, seen = (np.hstack(self._slopes[j : j + 3]).T for j in (0, 4))
        both = np.concatenate([linear, outside], axis=2)
        linear_rate = both @ flow
        return Stretch(
            linear=linear, state=state, linear_rate=linear_rate,
            rate=linear_rate + (state - linear) @ self.A.T + values[:, :, :N],
            linear_deviation=both @ seen, deviation=values[:, :, N : N + sets], distance=values[:, :, N + sets :],
        )  # fmt: skip


def _solved(matrix: ca.MX, right: ca.MX) -> ca.MX:
    """x of a small system near the unit matrix, without pivots."""
    for k in range(n := right.shape[0]):
        for row in range(n):
            if row != k:
                factor = matrix[row, k] / matrix[k, k]
                matrix[row, :] = matrix[row, :] - factor * matrix[k, :]
                right[row] = right[row] - factor * right[k]
    return right / ca.diag(matrix)


def _sparse(matrix: np.ndarray) -> ca.DM:
    """Without what rounding left of zeros."""
    return ca.sparsify(
        ca.DM(np.where(np.abs(matrix) > ROUNDING * np.abs(matrix).max(axis=1, keepdims=True), matrix, 0.0))
    )


def phi_functions(Z: np.ndarray, count: int) -> list[np.ndarray]:
    """φ_0 = e^Z, φ_1, …, φ_count of a square matrix: φ_{k+1}(Z) = ∫₀¹ e^{Z(1−s)} sᵏ ds / k!.

    Blocks of one exponential.  Source: Al-Mohy & Higham, SIAM J. Sci. Comput. 33 (2011) 488, theorem 2.1.
    """
    from scipy.linalg import expm

    n = len(Z)
    whole = np.zeros((n * (count + 1),) * 2)
    whole[:n, :n] = Z
    for k in range(count):
        whole[k * n : (k + 1) * n, (k + 1) * n : (k + 2) * n] = np.eye(n)
    exponential = expm(whole)
    return [exponential[:n, k * n : (k + 1) * n] for k in range(count + 1)]
