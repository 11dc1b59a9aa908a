"""The modal law: transformation matrices of Table B-3, decoupling, invariance, filters."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.control import Gains, ModalLaw, filters
from workbench.control.gains import GAIN_NAMES
from workbench.control.loop import close
from workbench.errors import InputError
from workbench.ledger.baseline import report_gains, report_law, report_model, report_vehicle
from workbench.physics.vehicle import linearise

A_F, A_R, B, C = 9.0, 7.65, 0.965, 1.21
D = A_F + A_R
POSITIVE = st.floats(0.2, 5.0)


def printed_P() -> np.ndarray:
    """P_SS, P_AS and P_AA of Table B-3: rows Z, Θ, Y, Φ, Ψ, columns vertical 1…4, lateral 1…4."""
    P_SS = np.array([[-A_R, -A_R, -A_F, -A_F], [1, 1, -1, -1]]) / (2 * D)
    P_AS = np.array([[-C, C, -C, C], [-1, 1, -1, 1], [0, 0, 0, 0]]) / (4 * B)
    P_AA = np.array([[A_R, -A_R, A_F, -A_F], [0, 0, 0, 0], [1, -1, -1, 1]]) / (2 * D)
    return np.block([[P_SS, np.zeros((2, 4))], [P_AS, P_AA]])


def test_the_printed_inverse_is_the_pseudo_inverse():
    assert np.linalg.pinv(report_law().displacement_matrix()) == pytest.approx(
        printed_P(), abs=1e-14
    )  # rounding of an SVD, by any BLAS


def test_the_displacement_matrix_is_the_printed_one():
    Q_SS = [[-1, A_F], [-1, A_F], [-1, -A_R], [-1, -A_R]]
    Q_SA = [[0, -B, 0], [0, B, 0], [0, -B, 0], [0, B, 0]]
    Q_AA = [[1, -C, A_F], [-1, C, -A_F], [1, -C, -A_R], [-1, C, A_R]]
    expected = np.block([[np.array(Q_SS), np.array(Q_SA)], [np.zeros((4, 2)), np.array(Q_AA)]])
    assert report_law().displacement_matrix() == pytest.approx(expected)


def test_displacements_of_the_vehicle_are_those_of_the_law():
    plant = report_model().plant
    gaps = plant.index("outputs", [f"gap_{i}" for i in range(1, 5)] + [f"gap_lateral_{i}" for i in range(1, 5)])
    assert plant.C[gaps][:, :5] == pytest.approx(report_law().displacement_matrix(), abs=1e-15)


def test_measuring_a_pose_gives_its_modal_signals():
    Z, Theta, Y, Phi, Psi = 0.01, -0.002, 0.03, 0.004, -0.001
    sensed = report_law().displacement_matrix() @ [Z, Theta, Y, Phi, Psi]
    modal = report_law().measurement_matrix()[:5, :8] @ sensed
    assert modal == pytest.approx([Z, Theta, Phi, Y - C * Phi, Psi], abs=1e-15)


def test_symmetric_currents_do_not_move_the_lateral_group():
    # B_A Q_SS = 0 and B_S Q_AA = 0
    current, Q = report_model().current, report_law().displacement_matrix()
    scale = np.abs(current).max()
    assert current[2:] @ Q[:4, :2] == pytest.approx(np.zeros((3, 2)), abs=1e-12 * scale)
    assert current[:2] @ Q[4:, 2:] == pytest.approx(np.zeros((2, 3)), abs=1e-12 * scale)


def test_there_are_four_independent_command_patterns():
    # sway and roll share one
    assert np.linalg.matrix_rank(report_law().command_columns()) == 4


@given(vertical=POSITIVE, lateral=POSITIVE)
@settings(max_examples=10, deadline=None)
def test_rescaled_gains_are_the_same_law(vertical, lateral):
    gains = report_gains()
    changed = gains.rescaled(vertical=vertical, lateral=lateral)
    for one, other in zip(report_law().numeric(gains), report_law().numeric(changed), strict=True):
        if one.shape == other.shape:
            continue
        pytest.fail("the number of filters changed")
    plant = report_model().plant
    omega = np.array([0.1, 3.0, 20.0])
    one, other = (close(plant, report_law(), g).system.response(omega) for g in (gains, changed))
    assert other == pytest.approx(one, rel=1e-9, abs=1e-12)  # products of factors up to 25


def test_normalised_gains_have_unit_heave_and_sway():
    normal = report_gains().with_values(K_heave=2.0, K_sway=0.5).normalised()
    assert (normal.K_heave, normal.K_sway) == (1.0, 1.0)


def test_the_state_space_is_the_filters_of_every_channel():
    gains, law = report_gains().with_values(K_hp=0.2, K_zddot=0.03, tau_z=0.3, tau_hp=0.1, tau_y=0.9), report_law()
    A, Bc, Cc, Dc = law.numeric(gains)
    omega = 2.7
    found = Cc @ np.linalg.solve(1j * omega * np.eye(len(A)) - A, Bc) + Dc
    channels = [
        filters.gap_response(gains.K_h, gains.K_hdot, gains.tau_h, omega),
        filters.gap_response(gains.K_hp, gains.K_hpdot, gains.tau_hp, omega),
        filters.acceleration_response(gains.K_zddot, gains.K_zdot, gains.tau_z, omega),
        filters.acceleration_response(gains.K_yddot, gains.K_ydot, gains.tau_y, omega),
    ]
    signals = np.repeat([complex(*c) for c in channels], [3, 2, 3, 2])  # heave, pitch, roll; sway, yaw
    factors = np.array([gains.K_heave, gains.K_pitch, gains.K_sway - gains.K_roll, gains.K_sway, gains.K_yaw])
    resolve = np.tile(law.command_columns() * factors, 2)
    assert found == pytest.approx(resolve @ np.diag(signals) @ law.measurement_matrix(), abs=1e-12)


@given(t=st.tuples(*[st.floats(0.0, 2.0)] * 2), k=st.tuples(*[st.floats(-2.0, 2.0)] * 4), omega=st.floats(0.1, 50.0))
@settings(max_examples=30, deadline=None)
def test_one_fraction_stands_for_both_filters(t, k, omega):
    # K_0 = H_gap + s² H_acc, Table C-1, any time constants including zero
    (tau_gap, tau_acc), (K, rate, direct, velocity), s = t, k, 1j * omega
    top, bottom = filters.combined_fraction(K, rate, tau_gap, direct, velocity, tau_acc)
    found = np.polyval(top[::-1], s) / np.polyval(bottom[::-1], s)
    expected = K + rate * s / (1 + tau_gap * s) + s**2 * (direct + velocity * tau_acc / (1 + tau_acc * s))
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * (1 + omega**2))


@pytest.mark.parametrize(
    ("t_1", "t_2", "d", "k"),
    [
        (
            0.3,
            0.5,
            "1, t1 + t2, t1*t2",
            "t3, t2*t3 + (t1*t3 + t4), t2*(t1*t3 + t4) + (t5 + t2*t6), t1*(t5 + t2*t6) + t2*t5, t1*t2*t5",
        ),
        (0.0, 0.5, "1, t2, 0", "t3, t2*t3 + t4, t2*t4 + (t5 + t2*t6), t2*t5, 0"),
        (0.0, 0.0, "1, 0, 0", "t3, t4, t5, 0, 0"),
    ],
)
def test_the_branches_of_table_c1_are_time_constants_of_zero(t_1, t_2, d, k):
    # Table C-1; its k_1 = t_1 + t_4 for t_1 = t_2 = 0 is t_4
    t = {"t1": t_1, "t2": t_2, "t3": -1.1, "t4": 0.3, "t5": 0.02, "t6": 0.7}
    top, bottom = filters.combined_fraction(t["t3"], t["t4"], t_1, t["t5"], t["t6"], t_2)
    assert bottom == pytest.approx(list(eval(f"[{d}]", {}, t)))
    assert top == pytest.approx(list(eval(f"[{k}]", {}, t)))


def test_equal_time_constants_and_rates_cancel_the_filter():
    # C.2: t_1 = t_2, t_4 = t_6 makes K_0 = t_3 + t_7 s + t_5 s²; Table C-1's own column for t_1 = t_2 has d_1 = t_1
    top, bottom = filters.combined_fraction(-2.155, 0.15, 0.637, 0.02, 0.15, 0.637)
    quotient, rest = np.polynomial.polynomial.polydiv(top, bottom)
    assert quotient == pytest.approx([-2.155, 0.15, 0.02])
    assert rest == pytest.approx(0.0, abs=1e-12)


def test_responses_of_the_filters_are_their_fractions():
    omega = 1.7
    for fraction, response, numbers in (
        (filters.gap_fraction, filters.gap_response, (-1.1, 0.35, 0.45)),
        (filters.acceleration_fraction, filters.acceleration_response, (0.17, 0.33, 0.8)),
    ):
        top, bottom = fraction(*numbers)
        expected = np.polyval(top[::-1], 1j * omega) / np.polyval(bottom[::-1], 1j * omega)
        assert complex(*(float(part) for part in response(*numbers, omega))) == pytest.approx(expected)


def test_an_unfiltered_rate_has_no_state_space():
    with pytest.raises(InputError, match="tau_h must be positive where responses are asked for"):
        report_law().numeric(report_gains().with_values(tau_h=0.0))


def test_filters_without_gain_are_dropped():
    assert len(report_law().kept_filters(report_gains())) == 10
    assert len(report_law().kept_filters(report_gains().with_values(K_hpdot=0.0))) == 8
    assert len(report_law().numeric(report_gains().with_values(K_zdot=0.0))[0]) == 7


@pytest.mark.parametrize(
    ("mapping", "sentence"),
    [
        ({"K_hh": 1.0}, "unknown gain 'K_hh'"),
        ({"K_h": 1.0}, "must name all seventeen parameters; missing K_hdot"),
    ],
)
def test_gains_come_under_their_own_names_only(mapping, sentence):
    with pytest.raises(InputError, match=sentence):
        Gains.from_mapping(mapping)


@pytest.mark.parametrize(
    ("name", "bad", "sentence"),
    [
        ("K_h", float("nan"), "K_h must be a finite number"),
        ("K_h", True, "K_h must be a finite number"),
        ("K_h", 1e9, "Check its unit"),
        ("tau_h", -0.1, "must not be negative"),
    ],
)
def test_gains_that_cannot_be_meant_are_refused(name, bad, sentence):
    with pytest.raises(InputError, match=sentence):
        report_gains().with_values(**{name: bad})


def test_the_names_are_kept_in_order():
    assert tuple(report_gains().as_dict()) == GAIN_NAMES
    assert Gains.from_mapping(report_gains().as_dict()) == report_gains()
    with pytest.raises(InputError, match="scale factors must be positive"):
        report_gains().rescaled(vertical=0.0)


def test_coil_sets_in_one_row_cannot_be_told_apart():
    with pytest.raises(InputError, match="at two stations"):
        ModalLaw(((0.0, 1.0), (0.0, -1.0), (0.0, 1.0), (0.0, -1.0)), 1.0)


def test_a_law_for_six_sets_closes_a_loop_for_six():
    places = tuple((x, side * 0.965) for x in (9.0, 0.5, -7.65) for side in (1, -1))
    vehicle = report_vehicle().with_values(positions=places)
    loop = close(linearise(vehicle).plant, ModalLaw(places, 1.21), report_gains())
    assert len(loop.system.states) == 20
    assert loop.system.poles().real.max() < 0
