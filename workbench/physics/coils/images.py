"""Images of a coil in a perfect conductor: what a guideway does at infinite speed.

    plane z = 0:  1 image       L-corner y = 0, z = 0:  3 images       circular guideway:  1 image by inversion

An image is (sign of its current, WireLoop). Force of the guideway on the coil = force of the images held fixed. Energy
form: ½ Σ sign·M(coil, image) I², whose derivative by the coil's pose, images moving along, is the same force.
"""

from workbench.errors import InputError
from workbench.physics.coils.loop import WireLoop

Image = tuple[float, WireLoop]


def plane_images(loop: WireLoop) -> tuple[Image, ...]:
    """The image below the plane z = 0: reflected, current reversed."""
    return ((-1.0, loop.reflected("z")),)


def corner_images(loop: WireLoop) -> tuple[Image, ...]:
    """The three images in the corner of a floor z = 0 and a wall y = 0.

    Floor and wall reverse the current, the image across the edge has it as in the coil.

    Source: report, Appendix A.1 (a).
    """
    return (-1.0, loop.reflected("z")), (-1.0, loop.reflected("y")), (1.0, loop.reflected("y", "z"))


def circular_images(loop: WireLoop, radius: float) -> tuple[Image, ...]:
    """The image in a circular cylinder of `radius` [m] about the x axis, by inversion of every vertex.

    (y, z) → radius² (y, z)/(y² + z²), current reversed; the coil may be inside or outside. Exact in two dimensions,
    that is for filaments along x of infinite length. For a coil of finite length the image of its ends is an arc that
    is replaced by a chord here, and inversion is no longer exact. Under the middle of a coil 0.5 m × 3 m, 0.4 m from a
    circle of 2 m, 2 % of its field still pass through the guideway, 0.2 % if it is 10 m long. Its force by the energy
    and by the image held fixed, equal for an exact image, differ by 2 %. The compensating current on the axis is zero,
    because the currents of a loop add to zero.

    Source: report, Appendix A.1 (a) (inversion); J. C. Maxwell, Treatise, art. 181-189.
    """
    if not radius > 0:
        raise InputError(
            f"the radius of a circular guideway must be positive; got {radius!r} m. Use plane_images for a plane."
        )
    vertices = []
    for x, y, z in loop.vertices:
        scale = radius * radius / (y * y + z * z)
        vertices.append((x, scale * y, scale * z))
    sides = [
        # a side along x stays along x: the zeros are known, not computed
        side
        if _along_x(side)
        else tuple(b - a for a, b in zip(vertices[i], vertices[(i + 1) % len(vertices)], strict=True))
        for i, side in enumerate(loop.sides)
    ]
    return ((-1.0, WireLoop(tuple(vertices), tuple(sides))),)


def _along_x(side) -> bool:
    return all(component.is_zero() if hasattr(component, "is_zero") else component == 0.0 for component in side[1:])
