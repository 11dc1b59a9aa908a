"""Passivity and sectors against the definition over frequency and closed formulas."""

import math

import numpy as np
import pytest
from goal_cases import loop_of, plant

from workbench.errors import InputError
from workbench.tuning import Controller
from workbench.tuning.goal_sector import ConicSector, Passivity, WeightedPassivity

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


def test_a_strictly_proper_channel_is_passive_on_a_band_only():
    loop = _alone([[-1.0]], [1.0], [1.0], 0.0)
    assert Passivity(**ONE).bind(loop).evaluate(NOTHING).value == pytest.approx(1.0, rel=1e-9)  # at infinity
    # |(1 − T)/(1 + T)| = |jω/(jω + 2)| at the band's end
    banded = Passivity(**ONE, focus=(0.0, 10.0)).bind(loop).evaluate(NOTHING)
    assert banded.value == pytest.approx(10 / math.sqrt(104), rel=1e-10)


def test_weights_enter_the_passivity():
    # (s + 1)/(s + 3) times the channel makes it 1
    loop = _alone([[-1.0]], [1.0], [2.0], 1.0)
    bound = WeightedPassivity(**ONE, left=([1.0, 1.0], [1.0, 3.0])).bind(loop)
    assert bound.evaluate(NOTHING).value == pytest.approx(0.0, abs=1e-7)  # square root of rounding


def test_a_sector_holds_exactly_the_gains_within_it():
    for gain, met in ((0.9, False), (1.1, True), (2.9, True), (3.1, False), (-2.0, False)):
        loop = _alone([[-1.0]], [0.0], [0.0], gain)
        for value in (f(NOTHING) for f in (ConicSector(**ONE, sector=(1.0, 3.0)).bind(loop).evaluate,)):
            assert (value.value < 1) == met
            # R² = (y − a u)(y − b u) split by eigenvalues: the sign of the product decides
            assert ((gain - 1) * (gain - 3) < 0) == met


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
