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
from workbench.lti.front import matrices
from workbench.lti.join import beside, wired
from workbench.lti.realisation import Realisation

CIRCLE = (
    "the direct acceleration gain closes an algebraic loop without solution (I + direct gain is singular); "
    "add the current-loop lag or change K_zddot, K_yddot."
)


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
    open_loop = tuple(name for name in plant.inputs if name not in commands)
    nu, ny, m, p = len(commands), len(sensors), len(plant.inputs), len(plant.outputs)
    u, w = plant.index("inputs", commands), plant.index("inputs", open_loop)
    back, into = np.zeros((m + ny, p + nu)), np.zeros((m + ny, len(w) + ny + nu))
    back[u, range(p, p + nu)] = 1.0
    back[range(m, m + ny), plant.index("outputs", sensors)] = 1.0
    into[[*w, *range(m, m + ny), *u], range(into.shape[1])] = 1.0
    past = np.zeros((p + nu, into.shape[1]))
    past[p:, -nu:] = np.eye(nu)
    whole = beside(matrices(plant), Realisation(*controller))
    A, B, C, D = wired(whole, back, into, np.eye(p + nu), past, CIRCLE)
    return Plant(
        A=A, B=B, C=C, D=D, states=plant.states + tuple(states),
        inputs=open_loop + tuple(f"error_{name}" for name in (*sensors, *commands)),
        outputs=plant.outputs + tuple(commands),
    )  # fmt: skip
