"""The closed loop of a Plant and a control law, as a Plant again.

    exogenous ──► Plant ──► sensors ──(+ sensor error)──► law ──(+ command error)──► commands ──► Plant

Inputs of the closed loop: every exogenous input of the plant, `error_<sensor>` and `error_<command>`.
Outputs: every output of the plant, and the commands that enter it. The transfer from command errors to commands is the
sensitivity (I + L)⁻¹ at the current commands.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.control.gains import GAIN_NAMES, Gains
from workbench.control.law import ModalLaw
from workbench.errors import InputError
from workbench.lti import Plant


@dataclass(frozen=True, slots=True, kw_only=True)
class ClosedLoop:
    """A plant under a control law with given gains.

    system : the closed loop as a Plant;  plant, law, gains : what it was made of
    """

    system: Plant
    plant: Plant
    law: ModalLaw
    gains: Gains

    @property
    def exogenous(self) -> tuple[str, ...]:
        """Inputs of the plant that are not commands."""
        return tuple(name for name in self.plant.inputs if name not in self.law.commands)

    def sensitivity(self, patterns: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(A, B, C, D) of S = (I + L)⁻¹ at the commands, projected on orthonormal patterns (n, k) if given."""
        seen = self.system.select(inputs=[f"error_{c}" for c in self.law.commands], outputs=self.law.commands)
        U = np.eye(self.law.count) if patterns is None else patterns
        return seen.A, seen.B @ U, U.T @ seen.C, U.T @ seen.D @ U


def close(plant: Plant, law: ModalLaw, gains: Gains) -> ClosedLoop:
    """The closed loop; refuses an algebraic loop without solution and unfiltered rates (`loop.polynomial` has their roots)."""
    Ac, Bc, Cc, Dc = law.numeric(gains)
    commands, sensors = law.commands, law.sensors
    open_loop = tuple(name for name in plant.inputs if name not in commands)
    u, w = plant.index("inputs", commands), plant.index("inputs", open_loop)
    y = plant.index("outputs", sensors)
    Bu, Bw, Cy = plant.B[:, u], plant.B[:, w], plant.C[y]
    Dyu, Dyw = plant.D[np.ix_(y, u)], plant.D[np.ix_(y, w)]
    loop_gain = np.eye(len(u)) - Dc @ Dyu
    if np.linalg.cond(loop_gain) > 1e10:
        raise InputError(
            "the direct acceleration gain closes an algebraic loop without solution (I + direct gain is singular); "
            "add the current-loop lag or change K_zddot, K_yddot."
        )
    # commands: u = E (Cc xc + Dc (Cy x + Dyw w + sensor error) + command error)
    E = np.linalg.inv(loop_gain)
    n, nc, nu, ny = len(plant.A), len(Ac), len(u), len(y)
    to_x, to_xc = E @ Dc @ Cy, E @ Cc
    to_w, to_sensor, to_command = E @ Dc @ Dyw, E @ Dc, E
    U_state = np.hstack([to_x, to_xc])
    U_input = np.hstack([to_w, to_sensor, to_command])
    Y_state = np.hstack([Cy, np.zeros((ny, nc))]) + Dyu @ U_state
    Y_input = np.hstack([Dyw, np.eye(ny), np.zeros((ny, nu))]) + Dyu @ U_input
    top = np.hstack([plant.A, np.zeros((n, nc))]) + Bu @ U_state
    bottom = Bc @ Y_state + np.hstack([np.zeros((nc, n)), Ac])
    B_top = np.hstack([Bw, np.zeros((n, ny + nu))]) + Bu @ U_input
    C_all = np.hstack([plant.C, np.zeros((len(plant.C), nc))]) + plant.D[:, u] @ U_state
    D_all = np.hstack([plant.D[:, w], np.zeros((len(plant.C), ny + nu))]) + plant.D[:, u] @ U_input
    system = Plant(
        A=np.vstack([top, bottom]), B=np.vstack([B_top, Bc @ Y_input]),
        C=np.vstack([C_all, U_state]), D=np.vstack([D_all, U_input]),
        states=plant.states + law.filter_names(law.kept_filters(gains)),
        inputs=open_loop + tuple(f"error_{name}" for name in sensors + commands),
        outputs=plant.outputs + commands,
    )  # fmt: skip
    return ClosedLoop(system=system, plant=plant, law=law, gains=gains)


def symbolic_dynamics(plant: Plant, law: ModalLaw, theta: ca.SX, channels: Sequence[int] | None = None) -> ca.SX:
    """State matrix of the closed loop, symbolic in the seventeen parameters `theta` (order of `GAIN_NAMES`).

    channels : which of the five modal channels keep their filters; the others must not reach the plant's states.
    """
    if theta.numel() != len(GAIN_NAMES):
        raise InputError(f"theta must have {len(GAIN_NAMES)} entries; got {theta.numel()}.")
    Ac, Bc, Cc, Dc = law.state_space(theta)
    if channels is not None:
        kept = [*channels, *(5 + k for k in channels)]
        Ac, Bc, Cc = Ac[kept, kept], Bc[kept, :], Cc[:, kept]
    u, y = plant.index("inputs", law.commands), plant.index("outputs", law.sensors)
    Bu, Cy, Dyu = plant.B[:, u], plant.C[y], plant.D[np.ix_(y, u)]
    if Dyu.any():
        E = ca.inv(ca.SX.eye(len(u)) - ca.mtimes(Dc, ca.DM(Dyu)))
    else:
        E = ca.DM.eye(len(u))
    U = ca.mtimes(E, ca.horzcat(ca.mtimes(Dc, ca.DM(Cy)), Cc))
    Y = ca.horzcat(ca.DM(Cy), ca.DM.zeros(len(y), Ac.shape[0])) + ca.mtimes(ca.DM(Dyu), U)
    nc = Ac.shape[0]
    top = ca.horzcat(ca.DM(plant.A), ca.DM.zeros(len(plant.A), nc)) + ca.mtimes(ca.DM(Bu), U)
    bottom = ca.mtimes(Bc, Y) + ca.horzcat(ca.DM.zeros(nc, len(plant.A)), Ac)
    return ca.vertcat(top, bottom)
