"""Sensitivity indices against functions whose indices are known."""

import numpy as np
import pytest

from workbench.study.definition import Parameter, Study
from workbench.study.sampling import sample
from workbench.study.sensitivity import indices, regression, sobol_indices

NAMES = ("mass", "K_h", "K_hdot")


def points(sampling, count, low=0.0, high=1.0):
    parameters = tuple(Parameter(name=n, distribution="uniform", low=low, high=high) for n in NAMES)
    return sample(Study(problem="heave", sampling=sampling, count=count, parameters=parameters))


def ishigami(x, a=7.0, b=0.1):
    return np.sin(x[:, 0]) + a * np.sin(x[:, 1]) ** 2 + b * x[:, 2] ** 4 * np.sin(x[:, 0])


# Ishigami & Homma (1990): variance a²/8 + bπ⁴/5 + b²π⁸/18 + 1/2 and its parts, for a = 7, b = 0.1
VARIANCE = 49 / 8 + 0.1 * np.pi**4 / 5 + 0.01 * np.pi**8 / 18 + 0.5
FIRST = np.array([(1 + 0.1 * np.pi**4 / 5) ** 2 / 2, 49 / 8, 0.0]) / VARIANCE
TOTAL = FIRST + np.array([1, 0, 1]) * 0.01 * np.pi**8 * (1 / 18 - 1 / 50) / VARIANCE


def test_sobol_indices_of_the_ishigami_function_are_the_analytic_ones():
    n = 4096
    first, total, used = sobol_indices(ishigami(points("sobol", n, -np.pi, np.pi)), n)
    assert used == n
    # a Sobol' sequence of 4096 points leaves about 1e-3 of each index; plain sampling would leave 2e-2
    np.testing.assert_allclose(first[:, 0], FIRST, atol=5e-3)
    np.testing.assert_allclose(total[:, 0], TOTAL, atol=5e-3)


def test_intervals_hold_the_analytic_index():
    n = 1024
    first, total, _ = sobol_indices(ishigami(points("sobol", n, -np.pi, np.pi)), n)
    for table, exact in ((first, FIRST), (total, TOTAL)):
        assert (table[:, 1] <= exact + 1e-3).all()  # 1e-3: a zero index whose interval is a point
        assert (table[:, 2] >= exact - 1e-3).all()
        assert (table[:, 1] < table[:, 2]).all()


def test_the_estimates_are_those_of_scipy():
    from scipy.stats import sobol_indices as reference

    n = 256
    values = ishigami(points("sobol", n, -np.pi, np.pi))
    A, B, *AB = values.reshape(5, n)
    theirs = reference(func={"f_A": A[None], "f_B": B[None], "f_AB": np.array(AB)[:, None, :]}, n=n)
    first, total, _ = sobol_indices(values, n)
    # scipy normalises by the mean of A and B, as we do: the same numbers but for rounding
    np.testing.assert_allclose(first[:, 0], np.ravel(theirs.first_order), atol=1e-12)
    np.testing.assert_allclose(total[:, 0], np.ravel(theirs.total_order), atol=1e-12)


def test_base_points_with_a_missing_row_are_left_out():
    n = 64
    values = ishigami(points("sobol", n, -np.pi, np.pi))
    values[[3, n + 5, 4 * n + 5]] = np.nan
    assert sobol_indices(values, n)[2] == n - 2


def test_a_mean_far_from_zero_changes_no_index():
    n = 128
    values = ishigami(points("sobol", n, -np.pi, np.pi))
    one, other = sobol_indices(values, n), sobol_indices(values + 1e6, n)
    np.testing.assert_allclose(one[0][:, 0], other[0][:, 0], atol=1e-8)  # 1e6 costs six of sixteen digits


def test_a_quantity_that_does_not_vary_has_no_indices():
    assert sobol_indices(np.full(5 * 16, 3.0), 16) is None
    x = points("latin_hypercube", 50)
    assert indices("latin_hypercube", 50, x, {"a": np.full(50, 3.0)}, NAMES) == ()


def test_coefficients_of_a_plane_are_its_slopes_in_deviations():
    x = points("latin_hypercube", 2000)
    (coefficients,), (ranks,), explained = regression(x, (x @ [3.0, -4.0, 0.0])[:, None])
    # three independent uniform parameters: β_i = slope_i / √(Σ slope²) but for their sampled correlation, 1/√2000
    np.testing.assert_allclose(coefficients[:, 0], [0.6, -0.8, 0.0], atol=0.03)
    assert explained == pytest.approx(1.0, abs=1e-12)
    assert ranks[0, 0] > 0.9
    assert ranks[1, 0] < -0.9


def test_the_interval_of_a_coefficient_is_that_of_linear_theory():
    rng = np.random.default_rng(5)
    x = rng.uniform(size=(4000, 3))
    y = x @ [1.0, 0.0, 0.0] + rng.normal(size=4000)
    (coefficients,), _, _ = regression(x, y[:, None])
    # standard error of a standardised slope: √((1 − R²)/n) = 0.0152; 95 % interval ± 0.030; the ends scatter by a tenth
    width = coefficients[:, 2] - coefficients[:, 1]
    np.testing.assert_allclose(width, 2 * 1.96 * np.sqrt(12 / 13 / 4000), rtol=0.25)


def test_rank_correlations_do_not_care_for_a_monotonic_change_of_scale():
    x = points("latin_hypercube", 300)
    y = x @ [1.0, 0.5, 0.0]
    plain, bent = regression(x, np.column_stack([y, np.exp(8 * y)]))[1]
    np.testing.assert_allclose(plain, bent, atol=1e-12)


@pytest.mark.parametrize("slopes", [(1.0,), (-1.0,), (3.0, -2.0), (2.0, 0.5, -1.0)])
def test_ranks_that_are_exactly_determined_have_the_sign_of_what_determines_them(slopes):
    rng = np.random.default_rng(3)
    for k, slope in enumerate(slopes):
        x = np.column_stack([rng.permutation(40) for _ in slopes]).astype(float)
        (ranks,) = regression(x, np.exp(slope * x[:, [k]] / 40))[1]
        expected = np.zeros(len(slopes))  # the others: nothing is left that they could move
        expected[k] = np.sign(slope)
        np.testing.assert_allclose(ranks[:, 0], expected, atol=1e-12)
        assert (ranks[:, 1] <= ranks[:, 0]).all()
        assert (ranks[:, 0] <= ranks[:, 2]).all()


def test_ranks_that_a_sum_determines_have_the_sign_of_each_summand():
    # a complete grid of 6 by 6: x + 6 z takes the values 0 … 35, so its ranks are that sum
    x = np.array([(i, j) for i in range(6) for j in range(6)], float)
    (ranks,) = regression(x, (x @ [1.0, -6.0])[:, None])[1]
    np.testing.assert_allclose(ranks[:, 0], [1.0, -1.0], atol=1e-12)


def test_partial_rank_correlations_are_those_of_the_inverse_where_there_is_one():
    from scipy.stats import rankdata

    x = points("latin_hypercube", 200)
    y = ishigami(x * 6 - 3)
    (ranks,) = regression(x, y[:, None])[1]
    precision = np.linalg.inv(np.corrcoef(rankdata(np.column_stack([x, y]), axis=0), rowvar=False))
    textbook = -precision[:-1, -1] / np.sqrt(np.diag(precision)[:-1] * precision[-1, -1])
    np.testing.assert_allclose(ranks[:, 0], textbook, atol=1e-12)


def test_parameters_that_move_together_have_no_index_of_their_own():
    rng = np.random.default_rng(4)
    a, b = rng.permutation(50).astype(float), rng.permutation(50).astype(float)
    found = indices("list", 0, np.column_stack([a, np.exp(a / 9), b]), {"y": a + 0.1 * b}, NAMES)
    ranked = {i.parameter for i in found if i.kind == "rank correlation"}
    assert ranked == {"K_hdot"}
    assert all(np.isfinite([i.value, i.low, i.high]).all() for i in found)


def test_an_interval_of_a_rank_correlation_that_is_none_holds_zero_nineteen_times_in_twenty(monkeypatch):
    monkeypatch.setattr("workbench.study.sensitivity.RESAMPLES", 2)  # of the other kind of interval
    rng = np.random.default_rng(11)
    hits = 0
    for _ in range(200):
        x = rng.uniform(size=(60, 3))
        table = regression(x, rng.normal(size=(60, 1)))[1][0]
        hits += int(table[0, 1] <= 0 <= table[0, 2])
    assert 180 <= hits <= 199  # binomial(200, 0.95): 190 ± 3.1, so ± 10 is beyond three deviations


def test_every_varying_column_gets_an_index_for_every_parameter():
    x = points("monte_carlo", 100)
    found = indices("monte_carlo", 100, x, {"a": x[:, 0], "b": np.full(100, np.nan)}, NAMES)
    assert {(i.quantity, i.parameter, i.kind) for i in found} == {
        ("a", name, kind) for name in NAMES for kind in ("regression", "rank correlation")
    }
