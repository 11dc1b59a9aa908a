"""Lift and drag over a plate at finite speed."""

import math

import casadi as ca
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from workbench.coils import REPORT_PLATE, Conductor, Loop, mutual_inductance, plane_forces, plane_images
from workbench.coils.conductor import reflection
from workbench.errors import InputError

THIN = Conductor(thickness=0.0254, conductivity=3.422e7, model="thin")
SLAB = Conductor(thickness=0.0254, conductivity=3.422e7)
HALF_SPACE = Conductor(thickness=0.0254, conductivity=3.422e7, model="half_space")


@settings(max_examples=10, deadline=None)
@given(
    speed=st.floats(0.5, 300.0),
    height=st.floats(0.25, 0.8),
    width=st.floats(0.3, 1.0),
    length=st.floats(0.5, 4.0),
)
def test_lift_over_drag_of_a_thin_sheet_is_speed_over_characteristic_speed(speed, height, width, length):
    forces = plane_forces(width, length, height, speed, THIN, order=6)
    # exact for any coil and height, wave by wave: only rounding is left, whatever the quadrature does
    assert forces.lift_to_drag == pytest.approx(speed / THIN.characteristic_speed, rel=1e-12)


def test_lift_at_infinite_speed_is_that_of_the_image():
    height = ca.SX.sym("h")
    coil = Loop.rectangle(0.5, 3.0).placed((0.0, 0.0, height))
    ((sign, image),) = plane_images(coil)
    energy = sign * mutual_inductance(coil, image) / 2
    slopes = ca.Function("f", [height], [ca.gradient(energy, height), ca.hessian(energy, height)[0]])
    for h in (0.15, 0.3, 0.6):
        force, slope = (float(value) for value in slopes(h))
        over_plate = plane_forces(0.5, 3.0, h, 134.0, SLAB)
        assert over_plate.lift_infinite == pytest.approx(force, rel=2e-9)  # the stated accuracy of order 8
        assert over_plate.by_height[2] == pytest.approx(slope, rel=1e-7)  # the derivative weighs short waves more


def test_thin_sheet_lift_is_that_of_receding_images():
    # Maxwell's images recede at w: F_L = I² [-M_z(0, 2h) - (w/v) ∫ M_zz(s, 2h + s w/v) ds], no Fourier in it
    ratio = 5.0  # v/w
    s, z = ca.SX.sym("s"), ca.SX.sym("z")
    M = mutual_inductance(Loop.rectangle(0.5, 1.0), Loop.rectangle(0.5, 1.0).placed((s, 0.0, z)))
    slopes = ca.Function("slopes", [s, z], [ca.gradient(M, z), ca.hessian(M, z)[0]])
    bounds = {"limit": 200, "points": (0.9, 1.1), "epsrel": 1e-9}
    tail, _ = quad(lambda x: float(slopes(x, 0.6 + x / ratio)[1]), 0, 60, **bounds)
    receding = -float(slopes(0.0, 0.6)[0]) - tail / ratio
    sheet = plane_forces(0.5, 1.0, 0.3, ratio * THIN.characteristic_speed, THIN)
    assert sheet.lift == pytest.approx(receding, rel=1e-6)  # the integral is cut at 60 m: (0.3/12)^4


def test_a_slab_becomes_a_thin_sheet_as_it_is_beaten_out():
    thin = Conductor(thickness=1e-4, conductivity=3.422e7, model="thin")
    slab = Conductor(thickness=1e-4, conductivity=3.422e7, model="slab")
    ours, limit = (plane_forces(0.5, 3.0, 0.3, 134.0, plate, order=6) for plate in (slab, thin))
    assert ours.lift == pytest.approx(limit.lift, rel=1e-3)  # first order in 0.1 mm over 0.3 m
    assert ours.drag == pytest.approx(limit.drag, rel=1e-3)


def test_a_thick_slab_is_a_half_space():
    slab = Conductor(thickness=1.0, conductivity=3.422e7)
    ours, limit = (plane_forces(0.5, 3.0, 0.3, 134.0, plate, order=6) for plate in (slab, HALF_SPACE))
    assert ours.lift == pytest.approx(limit.lift, rel=1e-4)  # waves longer than the metre of metal see the bottom
    assert ours.drag == pytest.approx(limit.drag, rel=1e-4)


def test_lift_rises_with_speed_and_ends_at_the_image_lift():
    ratios = [plane_forces(0.5, 3.0, 0.3, speed, SLAB, order=6).lift_ratio for speed in (1, 4, 16, 64, 256, 1e5)]
    assert ratios == sorted(ratios)
    assert 0.98 < ratios[-1] < 1


def test_drag_peaks_at_low_speed():
    drags = [plane_forces(0.5, 3.0, 0.3, speed, SLAB, order=6).drag for speed in (1.0, 4.0, 16.0, 134.0)]
    assert max(drags) == drags[1]


def test_more_points_do_not_change_the_ninth_digit():
    ours, finer = (plane_forces(0.5, 3.0, 0.3, 134.0, REPORT_PLATE, order=order) for order in (8, 12))
    assert ours.lift == pytest.approx(finer.lift, rel=2e-9)  # as the docstring says
    assert ours.drag == pytest.approx(finer.drag, rel=2e-9)


def test_slope_of_the_lift_ratio_is_its_slope():
    above, here, below = (plane_forces(0.5, 3.0, h, 134.0, SLAB) for h in (0.301, 0.3, 0.299))
    slope = (above.lift_ratio - below.lift_ratio) / 0.002
    assert here.lift_ratio_by_height == pytest.approx(slope, rel=1e-4)  # third derivative times 1e-6


def test_reflection_never_exceeds_one_and_never_pushes_forward():
    kx, ky, speed = (ca.SX.sym(name) for name in ("kx", "ky", "v"))
    for plate in (THIN, SLAB, HALF_SPACE):
        values = reflection(kx, ky, speed, plate.thickness, plate.conductivity, plate.model)
        function = ca.Function("R", [kx, ky, speed], values)
        for point in ((1e-4, 0.1, 10.0), (1.0, 1.0, 134.0), (30.0, 0.1, 300.0), (0.1, 30.0, 1.0)):
            lifting, dragging = (float(value) for value in function(*point))
            assert 0 < lifting < 1
            assert 0 < dragging <= 0.5 + 1e-12  # the half circle of the thin sheet is the outermost


@pytest.mark.parametrize(
    ("build", "sentence"),
    [
        (lambda: Conductor(thickness=0.0, conductivity=3e7), "thickness must be positive and finite; got 0.0 m"),
        (lambda: Conductor(thickness=0.02, conductivity=-1.0), "must be positive and finite; got -1.0 S/m"),
        (lambda: Conductor(thickness=0.02, conductivity=3e7, model="slob"), "'slob'; did you mean 'slab'"),
        (lambda: plane_forces(0.5, 3.0, 0.0, 134.0, SLAB), "height must be positive and finite; got 0.0 m"),
        (lambda: plane_forces(0.5, 3.0, 0.3, math.nan, SLAB), "speed must be positive and finite; got nan m/s"),
    ],
)
def test_what_is_not_a_plate_or_a_flight_is_refused_with_a_sentence(build, sentence):
    with pytest.raises(InputError, match=sentence):
        build()
