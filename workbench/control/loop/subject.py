"""One group of motion as a linear model of its own: coordinates held, channels kept, commands along its patterns.

    Plant of a vehicle --hold the other coordinates at zero, project the currents--> Subject

For a vehicle that is symmetric right to left the groups are exactly decoupled; for one that is not, the coupling is
measured and a split into groups refused ("all" takes the vehicle whole).
"""

from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from workbench.control.discrete import DiscreteLaw
from workbench.control.gains import GAIN_NAMES, Gains
from workbench.control.law import CHANNELS, ModalLaw
from workbench.control.loop.closed import interconnect
from workbench.control.loop.group import GROUPS, commanded
from workbench.errors import InputError, unknown_name
from workbench.lti import Plant
from workbench.lti.front import mixed
from workbench.lti.signals import ANTISYMMETRIC, COORDINATES, SYMMETRIC, current_of, motion

SUBJECTS = (*GROUPS, "heave", "all")
COUPLING_ALLOWED = 1e-9  # relative; rounding leaves 1e-16


@dataclass(frozen=True, slots=True)
class Subject:
    """A linear model of one group under a modal law.

    plant : inputs pattern_1 … pattern_k (commands along the patterns) and the exogenous ones; the group's states only
    channels : positions in `control.law.CHANNELS`
    patterns : (commands, k) orthonormal current patterns, commands = patterns · pattern inputs
    """

    name: str
    plant: Plant
    law: ModalLaw
    coordinates: tuple[str, ...]
    channels: tuple[int, ...]
    patterns: np.ndarray

    @property
    def commands(self) -> tuple[str, ...]:
        """Names of the pattern commands."""
        return tuple(f"pattern_{k + 1}" for k in range(self.patterns.shape[1]))

    @property
    def direct(self) -> bool:
        """Whether a command passes straight to a sensor: true without the current-loop lag."""
        rows, columns = self.plant.index("outputs", self.law.sensors), self.plant.index("inputs", self.commands)
        return bool(self.plant.D[np.ix_(rows, columns)].any())

    @property
    def modal_rows(self) -> list[int]:
        """Rows of the law's ten modal signals that this group measures."""
        return [*self.channels, *(5 + k for k in self.channels)]

    def controller(self, gains: Gains, resolve: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
        """(A, B, C, D) of the law from all sensors to the pattern commands; a filter without gain is dropped.

        resolve : (k, 5) to have other outputs of the five filtered channels than the pattern commands.
        """
        kept, own = self.law.kept_filters(gains), set(self.modal_rows)
        mine = [k for k, name in enumerate(kept) if name in own]
        if resolve is None:
            resolve = self.patterns.T @ self.law.numeric_resolution(gains)
        A, B, C, D = self.law.numeric(gains, resolve * self._owned)
        return A[np.ix_(mine, mine)], B[mine], C[:, mine], D

    def sampled(self, law: DiscreteLaw) -> DiscreteLaw:
        """The sampled law from all sensors to the pattern commands, with the group's own filters alone."""
        own = np.tile(self._owned, 2)
        return replace(
            law, resolution=(self.patterns.T @ law.resolution) * self._owned,
            advance=law.advance * own, direct=law.direct * own, memory=law.memory * own,
        )  # fmt: skip

    def static_gain(self, theta: ca.SX) -> ca.SX:
        """(k, 4n): pattern commands per sensor signal at rest, symbolic in the seventeen parameters."""
        A, B, C, D = self.law.filter_bank(theta)
        return ca.mtimes(self.resolution(theta), D - ca.mtimes(C, ca.solve(A, B)))

    @property
    def _owned(self) -> np.ndarray:
        """1 for the group's channels, 0 for the others, in the order of `CHANNELS`: others measure held coordinates."""
        return np.array([float(k in self.channels) for k in range(len(CHANNELS))])

    def resolution(self, theta):
        """(k, 5): pattern commands from the filtered channels of the group."""
        return ca.mtimes([ca.DM(self.patterns.T), self.law.resolution(theta), ca.diag(ca.DM(self._owned))])

    def close(self, gains: Gains) -> Plant:
        """The closed loop of the group: inputs as of the plant plus errors of sensors and pattern commands."""
        kept, own = self.law.kept_filters(gains), set(self.modal_rows)
        names = self.law.filter_names([k for k in kept if k in own])
        return interconnect(self.plant, self.controller(gains), self.commands, self.law.sensors, names)

    def sensitivity(self, closed: Plant) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(A, B, C, D) of (I + L)⁻¹ at the current commands, in the group's patterns."""
        seen = closed.select(inputs=[f"error_{c}" for c in self.commands], outputs=self.commands)
        return seen.A, seen.B, seen.C, seen.D

    def dynamics(self, theta: ca.SX) -> ca.SX:
        """State matrix of the closed loop, symbolic in the seventeen parameters (order of `GAIN_NAMES`).

        States: of the plant, then the filters of `modal_rows`.
        """
        if theta.numel() != len(GAIN_NAMES):
            raise InputError(f"theta must have {len(GAIN_NAMES)} entries; got {theta.numel()}.")
        rows = self.modal_rows
        Ac, Bc, *_ = self.law.filter_bank(theta)
        plant = self.plant
        u, y = plant.index("inputs", self.commands), plant.index("outputs", self.law.sensors)
        commands = self.commanded(theta)
        measured = ca.horzcat(ca.DM(plant.C[y]), ca.DM.zeros(len(y), len(rows)))
        measured = measured + ca.mtimes(ca.DM(plant.D[np.ix_(y, u)]), commands)
        top = ca.horzcat(ca.DM(plant.A), ca.DM.zeros(len(plant.A), len(rows)))
        top = top + ca.mtimes(ca.DM(plant.B[:, u]), commands)
        bottom = ca.mtimes(Bc[rows, :], measured) + ca.horzcat(ca.DM.zeros(len(rows), len(plant.A)), Ac[rows, rows])
        return ca.vertcat(top, bottom)

    def commanded(self, theta: ca.SX) -> ca.SX:
        """(k, n) pattern commands of the closed loop from the states of `dynamics`, symbolic."""
        resolve, rows, plant = self.resolution(theta), self.modal_rows, self.plant
        _, _, Cc, Dc = self.law.filter_bank(theta)
        Cc, Dc = ca.mtimes(resolve, Cc[:, rows]), ca.mtimes(resolve, Dc)
        u, y = plant.index("inputs", self.commands), plant.index("outputs", self.law.sensors)
        Dyu = plant.D[np.ix_(y, u)]
        E = ca.inv(ca.SX.eye(len(u)) - ca.mtimes(Dc, ca.DM(Dyu))) if Dyu.any() else ca.DM.eye(len(u))
        return ca.mtimes(E, ca.horzcat(ca.mtimes(Dc, ca.DM(plant.C[y])), Cc))

    def noise_inputs(self, theta: ca.SX) -> ca.SX:
        """(n, 4n) how errors of the sensors enter the states of `dynamics`, symbolic; of a plant with current lag."""
        _, Bc, _, Dc = self.law.filter_bank(theta)
        u = self.plant.index("inputs", self.commands)
        direct = ca.mtimes(self.resolution(theta), Dc)
        return ca.vertcat(ca.mtimes(ca.DM(self.plant.B[:, u]), direct), Bc[self.modal_rows, :])


def subject(plant: Plant, law: ModalLaw, name: str, *, unused: bool = False) -> Subject:
    """The named group of a vehicle's plant: "heave_pitch", "sway_roll_yaw", "heave" with pitch held, or "all".

    unused : whether to keep coil patterns that a law with actuators never commands
    """
    if name not in SUBJECTS:
        raise unknown_name("group", name, SUBJECTS)
    if name == "all":
        each = np.eye(len(law.commands))
        return Subject(name, _along(plant, law, each), law, COORDINATES, tuple(range(5)), each)
    for coupled, what in (
        (coupling(plant), "acceleration per displacement"), *current_coupling(plant, law, unused=unused),
    ):  # fmt: skip
        if coupled > COUPLING_ALLOWED:
            raise InputError(
                "heave/pitch and sway/roll/yaw must be decoupled to be looked at by group; "
                f"their coupling is {coupled:.2g} of the largest {what}. "
                "Place the coil sets symmetrically and make them alike, or take group 'all'."
            )
    whole = commanded("heave_pitch" if name == "heave" else name, law, unused=unused)
    coordinates, channels, patterns = whole.coordinates, whole.channels, whole.patterns
    if name == "heave":
        coordinates, channels, patterns = ("Z",), ("heave",), patterns[:, :1]
    alone = _hold(_along(plant, law, patterns), coordinates)
    return Subject(name, alone, law, coordinates, tuple(CHANNELS.index(c) for c in channels), patterns)


def coupling(plant: Plant) -> float:
    """Largest entry of A that couples (Z, Θ) with (Y, Φ, Ψ), relative to the largest of all; 0 if decoupled."""
    groups = [plant.index("states", [*names, *(f"{c}_rate" for c in names)]) for names in (SYMMETRIC, ANTISYMMETRIC)]
    off = max(np.abs(plant.A[np.ix_(a, b)]).max() for a, b in (groups, groups[::-1]))
    both = [*groups[0], *groups[1]]
    return float(off / np.abs(plant.A[np.ix_(both, both)]).max())


def current_coupling(plant: Plant, law: ModalLaw, *, unused: bool = False) -> list[tuple[float, str]]:
    """How much the patterns of one group move, and are moved by, the other: each relative to the largest of its kind.

    A plant whose stiffness is symmetric may still have sets of unlike force, or currents that lag unlike.
    """
    spreads = [commanded(name, law, unused=unused).patterns for name in GROUPS]
    motions = [plant.index("states", [*names, *(f"{c}_rate" for c in names)]) for names in (SYMMETRIC, ANTISYMMETRIC)]
    lagging = set(law.currents) <= set(plant.states)
    currents = plant.index("states", law.currents) if lagging else []
    driven = plant.A[:, currents] if lagging else plant.B[:, plant.index("inputs", law.commands)]

    def across(parts: list[list[np.ndarray]]) -> float:
        """Largest entry off the diagonal of two by two blocks over the largest of all."""
        sizes = [[float(np.abs(part).max(initial=0.0)) for part in row] for row in parts]
        return max(sizes[0][1], sizes[1][0]) / (max(map(max, sizes)) or 1.0)

    found = [(across([[driven[rows] @ V for V in spreads] for rows in motions]), "acceleration per current")]
    if lagging:
        own = plant.A[currents]
        found += [
            (across([[V.T @ own[:, columns] for columns in motions] for V in spreads]), "current per motion"),
            (across([[V.T @ driven[currents] @ W for W in spreads] for V in spreads]), "current per current"),
        ]
    return found


def _along(plant: Plant, law: ModalLaw, patterns: np.ndarray) -> Plant:
    """The plant with commands, and the currents' states if it has them, along patterns only."""
    names = tuple(f"pattern_{k + 1}" for k in range(patterns.shape[1]))
    currents = set(law.currents) & set(plant.states)
    into = np.eye(len(plant.states))[:, [i for i, s in enumerate(plant.states) if s not in currents]]
    states = tuple(s for s in plant.states if s not in currents)
    if currents:
        spread = np.zeros((len(plant.states), patterns.shape[1]))
        spread[plant.index("states", law.currents)] = patterns
        into, states = np.column_stack([into, spread]), states + tuple(map(current_of, names))
    alone = mixed(plant, law.commands, names, patterns)
    back = into.T  # the columns are orthonormal
    return Plant(
        A=back @ alone.A @ into, B=back @ alone.B, C=alone.C @ into, D=alone.D,
        states=states, inputs=alone.inputs, outputs=plant.outputs,
    )  # fmt: skip


def _hold(plant: Plant, moving: tuple[str, ...]) -> Plant:
    """A vehicle's plant with every coordinate but the moving ones held at zero."""
    held = {name for c in COORDINATES if c not in moving for name in motion(c)}
    keep = [i for i, s in enumerate(plant.states) if s not in held]
    C, D = plant.C.copy(), plant.D.copy()
    rows = [i for i, y in enumerate(plant.outputs) if y in held]
    C[rows], D[rows] = 0.0, 0.0
    return Plant(
        A=plant.A[np.ix_(keep, keep)], B=plant.B[keep], C=C[:, keep], D=D,
        states=tuple(plant.states[i] for i in keep), inputs=plant.inputs, outputs=plant.outputs,
    )  # fmt: skip
