"""The exact force law of a coil set in an L-shaped guideway, by images.

    energy W(h, h', φ, α)  --gradient-->  F_L, F_G, L  --gradient-->  symmetric stiffness, action of the control current

Times lift_ratio × current²: the report's algorithm, where the ratio f_L/f_L∞ of an endless plate stands for finite
speed (report, A.1 (d), (e)). The ratio is held while the pose deviates from the nominal one.
"""

import math
from dataclasses import dataclass
from functools import cache

import casadi as ca
import numpy as np

from workbench.errors import InputError
from workbench.physics.coils.loop import WireLoop
from workbench.physics.forces.elementwise import CASADI, elementwise
from workbench.physics.forces.energy import CoilSet, clearance, energy_parts, pair_energy, placed_in_corner
from workbench.physics.forces.law import Tangent

TILTED_ORDER = 16  # Gauss points when pitch or yaw tilts the long sides: 3e-10 of M for 3 m at 0.4 m, 1e-5 with 8


@dataclass(frozen=True, slots=True, kw_only=True)
class CornerLaw:
    """Forces of one coil set over floor and wall, exact in the image model.

    Parameters
    ----------
    coils : CoilSet
    gap, gap_lateral : float
        Nominal h and h' [m]: main coil's plane over the floor, near long side from the wall.
    current : float
        Ampere-turns of the main coil [A].
    lift_ratio : float
        f_L/f_L∞ at the speed considered [1].
    drag_ratio : float
        K_1 = f_D/f_L at that speed [1].
    order : int
        Gauss points on the coil ends; 8 gives 1e-7 of the largest coefficient.

    Raises
    ------
    InputError
        If a coil would not be clear of floor and wall, or a number has no sense.

    Source: report, A.1 and A.2.
    """

    coils: CoilSet
    gap: float
    gap_lateral: float
    current: float
    lift_ratio: float
    drag_ratio: float
    order: int = 8

    def __post_init__(self) -> None:
        for name, unit in (("gap", "m"), ("gap_lateral", "m"), ("current", "A"), ("lift_ratio", "1")):
            value = getattr(self, name)
            if not 0 < value < math.inf:
                raise InputError(
                    f"CornerLaw.{name} must be positive and finite; got {value!r} {unit}. "
                    "The coil flies above the floor and beside the wall, gaps counted away from them."
                )
        if not 0 <= self.drag_ratio < math.inf:
            raise InputError(f"drag_ratio must be f_D/f_L, not negative; got {self.drag_ratio!r}. See plane_forces.")
        if self.order < 2:
            raise InputError(f"order must be at least 2; got {self.order!r}. 8 gives seven digits.")
        self._check_clear(0.0, 0.0, 0.0)

    @property
    def scale(self) -> float:
        """Newtons per unit of energy gradient: lift_ratio × current² [A²]."""
        return self.lift_ratio * self.current**2

    def forces(self, gap_change, gap_lateral_change, roll, alpha):
        """Lift F_L [N], lateral force F_G [N] and roll moment L about the main coil's centre line [N m], elementwise.

        Parameters as in ForceLaw.forces. Raises InputError if numbers would take a coil through the guideway.
        """
        self._check_clear(gap_change, gap_lateral_change, roll)
        function = _forces(self.coils, self.order)
        values = elementwise(function, self.gap + gap_change, self.gap_lateral + gap_lateral_change, roll, alpha)
        return tuple(self.scale * value for value in values)

    def drag(self, gap_change, gap_lateral_change, roll, alpha):
        """Drag [N] = drag_ratio (F_L + F_G), elementwise (report, A.1 (e))."""
        lift, lateral, _ = self.forces(gap_change, gap_lateral_change, roll, alpha)
        return self.drag_ratio * (lift + lateral)

    @property
    def affine(self) -> bool:
        """False: forces fall exponentially with the gaps."""
        return False

    def tangent(self, deviation: np.ndarray, alpha: np.ndarray) -> Tangent:
        """Forces (3, n) and slopes (3, 4n); see ForceLaw. Raises InputError where a coil would touch the guideway."""
        each = [(float(h), float(hp), float(roll), float(a)) for h, hp, roll, a in np.vstack([deviation, alpha]).T]
        known = {pose: self._tangent(*pose) for pose in dict.fromkeys(each)}  # sets that ride alike are asked once
        return np.hstack([known[pose][0] for pose in each]), np.hstack([known[pose][1] for pose in each])

    def stiffness(self, gap_change=0.0, gap_lateral_change=0.0, roll=0.0, alpha=0.0) -> np.ndarray:
        """(3, 3) derivatives of (F_L, F_G, L) by (h, h', φ) at one pose; symmetric."""
        return self._tangent(gap_change, gap_lateral_change, roll, alpha)[1][:, :3]

    def current_action(self, gap_change=0.0, gap_lateral_change=0.0, roll=0.0, alpha=0.0) -> np.ndarray:
        """(3,) derivatives of (F_L, F_G, L) by α at one pose [N, N, N m]."""
        return self._tangent(gap_change, gap_lateral_change, roll, alpha)[1][:, 3]

    def pose_forces(self, gap_change, gap_lateral_change, roll, pitch, yaw, alpha):
        """The same forces with the coil also pitched and yawed, and all three moments about its centre, elementwise.

        Parameters
        ----------
        gap_change, gap_lateral_change, roll, alpha
            As in `forces`.
        pitch, yaw : scalar, DM or SX
            [rad], positive about +y and +z; orientation R_z(yaw) R_y(pitch) R_x(roll).

        Returns
        -------
        tuple
            F_L, F_G [N] and the moments about x, y, z through the main coil's centre [N m]. Drag is not in them: the
            image model does not say where along the coil it acts.
        """
        function = _pose_forces(self.coils, max(self.order, TILTED_ORDER))
        gaps = self.gap + gap_change, self.gap_lateral + gap_lateral_change
        return tuple(self.scale * value for value in elementwise(function, *gaps, roll, pitch, yaw, alpha))

    def _tangent(self, gap_change, gap_lateral_change, roll, alpha) -> tuple[np.ndarray, np.ndarray]:
        """Forces (3, 1) and slopes (3, 4) at one pose."""
        self._check_clear(gap_change, gap_lateral_change, roll)
        pose = self.gap + gap_change, self.gap_lateral + gap_lateral_change, roll, alpha
        forces, slopes = _tangent(self.coils, self.order)(*pose)
        return self.scale * forces.full(), self.scale * slopes.full()

    def _check_clear(self, gap_change, gap_lateral_change, roll) -> None:
        deviation = (gap_change, gap_lateral_change, roll)
        if any(isinstance(value, CASADI) for value in deviation):
            return
        pose = self.gap + np.asarray(gap_change), self.gap_lateral + np.asarray(gap_lateral_change), np.asarray(roll)
        height, distance = (np.min(value) for value in elementwise(_clearance(self.coils), *pose))
        if not (height > 0 and distance > 0):
            raise InputError(
                f"the coils must stay clear of the guideway; at this pose (h = {np.min(pose[0]):.4g} m, "
                f"h' = {np.min(pose[1]):.4g} m) a filament is {height:.4g} m over the floor and {distance:.4g} m from "
                "the wall. Increase the gap or turn the coil less."
            )


def pair_coefficients(coil: WireLoop, other: WireLoop, width: float, gap, gap_lateral, roll, order: int = 8):
    """Force and own-axis moment on one coil by the images of another (or of itself), both rigidly joined.

    Parameters
    ----------
    coil, other : WireLoop
        Both given about the centre of `coil`; numeric.
    width : float
        Of `coil` [m].
    gap, gap_lateral, roll : scalar, array, DM or SX, elementwise
        Pose of `coil` [m, m, rad].

    Returns
    -------
    f_L, f_G, m
        Per ampere-turn of each [N/A², N/A², N m/A²]; the images held fixed, so action need not equal reaction.

    Source: report, A.3, contributions (a) to (d); Figures A-3 to A-8.
    """
    return elementwise(_pair(coil, other, width, order), gap, gap_lateral, roll)


@cache
def _pair(coil: WireLoop, other: WireLoop, width: float, order: int) -> ca.Function:
    gap, lateral, roll = pose = ca.SX.sym("h"), ca.SX.sym("hp"), ca.SX.sym("roll")
    fixed = [ca.SX.sym(f"{name}_other") for name in ("h", "hp", "roll")]
    energy = pair_energy(
        placed_in_corner(coil, width, gap, lateral, roll), placed_in_corner(other, width, *fixed), order
    )
    force = ca.gradient(energy, ca.vertcat(*pose))
    force = ca.substitute(force, ca.vertcat(*fixed), ca.vertcat(*pose))
    return ca.Function("pair", list(pose), ca.vertsplit(force), {"cse": True})


@cache
def _clearance(coils: CoilSet) -> ca.Function:
    pose = [ca.SX.sym(name) for name in ("h", "hp", "roll")]
    return ca.Function("clearance", pose, list(clearance(coils, *pose)))


@cache
def energy_function(coils: CoilSet, order: int) -> tuple[list[ca.SX], list[ca.SX]]:
    """Symbols h, h', φ and the three energy parts W0, W1, W2 [H] as expressions in them."""
    pose = [ca.SX.sym(name) for name in ("h", "hp", "roll")]
    main, control = (placed_in_corner(loop, coils.width, *pose) for loop in (coils.main, coils.control))
    return pose, list(energy_parts(main, control, order))


@cache
def _symbols(coils: CoilSet, order: int) -> tuple[list[ca.SX], ca.SX]:
    """h, h', φ, α and the gradient of the energy by the first three.

    What the energy's terms have in common is found before it is derived: a tenth of the work of finding it afterwards.
    """
    pose, (main, mutual, control) = energy_function(coils, order)
    alpha = ca.SX.sym("alpha")
    energy = ca.cse(main + alpha * mutual + alpha**2 * control)
    return [*pose, alpha], ca.gradient(energy, ca.vertcat(*pose))


@cache
def _forces(coils: CoilSet, order: int) -> ca.Function:
    symbols, gradient = _symbols(coils, order)
    return ca.Function("corner_forces", symbols, ca.vertsplit(gradient), {"cse": True})


@cache
def _tangent(coils: CoilSet, order: int) -> ca.Function:
    symbols, gradient = _symbols(coils, order)
    return ca.Function("corner_tangent", symbols, [gradient, ca.jacobian(gradient, ca.vertcat(*symbols))])


@cache
def _pose_forces(coils: CoilSet, order: int) -> ca.Function:
    names = ("h", "hp", "roll", "pitch", "yaw", "alpha")
    gap, lateral, roll, pitch, yaw, alpha = symbols = [ca.SX.sym(name) for name in names]
    turn = ca.SX.sym("turn", 3)  # small rotation about the fixed axes, after the pose: its gradient is the moment
    main_loop, control_loop = (
        loop.placed(roll=roll, pitch=pitch, yaw=yaw).placed(
            (0.0, lateral + coils.width / 2, gap), roll=turn[0], pitch=turn[1], yaw=turn[2]
        )
        for loop in (coils.main, coils.control)
    )
    main, mutual, control = energy_parts(main_loop, control_loop, order)
    gradient = ca.gradient(main + alpha * mutual + alpha**2 * control, ca.vertcat(gap, lateral, turn))
    gradient = ca.substitute(gradient, turn, ca.SX.zeros(3))
    return ca.Function("pose_forces", symbols, ca.vertsplit(gradient), {"cse": True})
