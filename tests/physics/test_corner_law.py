"""The exact law of a coil set over the L-corner."""

import math

import casadi as ca
import magpylib
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.physics.coils import WireLoop, corner_images, lorentz_force
from workbench.physics.forces.corner import CornerLaw, pair_coefficients
from workbench.physics.forces.energy import REPORT_COILS, CoilSet
from workbench.physics.forces.law import ForceLaw
from workbench.physics.forces.operating import law_at

LAW = law_at()
COIL = WireLoop.rectangle(0.5, 3.0)
DEVIATION = {
    "dh": st.floats(-0.08, 0.15),
    "dhp": st.floats(-0.08, 0.15),
    "roll": st.floats(-0.05, 0.05),
    "alpha": st.floats(-0.5, 0.5),
}


def unit_law(coils=REPORT_COILS, order=8):
    """One kiloampere-turn at infinite speed: coefficients as in the report's figures."""
    return CornerLaw(coils=coils, gap=0.3, gap_lateral=0.3, current=1e3, lift_ratio=1.0, drag_ratio=0.0, order=order)


def image_forces(coils, gap, gap_lateral, alpha, **angles):
    """Force and torque on the set by Biot-Savart and Lorentz, images held fixed; per kA² of the main coil."""
    centre = (0.0, gap_lateral + coils.width / 2, gap)
    loops = ((coils.main.placed(centre, **angles), 1.0), (coils.control.placed(centre, **angles), alpha))
    force, torque = np.zeros(3), np.zeros(3)
    for loop, current in loops:
        for other, other_current in loops:
            for sign, image in corner_images(other):
                pull = lorentz_force(image, 1e3 * sign * other_current, loop, 1e3 * current, about=centre)
                force, torque = force + pull[0], torque + pull[1]
    return force, torque


def test_lift_of_one_coil_over_the_corner_is_the_printed_one():
    # A.3: 0.7187 N/(kA-turn)², four printed digits
    assert unit_law().forces(0.0, 0.0, 0.0, 0.0)[0] == pytest.approx(0.7187, abs=5e-5)


def test_four_contributions_are_those_of_the_figures():
    # forces on coil of h, h' by the images of a coil d below: rows (a) to (d) of Figure A-8's table; values read
    # from no figure (they are lost) but fixed by the expansion, where (b) + (c) is the α term and (d) the α² term
    rows = [
        np.array(pair_coefficients(COIL, COIL.placed((0.0, 0.0, -d)), 0.5, h, 0.3, 0.0)) * 1e6
        for h, d in ((0.3, 0.0), (0.3, 0.1), (0.2, -0.1), (0.2, 0.0))
    ]
    a, b, c, d = (row[0] for row in rows)
    scale = 0.8380 * 184635
    assert a * scale == pytest.approx(1.1120e5, abs=13)  # four digits of f times 154724, and five digits of F_L0
    assert (b + c) * scale == pytest.approx(3.3981e5, abs=21)  # two such f
    assert d * scale == pytest.approx(2.7177e5, abs=13)


@settings(max_examples=15, deadline=None)
@given(**DEVIATION)
def test_contributions_referred_to_the_main_coil_add_up_to_the_set(dh, dhp, roll, alpha):
    h, hp, d = 0.3 + dh, 0.3 + dhp, 0.1
    hc, hpc = h - d * math.cos(roll), hp + d * math.sin(roll)
    below, above = COIL.placed((0.0, 0.0, -d)), COIL.placed((0.0, 0.0, d))
    on_main = np.array(pair_coefficients(COIL, COIL, 0.5, h, hp, roll))
    on_main = on_main + alpha * np.array(pair_coefficients(COIL, below, 0.5, h, hp, roll))
    on_control = alpha * np.array(pair_coefficients(COIL, above, 0.5, hc, hpc, roll))
    on_control = on_control + alpha**2 * np.array(pair_coefficients(COIL, COIL, 0.5, hc, hpc, roll))
    # moving the control coil's force to the main centre line: arm (y, z) = (d sin φ, -d cos φ), both components count
    arm = d * math.sin(roll) * on_control[0] + d * math.cos(roll) * on_control[1]
    total = 1e6 * (on_main + on_control + [0.0, 0.0, arm])
    assert total == pytest.approx(np.array(unit_law().forces(dh, dhp, roll, alpha)), rel=1e-6, abs=1e-7)


@settings(max_examples=8, deadline=None)
@given(**DEVIATION)
def test_energy_derivatives_are_the_lorentz_forces_of_fixed_images(dh, dhp, roll, alpha):
    force, torque = image_forces(REPORT_COILS, 0.3 + dh, 0.3 + dhp, alpha, roll=roll)
    # 12 points on the coil ends: 1.4e-10 at 0.2 m from floor and wall, worse when closer
    ours = unit_law(order=12).forces(dh, dhp, roll, alpha)
    assert ours == pytest.approx((force[2], force[1], torque[0]), rel=1e-6, abs=1e-7)


def test_forces_of_a_rolled_coil_are_magpylibs():
    centre = (0.0, 0.55, 0.3)
    coil = COIL.placed(centre, roll=0.1)
    target = magpylib.current.Polyline(current=1e3, vertices=[*coil.vertices, coil.vertices[0]])
    images = [
        magpylib.current.Polyline(current=1e3 * sign, vertices=[*image.vertices, image.vertices[0]])
        for sign, image in corner_images(coil)
    ]
    force, torque = np.array(magpylib.getFT(images, target, pivot=centre, meshing=2000)).sum(axis=1)
    ours = unit_law().forces(0.0, 0.0, 0.1, 0.0)
    assert ours == pytest.approx((force[2], force[1], torque[0]), rel=2e-5)  # the mesh error of magpylib: 1e-6 of F


@settings(max_examples=15, deadline=None)
@given(**DEVIATION)
def test_stiffness_is_symmetric_at_every_pose(dh, dhp, roll, alpha):
    stiffness = LAW.stiffness(dh, dhp, roll, alpha)
    assert stiffness == pytest.approx(stiffness.T, rel=1e-8, abs=1e-3)  # rounding; entries reach 1e6


@settings(max_examples=10, deadline=None)
@given(**DEVIATION)
def test_stiffness_is_the_slope_of_the_forces(dh, dhp, roll, alpha):
    x = ca.SX.sym("x", 4)
    forces = ca.vertcat(*LAW.forces(*ca.vertsplit(x)))
    slopes = ca.Function("slopes", [x], [ca.jacobian(forces, x)])([dh, dhp, roll, alpha]).full()
    assert LAW.stiffness(dh, dhp, roll, alpha) == pytest.approx(slopes[:, :3], rel=1e-9, abs=1e-3)
    assert LAW.current_action(dh, dhp, roll, alpha) == pytest.approx(slopes[:, 3], rel=1e-9, abs=1e-3)


@pytest.mark.parametrize(("h", "hp", "size"), [(0.2, 0.5, 0.25), (0.4, 0.2, 5.0)])
def test_forces_do_not_depend_on_the_size_of_the_whole_scene(h, hp, size):
    # all lengths scaled, currents kept: F is a pure number times μ0 I²
    def lift(k):
        sizes = {"width": 0.5 * k, "length": 3 * k, "control_width": 0.5 * k, "control_length": 3 * k}
        coils = CoilSet(**sizes, control_offset=(0.0, 0.0, -0.1 * k))
        law = CornerLaw(coils=coils, gap=h * k, gap_lateral=hp * k, current=1e3, lift_ratio=1.0, drag_ratio=0.0)
        return law.forces(0.0, 0.0, 0.0, 0.3)[0]

    assert lift(size) == pytest.approx(lift(1.0), rel=1e-10)  # rounding


@settings(max_examples=10, deadline=None)
@given(alpha=st.floats(-0.4, 0.4), h=st.floats(0.25, 0.5))
def test_a_control_coil_upon_the_main_coil_only_adds_current(alpha, h):
    # placed 1 µm away in x, the control coil is the main coil: F(α) = (1 + α)² F(0)
    coils = CoilSet(width=0.5, length=3.0, control_width=0.5, control_length=3.0, control_offset=(1e-6, 0.0, 0.0))
    law = unit_law(coils)
    both, alone = (np.array(law.forces(h - 0.3, 0.0, 0.02, a)) for a in (alpha, 0.0))
    assert both == pytest.approx((1 + alpha) ** 2 * alone, rel=1e-6)  # first order in the micrometre


def test_a_level_coil_has_no_pitch_or_yaw_moment():
    *_, pitch, yaw = LAW.pose_forces(0.02, -0.03, 0.02, 0.0, 0.0, 0.2)
    assert abs(pitch) < 1e-6  # N m, beside a roll moment of 1e4: symmetry in x
    assert abs(yaw) < 1e-6


def test_without_pitch_and_yaw_the_pose_forces_are_the_forces():
    three, five = LAW.forces(0.02, -0.03, 0.02, 0.2), LAW.pose_forces(0.02, -0.03, 0.02, 0.0, 0.0, 0.2)
    assert five[:3] == pytest.approx(three, rel=1e-6)  # 16 against 8 points on the coil ends


@pytest.mark.slow  # another coil set, another expression of 130 000 operations
def test_a_tilted_coil_feels_the_lorentz_forces_about_all_axes():
    coils = CoilSet(width=0.5, length=3.0, control_width=0.4, control_length=2.0, control_offset=(0.3, 0.05, -0.08))
    angles = {"roll": 0.03, "pitch": 0.02, "yaw": -0.015}
    ours = unit_law(coils).pose_forces(0.0, 0.0, *angles.values(), 0.3)
    force, torque = image_forces(coils, 0.3, 0.3, 0.3, **angles)
    # 16 Gauss points on 3 m sides: 1e-7 of the force at these gaps
    assert ours == pytest.approx((force[2], force[1], *torque), rel=1e-6, abs=1e-7)


def test_nose_up_pitch_is_countered():
    *_, pitch_moment, _ = LAW.pose_forces(0.0, 0.0, 0.0, 0.01, 0.0, 0.0)
    # +y pitch lowers the front (x to -z): the front lifts more and the moment turns it back
    assert pitch_moment < 0
    # a stiff beam of L²/12 times the local stiffness, within the shortening of the coil by its ends
    assert pitch_moment == pytest.approx(-893.7e3 * 3.0**2 / 12 * 0.01, rel=0.3)


def test_forces_take_arrays_columns_and_symbols():
    gaps = np.linspace(-0.02, 0.02, 6).reshape(2, 3)
    lift, _, _ = LAW.forces(gaps, 0.0, 0.0, 0.1)
    assert lift.shape == (2, 3)
    column = LAW.forces(ca.DM(gaps.ravel()), 0.0, 0.0, 0.1)[0]
    assert column.shape == (6, 1)
    assert column.full().ravel() == pytest.approx(lift.ravel(), rel=1e-14)
    assert LAW.forces(float(gaps[1, 2]), 0.0, 0.0, 0.1)[0] == pytest.approx(lift[1, 2], rel=1e-14)
    x = ca.SX.sym("x", 2)
    assert LAW.forces(x, 0.0, 0.0, 0.0)[0].shape == (2, 1)
    assert isinstance(LAW, ForceLaw)


def test_drag_is_lift_and_lateral_force_over_the_ratio():
    lift, lateral, _ = LAW.forces(0.01, 0.0, 0.0, 0.1)
    assert LAW.drag(0.01, 0.0, 0.0, 0.1) == pytest.approx((lift + lateral) / 61.505, rel=1e-12)


@pytest.mark.parametrize(
    ("build", "sentence"),
    [
        (lambda: LAW.forces(-0.25, 0.0, 0.0, 0.0), r"must stay clear of the guideway; at this pose \(h = 0.05 m"),
        (lambda: LAW.forces(0.0, -0.35, 0.0, 0.0), "is 0.2 m over the floor and -0.05 m from the wall"),
        (lambda: LAW.stiffness(np.nan), "the coils must stay clear of the guideway"),
        (lambda: law_at(height_lateral=-0.3), "CornerLaw.gap_lateral must be positive and finite; got -0.3 m"),
        (lambda: law_at(current=0.0), "CornerLaw.current must be positive and finite; got 0.0 A"),
        (
            lambda: CoilSet(width=0.5, length=3.0, control_width=0.5, control_length=3.0, control_offset=(0, 0, 0)),
            "control_offset must be three finite lengths, not all zero",
        ),
        (
            lambda: CoilSet(width=-0.5, length=3.0, control_width=0.5, control_length=3.0, control_offset=(0, 0, -0.1)),
            "CoilSet.width must be positive and finite; got -0.5 m",
        ),
    ],
)
def test_impossible_poses_and_coils_are_refused_with_a_sentence(build, sentence):
    with pytest.raises(InputError, match=sentence):
        build()
