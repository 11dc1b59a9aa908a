"""Closed loops as affine functions of the law's matrices, so that roots and responses have exact derivatives cheaply.

    plant, sensors and commands as they are, one filter bank   --Stacked-->  A(θ) = A0 + E K(θ) F
    K(θ) = [[D, C], [B, A]] of the law: from sensors and filter states to commands and their rates

One K(θ) and its derivatives serve every loop of a group: scaled or dead sensors are columns of F, lost commands rows of
E, other vehicles, gap offsets and dead times other A0. Sampled laws have a K of their own (Tustin), and plants between
the samples.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from workbench.compiled import Buffered
from workbench.control.discrete import discrete_acceleration, discrete_gap
from workbench.control.gains import GAIN_NAMES
from workbench.control.law import VERTICAL_CHANNELS
from workbench.control.loop.subject import Subject
from workbench.errors import InputError


@dataclass(frozen=True, slots=True)
class LawMatrices:
    """K (m, p) of a law at one θ and its derivatives (17, m, p)."""

    value: np.ndarray
    slope: np.ndarray


class LawFunction:
    """θ (17,) → K and its derivatives, for one group; continuous, or at a sample time [s].

    modal : positions in `control.law.MODAL` to have these scaled modal signals K_i q_i for commands
    """

    def __init__(self, subject: Subject, sample_time: float | None = None, modal: Sequence[int] | None = None) -> None:
        theta = ca.SX.sym("theta", len(GAIN_NAMES))
        resolve = subject.resolution(theta) if modal is None else subject.law.modal_resolution(theta)[list(modal), :]
        K = _stacked(subject, theta, resolve, sample_time)
        self.shape: tuple[int, int] = K.shape
        self._function = Buffered(
            ca.Function("law", [theta], [ca.densify(K), ca.densify(ca.jacobian(ca.vec(K), theta))])
        )

    def __call__(self, theta: np.ndarray) -> LawMatrices:
        K, J = self._function(np.asarray(theta, float))
        m, p = self.shape
        return LawMatrices(K.copy(), J.T.reshape(len(GAIN_NAMES), p, m).transpose(0, 2, 1).copy())


def _stacked(subject: Subject, theta: ca.SX, resolve: ca.SX, sample_time: float | None) -> ca.SX:
    """[[D, C], [B, A]] of the group's law, its own filters alone."""
    rows, law = subject.modal_rows, subject.law
    if sample_time is None:
        A, B, C, D = law.filter_bank(theta)
        return ca.vertcat(
            ca.horzcat(ca.mtimes(resolve, D), ca.mtimes(resolve, C[:, rows])), ca.horzcat(B[rows, :], A[rows, rows])
        )
    g = dict(zip(GAIN_NAMES, ca.vertsplit(theta), strict=True))
    v, w, T = VERTICAL_CHANNELS, 5 - VERTICAL_CHANNELS, sample_time
    filters = [
        *[discrete_gap(g["K_h"], g["K_hdot"], g["tau_h"], T)] * v,
        *[discrete_gap(g["K_hp"], g["K_hpdot"], g["tau_hp"], T)] * w,
        *[discrete_acceleration(g["K_zddot"], g["K_zdot"], g["tau_z"], T)] * v,
        *[discrete_acceleration(g["K_yddot"], g["K_ydot"], g["tau_y"], T)] * w,
    ]
    advance, direct, memory = (ca.vertcat(*(f[k] for f in filters)) for k in range(3))
    both, measure = ca.horzcat(resolve, resolve), ca.DM(law.measurement_matrix())
    D = ca.mtimes([both, ca.diag(direct), measure])
    C = ca.mtimes(both, ca.diag(memory))[:, rows]
    B = ca.mtimes(ca.diag(advance), measure)[rows, :]
    return ca.vertcat(ca.horzcat(D, C), ca.horzcat(B, ca.diag((1 - advance)[rows])))


@dataclass(frozen=True)
class Stacked:
    """A closed loop A(θ) = A0 + E K(θ) F of a group; of a sampled one, the map from one sample to the next.

    commands, sensors : how many rows of K are commands, how many columns sensors; the others are filters
    """

    name: str
    A0: np.ndarray
    E: np.ndarray
    F: np.ndarray
    commands: int
    sensors: int
    sample_time: float | None = None

    @classmethod
    def of(cls, subject: Subject, name: str = "") -> "Stacked":
        """The group's own plant in continuous time; refuses commands that pass straight to a sensor."""
        if subject.direct:
            raise InputError(
                "a loop's derivatives need the current-loop lag; set current_lag_s in the data, 0.010 say."
            )
        plant = subject.plant
        u, y = plant.index("inputs", subject.commands), plant.index("outputs", subject.law.sensors)
        return cls.from_plant(name or subject.name, plant.A, plant.B[:, u], plant.C[y], len(subject.modal_rows))

    @classmethod
    def from_plant(cls, name: str, A, B, C, filters: int, sample_time: float | None = None) -> "Stacked":
        """A plant from commands to sensors, its filters beside it."""
        n, m, p = len(A), B.shape[1], len(C)
        A0, E, F = (
            np.zeros((n + filters,) * 2),
            np.zeros((n + filters, m + filters)),
            np.zeros((p + filters, n + filters)),
        )
        A0[:n, :n], E[:n, :m], F[:p, :n] = A, B, C
        E[n:, m:] = np.eye(filters)
        F[p:, n:] = np.eye(filters)
        return cls(name, A0, E, F, m, p, sample_time)

    def with_sensors(self, name: str, scale: np.ndarray) -> "Stacked":
        """Every sensor (p,) reading its factor times what it should."""
        F = self.F.copy()
        F[: self.sensors] *= np.asarray(scale, float)[:, None]
        return replace(self, name=name, F=F)

    def with_commands(self, name: str, scale: np.ndarray) -> "Stacked":
        """Every command (m,) acting its factor times as it should."""
        E = self.E.copy()
        E[:, : self.commands] *= np.asarray(scale, float)
        return replace(self, name=name, E=E)

    def state_matrix(self, K: LawMatrices) -> np.ndarray:
        """A(θ)."""
        return self.A0 + self.E @ K.value @ self.F

    def roots(
        self, K: LawMatrices, worst: Callable[[np.ndarray], np.ndarray] | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Roots (k,) [1/s] with Im ≥ 0 and their derivatives (k, 17); of a sampled loop ln(z)/T.

        worst : roots → positions of those that are wanted; all if left out
        """
        values, right = np.linalg.eig(self.state_matrix(K))
        left = np.linalg.inv(right)
        upper = values.imag >= 0
        if self.sample_time is not None:
            upper &= np.abs(values) > 1e-9
        kept, T = np.flatnonzero(upper), self.sample_time
        shown = values if T is None else np.log(np.where(upper, values, 1.0).astype(complex)) / T
        if worst is not None:
            kept = kept[worst(shown[kept])]
        into, out = left[kept] @ self.E, self.F @ right[:, kept]
        slopes = ((K.slope @ out) * into.T).sum(axis=1).T
        return shown[kept], slopes if T is None else slopes / (values[kept, None] * T)

    def closed(self, K: LawMatrices, omega: np.ndarray) -> np.ndarray:
        """M (k, p, m): from what is added to K's outputs to K's inputs, the loop closed."""
        A = self.state_matrix(K)
        z = 1j * omega if self.sample_time is None else np.exp(1j * omega * self.sample_time)
        resolvent = z[:, None, None] * np.eye(len(A)) - A
        return self.F @ np.linalg.solve(resolvent, np.broadcast_to(self.E.astype(complex), (len(z), *self.E.shape)))
