"""Mutual inductance against closed forms, brute force and another library."""

import math

import casadi as ca
import magpylib
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.physics.coils import WireLoop, lorentz_force, magnetic_field, mutual_inductance, rectangle_row
from workbench.physics.coils.inductance import gauss_nodes

COIL = WireLoop.rectangle(0.5, 3.0)
METRES = st.floats(-0.5, 0.5)


def neumann_double_sum(loop_a, loop_b, order=24, panels=12):
    """M [H] by Gauss quadrature along both loops: no closed form at all."""
    nodes = np.array(gauss_nodes(order, panels))
    ends = []
    for loop in (loop_a, loop_b):
        start, side = np.array(loop.vertices), np.array(loop.sides)
        points = (start[:, None, :] + nodes[None, :, :1] * side[:, None, :]).reshape(-1, 3)
        ends.append((points, (nodes[None, :, 1:] * side[:, None, :]).reshape(-1, 3)))
    (p, dp), (q, dq) = ends
    return 1e-7 * sum(np.sum((dq @ dp[i]) / np.linalg.norm(q - p[i], axis=1)) for i in range(len(p)))


def grover_coaxial_rectangles(a, b, d):
    """Grover, Inductance Calculations, ch. 10: equal parallel rectangles a × b, d apart; M [H]."""
    diagonal_a, diagonal_b = math.hypot(a, d), math.hypot(b, d)
    space = math.hypot(a, b, d)
    along_a = a * math.log((a + diagonal_a) / (a + space) * diagonal_b / d)
    along_b = b * math.log((b + diagonal_b) / (b + space) * diagonal_a / d)
    return 4e-7 * (along_a + along_b) + 8e-7 * (space - diagonal_a - diagonal_b + d)


def test_coaxial_rectangles_have_grovers_inductance():
    for distance in (0.05, 0.2, 0.6, 2.0):
        ours = mutual_inductance(COIL, COIL.placed((0.0, 0.0, distance)))
        # both closed forms in double precision; a digit or two go in the differences of large terms
        assert ours == pytest.approx(grover_coaxial_rectangles(0.5, 3.0, distance), rel=1e-12)


def test_rolled_coils_have_the_inductance_of_the_double_sum():
    other = COIL.placed((0.1, 0.15, 0.55), roll=0.08)
    # order 8 on the 0.5 m ends at 0.5 m: 1e-9 (geometric convergence)
    assert mutual_inductance(COIL, other) == pytest.approx(neumann_double_sum(COIL, other), rel=1e-8)


def test_coils_tilted_about_all_axes_have_the_inductance_of_the_double_sum():
    other = COIL.placed((0.1, 0.15, 0.55), roll=0.08, pitch=0.03, yaw=-0.05)
    # 16 points on the 3 m sides: 3e-10 at 0.4 m (docstring of mutual_inductance: 4 × 8 gives 1e-8)
    assert mutual_inductance(COIL, other, order=16) == pytest.approx(neumann_double_sum(COIL, other), rel=1e-8)
    assert mutual_inductance(COIL, other, panels=4) == pytest.approx(neumann_double_sum(COIL, other), rel=1e-8)


def test_inclined_sides_converge_geometrically_with_the_order():
    other = COIL.placed((0.0, 0.1, 0.4), yaw=0.01, pitch=0.02)
    exact = mutual_inductance(COIL, other, order=32, panels=4)
    errors = [abs(mutual_inductance(COIL, other, order=order) / exact - 1) for order in (4, 8, 16)]
    assert errors[1] < errors[0] / 50  # 1.3e-3 -> 1.1e-5 -> 2.8e-10
    assert errors[2] < errors[1] / 1000
    assert mutual_inductance(COIL, other, panels=4) == pytest.approx(exact, rel=1e-8)  # the stated accuracy


@settings(max_examples=25, deadline=None)
@given(x=METRES, y=METRES, roll=METRES, pitch=st.floats(-0.1, 0.1), yaw=METRES)
def test_inductance_does_not_depend_on_which_loop_comes_first(x, y, roll, pitch, yaw):
    a, b = (
        WireLoop.rectangle(0.5, 1.0),
        WireLoop.rectangle(0.6, 0.8).placed((x, y, 0.9), roll=roll, pitch=pitch, yaw=yaw),
    )
    forward, backward = (mutual_inductance(*pair, order=16) for pair in ((a, b), (b, a)))
    # Gauss runs along the first loop, so the two differ by its error: sides ≤ 1 m, filaments ≥ 0.4 m apart
    assert forward == pytest.approx(backward, rel=1e-7, abs=1e-16)


@settings(max_examples=25, deadline=None)
@given(scale=st.floats(0.01, 100.0))
def test_inductance_grows_in_proportion_to_size(scale):
    small = mutual_inductance(COIL, COIL.placed((0.2, 0.1, 0.4), roll=0.1))
    large = mutual_inductance(
        WireLoop.rectangle(0.5 * scale, 3 * scale),
        WireLoop.rectangle(0.5 * scale, 3 * scale).placed((0.2 * scale, 0.1 * scale, 0.4 * scale), roll=0.1),
    )
    assert large == pytest.approx(scale * small, rel=1e-10)  # rounding


@settings(max_examples=25, deadline=None)
@given(roll=METRES, pitch=METRES, yaw=METRES, x=METRES)
def test_inductance_does_not_change_when_both_loops_move_together(roll, pitch, yaw, x):
    other = COIL.placed((0.1, 0.2, 0.4))
    moved = [loop.placed((x, 0.3, -0.2), roll=roll, pitch=pitch, yaw=yaw) for loop in (COIL, other)]
    # parallel sides stay parallel to rounding and keep their closed form
    assert mutual_inductance(*moved) == pytest.approx(mutual_inductance(COIL, other), rel=1e-10)


def test_collinear_sides_are_the_limit_of_nearly_collinear_ones():
    beside = mutual_inductance(COIL, COIL.placed((3.5, 0.0, 0.0)))
    lifted = mutual_inductance(COIL, COIL.placed((3.5, 0.0, 1e-5)))
    assert beside == pytest.approx(lifted, rel=1e-8)  # second order in 1e-5 m over 0.5 m
    assert beside < 0  # the return flux of a coil beside crosses the other way


def test_symbols_and_numbers_give_the_same_inductance():
    height, roll = ca.SX.sym("h"), ca.SX.sym("roll")
    symbolic = mutual_inductance(COIL, COIL.placed((0.0, 0.1, height), roll=roll))
    value = ca.Function("M", [height, roll], [symbolic])(0.4, 0.05)
    assert float(value) == pytest.approx(mutual_inductance(COIL, COIL.placed((0.0, 0.1, 0.4), roll=0.05)), rel=1e-13)


def test_a_polygon_of_many_chords_has_the_inductance_of_circles():
    # coaxial circles of 0.5 m, 0.4 m apart: Maxwell's elliptic integrals
    from scipy.special import ellipe, ellipk

    a, d = 0.5, 0.4
    m = 4 * a * a / (4 * a * a + d * d)
    circles = 4e-7 * math.pi * a * ((2 / math.sqrt(m) - math.sqrt(m)) * ellipk(m) - 2 / math.sqrt(m) * ellipe(m))
    angles = 2 * math.pi * np.arange(48) / 48
    polygon = WireLoop.polygon(zip(a * np.cos(angles), a * np.sin(angles), strict=True))
    # an inscribed 48-gon is smaller by 1 - cos(π/48) = 0.2 %; M grows no faster than the fourth power
    ratio = mutual_inductance(polygon, polygon.placed((0.0, 0.0, d)), order=4) / circles
    assert 1 - 4 * (1 - math.cos(math.pi / 48)) < ratio < 1


def test_a_racetrack_with_a_small_radius_is_nearly_a_rectangle():
    other = COIL.placed((0.0, 0.0, 0.4))
    track = WireLoop.racetrack(0.5, 3.0, 0.01)
    # four cut corners of (1 - π/4) 1 cm² from 1.5 m²: 6e-5 of the flux at most
    assert mutual_inductance(track, other) == pytest.approx(mutual_inductance(COIL, other), rel=1e-4)


def test_the_field_of_a_loop_is_magpylibs():
    loop = COIL.placed((0.2, 0.1, 0.3), roll=0.2, pitch=0.1, yaw=0.3)
    closed = [*loop.vertices, loop.vertices[0]]
    points = np.array([[0.0, 0.0, 0.0], [1.0, -0.4, 0.7], [2.0, 1.0, -1.0]])
    theirs = magpylib.current.Polyline(current=1e5, vertices=closed).getB(points)
    assert magnetic_field(loop, 1e5, points) == pytest.approx(theirs, rel=1e-9, abs=1e-12)  # both closed forms


def test_the_gradient_of_the_inductance_is_the_lorentz_force_and_torque():
    x, turn = ca.SX.sym("x", 3), ca.SX.sym("turn", 3)
    moved = COIL.placed(roll=0.1, pitch=0.05).placed(ca.vertsplit(x), roll=turn[0], pitch=turn[1], yaw=turn[2])
    M = mutual_inductance(COIL, moved, order=16, panels=2)
    work = ca.Function("work", [x, turn], [ca.gradient(M, x), ca.gradient(M, turn)])
    place = (0.1, 0.15, 0.5)
    force, torque = (2e5 * 3e5 * value.full().ravel() for value in work(place, [0.0, 0.0, 0.0]))
    sides = COIL, COIL.placed(roll=0.1, pitch=0.05).placed(place)
    oracle_force, oracle_torque = lorentz_force(sides[0], 2e5, sides[1], 3e5, about=place)
    # two independent formulas; quadrature of both below 1e-9
    assert force == pytest.approx(oracle_force, rel=1e-8, abs=1e-6)
    assert torque == pytest.approx(oracle_torque, rel=1e-8, abs=1e-6)


def test_force_and_torque_are_magpylibs():
    other = COIL.placed((0.1, 0.15, 0.5), roll=0.1, pitch=0.05)
    source, target = (
        magpylib.current.Polyline(current=1e5, vertices=[*loop.vertices, loop.vertices[0]]) for loop in (COIL, other)
    )
    theirs = magpylib.getFT(source, target, pivot=(0.1, 0.15, 0.5), meshing=2000)
    ours = lorentz_force(COIL, 1e5, other, 1e5, about=(0.1, 0.15, 0.5))
    # magpylib cuts the loop into 2000 pieces; its error is of second order in their length, 7e-7 here
    assert np.array(ours) == pytest.approx(np.squeeze(theirs), rel=5e-6, abs=1e-2)


def test_a_row_alternates_and_puts_a_positive_coil_at_the_middle():
    row = rectangle_row(1.0, 1.1, 5)
    assert [sign for sign, _ in row] == [1.0, -1.0, 1.0, -1.0, 1.0]
    centres = [np.mean(np.array(loop.vertices)[:, 0]) for _, loop in row]
    assert centres == pytest.approx([-2.2, -1.1, 0.0, 1.1, 2.2])


def test_touching_loops_are_refused():
    with pytest.raises(InputError, match=r"filaments of the two loops must not overlap; .* Move a loop"):
        mutual_inductance(COIL, COIL)
    with pytest.raises(InputError, match="filaments of the two loops must not overlap"):
        mutual_inductance(*(loop for _, loop in rectangle_row(1.0, 1.1, 2)))


@pytest.mark.parametrize(
    ("build", "sentence"),
    [
        (lambda: WireLoop.rectangle(0.0, 3.0), "the width of a rectangle must be positive and finite; got 0.0 m"),
        (lambda: WireLoop.rectangle(0.5, math.nan), "the length of a rectangle must be positive and finite; got nan m"),
        (lambda: WireLoop(((0, 0, 0), (1, 0, 0))), "a loop must have at least three vertices; got 2"),
        (lambda: WireLoop(((0, 0), (1, 0), (1, 1))), "a point must have three coordinates x, y, z; got 2"),
        (lambda: WireLoop(((0, 0, 0), (0, 0, 0), (1, 1, 0))), "two neighbouring vertices coincide. Drop one"),
        (lambda: WireLoop.racetrack(0.5, 3.0, 0.3), "corner radius must not exceed half its smaller side; got 0.3 m"),
        (lambda: mutual_inductance(COIL, COIL.placed((0, 0, 1)), order=0), "must be at least 1; got 0"),
        (lambda: COIL.reflected("u"), "unknown axis 'u'"),
        (lambda: WireLoop(COIL.vertices, COIL.sides[:2]), "a side per vertex; got 2 and 4"),
        (lambda: rectangle_row(1.0, 1.1, 0), "a row must have at least one coil; got 0"),
        (lambda: lorentz_force(COIL.placed((ca.SX.sym("x"), 0, 1)), 1, COIL, 1), "a loop of numbers; got symbols"),
    ],
)
def test_what_is_not_a_loop_is_refused_with_a_sentence(build, sentence):
    with pytest.raises(InputError, match=sentence):
        build()
