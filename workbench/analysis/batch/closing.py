"""Closed loops of one group of motion, a stack at a time: the same loop as `Subject.close` makes one by one.

gains (b, 17) --law, compiled--> filters and modal gains --with a plant's reading--> A (b, n, n), inputs, outputs, modes
"""

from dataclasses import dataclass, fields, replace

import casadi as ca
import numpy as np

from workbench.analysis.batch.delays import delays
from workbench.analysis.batch.plants import Reading
from workbench.control.gains import GAIN_NAMES
from workbench.control.law import VERTICAL_CHANNELS
from workbench.control.loop import Subject
from workbench.lti.algebraic import closing
from workbench.lti.modal import Modes, modes, peaks
from workbench.lti.realisation import state_scale

FILTERS = (("K_hdot", "tau_h"), ("K_hpdot", "tau_hp"), ("K_zdot", "tau_z"), ("K_ydot", "tau_y"))
_RATES, _TAUS = ([GAIN_NAMES.index(pair[k]) for pair in FILTERS] for k in (0, 1))


def acting(gains: np.ndarray) -> np.ndarray:
    """Which of the four kinds of filter act, (b, 4) bool, for gains (b, 17)."""
    return (gains[:, _RATES] != 0) & (gains[:, _TAUS] > 0)


def unfiltered(gains: np.ndarray) -> np.ndarray:
    """Rows (b,) that take a gap's rate without a filter; they have roots only."""
    return ((gains[:, _RATES] != 0) & (gains[:, _TAUS] == 0))[:, :2].any(axis=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Closed:
    """Closed loops; states in units of `scale`, sound (b,) where the algebraic loop has a solution.

    A : (b, n, n);  B_front, B_rear : (b, n, types);  B_sensor : (b, n, 4 sets), B_command : (b, n, patterns), errors
    C, D_front, D_rear : the outputs that were read;  C_sensed : gaps, lateral gaps, currents of all sets
    U, E : commands from states, and from command errors
    """

    A: np.ndarray
    B_front: np.ndarray
    B_rear: np.ndarray
    B_sensor: np.ndarray
    B_command: np.ndarray
    C: np.ndarray
    D_front: np.ndarray
    D_rear: np.ndarray
    C_sensed: np.ndarray
    U: np.ndarray
    E: np.ndarray
    sound: np.ndarray
    modes: Modes

    def only(self, rows: np.ndarray) -> "Closed":
        """Some of the loops."""
        changed = {f.name: getattr(self, f.name)[rows] for f in fields(self) if f.name != "modes"}
        return replace(self, **changed, modes=Modes(*(part[rows] for part in self.modes)))

    def peak(self) -> np.ndarray:
        """Peak sensitivity at the current commands (b,)."""
        left, right = self.modes.residues(self.B_command, self.U)
        return peaks(self.modes.poles, left, right, self.E)

    def delay(self) -> tuple[np.ndarray, np.ndarray]:
        """Smallest delay margin of one current command, the others closed (b,) [s]; and where it is sound (b,)."""
        left, right = self.modes.residues(self.B_command, self.U)
        return delays(self.modes.poles, left, right, self.E)

    def static(self) -> np.ndarray:
        """Gap and lateral gap of every set at rest per bias of every accelerometer, (b, 2 sets, 2 sets)."""
        half = self.B_sensor.shape[2] // 2
        gaps = self.C_sensed[:, :half]
        return -gaps @ np.linalg.solve(self.A, self.B_sensor[:, :, half:])

    def noise(self, density: np.ndarray) -> np.ndarray:
        """Mean squares (b, 3 sets) of gaps, lateral gaps, currents under white sensor noise of intensity density²."""
        left, right = self.modes.residues(self.B_sensor * density, self.C_sensed)
        poles = self.modes.poles
        overlap = -(left @ left.transpose(0, 2, 1)) / (poles[:, :, None] + poles[:, None, :])
        return ((right @ overlap) * right).sum(axis=2).real


class Closing:
    """What closes the loop of one group for any gains."""

    def __init__(self, subject: Subject) -> None:
        self.subject, law = subject, subject.law
        self._rows = np.array(subject.modal_rows)
        self._measure = law.measurement_matrix()[self._rows]
        theta = ca.SX.sym("theta", len(GAIN_NAMES))
        A, _, filtered, through = law.filter_bank(theta)
        own = ca.diag(ca.DM([float(k in subject.channels) for k in range(5)]))
        resolve = ca.mtimes([ca.DM(subject.patterns.T), law.resolution(theta), own])
        through = ca.mtimes(through, ca.DM(np.linalg.pinv(law.measurement_matrix())))  # from modal signals
        parts = [-ca.diag(A), ca.mtimes(resolve, filtered), ca.mtimes(resolve, through)]
        self._law = ca.Function("law", [theta], [ca.densify(p) for p in parts])

    def __call__(self, gains: np.ndarray, r: Reading) -> Closed:
        """The loops of gains (b, 17) whose acting filters are the same in every row."""
        b, k = len(gains), len(self.subject.commands)
        pace, filtered, through, mine = self._filters(gains)
        sound = np.ones(b, bool)
        E = np.broadcast_to(np.eye(k), (b, k, k))
        if r.D_y.any():  # without current loops the commands reach the accelerometers at once
            E, sound = closing(through, r.D_y)
        law, filtered = E @ through, E @ filtered
        U = np.concatenate([law @ r.C_y, filtered], axis=2)
        n, m = r.A.shape[-1], len(mine)
        A = np.zeros((b, n + m, n + m))
        A[:, :n, :n] = r.A
        A[:, :n] += r.B @ U
        A[:, n:] = pace[:, :, None] * (r.D_y @ U)[:, mine]
        A[:, n:, :n] += pace[:, :, None] * r.C_y[..., mine, :]
        A[:, range(n, n + m), range(n, n + m)] -= pace
        scale = state_scale(A[0])  # powers of two, so nothing is rounded

        def entry(straight, commands: np.ndarray, signals) -> np.ndarray:
            """Inputs (b, n + m, …) that act on the plant, through commands, and on the modal signals."""
            upper = straight + r.B @ commands
            lower = pace[:, :, None] * (signals + r.D_y @ commands)[:, mine]
            return np.concatenate([upper, lower], axis=1) / scale[:, None]

        def seen(rows: np.ndarray) -> np.ndarray:
            """Outputs of the plant's states alone, over all states."""
            rows = np.broadcast_to(rows, (b, *rows.shape[-2:]))
            return np.concatenate([rows, np.zeros((b, rows.shape[1], m))], axis=2)

        front, rear = law @ r.D_y_front, law @ r.D_y_rear
        A = A / scale[:, None] * scale
        return Closed(
            A=A, modes=modes(A), U=U * scale, E=E, sound=sound,
            B_front=entry(r.B_front, front, r.D_y_front), B_rear=entry(r.B_rear, rear, r.D_y_rear),
            B_sensor=entry(0.0, law @ self._measure, self._measure), B_command=entry(0.0, E, 0.0),
            C=(seen(r.C_z) + r.D_z @ U) * scale, C_sensed=seen(r.C_sensed) * scale,
            D_front=r.D_z_front + r.D_z @ front, D_rear=r.D_z_rear + r.D_z @ rear,
        )  # fmt: skip

    def _filters(self, gains: np.ndarray):
        """1/τ (b, m) of acting filters, pattern commands per filter state (b, k, m) and per signal, and which act."""
        safe, act = gains.copy(), acting(gains)
        vertical = self._rows % 5 < VERTICAL_CHANNELS
        kind = np.where(vertical, 0, 1) + np.where(self._rows < 5, 0, 2)
        mine = np.flatnonzero(act[0][kind])
        safe[:, _TAUS] = np.where(safe[:, _TAUS] == 0, 1.0, safe[:, _TAUS])  # of filters that do not act
        safe[:, _RATES] = np.where(act, safe[:, _RATES], 0.0)
        b, k = len(gains), len(self.subject.commands)
        pace, filtered, through = (np.array(part) for part in self._law(ca.DM(safe.T)))
        pace = pace.T[:, self._rows[mine]]
        filtered = filtered.reshape(k, b, 10).transpose(1, 0, 2)[:, :, self._rows[mine]]
        through = through.reshape(k, b, 10).transpose(1, 0, 2)[:, :, self._rows]
        return pace, filtered, through, mine
