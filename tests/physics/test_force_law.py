"""The report's expansions, as printed and as mended."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.physics.forces.law import ExtendedLaw, FirstOrderLaw, ForceLaw, report_extended, report_first_order


def test_the_nominal_forces_are_the_printed_ones():
    # A.3, first-order expansion, constants
    assert report_first_order().forces(0.0, 0.0, 0.0, 0.0) == (1.1120e5, 3.9640e4, 1.1768e4)


def test_a_centimetre_up_with_a_tenth_of_control_current_follows_the_printed_line():
    # A.3: 1.1120(05) - 8.9372(05) Δh + 3.3981(05) α
    lift, _, _ = report_first_order().forces(0.01, 0.0, 0.0, 0.1)
    assert lift == pytest.approx(1.1120e5 - 8.9372e3 + 3.3981e4, rel=1e-12)  # rounding


def test_four_coil_sets_drag_with_9800_newtons():
    # 4 (F_L0 + F_G0)/61.505, A.1 (e) with the printed constants
    law = report_first_order()
    lift, lateral, _ = law.forces(0.0, 0.0, 0.0, 0.0)
    assert 4 * law.drag_ratio * (lift + lateral) == pytest.approx(9810, abs=0.5)


def test_the_extended_law_is_quadratic_in_the_current():
    law = report_extended()
    lift, _, _ = law.forces(0.01, 0.0, 0.0, 0.2)
    # A.3, table after Figure A-9, rows 1, α, α²
    expected = (1.1120e5 - 8.9372e3 + 0.2 * 3.3981e5) + 0.2 * (-3.0328e4 + 0.2 * 2.7177e5) + 0.04 * -2.6868e4
    assert lift == pytest.approx(expected, rel=1e-12)  # rounding


@settings(max_examples=20, deadline=None)
@given(deviation=st.tuples(*[st.floats(-0.1, 0.1)] * 3), alpha=st.floats(-0.5, 0.5))
def test_the_mended_law_has_a_symmetric_stiffness_at_every_pose(deviation, alpha):
    stiffness = stiffness_of(report_extended(corrected=True), deviation, alpha)
    assert stiffness == pytest.approx(stiffness.T, rel=1e-9)  # entries copied digit by digit


def test_the_printed_law_has_not():
    stiffness = stiffness_of(report_extended(corrected=False), (0.0, 0.0, 0.0), 0.2)
    # α φ of F_L is 6626, α Δh of L is 6260.1; the other pair agrees, both with the wrong sign
    assert stiffness[0, 2] - stiffness[2, 0] == pytest.approx(0.2 * (6626 - 6260.1), rel=1e-9)


def stiffness_of(law, deviation, alpha):
    x = ca.SX.sym("x", 3)
    forces = ca.vertcat(*law.forces(x[0], x[1], x[2], alpha))
    return ca.Function("K", [x], [ca.jacobian(forces, x)])(deviation).full()


def test_numbers_arrays_and_symbols_give_the_same_forces():
    x = ca.SX.sym("x", 4)
    for law in (report_first_order(), report_extended()):
        assert isinstance(law, ForceLaw)
        symbolic = ca.Function("f", [x], list(law.forces(*ca.vertsplit(x))))(ca.DM([0.01, -0.02, 0.03, 0.1]))
        numbers = law.forces(0.01, -0.02, 0.03, 0.1)
        arrays = law.forces(np.array([0.0, 0.01]), np.array([0.0, -0.02]), np.array([0.0, 0.03]), np.array([0.0, 0.1]))
        for value, symbol, array in zip(numbers, symbolic, arrays, strict=True):
            assert float(symbol) == pytest.approx(value, rel=1e-14)
            assert array[1] == pytest.approx(value, rel=1e-14)


def test_wrong_numbers_of_coefficients_are_refused():
    with pytest.raises(InputError, match=r"FirstOrderLaw.lift must hold 5 coefficients; got 2"):
        FirstOrderLaw(lift=(1.0, 2.0), lateral=(0.0,) * 5, moment=(0.0,) * 5, drag_ratio=0.0)
    with pytest.raises(InputError, match=r"ExtendedLaw.lift must have three rows .*; got 1"):
        ExtendedLaw(lift=((0.0,) * 5,), lateral=(), moment=(), drag_ratio=0.0)
    with pytest.raises(InputError, match=r"drag_ratio must be f_D/f_L, finite and not negative; got -1.0"):
        FirstOrderLaw(lift=(0.0,) * 5, lateral=(0.0,) * 5, moment=(0.0,) * 5, drag_ratio=-1.0)
    with pytest.raises(InputError, match=r"FirstOrderLaw.moment must hold finite numbers; got nan"):
        FirstOrderLaw(lift=(0.0,) * 5, lateral=(0.0,) * 5, moment=(float("nan"),) * 5, drag_ratio=0.0)
