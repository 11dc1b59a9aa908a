"""Measured frequency responses: fitted models against the systems that made the numbers."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.lti.make import second_order, ss, tf, zpk
from workbench.lti.measured import frd

F = np.geomspace(0.05, 50.0, 120)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_the_response_of_a_system_gives_back_its_poles_and_its_response_in_between(seed):
    rng = np.random.default_rng(seed)
    # spread over the band, apart from each other; unstable ones among them
    poles = [*second_order(rng.uniform(1, 3), rng.uniform(-0.3, 0.5)), -rng.uniform(5, 15)]
    poles += second_order(rng.uniform(40, 120), rng.uniform(0.01, 0.3))
    truth = zpk([-rng.uniform(0.5, 100), *second_order(rng.uniform(5, 30), 0.2)], poles, rng.uniform(1, 100))
    fit = frd(F, truth.response(2 * np.pi * F), name="test").fitted(tolerance=1e-6)
    assert fit.order == 5
    np.testing.assert_allclose(np.sort_complex(fit.model.poles()), np.sort_complex(truth.poles()), rtol=1e-5)
    between = 2 * np.pi * np.sqrt(F[1:] * F[:-1])
    np.testing.assert_allclose(fit.model.response(between), truth.response(between), rtol=1e-5)


def test_several_inputs_and_outputs_share_poles_and_integrators_and_dead_time_stay_exact():
    truth = tf(
        [[[1.0, 2.0], 3.0], [5.0, [1.0, -1.0]]], [[[1.0, 0.4, 4.0, 0.0]] * 2] * 2, dead_time=0.02,
        input=["a", "b"], output=["p", "q"],
    )  # fmt: skip
    fit = frd(F, truth.response(2 * np.pi * F), input=["a", "b"], output=["p", "q"]).fitted(
        integrators=1, dead_time=0.02, tolerance=1e-8
    )
    assert fit.order == 2
    poles = np.sort_complex(np.unique(fit.model.plant.poles().round(6)))
    np.testing.assert_allclose(poles, np.sort_complex(np.array([0, *np.roots([1, 0.4, 4])])), atol=2e-6)
    assert np.sum(np.abs(fit.model.plant.poles()) == 0) == 2
    assert {line.dead_time for line in fit.model.lines} == {0.02}
    omega = np.array([1e-3, 1e3])  # beyond the points
    np.testing.assert_allclose(fit.model.response(omega), truth.response(omega), rtol=1e-5)


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_units_of_time_and_signals_do_not_matter(unit):
    truth = tf([3.0], [1.0, 0.2, 1.0])
    fit = frd(F / unit, 1e9 * truth.response(2 * np.pi * F)).fitted(tolerance=1e-8)
    assert fit.order == 2
    np.testing.assert_allclose(np.sort_complex(fit.model.poles()) * unit, np.sort_complex(truth.poles()), rtol=1e-6)


def test_a_sampled_response_gives_a_sampled_model():
    truth = ss([[0.9, 0.2], [-0.2, 0.8]], [[1.0], [0.0]], [[0.0, 1.0]], [[0.3]], sample_time=0.01)
    f = np.linspace(0.5, 49.0, 80)
    fit = frd(f, truth.response(2 * np.pi * f), sample_time=0.01).fitted(tolerance=1e-7)
    assert fit.model.sample_time == 0.01
    np.testing.assert_allclose(np.sort_complex(fit.model.poles()), np.sort_complex(truth.poles()), rtol=1e-6)


def test_noise_is_refused_with_the_best_error_and_accepted_within_its_own_size():
    truth, rng = tf([3.0], [1.0, 0.2, 1.0]), np.random.default_rng(1)
    noisy = truth.response(2 * np.pi * F)[:, 0, 0] * (1 + 0.01 * rng.normal(size=len(F)))
    with pytest.raises(InputError, match=r"must come within 1e-06 of measured at every point; the best, of order \d+"):
        frd(F, noisy).fitted(tolerance=1e-6)
    fit = frd(F, noisy).fitted(tolerance=0.05)
    assert fit.order == 2
    assert 0.005 < fit.error <= 0.05
    own = np.abs(fit.model.response(2 * np.pi * F)[:, 0, 0] - noisy) / np.abs(noisy)
    assert fit.error == pytest.approx(own.max(), rel=1e-9)


def test_between_points_it_is_interpolated_and_outside_it_says_nothing():
    lag = frd(F, 1 / (1 + 2j * np.pi * F))
    omega = np.array([2 * np.pi * F[3], 3.0, 2 * np.pi * F[-1]])
    np.testing.assert_allclose(lag.response(omega)[:, 0, 0], 1 / (1 + 1j * omega), rtol=1e-3)
    with pytest.raises(InputError, match="says nothing beyond"):
        lag.response([1e-3])


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (([1.0, 0.5], [1, 1]), "rising numbers"),
        (([1.0, 2.0], [1, 1, 1]), "for each of the 2 frequencies"),
        (([1.0, 2.0], [1, np.nan]), "finite number"),
        (([1.0, 2.0], [1, 0]), "must not be zero"),
    ],
)
def test_tables_that_cannot_be_are_refused(arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        frd(*arguments)
    with pytest.raises(InputError, match="below 1/"):
        frd([1.0, 60.0], [1, 1], sample_time=0.01)
