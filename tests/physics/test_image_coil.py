"""Images in planes, corners and circles."""

import casadi as ca
import numpy as np
import pytest

from workbench.errors import InputError
from workbench.physics.coils import (
    WireLoop,
    circular_images,
    corner_images,
    lorentz_force,
    magnetic_field,
    plane_images,
)
from workbench.physics.coils.inductance import mutual_inductance

COIL = WireLoop.rectangle(0.5, 3.0).placed((0.0, 0.55, 0.3), roll=0.07)


def total_field(loop, images, points):
    return magnetic_field(loop, 1.0, points) + sum(magnetic_field(image, sign, points) for sign, image in images)


def test_no_flux_enters_floor_or_wall_of_a_corner():
    floor = np.array([[x, y, 0.0] for x in (0.0, 1.0, 2.0) for y in (0.1, 0.5, 1.5)])
    wall = np.array([[x, 0.0, z] for x in (0.0, 1.0, 2.0) for z in (0.1, 0.5, 1.5)])
    largest = np.abs(magnetic_field(COIL, 1.0, np.vstack([floor, wall]))).max()
    assert np.abs(total_field(COIL, corner_images(COIL), floor)[:, 2]).max() < 1e-12 * largest  # rounding
    assert np.abs(total_field(COIL, corner_images(COIL), wall)[:, 1]).max() < 1e-12 * largest


def test_no_flux_enters_a_plane():
    floor = np.array([[0.0, 0.5, 0.0], [1.4, 0.2, 0.0]])
    normal = total_field(COIL, plane_images(COIL), floor)[:, 2]
    assert np.abs(normal).max() < 1e-12 * np.abs(magnetic_field(COIL, 1.0, floor)).max()  # rounding


def test_far_from_the_wall_the_corner_is_a_plane():
    def lift(images_of):
        height = ca.SX.sym("h")
        coil = WireLoop.rectangle(0.5, 3.0).placed((0.0, 50.0, height))
        energy = sum(sign * mutual_inductance(coil, image) / 2 for sign, image in images_of(coil))
        return float(ca.Function("lift", [height], [ca.gradient(energy, height)])(0.3))

    # dipoles 100 m apart against images 0.6 m apart
    assert lift(corner_images) == pytest.approx(lift(plane_images), rel=1e-5)


def normal_flux_share(length):
    """Flux through a circular guideway of 2 m at the coil's middle, over the field there without it."""
    coil = WireLoop.rectangle(0.5, length).placed((0.0, 0.2, -1.6), roll=0.1)
    angles = np.linspace(-0.5, 0.5, 9) - np.pi / 2
    normal = np.stack([np.zeros(9), np.cos(angles), np.sin(angles)], axis=1)
    alone = np.sum(magnetic_field(coil, 1.0, 2.0 * normal) * normal, axis=1)
    through = np.sum(total_field(coil, circular_images(coil, 2.0), 2.0 * normal) * normal, axis=1)
    return np.abs(through).max() / np.abs(alone).max()


def test_inversion_keeps_flux_out_of_a_circular_guideway_if_the_coil_is_long():
    shares = [normal_flux_share(length) for length in (3.0, 10.0, 100.0)]
    assert shares[0] < 0.02  # the report's coil: the limit stated in the docstring
    assert shares[1] < 0.0025
    assert shares[2] < shares[1] / 50  # nearly two-dimensional: falls with the square of the length


def energy_and_image_force(length):
    """Force in y and z on a coil in a circle of 2 m: derivative of the energy; and of the image held fixed."""
    y, z = ca.SX.sym("y"), ca.SX.sym("z")
    coil = WireLoop.rectangle(0.5, length)
    moving = coil.placed((0.0, y, z))
    energy = sum(sign * mutual_inductance(moving, image) / 2 for sign, image in circular_images(moving, 2.0))
    force = ca.Function("F", [y, z], [1e6 * ca.gradient(energy, ca.vertcat(y, z))])(0.3, -1.5).full().ravel()
    placed = coil.placed((0.0, 0.3, -1.5))
    ((sign, image),) = circular_images(placed, 2.0)
    return force, lorentz_force(image, 1e3 * sign, placed, 1e3, panels=200)[0][1:]


def test_the_energy_of_a_long_coil_in_a_circle_gives_the_force_of_the_fixed_image():
    # the image is stretched as the coil moves: only half the energy as a whole has the right derivative
    errors = [np.abs(a - b).max() / np.abs(b).max() for a, b in map(energy_and_image_force, (60.0, 600.0))]
    assert errors[0] < 2e-3  # two-dimensional but for the ends
    assert errors[1] < errors[0] / 5  # whose share falls with the length


def test_a_circle_of_large_radius_is_a_plane():
    radius = 1e5
    coil = WireLoop.rectangle(0.5, 3.0).placed((0.0, 0.0, 0.3 - radius))
    ((sign, image),) = circular_images(coil, radius)
    force, _ = lorentz_force(image, sign * 1e3, coil, 1e3)
    flat = WireLoop.rectangle(0.5, 3.0).placed((0.0, 0.0, 0.3))
    ((sign, image),) = plane_images(flat)
    plane_force, _ = lorentz_force(image, sign * 1e3, flat, 1e3)
    assert force[2] == pytest.approx(plane_force[2], rel=1e-4)  # 0.6 m over 1e5 m, and differences of 1e5


def test_a_circle_without_radius_is_refused():
    with pytest.raises(InputError, match=r"must be positive; got 0\.0 m\. Use plane_images for a plane"):
        circular_images(COIL, 0.0)
