"""Passivity and sectors against the definition over frequency and closed formulas."""

import math

import numpy as np
import pytest
from goal_cases import loop_of, plant
from goal_cases import plant as plant_of

from workbench.control.structure.block import Controller
from workbench.control.structure.blocks import gain, pid
from workbench.control.structure.channel import Channel
from workbench.control.structure.fraction import Fraction
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.design.tuner.tune import tune
from workbench.errors import InputError
from workbench.goals.gain import Gain
from workbench.goals.sector import ConicSector, Passivity, WeightedPassivity
from workbench.lti.make import tf
from workbench.lti.model import Model

NOTHING = Controller.static([[0.0]])
ONE = {"inputs": "w", "outputs": "z"}


def _alone(A, B, C, D):
    """The channel w → z with transfer function D + C (s − A)⁻¹ B."""
    n = len(np.atleast_2d(A))
    system = plant(
        A, np.hstack([np.reshape(B, (n, 1)), np.zeros((n, 1))]), np.vstack([np.reshape(C, (1, n)), np.zeros((1, n))]),
        np.diag([float(D), 0.0]), inputs=["w", "u"], outputs=["z", "y"],
    )  # fmt: skip
    return loop_of(system, controls=["u"], measured=["y"])


def test_the_passivity_index_is_the_gain_of_the_scattering():
    # T = (s + 3)/(s + 1): (1 − T)/(1 + T) = −1/(s + 2), largest at zero
    loop = _alone([[-1.0]], [1.0], [2.0], 1.0)
    bound = Passivity(**ONE).bind(loop)
    assert bound.evaluate(NOTHING).value == pytest.approx(0.5, rel=1e-10)
    assert bound.exact(NOTHING).upper == pytest.approx(0.5, rel=1e-6)


def test_a_channel_that_is_not_passive_is_above_one():
    # T = 1 − 3/(s + 1): −2 at zero; |(1 − T)/(1 + T)| = 3/|2s − 1| is 3 at zero
    loop = _alone([[-1.0]], [1.0], [-3.0], 1.0)
    bound = Passivity(**ONE).bind(loop)
    assert bound.evaluate(NOTHING).value == pytest.approx(3.0, rel=1e-10)
    assert bound.exact(NOTHING).value == pytest.approx(3.0, rel=1e-10)


@pytest.mark.parametrize(("into", "out"), [(0.0, 0.0), (0.6, 0.0), (0.0, 0.2), (1.2, 0.0), (0.0, 0.9), (-0.5, 0.1)])
def test_the_verdict_is_that_of_the_inequality(into, out):
    # T = (s + 3)/(s + 1) runs through the circle over [1, 3]: Re T ≥ ν + ρ|T|² is checked on a fine grid
    loop = _alone([[-1.0]], [1.0], [2.0], 1.0)
    w = np.r_[0.0, np.geomspace(1e-4, 1e4, 20001)]
    T = 1 + 2 / (1j * w + 1)
    met = bool(np.all(T.real - into - out * np.abs(T) ** 2 > 0))
    bound = Passivity(**ONE, input_index=into, output_index=out).bind(loop)
    assert (bound.evaluate(NOTHING).value < 1) == met
    assert (bound.exact(NOTHING).upper < 1) == met


def test_a_strictly_proper_channel_is_passive_on_a_band_with_room():
    loop = _alone([[-1.0]], [1.0], [1.0], 0.0)
    found = Passivity(**ONE).bind(loop).exact(NOTHING)
    assert (found.value, found.upper) == (pytest.approx(1.0, rel=1e-9), 1.0)  # at infinity, from below
    # |(1 − T)/(1 + T)| = |jω/(jω + 2)| at the band's end
    banded = Passivity(**ONE, focus=(0.0, 10.0)).bind(loop).evaluate(NOTHING)
    assert banded.value == pytest.approx(10 / math.sqrt(104), rel=1e-10)


def test_weights_enter_the_passivity():
    # (s + 1)/(s + 3) times the channel makes it 1
    loop = _alone([[-1.0]], [1.0], [2.0], 1.0)
    bound = WeightedPassivity(**ONE, left=([1.0, 1.0], [1.0, 3.0])).bind(loop)
    assert bound.evaluate(NOTHING).value == pytest.approx(0.0, abs=1e-7)  # square root of rounding


def test_a_sector_holds_exactly_the_gains_within_it():
    for inside, met in ((0.9, False), (1.1, True), (2.9, True), (3.1, False), (-2.0, False)):
        loop = _alone([[-1.0]], [0.0], [0.0], inside)
        for value in (f(NOTHING) for f in (ConicSector(**ONE, sector=(1.0, 3.0)).bind(loop).evaluate,)):
            assert (value.value < 1) == met
            # R² = (y − a u)(y − b u) split by eigenvalues: the sign of the product decides
            assert ((inside - 1) * (inside - 3) < 0) == met


def test_the_sector_of_a_circle_is_its_gain_bound():
    # sector (−γ, γ): y² < γ² u²; R is a function of |T|/γ alone and 1 where |T| = γ
    loop = _alone([[-1.0]], [1.0], [2.0], 1.0)  # largest gain 3
    for gamma, met in ((2.99, False), (3.01, True)):
        assert (ConicSector(**ONE, sector=(-gamma, gamma)).bind(loop).evaluate(NOTHING).value < 1) == met
    Q = np.diag([1.0, -9.0])
    found = ConicSector(**ONE, matrix=Q).bind(loop).evaluate(NOTHING)
    assert found.value == pytest.approx(1.0, rel=1e-9)


def test_the_far_side_of_a_sector_that_is_not_convex_is_refused():
    # outside of the circle over [1, 3]: −(y − u)(y − 3u) < 0; W₂'H vanishes for some T: 2 + 4/(s − …) is on both sides
    Q = np.array([[-1.0, 2.0], [2.0, -3.0]])
    inside = _alone([[-1.0]], [1.0], [-8.0], 5.0)  # from −3 at zero to 5 at infinity: both outside, around the circle
    value = ConicSector(**ONE, matrix=Q).bind(inside).evaluate(NOTHING)
    outside = ConicSector(**ONE, matrix=Q).bind(_alone([[-1.0]], [1.0], [1.0], 4.0)).evaluate(NOTHING)
    assert outside.value < 1
    assert value.value == math.inf
    assert "far side of the sector" in value.reason


def test_impossible_sectors_are_refused():
    with pytest.raises(InputError, match="No system can do more"):
        Passivity(**ONE, input_index=1.0, output_index=0.3)
    with pytest.raises(InputError, match="low < high"):
        ConicSector(**ONE, sector=(3.0, 1.0))
    with pytest.raises(InputError, match="one negative eigenvalue per input"):
        ConicSector(**ONE, matrix=np.eye(2))


def _fraction(num, den, unit=1.0, time=1.0):
    """The channel num/den in other units of its output and of time, by itself."""
    num, den = (np.asarray(c, float) * time ** np.arange(len(c))[::-1] for c in (num, den))
    plant = tf([[unit * num]], [[den]], input="w", output="z").plant
    n = len(plant.A)
    beside = plant_of(
        plant.A, np.hstack([plant.B, np.zeros((n, 1))]), np.vstack([plant.C, np.zeros((1, n))]),
        np.diag([plant.D.item(), 0.0]), inputs=["w", "u"], outputs=["z", "y"],
    )  # fmt: skip
    return Channelled(Model("alone", beside))


class Channelled:
    """The channels of a model alone, as a loop has them: an integrator may stand in them."""

    def __init__(self, model):
        self.model, lined = model, model.lined()
        self.lined = lined

    def channel(self, inputs, outputs, openings=()):
        A, B, C, D = (np.asarray(M) for M in self.lined[:4])
        none = np.zeros((len(A), 1)), np.zeros((1, len(A)))
        one = np.zeros((1, 1))
        fraction = Fraction(A, B[:, :1], none[0], C[:1], none[1], D[:1, :1], one, one, one)
        return Channel(inputs, outputs, openings, None, False, fraction, fraction, self.lined)


@pytest.mark.parametrize("time", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("unit", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize(
    ("num", "den", "met"),
    [
        ([1], [1, 1], True),  # Re T = 1/(1 + ω²)
        ([1], [1, 1, 1], False),  # Re T = (1 − ω²)/…
        ([1, 1.001], [1, 1, 1], False),  # Re T = (1.001 − 0.001 ω²)/…: negative from ω = 31.6 on only
        ([1, 0.999], [1, 1, 1], True),
        ([2, 1], [1, 0], True),  # PI: 2 + 1/s
        ([-1e-3, 1], [1, 0], False),  # Re T = −1e-3
        ([1], [1, 0], True),  # lossless: Re T = 0
        ([-1], [1, 0], False),  # the residue of the pole on the axis is negative
        ([1], [1, 0, 0], False),
        ([1, 0], [1, 0, 1], True),  # a lossless resonance
        ([1, 1], [1, 0, 1, 0], False),  # 1/s + (1 − s)/(s² + 1): a residue that is not real
        ([1], [1, -1], False),
    ],
)  # fmt: skip
def test_passivity_is_that_of_the_real_part_in_any_units_also_at_its_limits(num, den, met, unit, time):
    bound = Passivity(**ONE).bind(_fraction(num, den, unit, time))
    for value in (bound.exact(NOTHING), bound.evaluate(NOTHING)):
        assert (value.upper <= 1) == met, value
        assert (value.value <= 1) == met, value


@pytest.mark.parametrize(("slope", "met"), [(0.999, False), (1.0, True), (1.001, True)])
def test_a_strictly_proper_channel_lies_in_a_sector_that_begins_at_zero(slope, met):
    # 1/(s + 1) is the circle over [0, 1]: |T|² ≤ slope Re T from 1 on
    found = ConicSector(**ONE, sector=(0.0, slope)).bind(_fraction([1], [1, 1])).exact(NOTHING)
    assert (found.upper <= 1) == met


def test_a_sampled_channel_is_passive_up_to_its_half_sample_rate():
    # 0.1/(z − 0.9) has Re < 0 towards z = −1; with half a sample's lead, 0.05 (z + 1)/(z − 0.9), it has not
    for num, met in (((0.0, 0.1), False), ((0.05, 0.05), True)):
        system = plant_of([[0.9]], [[1.0, 0.0]], [[num[1] + 0.9 * num[0]], [0.0]], [[num[0], 0.0], [0.0, 0.0]],
                          inputs=["w", "u"], outputs=["z", "y"])  # fmt: skip
        loop = loop_of(system, controls=["u"], measured=["y"], sample_time=0.1)
        assert (Passivity(**ONE).bind(loop).exact(NOTHING).upper <= 1) == met


def test_a_hard_passivity_of_a_strictly_proper_channel_can_be_tuned():
    # w → y of 1/(s² + s) under k1 on y and k2 on its rate: with s in the numerator it is passive from w to the rate
    system = plant_of([[0, 1], [0, -1]], [[0, 0], [1, 1]], np.eye(2), np.zeros((2, 2)), inputs=["u", "w"],
                      outputs=["y", "rate"])  # fmt: skip
    structure = Structure(gain(["y", "rate"], "u", [[-1.0, 0.5]], low=-10.0, high=10.0, name="k"))
    goals = [
        Passivity(inputs="w", outputs="rate", hard=True),
        Gain(name="effect", inputs=("w",), outputs=("y",)),
    ]
    found = tune(Model("cart", system), structure, goals, starts=1, budget_seconds=20)
    assert found.met
    assert found.goal("effect").value == pytest.approx(0.1, rel=1e-3)  # 1/k1 at its bound


def test_the_passivity_of_a_controller_with_integral_action_has_an_answer():
    lag = plant_of([[-1.0]], [[1.0]], [[1.0]], inputs=["u"], outputs=["y"])
    for Kp, met in ((2.0, True), (-0.1, False)):
        structure = Structure(pid("y", "u", Kp=Kp, Ki=1.0, parts="PI"))
        loop = Loop(Model("lag", lag), structure)
        goal = Passivity(inputs="y", outputs="before u", openings="u").bind(loop)
        K = structure.controller()
        assert (goal.exact(K).upper <= 1) == met
        assert math.isfinite(goal.evaluate(K).value)
