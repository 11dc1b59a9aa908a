"""Facts about the frequency weightings: tabulated magnitudes, exact state space."""

import casadi as ca
import numpy as np
import pytest
from scipy.linalg import solve_continuous_lyapunov

from workbench.analysis.ride import rms, weight
from workbench.errors import InputError

NAMES = ("Wk", "Wd", "Wf", "Wb", "We", "Wc", "Wb_en12299")


# Values at exact one-third-octave centres 10^(n/10), three decimals; independent evaluation of ISO 8041-1, Table 3
@pytest.mark.parametrize(
    ("name", "exponent", "magnitude"),
    [
        ("Wk", 0.0, 0.482),
        ("Wk", 0.3, 0.531),
        ("Wk", 0.7, 1.039),
        ("Wk", 0.8, 1.054),
        ("Wk", 1.0, 0.988),
        ("Wk", 1.9, 0.134),
        ("Wd", -0.3, 0.854),
        ("Wd", 0.0, 1.011),
        ("Wd", 0.3, 0.891),
        ("Wd", 1.0, 0.202),
        ("Wf", -0.8, 1.004),
        ("Wf", -0.6, 0.850),
        ("Wb", 0.9, 1.026),
    ],
)
def test_the_weights_are_the_tabulated_ones(name, exponent, magnitude):
    assert weight(name).magnitude(10**exponent) == pytest.approx(magnitude, abs=5.5e-4)  # last digit, ±10 % of it


@pytest.mark.parametrize("name", NAMES)
def test_the_state_space_has_the_magnitude_of_the_formula(name):
    record = weight(name)
    A, B, C, D = record.state_space()
    f = np.geomspace(0.01, 500, 60)
    response = [(C @ np.linalg.solve(2j * np.pi * x * np.eye(len(A)) - A, B) + D)[0, 0] for x in f]
    # 1e-11: far outside the band cancels a second derivative, (0.01/0.4)² of 1e-14
    np.testing.assert_allclose(np.abs(response), record.magnitude(f), rtol=1e-11)
    assert D[0, 0] == 0
    assert np.linalg.eigvals(A).real.max() < 0


def test_the_state_space_has_the_phase_of_the_transfer_function():
    # Wk as its four factors of s, ISO 8041-1
    s = 2j * np.pi * 3.0
    w1, w2, w34, w5, w6 = (2 * np.pi * f for f in (0.4, 100, 12.5, 2.37, 3.35))
    band = 1 / (1 + 2**0.5 * w1 / s + (w1 / s) ** 2) / (1 + 2**0.5 * s / w2 + (s / w2) ** 2)
    transition = (1 + s / w34) / (1 + s / 0.63 / w34 + (s / w34) ** 2)
    step = (1 + s / 0.91 / w5 + (s / w5) ** 2) / (1 + s / 0.91 / w6 + (s / w6) ** 2) * (w5 / w6) ** 2
    A, B, C, D = weight("Wk").state_space()
    response = (C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D)[0, 0]
    assert response == pytest.approx(band * transition * step, rel=1e-12)


@pytest.mark.parametrize("name", ["Wk", "Wd", "Wf"])
def test_the_variance_of_weighted_white_noise_is_the_area_under_its_density(name):
    A, B, C, _ = weight(name).state_space()
    P = solve_continuous_lyapunov(A, -B @ B.T)
    area = rms(lambda f: 2 * np.ones_like(f), name, low_hz=1e-4, high_hz=1e6) ** 2
    # the density falls as f⁻² or faster above 100 Hz: 1e-4 of the area lies beyond 1 MHz at most; panels agree to 1e-5
    assert area == pytest.approx((C @ P @ C.T)[0, 0], rel=1e-4)


@pytest.mark.parametrize("name", NAMES)
def test_numbers_arrays_dm_and_symbols_give_the_same_weight(name):
    f = ca.SX.sym("f")
    record = weight(name)
    compiled = ca.Function("weight", [f], [record.magnitude(f)])
    number = record.magnitude(2.5)
    assert isinstance(number, float)
    assert record.magnitude(np.array([[2.5]]))[0, 0] == pytest.approx(number, rel=1e-14)
    assert float(record.magnitude(ca.DM(2.5))) == pytest.approx(number, rel=1e-14)
    assert float(compiled(2.5)) == pytest.approx(number, rel=1e-14)


def test_vertical_weight_hides_three_quarters_of_the_power_and_more_at_0_6_hz():
    assert weight("Wk").magnitude(0.6) ** 2 < 0.25
    assert weight("Wd").magnitude(0.6) > 0.9


def test_the_two_sets_for_wb_differ_by_less_than_a_fifth_in_their_band():
    f = np.geomspace(0.5, 80, 50)
    ratio = weight("Wb_en12299").magnitude(f) / weight("Wb").magnitude(f)
    assert 0.8 < ratio.min() < ratio.max() < 1.2
    assert "not checked" in weight("Wb_en12299").source


def test_an_unknown_weighting_is_refused_with_the_nearest_name():
    with pytest.raises(InputError, match="unknown frequency weighting 'Wz'"):
        weight("Wz")
