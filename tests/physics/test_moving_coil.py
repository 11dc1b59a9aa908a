"""Lift and drag over a plate at finite speed."""

import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from workbench.constants import MU_0
from workbench.errors import InputError
from workbench.physics.coils import (
    REPORT_PLATE,
    Conductor,
    WireLoop,
    mutual_inductance,
    plane_forces,
    plane_images,
    sheet,
)
from workbench.physics.coils.conductor import reflection

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
    forces = plane_forces(width, length, height, speed, THIN)
    # exact for any coil and height, wave by wave: only rounding is left, whatever the quadrature does
    assert forces.lift_to_drag == pytest.approx(speed / THIN.characteristic_speed, rel=1e-12)


def test_lift_at_infinite_speed_is_that_of_the_image():
    height = ca.SX.sym("h")
    coil = WireLoop.rectangle(0.5, 3.0).placed((0.0, 0.0, height))
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
    M = mutual_inductance(WireLoop.rectangle(0.5, 1.0), WireLoop.rectangle(0.5, 1.0).placed((s, 0.0, z)))
    slopes = ca.Function("slopes", [s, z], [ca.gradient(M, z), ca.hessian(M, z)[0]])
    bounds = {"limit": 200, "points": (0.9, 1.1), "epsrel": 1e-9}
    tail, _ = quad(lambda x: float(slopes(x, 0.6 + x / ratio)[1]), 0, 60, **bounds)
    receding = -float(slopes(0.0, 0.6)[0]) - tail / ratio
    plate = plane_forces(0.5, 1.0, 0.3, ratio * THIN.characteristic_speed, THIN)
    assert plate.lift == pytest.approx(receding, rel=1e-6)  # the integral is cut at 60 m: (0.3/12)^4


def test_a_slab_becomes_a_thin_sheet_as_it_is_beaten_out():
    thin = Conductor(thickness=1e-4, conductivity=3.422e7, model="thin")
    slab = Conductor(thickness=1e-4, conductivity=3.422e7, model="slab")
    ours, limit = (plane_forces(0.5, 3.0, 0.3, 134.0, plate) for plate in (slab, thin))
    assert ours.lift == pytest.approx(limit.lift, rel=1e-3)  # first order in 0.1 mm over 0.3 m
    assert ours.drag == pytest.approx(limit.drag, rel=1e-3)


def test_a_thick_slab_is_a_half_space():
    slab = Conductor(thickness=1.0, conductivity=3.422e7)
    ours, limit = (plane_forces(0.5, 3.0, 0.3, 134.0, plate) for plate in (slab, HALF_SPACE))
    assert ours.lift == pytest.approx(limit.lift, rel=1e-4)  # waves longer than the metre of metal see the bottom
    assert ours.drag == pytest.approx(limit.drag, rel=1e-4)


def test_lift_rises_with_speed_and_ends_at_the_image_lift():
    ratios = [plane_forces(0.5, 3.0, 0.3, speed, SLAB).lift_ratio for speed in (1, 4, 16, 64, 256, 1e5)]
    assert ratios == sorted(ratios)
    assert 0.98 < ratios[-1] < 1


def test_drag_peaks_at_low_speed():
    drags = [plane_forces(0.5, 3.0, 0.3, speed, SLAB).drag for speed in (1.0, 4.0, 16.0, 134.0)]
    assert max(drags) == drags[1]


@pytest.mark.parametrize("speed", [0.5, 134.0, 1e4])
@pytest.mark.parametrize("height", [1e-4, 0.0037, 0.05, 0.3, 3.0])
def test_the_accuracy_asked_for_is_reached_at_every_height(height, speed):
    rough, ours, finer = (plane_forces(0.5, 3.0, height, speed, REPORT_PLATE, accuracy=a) for a in (1e-4, 1e-9, 1e-12))
    for value in ("lift", "drag", "lift_infinite"):
        assert getattr(ours, value) == pytest.approx(getattr(finer, value), rel=5e-9)  # the estimate is good to a few
        assert getattr(rough, value) == pytest.approx(getattr(finer, value), rel=1e-4)
    assert ours.by_height == pytest.approx(finer.by_height, rel=5e-9)


@settings(max_examples=5, deadline=None)
@given(height=st.floats(0.15, 0.8), speed=st.floats(1.0, 300.0), width=st.floats(0.3, 1.0), length=st.floats(0.5, 3.0))
def test_the_integral_is_that_of_narrow_panels_which_resolve_every_wave(height, speed, width, length):
    # by hand, with Gauss points on panels of half a wave of the coil's spectrum
    x, wx = narrow(11.0 / height, length)
    y, wy = narrow(11.0 / height, width)
    k = np.hypot(x[:, None], y)
    spectrum = (2 * np.sin(x * length / 2) / x)[:, None] ** 2 * (2 * np.sin(y * width / 2) / y) ** 2
    lift = wx @ (MU_0 / (2 * np.pi**2) * k**2 * spectrum * np.exp(-2 * k * height)) @ wy
    assert plane_forces(width, length, height, speed, SLAB).lift_infinite == pytest.approx(lift, rel=1e-8)


def narrow(end: float, side: float) -> tuple[np.ndarray, np.ndarray]:
    low = np.geomspace(1e-6, 1e-2, 15) * end
    edges = np.concatenate([[0.0], low, np.arange(0.01 * end, end, 1.5 / side)[1:], [end]])
    t, w = np.polynomial.legendre.leggauss(8)
    half = np.diff(edges)[:, None] / 2
    return (edges[:-1, None] + half * (1 + t)).ravel(), (half * w).ravel()


def test_over_a_plate_nearly_touched_a_side_of_the_coil_is_a_long_wire():
    # an endless wire over its image: lift μ0/(4π h) per metre; the coil has 2 (width + length) of it, less its corners
    h = 1e-4
    near = plane_forces(0.5, 3.0, h, 134.0, SLAB)
    assert near.lift_infinite == pytest.approx(MU_0 / (4 * np.pi * h) * 7.0, rel=3 * h / 0.5)
    assert near.by_height[2] == pytest.approx(-near.lift_infinite / h, rel=3 * h / 0.5)


def test_a_coil_close_to_the_plate_costs_no_more_memory_than_one_far_off(monkeypatch):
    largest = []
    whole = sheet._integrand

    def counted(model):
        function = whole(model)

        class Counted:
            def map(self, size):
                largest.append(size)
                return function.map(size)

        return Counted()

    monkeypatch.setattr(sheet, "_integrand", counted)
    plane_forces(0.5, 1.5, 0.0037 + 1e-9, 134.0, SLAB)
    assert max(largest) <= sheet.BLOCK
    assert sum(largest) < 300_000  # 13 million before


def test_an_accuracy_out_of_reach_is_refused_with_what_was_reached(monkeypatch):
    monkeypatch.setattr(sheet, "ORDERS", (6, 7))
    with pytest.raises(
        InputError, match=r"integrated to 1e-12; at a height of 0.0123 m and 134 m/s the last two rules"
    ):
        plane_forces(0.5, 3.0, 0.0123, 134.0, SLAB, accuracy=1e-12)
    with pytest.raises(InputError, match=r"must lie within a factor 1e\+09 of each other; got 0.5, 3 and 1e-300 m"):
        plane_forces(0.5, 3.0, 1e-300, 134.0, SLAB)


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
