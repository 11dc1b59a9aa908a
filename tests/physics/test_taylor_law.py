"""Expansions of the exact law, and what they are worth."""

import casadi as ca
import numpy as np
import pytest

from workbench.errors import InputError
from workbench.physics.forces.law import report_extended
from workbench.physics.forces.operating import law_at
from workbench.physics.forces.taylor import Region, TaylorLaw, error_over

EXACT = law_at()
RIDE = Region(gap=0.03, gap_lateral=0.03, roll=0.02, alpha=0.2)  # some two standard deviations of the revenue vehicle


def half(region, factor=0.5):
    return Region(
        gap=region.gap * factor, gap_lateral=region.gap_lateral * factor, roll=region.roll * factor, alpha=region.alpha
    )


def test_the_first_order_is_value_stiffness_and_action_of_the_current():
    first = TaylorLaw.from_corner(EXACT, 1).first_order()
    table = np.array([first.lift, first.lateral, first.moment])
    scale = np.abs(table).max()
    assert table[:, 0] == pytest.approx(np.array(EXACT.forces(0.0, 0.0, 0.0, 0.0)), rel=1e-9)
    # two ways of differentiating the same energy
    assert table[:, 1:4] == pytest.approx(EXACT.stiffness(), rel=1e-9, abs=1e-9 * scale)
    assert table[:, 4] == pytest.approx(EXACT.current_action(), rel=1e-9)


def test_second_order_terms_are_second_derivatives():
    law = TaylorLaw.from_corner(EXACT, 2)
    x = ca.SX.sym("x", 4)
    lift = EXACT.forces(*ca.vertsplit(x))[0]
    hessian = ca.Function("H", [x], [ca.hessian(lift, x)[0]])(ca.DM.zeros(4)).full()
    for i in range(4):
        for j in range(i, 4):
            powers = tuple((position == i) + (position == j) for position in range(4))
            expected = hessian[i, j] / (2 if i == j else 1)
            # solved from a lattice of directions: a few digits of rounding
            assert law.coefficient(0, powers) == pytest.approx(expected, rel=1e-7, abs=1e-3)


def test_a_symmetric_stiffness_belongs_to_every_order():
    x = ca.SX.sym("x", 3)
    for order in (1, 2):
        forces = ca.vertcat(*TaylorLaw.from_corner(EXACT, order).forces(x[0], x[1], x[2], 0.3))
        stiffness = ca.Function("K", [x], [ca.jacobian(forces, x)])([0.02, -0.01, 0.03]).full()
        assert stiffness == pytest.approx(stiffness.T, rel=1e-10)


@pytest.mark.parametrize("order", [1, 2])
def test_the_error_falls_with_the_next_power_of_the_deviation(order):
    law = TaylorLaw.from_corner(EXACT, order)
    large, small = (error_over(law, EXACT, region) for region in (half(RIDE), half(RIDE, 0.25)))
    # halving gaps and roll divides the error by 2^(order + 1), up to the next term: 30 % at these sizes
    assert large.lift / small.lift == pytest.approx(2 ** (order + 1), rel=0.3)


def test_errors_over_the_ride_are_nine_percent_and_one():
    errors = [error_over(TaylorLaw.from_corner(EXACT, order), EXACT, RIDE).relative[0] for order in (1, 2)]
    assert errors == pytest.approx([0.0887, 0.01015], rel=0.01)  # regression


def test_the_mended_table_is_as_good_as_the_exact_coefficients_and_the_printed_one_is_not():
    exact = error_over(TaylorLaw.from_corner(EXACT, 1), EXACT, RIDE).relative
    mended = error_over(report_extended(corrected=True), EXACT, RIDE).relative
    printed = error_over(report_extended(corrected=False), EXACT, RIDE).relative
    assert np.array(mended) == pytest.approx(np.array(exact), rel=0.05)  # the report's 0.2 % in the moment
    assert printed[2] > 1.15 * exact[2]


@pytest.mark.slow  # the energy is differentiated six times: half a minute
def test_every_order_gains_most_of_a_digit_up_to_the_fifth():
    errors = [error_over(TaylorLaw.from_corner(EXACT, order), EXACT, RIDE).relative for order in range(1, 6)]
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert ratios.min() > 4  # measured 4.3 … 12: the series converges like (0.03 + …)/0.3
    assert max(errors[-1]) < 1e-4


def test_the_region_counts_its_poses_and_leaves_out_what_does_not_move():
    found = error_over(report_extended(), EXACT, Region(gap=0.01, gap_lateral=0.0, roll=0.0, alpha=0.1), points=3)
    assert found.points == 9
    assert "largest lift error" in repr(found)


def test_impossible_orders_and_regions_are_refused():
    with pytest.raises(InputError, match=r"the order of an expansion must be 1 … 5; got 6"):
        TaylorLaw.from_corner(EXACT, 6)
    with pytest.raises(InputError, match=r"Region.gap must be a half width, finite and not negative; got -0.1"):
        Region(gap=-0.1, gap_lateral=0.0, roll=0.0, alpha=0.0)
    with pytest.raises(InputError, match="the coils must stay clear of the guideway"):
        error_over(report_extended(), EXACT, Region(gap=0.25, gap_lateral=0.0, roll=0.0, alpha=0.0))
    with pytest.raises(InputError, match="points must be at least 2"):
        error_over(report_extended(), EXACT, RIDE, points=1)
