"""The report's fit of the characteristic polynomial (C.3) against the exact expansion."""

import numpy as np
import pytest

from workbench.control.gains import TIME_CONSTANTS
from workbench.control.loop.determinant import determinant_fit, fit_coefficients, pair_count, point_ratio
from workbench.control.loop.polynomial import loop_polynomial
from workbench.errors import InputError
from workbench.ledger.baseline import report_gains, report_law, report_model


def loop_matrix(part: str, **changed):
    return loop_polynomial(report_model().plant, report_law(), part, report_gains().with_values(**changed)).matrix


@pytest.mark.parametrize(
    ("pairs", "printed"), [(2, 2.0), (3, 2.0), (4, 2.0), (5, 1.468), (6, 1.233), (7, 1.135), (8, 1.086)]
)
def test_the_ratio_of_points_follows_the_rule(pairs, printed):
    # C.3 prints 2, 2, 2, 1.5, 1.25, 1.14, 1.09: the rule's values, rounded up
    assert point_ratio(pairs) == pytest.approx(printed, abs=5e-4)


def test_the_diagonal_product_just_reaches_ten_to_the_k():
    for pairs in (5, 6, 7, 8):
        points = point_ratio(pairs) ** np.arange(pairs)
        assert np.prod(points ** (2 * np.arange(pairs))) == pytest.approx(1e10, rel=1e-9)


@pytest.mark.parametrize(("order", "pairs"), [(4, 2), (6, 3), (8, 4), (9, 5), (12, 6)])
def test_half_the_order_rounded_up_gives_the_pairs(order, pairs):
    assert pair_count(order) == pairs


@pytest.mark.parametrize("order", [4, 5, 8])
def test_a_polynomial_is_found_again_from_its_values(order):
    coefficients = np.random.default_rng(order).normal(size=order + 1)
    found, points, condition = fit_coefficients(lambda s: float(np.polyval(coefficients[::-1], s)), order)
    assert found == pytest.approx(
        coefficients, abs=1e-9
    )  # condition of the Vandermonde matrix (4e5) times 1e-16, with room
    assert len(points) == pair_count(order)
    assert condition < 1e6


@pytest.mark.parametrize("part", ["heave_pitch", "sway_roll_yaw"])
def test_double_precision_pays_for_the_vandermonde_matrix_without_filters(part):
    fit = determinant_fit(loop_matrix(part, **dict.fromkeys(TIME_CONSTANTS, 0.0)))
    assert fit.coefficient_error < 1e-10
    assert fit.root_error < 1e-9


def test_near_coincident_roots_every_polynomial_loses_half_the_digits():
    # double −1/τ of the filters: roots of the exact coefficients are no better than those of the fit
    fit = determinant_fit(loop_matrix("heave_pitch"))
    assert fit.coefficient_error < 1e-11
    assert 1e-6 < fit.root_error < 1e-2


def test_single_precision_cannot_pay_at_order_twelve():
    matrix = loop_matrix("sway_roll_yaw", tau_h=0.45, tau_hp=0.1, tau_z=0.8, tau_y=0.2)
    assert determinant_fit(matrix).root_error < 1e-4
    assert determinant_fit(matrix, dtype=np.float32).root_error > 0.1


def test_bad_points_and_orders_are_refused():
    with pytest.raises(InputError, match="at least 1; got 0"):
        pair_count(0)
    with pytest.raises(InputError, match="ratio above 1"):
        fit_coefficients(lambda s: s, 4, beta=1.0)
