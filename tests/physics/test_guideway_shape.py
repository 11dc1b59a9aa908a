"""Facts about girders, joints, ramps and bumps."""

import casadi as ca
import numpy as np
import pytest

from workbench.errors import InputError
from workbench.physics.guideway.shape import GirderSpans, JointSteps, Ramp, Superposition, VersineBump

SHAPES = (
    GirderSpans(span=25.0, sag=0.01, start=3.0),
    GirderSpans(span=25.0, sag=0.01, profile="sine"),
    JointSteps(places=(0.0, 10.0), steps=(0.002, -0.003)),
    Ramp(start=2.0, length=10.0, rise=0.02),
    Ramp(start=2.0, length=10.0, rise=0.02, profile="cosine"),
    VersineBump(start=-5.0, length=10.0, peak=0.01),
    Superposition((Ramp(start=2.0, length=10.0, rise=0.02), VersineBump(start=-5.0, length=10.0, peak=0.01))),
)


@pytest.mark.parametrize("shape", SHAPES)
def test_numbers_arrays_and_symbols_give_the_same_height(shape):
    x = ca.SX.sym("x")
    compiled = ca.Function("height", [x], [shape.height(x)])
    points = np.array([[-30.0, -2.5, 0.0], [3.0, 7.0, 40.0]])
    heights = shape.height(points)
    assert heights.shape == points.shape
    assert isinstance(shape.height(3.0), float)
    for point, height in zip(points.ravel(), heights.ravel(), strict=True):
        assert float(compiled(point)) == height == shape.height(float(point)) == float(shape.height(ca.DM(point)))


@pytest.mark.parametrize("profile", ["uniform_load", "sine"])
def test_girders_touch_their_piers_and_sag_in_the_middle(profile):
    girders = GirderSpans(span=25.0, sag=0.01, start=3.0, profile=profile)
    assert girders.height(np.array([3.0, 28.0, -22.0])) == pytest.approx(np.zeros(3), abs=1e-16)
    assert girders.height(15.5) == pytest.approx(-0.01, rel=1e-14)


def test_a_girder_under_its_weight_bends_with_constant_fourth_derivative_and_free_ends():
    x = ca.SX.sym("x")
    h = GirderSpans(span=25.0, sag=0.01).height(x)
    derivatives = [h]
    for _ in range(4):
        derivatives.append(ca.jacobian(derivatives[-1], x))
    second, fourth = (ca.Function("d", [x], [derivatives[order]]) for order in (2, 4))
    assert float(second(0.0)) == 0
    # δ = 5 q L⁴/(384 EI), h'''' = −q/EI = −384 δ/(5 L⁴)
    for place in (1.0, 12.0, 20.0):
        assert float(fourth(place)) == pytest.approx(-384 * 0.01 / (5 * 25.0**4), rel=1e-12)


# Tail of the series after N terms: 2·6.4/(2π)²/N = 0.324 sag/N (kinked piers), 1/π/N = 0.318 sag/N (half sines)
@pytest.mark.parametrize("profile", ["uniform_load", "sine"])
def test_the_harmonics_of_a_girder_line_add_up_to_its_shape(profile):
    girders = GirderSpans(span=25.0, sag=0.01, start=3.0, profile=profile)
    mean, cosines = girders.harmonics(1000)
    x = np.linspace(0, 25, 13)
    series = mean + np.cos(2 * np.pi * np.outer((x - 3) / 25, np.arange(1, 1001))) @ cosines
    np.testing.assert_allclose(series, girders.height(x), atol=3.3e-4 * 0.01)


def test_steps_hold_from_their_joint_on():
    joints = JointSteps(places=(0.0, 10.0), steps=(0.002, -0.003))
    assert joints.height(np.array([-1e-9, 0.0, 9.999, 10.0, 99.0])) == pytest.approx([0, 0.002, 0.002, -0.001, -0.001])


def test_ramps_join_their_levels_halfway_up_in_the_middle():
    for profile in ("straight", "cosine"):
        ramp = Ramp(start=2.0, length=10.0, rise=0.02, profile=profile)
        assert ramp.height(np.array([1.0, 7.0, 13.0])) == pytest.approx([0, 0.01, 0.02])


def test_a_versine_bump_has_half_its_height_on_the_average():
    bump = VersineBump(start=0.0, length=8.0, peak=0.01)
    x = np.linspace(0, 8, 1000, endpoint=False)
    assert bump.height(x).mean() == pytest.approx(0.005, rel=1e-12)  # exact for a trigonometric polynomial
    assert bump.height(4.0) == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: GirderSpans(span=0.0, sag=0.01), "span must be positive"),
        (lambda: GirderSpans(span=1.0, sag=0.1), "must not be steeper than 0.05; got a slope of 0.32"),
        (lambda: GirderSpans(span=25.0, sag=0.01, profile="arch"), "'uniform_load' or 'sine'"),
        (lambda: JointSteps(places=(0.0,), steps=()), "one finite step per joint; got 1 places and 0 steps"),
        (lambda: JointSteps(places=(), steps=()), "one finite step per joint"),
        (lambda: Ramp(start=0.0, length=1.0, rise=0.06), "must not be steeper"),
        (lambda: Ramp(start=0.0, length=1.0, rise=0.01, profile="round"), "'straight' or 'cosine'"),
        (lambda: VersineBump(start=0.0, length=1.0, peak=np.nan), "must not be steeper"),
        (lambda: Superposition(()), "at least one shape"),
        (lambda: Ramp(start=0.0, length=1.0, rise=0.01).height(np.inf), "distance must be finite"),
    ],
)
def test_shapes_beyond_the_linear_model_are_refused(ask, sentence):
    with pytest.raises(InputError, match=sentence):
        ask()
