"""The closed loop of a Plant and a control law, as a Plant again.

    exogenous ──► Plant ──► sensors ──(+ sensor error)──► law ──(+ command error)──► commands ──► Plant

Inputs of the closed loop: every exogenous input of the plant, `error_<sensor>` and `error_<command>`.
Outputs: every output of the plant, and the commands that enter it. The transfer from command errors to commands is the
sensitivity (I + L)⁻¹ at the current commands.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.control.gains import Gains
from workbench.control.law import ModalLaw
from workbench.lti import Plant
from workbench.lti.algebraic import IllPosedError, closing


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
        """(A, B, C, D) of S = (I + L)⁻¹ at the commands, projected on orthonormal patterns (commands, k) if given."""
        seen = self.system.select(inputs=[f"error_{c}" for c in self.law.commands], outputs=self.law.commands)
        U = np.eye(len(self.law.commands)) if patterns is None else patterns
        return seen.A, seen.B @ U, U.T @ seen.C, U.T @ seen.D @ U


def close(plant: Plant, law: ModalLaw, gains: Gains) -> ClosedLoop:
    """The closed loop; refuses an algebraic loop without solution and unfiltered rates, whose roots `roots_of` has."""
    names = law.filter_names(law.kept_filters(gains))
    system = interconnect(plant, law.numeric(gains), law.commands, law.sensors, names)
    return ClosedLoop(system=system, plant=plant, law=law, gains=gains)


def interconnect(
    plant: Plant, controller, commands: Sequence[str], sensors: Sequence[str], states: Sequence[str]
) -> Plant:
    """A plant under a controller (A, B, C, D) from its sensors to its commands, with error inputs at both."""
    Ac, Bc, Cc, Dc = controller
    open_loop = tuple(name for name in plant.inputs if name not in commands)
    u, w = plant.index("inputs", commands), plant.index("inputs", open_loop)
    y = plant.index("outputs", sensors)
    Bu, Bw, Cy = plant.B[:, u], plant.B[:, w], plant.C[y]
    Dyu, Dyw = plant.D[np.ix_(y, u)], plant.D[np.ix_(y, w)]
    E, sound = closing(Dc, Dyu)
    if not sound:
        raise IllPosedError(
            "the direct acceleration gain closes an algebraic loop without solution (I + direct gain is singular); "
            "add the current-loop lag or change K_zddot, K_yddot."
        )
    # commands: u = E (Cc xc + Dc (Cy x + Dyw w + sensor error) + command error)
    n, nc, nu, ny = len(plant.A), len(Ac), len(u), len(y)
    U_state = np.hstack([E @ Dc @ Cy, E @ Cc])
    U_input = np.hstack([E @ Dc @ Dyw, E @ Dc, E])
    Y_state = np.hstack([Cy, np.zeros((ny, nc))]) + Dyu @ U_state
    Y_input = np.hstack([Dyw, np.eye(ny), np.zeros((ny, nu))]) + Dyu @ U_input
    top = np.hstack([plant.A, np.zeros((n, nc))]) + Bu @ U_state
    bottom = Bc @ Y_state + np.hstack([np.zeros((nc, n)), Ac])
    B_top = np.hstack([Bw, np.zeros((n, ny + nu))]) + Bu @ U_input
    C_all = np.hstack([plant.C, np.zeros((len(plant.C), nc))]) + plant.D[:, u] @ U_state
    D_all = np.hstack([plant.D[:, w], np.zeros((len(plant.C), ny + nu))]) + plant.D[:, u] @ U_input
    return Plant(
        A=np.vstack([top, bottom]), B=np.vstack([B_top, Bc @ Y_input]),
        C=np.vstack([C_all, U_state]), D=np.vstack([D_all, U_input]),
        states=plant.states + tuple(states),
        inputs=open_loop + tuple(f"error_{name}" for name in (*sensors, *commands)),
        outputs=plant.outputs + tuple(commands),
    )  # fmt: skip
