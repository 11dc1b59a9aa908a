"""The controllable and observable part, and the poles that belong to it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loop_of_1975 import TAU, heave_pitch, sway_roll_yaw
from scipy.linalg import block_diag, qr

from workbench.errors import InputError
from workbench.lti.margin import sensitivity
from workbench.lti.minimal import controllable_observable, loop_poles
from workbench.lti.norm import frequency_response

quick = settings(max_examples=25, deadline=None, derandomize=True)


def four_parts(seed):
    """A system with all four of Kalman's parts, mixed by a rotation and random units; its seen poles are double."""
    rng = np.random.default_rng(seed)
    both = np.array([[-1, 1, 1, 0], [-1, -1, 0, 1], [0, 0, -1, 1], [0, 0, -1, -1.0]])  # −1 ± j, twice, one chain
    A = block_diag(both, np.diag([-1.0, -3]), np.diag([-1.0, -5]), [[-2.0]])
    A[4:6, :4], A[:4, 6:8], A[4:6, 6:9] = (rng.standard_normal(shape) for shape in ((2, 4), (4, 2), (2, 3)))
    A[8, 6:8] = rng.standard_normal(2)
    B, C = np.zeros((9, 2)), np.zeros((2, 9))
    B[:6] = rng.standard_normal((6, 2))
    C[:, :4], C[:, 6:8] = rng.standard_normal((2, 4)), rng.standard_normal((2, 2))
    turn = qr(rng.standard_normal((9, 9)))[0]
    units = 10 ** rng.uniform(-3, 3, 9)
    T, back = units[:, None] * turn, turn.T / units
    return T @ A @ back, T @ B, C @ back


@quick
@given(st.integers(0, 10**6))
def test_the_seen_part_of_a_mixed_system_has_the_right_order_and_its_double_poles(seed):
    part = controllable_observable(*four_parts(seed))
    assert len(part.poles) == 4
    assert np.sort(part.removed_poles.real) == pytest.approx([-5, -3, -2, -1, -1], abs=1e-5)  # a double one among them
    # a chain of two equal poles moves by the root of the rounding: √1e-13 and the chain's conditioning
    assert np.abs(np.abs(part.poles + 1) - 1).max() < 1e-4
    # what two equal poles share, their mean, moves like a simple pole
    assert np.sum(part.poles).real == pytest.approx(-4, abs=1e-8)


@quick
@given(st.integers(0, 10**6))
def test_the_part_answers_every_frequency_like_the_whole(seed):
    A, B, C = four_parts(seed)
    part = controllable_observable(A, B, C)
    omega = np.geomspace(1e-2, 1e2, 20)
    whole = frequency_response(A, B, C, None, omega)
    reduced = frequency_response(part.A, part.B, part.C, None, omega)
    assert np.abs(whole - reduced).max() < 1e-8 * np.abs(whole).max()  # units over six decades


def test_equal_filters_on_relative_and_absolute_rate_cancel_exactly():
    # s/(1 + τs) + τs²/(1 + τs) = s: of ten and fourteen states, four and six sit at −1/τ unseen
    for loop, order, removed in ((heave_pitch(), 6, 4), (sway_roll_yaw(), 8, 6)):
        S = sensitivity(*loop)
        part = controllable_observable(*S[:3])
        assert len(part.poles) == order
        # a cluster of four to six equal eigenvalues that are not defective moves by rounding, not by its root
        assert part.removed_poles == pytest.approx(np.full(removed, -1 / TAU), abs=1e-9)
        # nothing lies between what was kept and what was dropped
        assert part.strongest_dropped < 1e-13 < 1e-3 < part.weakest_kept


def test_the_loop_poles_of_the_report_solve_its_characteristic_polynomial():
    # heave and pitch with K_h + 0.15 s behind the lag: det(M s² − K − B H (K_h + 0.15 s)/(1 + s/100)) = 0
    A, B, C = heave_pitch()
    M, K = np.diag([444800 / 9.80665, 3.41e6]), np.array([[-3.5749e6, 2.4130e6], [2.3492e6, -2.4880e8]])
    force = 2 * np.array([[-3.3981e5, -3.3981e5], [3.0504e6, -2.6075e6]]) @ np.array([[1, -9.0], [1, 7.65]])
    poles = loop_poles(*sensitivity(A, B, C)[:3])
    for s in poles:
        rows = M * s**2 - K - force * (-2.155 + 0.15 * s) / (1 + 0.01 * s)
        sizes = np.linalg.svd(rows / np.sqrt(np.diag(M))[:, None] / np.sqrt(np.diag(M)), compute_uv=False)
        assert sizes[-1] < 1e-9 * max(sizes[0], abs(s) ** 2)  # simple poles of a matrix of norm 1e2
    assert len(poles) == 6


def test_a_double_root_survives_both_reductions():
    # two equal oscillators in a row, seen at the end, beside a third one that no input reaches
    block = np.array([[0, 1], [-4.0, -0.4]])
    A = block_diag(block, block, block)
    A[3, 0] = 1.0
    B, C = np.eye(6)[:, [1]], np.eye(6)[[2]]
    part = controllable_observable(A, B, C)
    assert len(part.poles) == 4
    root = -0.2 + 1j * np.sqrt(4 - 0.04)
    assert np.abs(part.poles[part.poles.imag > 0] - root).max() < 1e-6  # √ε of a double root
    assert np.sum(part.poles).real == pytest.approx(-0.8, abs=1e-14)


def test_units_of_inputs_and_outputs_do_not_decide():
    A, B, C = four_parts(1)
    poles = loop_poles(A, B * [1e9, 1e-9], C * [[1e-7], [1e7]])
    assert len(poles) == 4


def test_a_system_without_actuators_or_sensors_has_no_loop_poles():
    assert len(loop_poles(-np.eye(3), np.zeros((3, 1)), np.ones((1, 3)))) == 0
    assert len(loop_poles(-np.eye(3), np.ones((3, 1)), np.zeros((1, 3)))) == 0
    assert len(loop_poles(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)))) == 0


def test_a_full_system_loses_nothing():
    rng = np.random.default_rng(3)
    A, B, C = rng.standard_normal((12, 12)), rng.standard_normal((12, 2)), rng.standard_normal((2, 12))
    part = controllable_observable(A, B, C)
    assert len(part.removed_poles) == 0
    assert np.sort_complex(part.poles) == pytest.approx(np.sort_complex(np.linalg.eigvals(A)), abs=1e-11)
    assert part.strongest_dropped == 0


def test_a_coupling_counts_from_the_tolerance_on():
    A, B = np.array([[-1.0, 0], [1e-6, -2.0]]), np.array([[1.0], [0]])
    C = np.array([[1.0, 1.0]])
    assert len(controllable_observable(A, B, C).poles) == 2
    assert len(controllable_observable(A, B, C, tolerance=1e-4).poles) == 1


def test_a_tolerance_of_zero_is_refused():
    with pytest.raises(InputError, match="tolerance must lie between 0 and 1; got 0"):
        controllable_observable(-np.eye(1), np.eye(1), np.eye(1), tolerance=0)
