"""Samples of a study: each parameter's values are where its distribution says, and the same every time."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.study.definition import Parameter, Study
from workbench.study.sampling import sample, transformed


def study(sampling, count=0, *parameters, **more):
    return Study(problem="heave", sampling=sampling, count=count, parameters=parameters, **more)


def over(name, low, high, distribution="uniform", **more):
    return Parameter(name=name, distribution=distribution, low=low, high=high, **more)


@settings(max_examples=50, deadline=None)
@given(count=st.integers(1, 200), dimensions=st.integers(1, 5), seed=st.integers(0, 2**32))
def test_a_latin_hypercube_has_one_value_in_each_stratum_of_every_parameter(count, dimensions, seed):
    names = ("mass", "current_force", "gap_force", "K_h", "K_hdot")[:dimensions]
    values = sample(study("latin_hypercube", count, *(over(n, 0.0, 1.0) for n in names), seed=seed))
    strata = np.sort((values * count).astype(int), axis=0)
    assert (strata == np.arange(count)[:, None]).all()


def test_a_grid_runs_through_every_combination_the_last_parameter_fastest():
    values = sample(
        study("grid", 0, Parameter(name="mass", distribution="values", values=(0.9, 1.1)), over("K_h", 1, 3, levels=3))
    )
    assert values.tolist() == [[0.9, 1], [0.9, 2], [0.9, 3], [1.1, 1], [1.1, 2], [1.1, 3]]


def test_a_list_goes_through_its_values_together():
    a, b = (Parameter(name=n, distribution="values", values=v) for n, v in (("mass", (1.0, 2.0)), ("K_h", (3.0, 4.0))))
    assert sample(study("list", 0, a, b)).tolist() == [[1.0, 3.0], [2.0, 4.0]]


def test_a_list_of_unequal_lengths_is_refused():
    a, b = (Parameter(name=n, distribution="values", values=v) for n, v in (("mass", (1.0,)), ("K_h", (3.0, 4.0))))
    with pytest.raises(InputError, match=r"as many values as the others; got mass 1, K_h 2"):
        study("list", 0, a, b)


def test_the_sobol_design_is_two_samples_and_their_mixtures():
    n, d = 16, 3
    values = sample(study("sobol", n, *(over(name, 0, 1) for name in ("mass", "K_h", "K_hdot"))))
    A, B, *mixed = values.reshape(d + 2, n, d)
    for k, AB in enumerate(mixed):
        expected = A.copy()
        expected[:, k] = B[:, k]
        assert (expected == AB).all()
    assert len({tuple(row) for row in np.vstack([A, B])}) == 2 * n


def test_base_points_of_the_sobol_design_are_balanced():
    # a scrambled sequence of 2^m points has exactly one point in each of 2^m intervals of every coordinate
    values = sample(study("sobol", 32, over("mass", 0, 1), over("K_h", 0, 1)))
    assert (np.sort((values[:32] * 32).astype(int), axis=0) == np.arange(32)[:, None]).all()


@pytest.mark.parametrize("sampling", ["latin_hypercube", "monte_carlo", "sobol"])
def test_the_same_seed_gives_the_same_rows_and_another_seed_others(sampling):
    one, again, other = (sample(study(sampling, 8, over("mass", 0.9, 1.1), seed=s)) for s in (3, 3, 4))
    assert (one == again).all()
    assert not (one == other).any()


def test_a_log_uniform_median_is_the_geometric_mean():
    p = over("guideway.roughness_m", 1e-7, 1e-5, "log_uniform")
    assert transformed(p, np.array([0.5]))[0] == pytest.approx(1e-6, rel=1e-12)


def test_a_normal_distribution_keeps_its_range_and_its_moments():
    p = over("mass", -1e9, 1e9, "normal", mean=2.0, deviation=0.5)
    u = (np.arange(20000) + 0.5) / 20000
    values = transformed(p, u)
    # midpoint rule over 20000 strata: the tails beyond 4 deviations hold 1e-3 of the variance's last stratum
    assert values.mean() == pytest.approx(2.0, abs=1e-10)
    assert values.std() == pytest.approx(0.5, rel=1e-3)
    cut = transformed(over("mass", 3.4, 3.6, "normal", mean=2.0, deviation=0.5), np.array([0.0, 0.3, 0.999999]))
    assert ((cut >= 3.4) & (cut <= 3.6)).all()
    assert np.all(np.diff(cut) > 0)


def test_far_in_a_tail_a_normal_distribution_still_rises():
    p = over("mass", 8.0, 9.0, "normal", mean=2.0, deviation=1.5)
    assert np.all(np.diff(transformed(p, np.linspace(0, 0.999, 50))) > 0)


@pytest.mark.parametrize(
    ("parameter", "sentence"),
    [
        ({"name": "K_h", "distribution": "uniform", "low": 2.0, "high": 1.0}, "must have a rising range"),
        ({"name": "K_h", "distribution": "log_uniform", "low": -2.0, "high": 1.0}, "positive range to be log-uniform"),
        ({"name": "K_h", "distribution": "normal", "low": 0, "high": 1, "mean": 9, "deviation": 0.1}, "six deviations"),
        ({"name": "K_h", "distribution": "gauss", "low": 0.0, "high": 1.0}, "unknown distribution 'gauss'"),
    ],
)
def test_a_parameter_that_makes_no_sense_is_refused(parameter, sentence):
    with pytest.raises(InputError, match=sentence):
        Parameter(**parameter)
