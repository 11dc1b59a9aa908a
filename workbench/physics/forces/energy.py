"""Magnetic energy of a coil set over an L-shaped guideway at infinite speed; every force is a derivative of it.

    CoilSet, pose  -->  loops  -->  images in the corner  -->  W0 + α W1 + α² W2  [per ampere-turn squared of the main
    coil]

Axes: x along the track, y away from the wall (y = 0), z away from the floor (z = 0); roll > 0 turns +y into +z. The
pose is that of the main coil's centre: z = gap, y = gap_lateral + width/2. Everything here takes numbers or SX.
"""

import math
from dataclasses import dataclass

import casadi as ca

from workbench.errors import InputError
from workbench.physics.coils.images import corner_images
from workbench.physics.coils.inductance import mutual_inductance
from workbench.physics.coils.loop import WireLoop


@dataclass(frozen=True, slots=True, kw_only=True)
class CoilSet:
    """A main coil and the control coil fixed to it, both rectangular and parallel.

    Parameters
    ----------
    width, length : float
        Main coil across and along the track, between winding centre lines [m].
    control_width, control_length : float
        Control coil [m].
    control_offset : (3,)
        Centre of the control coil as seen from the main coil's centre, x, y, z [m]; z < 0 is below.

    Source: report, Figure A-1 and A.3.
    """

    width: float
    length: float
    control_width: float
    control_length: float
    control_offset: tuple[float, float, float]

    def __post_init__(self) -> None:
        for name in ("width", "length", "control_width", "control_length"):
            value = getattr(self, name)
            if not 0 < value < math.inf:
                raise InputError(f"CoilSet.{name} must be positive and finite; got {value!r} m. Give it in metres.")
        offset = tuple(float(value) for value in self.control_offset)
        if len(offset) != 3 or not all(map(math.isfinite, offset)) or not any(offset):
            raise InputError(
                f"CoilSet.control_offset must be three finite lengths, not all zero; got {self.control_offset!r}. "
                "The report's control coil sits at (0, 0, -0.1) m."
            )
        object.__setattr__(self, "control_offset", offset)

    @property
    def main(self) -> WireLoop:
        """The main coil about its own centre."""
        return WireLoop.rectangle(self.width, self.length)

    @property
    def control(self) -> WireLoop:
        """The control coil about the main coil's centre."""
        return WireLoop.rectangle(self.control_width, self.control_length).placed(self.control_offset)


REPORT_COILS = CoilSet(width=0.5, length=3.0, control_width=0.5, control_length=3.0, control_offset=(0.0, 0.0, -0.1))
"""The 0.5 m by 3.0 m coils of the report, control coil 0.1 m below (A.3)."""


def energy_parts(main: WireLoop, control: WireLoop, order: int = 8) -> tuple:
    """W0, W1 and W2 [H] of two placed loops: energy of the set is (W0 + α W1 + α² W2) times ampere-turns squared.

    W0 = ½ Σ s M(main, image of main), W1 = Σ s M(main, image of control), W2 = ½ Σ s M(control, image of control).
    The half belongs to an image that moves with its coil; W1 holds both cross terms.

    Source: report, A.1 (a), (b).
    """
    return (
        _image_energy(main, main, order) / 2,
        _image_energy(main, control, order),
        _image_energy(control, control, order) / 2,
    )


def pair_energy(coil: WireLoop, other: WireLoop, order: int = 8):
    """Energy [H] of one coil in the field of another coil's images, Σ s M(coil, image of other): hold `other` fixed and
    its derivative by the coil's pose is the force on the coil."""
    return _image_energy(coil, other, order)


def _image_energy(coil: WireLoop, other: WireLoop, order: int):
    return sum((sign * mutual_inductance(coil, image, order) for sign, image in corner_images(other)), 0.0)


def placed_in_corner(loop: WireLoop, width, gap, gap_lateral, roll=0.0, pitch=0.0, yaw=0.0) -> WireLoop:
    """A loop given about the main coil's centre, at a pose in the corner; `width` is the main coil's [m]."""
    return loop.placed((0.0, gap_lateral + width / 2, gap), roll=roll, pitch=pitch, yaw=yaw)


def clearance(coils: CoilSet, gap, gap_lateral, roll) -> tuple:
    """Smallest height over the floor and smallest distance from the wall of any filament [m], elementwise."""
    height = distance = ca.inf
    for floor, wall in zip(*edge_distances(coils, gap, gap_lateral, roll), strict=True):
        height, distance = ca.fmin(height, floor), ca.fmin(distance, wall)
    return height, distance


def edge_distances(coils: CoilSet, gap, gap_lateral, roll) -> tuple[list, list]:
    """Heights over the floor and distances from the wall of the four long sides [m], elementwise.

    Long sides only: pitch and yaw are zero, so they contain the extremes.
    """
    _, y0, z0 = coils.control_offset
    half, half_control = coils.width / 2, coils.control_width / 2
    sides = ((-half, 0.0), (half, 0.0), (y0 - half_control, z0), (y0 + half_control, z0))
    sine, cosine = ca.sin(roll), ca.cos(roll)
    floor = [gap + eta * sine + zeta * cosine for eta, zeta in sides]
    wall = [gap_lateral + half + eta * cosine - zeta * sine for eta, zeta in sides]
    return floor, wall
