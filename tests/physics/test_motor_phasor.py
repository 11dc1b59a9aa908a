"""The plane-wave phasor against a Lorentz sum over filaments, and against its own symmetries."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.physics.coils import WireLoop, magnetic_field, rectangle_row
from workbench.physics.motor import REPORT_COIL, REPORT_WINDING, VehicleCoil, Winding, mutual_phasor
from workbench.physics.motor.kernel import quadrature, sinhc, sinhc_jet
from workbench.physics.motor.phasor import rotation
from workbench.physics.motor.winding import rectangular_bundle

PITCH = 1.1
FINE = {"places": 48, "order": 48, "panels": 3}
TO_TRACK = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]])  # motor axes (x, y, z) to coil axes (along, lateral, normal)


def random_pose(seed: int, gap: float) -> np.ndarray:
    """A pose whose centre is at `gap`, shifted by up to 0.2 m and turned by up to 0.1 rad about every axis."""
    rng = np.random.default_rng(seed)
    return np.array([rng.uniform(-0.2, 0.2), gap, rng.uniform(-1, 1), *rng.uniform(-0.1, 0.1, 3)])


def filament_phasor(pose, harmonic=1, places=16, count=61, order=32, panels=2):
    """(6,) complex force and torque per ampere² by Biot-Savart and Lorentz over a long finite row, then Fourier.

    Nothing of the plane-wave route: closed-form field of every filament, Gauss sum of I ds × B along the coil,
    sixteen places over half a period. The last rectangle at either end counts half, so that the alternating tail is
    averaged.
    """
    t, weight = np.polynomial.legendre.leggauss(order)
    t = np.concatenate([(panel + (1 + t) / 2) / panels for panel in range(panels)])
    weight = np.tile(weight / 2 / panels, panels)
    R = np.asarray(rotation(*pose[3:].tolist()))
    # counter-clockwise seen from +y: the boundary of area vector e2 × e1
    corner = np.array([(-1, 0, -1.1), (-1, 0, 1.1), (1, 0, 1.1), (1, 0, -1.1)]) / 2 @ R.T
    sides = np.roll(corner, -1, axis=0) - corner
    points = (corner[:, None] + t[:, None] * sides[:, None]).reshape(-1, 3)
    elements = (weight[:, None] * sides[:, None]).reshape(-1, 3)
    z = np.arange(places) * PITCH / places
    centres = np.array(pose[:3]) + np.outer(z, (0, 0, 1))
    everywhere = (centres[:, None] + points).reshape(-1, 3) @ TO_TRACK.T
    field = np.zeros_like(everywhere)
    row = rectangle_row(1.0, 1.1, count)
    for number, (sign, loop) in enumerate(row):
        field += sign * (0.5 if number in (0, count - 1) else 1.0) * magnetic_field(loop, 1.0, everywhere)
    field = (field @ TO_TRACK).reshape(places, -1, 3)
    pull = np.cross(elements, field)
    wrench = np.concatenate([pull.sum(axis=1), np.cross(points, pull).sum(axis=1)], axis=1)
    kappa = np.pi / PITCH
    return 2 / places * np.exp(-1j * harmonic * kappa * z) @ wrench


@pytest.mark.parametrize(
    ("gap", "seed", "sum_of"), [(0.25, 1, {}), (0.25, 2, {}), (0.3, 3, {}), (0.15, 4, FINE), (0.15, 5, FINE)]
)
def test_force_and_torque_are_those_of_a_long_row_of_filaments(gap, seed, sum_of):
    # tolerance: what the production kernel promises from 25 cm and at 15 cm; the sum's own error (row of 61, points
    # a side, alias of harmonic 2·places − 1) is below it, at 15 cm only with a fine sum: the lowest corner is at 5 cm
    tolerance = 1e-6 if gap >= 0.25 else 1e-4
    pose = random_pose(seed, gap)
    exact = filament_phasor(pose, **sum_of)
    found = mutual_phasor(pose, REPORT_WINDING, REPORT_COIL, order=1).gradient[0]
    for kind in (slice(0, 3), slice(3, 6)):
        assert np.linalg.norm(found[kind] - exact[kind]) < tolerance * np.linalg.norm(exact[kind])


@pytest.mark.parametrize("harmonic", [5, 7])
def test_ripple_harmonics_are_those_of_a_long_row_of_filaments(harmonic):
    # 1e-5: they are 40 to 200 times weaker than the fundamental, whose sum is good to 1e-7
    pose = random_pose(5, 0.3)
    exact = filament_phasor(pose, harmonic)
    found = mutual_phasor(pose, REPORT_WINDING, REPORT_COIL, harmonic=harmonic, order=1).gradient[0]
    assert np.linalg.norm(found - exact) < 1e-5 * np.linalg.norm(exact)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10, 30))
def test_twenty_random_poses_from_25_centimetres_agree_with_filaments_to_a_millionth(seed):
    pose = random_pose(seed, 0.25 + 0.2 * (seed % 3) / 2)
    exact = filament_phasor(pose, places=20)
    found = mutual_phasor(pose, REPORT_WINDING, REPORT_COIL, order=1).gradient[0]
    for kind in (slice(0, 3), slice(3, 6)):
        assert np.linalg.norm(found[kind] - exact[kind]) < 1e-6 * np.linalg.norm(exact[kind])


def test_mutual_inductance_of_all_harmonics_is_that_of_a_row_of_rectangles():
    # parallel rectangles: Neumann's closed form, exact but for the ends of the row (half weight, below 1e-8)
    from workbench.physics.coils import mutual_inductance

    pose = (0.1, 0.3, 0.35)
    coil = WireLoop.rectangle(1.0, 1.1).placed((pose[2], pose[0], pose[1]))
    row = rectangle_row(1.0, 1.1, 61)
    ends = (0, len(row) - 1)
    exact = sum(sign * (0.5 if i in ends else 1) * mutual_inductance(loop, coil) for i, (sign, loop) in enumerate(row))
    found = sum(
        mutual_phasor((*pose, 0, 0, 0), REPORT_WINDING, REPORT_COIL, harmonic=m, order=0).value[0].real
        for m in range(1, 33, 2)
    )
    assert found == pytest.approx(exact, rel=1e-7)


@pytest.mark.parametrize("gap", [0.05, 0.15, 0.3, 1.34])
def test_quadrature_keeps_its_accuracy_at_every_gap(gap):
    # the default asks for 1e-9 of the value; gradients carry one, Hessians two powers of the wave number more
    pose = random_pose(7, gap) * ([1, 1, 1, 0, 0.5, 0] if gap < 0.1 else [1] * 6)
    rough = mutual_phasor(pose, REPORT_WINDING, REPORT_COIL)
    fine = mutual_phasor(pose, REPORT_WINDING, REPORT_COIL, accuracy=1e-13)
    for a, b, tolerance in (
        (rough.value, fine.value, 1e-9),
        (rough.gradient, fine.gradient, 1e-7),
        (rough.hessian, fine.hessian, 1e-6),
    ):
        assert np.linalg.norm(a - b) < tolerance * np.linalg.norm(b)


def test_the_lower_the_coil_the_more_waves_are_summed():
    low, high = (len(quadrature(np.array([gap]), np.array([0.5]), 2.9, 1.0, 1e-9)[0]) for gap in (0.15, 0.3))
    assert low > high


def test_stiffness_is_how_the_forces_change():
    # central difference of the gradient, step 1e-5: truncation 1e-10 of the third derivative's scale, rounding 1e-9
    pose, step = random_pose(11, 0.3), 1e-5
    phasor = mutual_phasor(pose, REPORT_WINDING, REPORT_COIL, pivot=(0.1, -0.8, 0.3), accuracy=1e-13)
    both = [
        mutual_phasor(
            pose + s * step * np.eye(6), REPORT_WINDING, REPORT_COIL, pivot=(0.1, -0.8, 0.3), order=1, accuracy=1e-13
        )
        for s in (-1, 1)
    ]
    slope = ((both[1].gradient - both[0].gradient) / (2 * step)).T
    assert np.abs(slope - phasor.hessian[0]).max() < 1e-7 * np.abs(slope).max()


def test_force_is_the_slope_of_mutual_inductance():
    # step 1e-5, as above
    pose, step = random_pose(12, 0.3), 1e-5
    values = [
        mutual_phasor(pose + s * step * np.eye(6)[:3], REPORT_WINDING, REPORT_COIL, order=0, accuracy=1e-13).value
        for s in (-1, 1)
    ]
    gradient = mutual_phasor(pose, REPORT_WINDING, REPORT_COIL, order=1).gradient[0, :3]
    slope = (values[1] - values[0]) / (2 * step)
    assert np.abs(slope - gradient).max() < 1e-7 * np.abs(gradient).max()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6), arm=st.tuples(*[st.floats(-1, 1)] * 3))
def test_torque_about_a_pivot_is_torque_about_the_centre_plus_arm_times_force(seed, arm):
    # unturned coil: the pivot's lever arm is −arm; rounding only
    pose = random_pose(seed, 0.3)
    pose[3:] = 0
    here, there = (
        mutual_phasor(pose, REPORT_WINDING, REPORT_COIL, pivot=p, order=1).gradient[0] for p in ((0, 0, 0), arm)
    )
    assert np.allclose(there[:3], here[:3], rtol=0, atol=1e-12 * np.abs(here).max())
    expected = here[3:] + np.cross(-np.array(arm), here[:3])
    assert np.allclose(there[3:], expected, rtol=0, atol=1e-12 * np.abs(here).max())


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_field_is_harmonic_so_the_force_stiffnesses_of_any_pose_add_to_zero(seed):
    # Earnshaw; 1e-7 is the quadrature's error of a Hessian
    hessian = mutual_phasor(random_pose(seed, 0.3), REPORT_WINDING, REPORT_COIL).hessian[0]
    assert abs(np.trace(hessian[:3, :3])) < 1e-7 * np.abs(hessian[:3, :3]).max()


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6), shift=st.floats(-3, 3))
def test_a_step_along_the_track_turns_the_phase_and_nothing_else(seed, shift):
    pose = random_pose(seed, 0.3)
    moved = pose + np.array([0, 0, shift, 0, 0, 0])
    a, b = (mutual_phasor(p, REPORT_WINDING, REPORT_COIL, order=1).gradient[0] for p in (pose, moved))
    # exact in the formula; rounding of the phases
    assert np.allclose(b, a * np.exp(1j * np.pi / PITCH * shift), rtol=0, atol=1e-11 * np.abs(a).max())


@pytest.mark.parametrize("yaw", [0.0, np.pi / 4, np.pi / 2, np.arctan(1 / np.sinh(0.5)), 3.0])
def test_no_angle_is_singular(yaw):
    # at some of these an edge lies along a wave front; a coil turned by π/2 and one of swapped sides are the same
    turned = mutual_phasor((0.05, 0.3, 0.1, 0, yaw, 0), REPORT_WINDING, REPORT_COIL)
    for part in (turned.value, turned.gradient, turned.hessian):
        assert np.all(np.isfinite(part))
    if yaw == np.pi / 2:
        swapped = mutual_phasor((0.05, 0.3, 0.1, 0, 0, 0), REPORT_WINDING, VehicleCoil(width=1.1, length=1.0))
        assert turned.value[0] == pytest.approx(swapped.value[0], rel=1e-9)
        assert np.allclose(turned.gradient[0], swapped.gradient[0], rtol=0, atol=1e-8 * np.abs(swapped.gradient).max())


@pytest.mark.parametrize("a", [0.0, 1e-8, 0.01j, 0.05, 0.05 + 0.03j, 0.2j, 1 - 2j, 3 + 30j])
def test_sinhc_and_its_derivatives_are_right_through_zero(a):
    # the blend of quotient and series is good to 1e-10 in value and slope and to 2e-7 in curvature (its docstring)
    points = a + 0.5 * np.exp(2j * np.pi * np.arange(32) / 32)  # Cauchy's integral over a circle
    values = np.sinh(points) / points
    for order, tolerance in ((0, 1e-10), (1, 1e-8), (2, 2e-7)):
        factorial = (1, 1, 2)[order]
        exact = factorial * np.mean(values * (0.5 * np.exp(2j * np.pi * np.arange(32) / 32)) ** -order)
        real, imaginary = sinhc_jet(np.real(a), np.imag(a), 2)[order]
        scale = max(1.0, abs(np.sinh(a)))
        assert complex(float(real), float(imaginary)) == pytest.approx(exact, abs=tolerance * scale)


def test_sinhc_takes_symbols():
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    f = ca.Function("f", [x, y], list(sinhc(x, y)))
    assert float(f(0.0, 0.0)[0]) == 1.0


def test_many_poses_give_what_each_gives_alone():
    poses = np.array([random_pose(seed, 0.3) for seed in range(5)])
    together = mutual_phasor(poses, REPORT_WINDING, REPORT_COIL)
    for i, pose in enumerate(poses):
        alone = mutual_phasor(pose, REPORT_WINDING, REPORT_COIL)
        # the worst pose chooses the nodes for all; both are good to the quadrature's 1e-9 (value), 1e-7 (Hessian)
        assert together.value[i] == pytest.approx(alone.value[0], rel=1e-8)
        assert np.allclose(together.hessian[i], alone.hessian[0], rtol=0, atol=1e-7 * np.abs(alone.hessian).max())


def test_a_thick_conductor_pulls_less_than_a_filament_at_its_top_and_more_than_one_at_its_bottom():
    def lift(filaments):
        winding = Winding(pole_pitch=1.1, width=1.0, length=1.1, filaments=filaments)
        return abs(mutual_phasor((0, 0.3, 0, 0, 0, 0), winding, REPORT_COIL, order=1).gradient[0, 1])

    bundle = lift(rectangular_bundle(0.02, 0.02, 2, 2))
    assert lift(((0.01, 0.02),)) < bundle < lift(((0.01, 0.0),))


@pytest.mark.parametrize(
    ("pose", "sentence"),
    [
        ((0, 0.0, 0, 0, 0, 0), "must clear the winding by 5 mm"),
        ((0, 0.3, 0, 0, 0, 0.7), "must clear the winding by 5 mm"),
        ((0, np.nan, 0, 0, 0, 0), "six finite numbers"),
        ((0, 0.3, 0), "six finite numbers"),
    ],
)
def test_a_pose_that_cannot_be_is_refused(pose, sentence):
    with pytest.raises(InputError, match=sentence):
        mutual_phasor(pose, REPORT_WINDING, REPORT_COIL)


def test_even_harmonics_and_idle_accuracies_and_pivots_are_refused():
    pose = (0, 0.3, 0, 0, 0, 0)
    with pytest.raises(InputError, match="harmonic must be odd and positive; got 2"):
        mutual_phasor(pose, REPORT_WINDING, REPORT_COIL, harmonic=2)
    with pytest.raises(InputError, match="accuracy must lie between"):
        mutual_phasor(pose, REPORT_WINDING, REPORT_COIL, accuracy=0.5)
    with pytest.raises(InputError, match="three finite coordinates"):
        mutual_phasor(pose, REPORT_WINDING, REPORT_COIL, pivot=(0, 1))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"length": 1.2}, "must not overlap"),
        ({"width": -1.0}, "Winding.width must be positive"),
        ({"filaments": ()}, "at least one"),
        ({"filaments": ((0.6, 0.0),)}, "inside its coil"),
        ({"filaments": ((0.0, -0.1),)}, "depth must not be negative"),
        ({"filaments": ((0.0, float("inf")),)}, "two finite lengths"),
    ],
)
def test_a_winding_that_cannot_be_built_is_refused(change, sentence):
    with pytest.raises(InputError, match=sentence):
        Winding(**{"pole_pitch": 1.1, "width": 1.0, "length": 1.1, **change})
