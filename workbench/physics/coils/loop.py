"""A closed polygon of straight filaments, and where it is.

    rectangle | racetrack | polygon  -->  WireLoop.placed(translation, roll, pitch, yaw)  -->  WireLoop.reflected(axis)

Axes of a coil: x along the track, y lateral, z normal to the coil. Coordinates are numbers or SX symbols; a loop
carries one turn and no current. Positive current follows the order of the vertices: counter-clockwise seen from +z
for the constructors.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import casadi as ca

from workbench.errors import InputError, unknown_name

Vector = tuple[Any, Any, Any]  # of floats or SX scalars


@dataclass(frozen=True, slots=True)
class WireLoop:
    """A closed polygon; the last vertex joins the first.

    Parameters
    ----------
    vertices : (n, 3) array_like of numbers or SX, n ≥ 3
        Corner coordinates [m].
    sides : (n, 3), optional
        Side vectors [m]; follow from the vertices when left out. Placing and reflecting carry them along, so that a
        zero component stays an exact zero and parallel sides are known to be parallel while the pose is a symbol.

    Raises
    ------
    InputError
        If there are fewer than three vertices, a vertex has not three coordinates, a number is not finite, or a side
        has no length.
    """

    vertices: tuple[Vector, ...]
    sides: tuple[Vector, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        vertices = tuple(_vector(vertex) for vertex in self.vertices)
        if len(vertices) < 3:
            raise InputError(f"a loop must have at least three vertices; got {len(vertices)}. Give every corner once.")
        closed = (*vertices[1:], vertices[0])
        sides = tuple(_vector(side) for side in self.sides) or tuple(
            tuple(end - start for start, end in zip(p, q, strict=True)) for p, q in zip(vertices, closed, strict=True)
        )
        if len(sides) != len(vertices):
            raise InputError(
                f"a loop must have a side per vertex; got {len(sides)} and {len(vertices)}. Leave sides out."
            )
        for number, side in enumerate(sides):
            if all(isinstance(component, float) for component in side) and not any(side):
                raise InputError(
                    f"side {number} of the loop must have a length; two neighbouring vertices coincide. Drop one."
                )
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "sides", sides)

    @classmethod
    def rectangle(cls, width, length) -> "WireLoop":
        """Rectangle in the plane z = 0 about the origin: `length` [m] along x, `width` [m] along y.

        Examples
        --------
        >>> WireLoop.rectangle(0.5, 3.0).vertices
        ((-1.5, -0.25, 0.0), (1.5, -0.25, 0.0), (1.5, 0.25, 0.0), (-1.5, 0.25, 0.0))
        """
        _positive("rectangle", width=width, length=length)
        x, y = length / 2, width / 2
        return cls(((-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)))

    @classmethod
    def polygon(cls, points: Iterable[Sequence]) -> "WireLoop":
        """Polygon in the plane z = 0 through `points` : (n, 2), x and y [m]."""
        return cls(tuple((x, y, 0.0) for x, y in points))

    @classmethod
    def racetrack(cls, width: float, length: float, radius: float, segments: int = 8) -> "WireLoop":
        """Rectangle with rounded corners: each quarter circle of `radius` [m] becomes `segments` chords.

        The corners of the chords lie on the circle; the enclosed area is short of the true one by
        4·(π/4 − n/2·sin(π/2n)) radius², 0.6 % of radius²·π for n = 8.
        """
        _positive("racetrack", width=width, length=length, radius=radius)
        if segments < 1:
            raise InputError(f"a racetrack corner must have at least one chord; got {segments!r}. Use 8 or more.")
        if 2 * radius > min(width, length):
            raise InputError(
                f"a racetrack's corner radius must not exceed half its smaller side; got {radius!r} m "
                f"for {width!r} m × {length!r} m. "
                "Use a smaller radius."
            )
        points: list[tuple[float, float]] = []
        centres = ((1, -1), (1, 1), (-1, 1), (-1, -1))
        for quarter, (sx, sy) in enumerate(centres):
            x, y = sx * (length / 2 - radius), sy * (width / 2 - radius)
            for step in range(segments + 1):
                angle = (quarter - 1 + step / segments) * math.pi / 2
                point = (x + radius * math.cos(angle), y + radius * math.sin(angle))
                if not points or math.dist(point, points[-1]) > 1e-12 * radius:
                    points.append(point)
        if math.dist(points[0], points[-1]) <= 1e-12 * radius:
            points.pop()
        return cls.polygon(points)

    def placed(self, translation: Sequence = (0.0, 0.0, 0.0), *, roll=0.0, pitch=0.0, yaw=0.0) -> "WireLoop":
        """The loop turned about the origin, R = R_z(yaw) R_y(pitch) R_x(roll), then moved by `translation` [m].

        Angles [rad] and translation may be numbers or SX.

        Examples
        --------
        >>> [corner[2] for corner in WireLoop.rectangle(0.5, 3.0).placed((0.0, 0.0, 0.3)).vertices]
        [0.3, 0.3, 0.3, 0.3]
        """
        rotation = rotation_matrix(roll, pitch, yaw)
        offset = _vector(translation)
        vertices = tuple(tuple(c + o for c, o in zip(_turn(rotation, v), offset, strict=True)) for v in self.vertices)
        return WireLoop(vertices, tuple(_turn(rotation, side) for side in self.sides))

    def reflected(self, *axes: str) -> "WireLoop":
        """The mirror image in the planes through the origin normal to `axes` ("x", "y", "z"), in the same order."""
        for axis in axes:
            if axis not in ("x", "y", "z"):
                raise unknown_name("axis", str(axis), "xyz")
        signs = tuple(-1.0 if axis in axes else 1.0 for axis in "xyz")
        mirrored = (
            tuple(tuple(s * c for s, c in zip(signs, v, strict=True)) for v in group)
            for group in (self.vertices, self.sides)
        )
        return WireLoop(*mirrored)

    @property
    def numeric(self) -> bool:
        """Whether every coordinate is a number."""
        return all(isinstance(component, float) for vertex in self.vertices for component in vertex)


def rotation_matrix(roll, pitch, yaw) -> tuple[Vector, Vector, Vector]:
    """R_z(yaw) R_y(pitch) R_x(roll) as three rows; scalars or SX [rad]."""
    cr, sr, cp, sp, cy, sy = ca.cos(roll), ca.sin(roll), ca.cos(pitch), ca.sin(pitch), ca.cos(yaw), ca.sin(yaw)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def _turn(rotation: Sequence[Vector], vector: Vector) -> Vector:
    x, y, z = (a * vector[0] + b * vector[1] + c * vector[2] for a, b, c in rotation)
    return x, y, z


def _vector(components: Iterable) -> Vector:
    values = tuple(c if isinstance(c, ca.SX | ca.MX) else float(c) for c in components)
    if len(values) != 3:
        raise InputError(
            f"a point must have three coordinates x, y, z; got {len(values)}. Give metres along all three axes."
        )
    if any(isinstance(value, float) and not math.isfinite(value) for value in values):
        raise InputError(f"coordinates must be finite; got {values!r}. Check the pose.")
    return values


def _positive(shape: str, **sizes) -> None:
    for name, value in sizes.items():
        if not isinstance(value, ca.SX | ca.MX) and not 0 < value < math.inf:
            raise InputError(
                f"the {name} of a {shape} must be positive and finite; got {value!r} m. Give it in metres."
            )
