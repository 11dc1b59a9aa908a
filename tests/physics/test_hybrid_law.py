"""The law that hands sway and yaw to the motor: what it commands, what changes nothing, and its loop by two routes."""

import casadi as ca
import numpy as np
import pytest

from workbench.control import GAIN_NAMES, Gains, ModalLaw
from workbench.control.law import CHANNELS, MODAL, Actuator, modal_factors
from workbench.control.loop import close, subject
from workbench.control.loop.group import commanded
from workbench.design.kernel import Complex, largest_square
from workbench.design.measures import GroupMeasures
from workbench.design.starts import SPLIT_CENTRE
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.lti.norm import peak_gain

HYBRID, COILS = load_problem("hybrid_motor"), load_problem("comfort_limit")
LAW, PLANT = HYBRID.law, HYBRID.setting.plant
# an ordinary stable point of the problem, to four digits
GAINS = Gains(
    K_h=0.8065, K_hdot=-0.4766, tau_h=0.1285, K_hp=-4.697, K_hpdot=1.999, tau_hp=0.141,
    K_zddot=0.0251, K_zdot=1.052, tau_z=0.8644, K_yddot=-0.1868, K_ydot=2.914, tau_y=0.2522,
    K_heave=1.0, K_pitch=0.8294, K_sway=0.5389, K_roll=1.523, K_yaw=6.0,
)  # fmt: skip


def column(gains):
    return ca.DM([gains.as_dict()[name] for name in GAIN_NAMES])


def commands_per_channel(law, gains):
    return ca.DM(law.resolution(column(gains))).full()


def test_commands_are_the_modal_spread_of_the_scaled_modal_signals():
    for law in (LAW, COILS.law):
        assert commands_per_channel(law, GAINS) == pytest.approx(
            law.modal_spread() @ law.modal_matrix(GAINS), abs=1e-15
        )


def test_a_law_without_actuators_is_columns_times_factors():
    factors = ca.DM(modal_factors(column(GAINS))).full().ravel()
    assert np.array_equal(commands_per_channel(COILS.law, GAINS), COILS.law.command_columns() * factors)


def test_sway_at_the_centre_of_gravity_drives_only_the_motors_d_current():
    # Y − cΦ with Φ: the corrected signal is Y, so a pure roll leaves the motor alone and the coils answer with K_roll
    filtered = np.zeros(5)
    filtered[CHANNELS.index("roll")], filtered[CHANNELS.index("sway")] = 0.01, -LAW.depth * 0.01
    coils, motor = np.split(commands_per_channel(LAW, GAINS) @ filtered, [4])
    assert motor == pytest.approx(np.zeros(4), abs=1e-17)
    assert coils == pytest.approx(LAW.side * LAW.depth * GAINS.K_roll * 0.01, rel=1e-12)


def test_motor_commands_are_opposite_on_the_two_sides_and_push_back():
    sway, yaw = np.zeros(5), np.zeros(5)
    sway[CHANNELS.index("sway")], yaw[CHANNELS.index("yaw")] = 1.0, 1.0
    positive = GAINS.with_values(K_sway=2.0, K_yaw=3.0)
    d, q = np.split((commands_per_channel(LAW, positive) @ sway)[4:], 2)
    assert d == pytest.approx([2.0, -2.0])
    assert q == pytest.approx([0.0, 0.0])
    arm = np.sqrt((9.0**2 + 7.65**2) / 2)
    turned = (commands_per_channel(LAW, positive) @ yaw)[4:]
    assert turned == pytest.approx([0, 0, 3.0 * arm, -3.0 * arm])
    forces = HYBRID.setting.motor.forces
    assert (forces @ np.r_[d, 0, 0])[2] < 0  # to the left for a displacement to the right
    assert (forces @ turned)[4] < 0  # nose left for a nose turned right


def test_only_one_direction_of_the_seventeen_changes_nothing():
    scale = 1.7
    filters = ("K_h", "K_hdot", "K_zddot", "K_zdot", "K_hp", "K_hpdot", "K_yddot", "K_ydot")
    both = GAINS.with_values(
        **{name: getattr(GAINS, name) * scale for name in filters},
        **{f"K_{m}": getattr(GAINS, f"K_{m}") / scale for m in MODAL},
    )
    lateral_alone = GAINS.rescaled(lateral=scale)

    def poles(gains):
        return np.sort_complex(close(PLANT, LAW, gains).system.poles())

    # 1e-7: a double eigenvalue (vertical filters of equal time constant) splits by the root of rounding
    assert poles(both) == pytest.approx(poles(GAINS), rel=1e-7, abs=1e-6)
    assert np.abs(poles(lateral_alone) - poles(GAINS)).max() > 1e-2
    assert LAW.references == ("K_heave",)
    assert COILS.law.references == ("K_heave", "K_sway")


def test_without_motor_gains_the_motor_is_a_spring_and_the_coils_hold_heave_pitch_and_roll():
    idle = GAINS.with_values(K_sway=0.0, K_yaw=0.0)
    hybrid = subject(PLANT, LAW, "sway_roll_yaw").close(idle)
    coil_law = ModalLaw(LAW.positions, LAW.depth)
    alone = subject(PLANT, coil_law, "sway_roll_yaw").close(idle)

    def moving(closed):
        poles = closed.poles()
        return np.sort_complex(poles[np.abs(poles.imag) > 0.1])

    # the same loop: the motor's lags (−100/s) and idle filters of sway and yaw are real poles; 1e-9 is rounding
    assert moving(hybrid) == pytest.approx(moving(alone), rel=1e-9)


def test_heave_and_pitch_do_not_notice_which_currents_steer_sway_and_yaw():
    closed = [subject(p.setting.plant, p.law, "heave_pitch").close(GAINS) for p in (HYBRID, COILS)]
    omega = 2 * np.pi * np.array([0.3, 1.0, 5.0])
    seen = [c.select(inputs=["zeta_1"], outputs=["Z"]).response(omega) for c in closed]
    # thrust at the height of the cg couples heave and pitch by 1.5e4 N/rad: 0.02 of what pitch feels from heave
    assert seen[0] == pytest.approx(seen[1], rel=5e-3)


def test_groups_together_have_the_poles_of_the_whole_vehicle():
    whole = subject(PLANT, LAW, "all").close(GAINS).poles()
    groups = np.concatenate([subject(PLANT, LAW, g).close(GAINS).poles() for g in ("heave_pitch", "sway_roll_yaw")])
    # what the groups leave out are the currents nobody commands: one coil pattern, two symmetric motor currents
    assert len(whole) == len(groups) + 3
    distance = np.abs(groups[:, None] - whole[None, :]).min(axis=1)
    assert distance.max() < 1e-5  # double eigenvalues split by the root of rounding, 1e-8 × 100/s


def test_patterns_are_orthonormal_and_leave_out_the_coil_pattern_that_only_yaw_would_use():
    for unused, count in ((False, 3), (True, 4)):
        U = commanded("sway_roll_yaw", LAW, unused=unused).patterns
        assert U.shape == (8, count)
        product = U.T @ U
        assert product == pytest.approx(np.eye(count), abs=1e-15)
    assert commanded("sway_roll_yaw", LAW).patterns[:4, 0] == pytest.approx(LAW.side / 2)
    assert np.array_equal(
        commanded("heave_pitch", COILS.law).patterns, subject(COILS.setting.plant, COILS.law, "heave_pitch").patterns
    )


def test_sensitivity_of_the_kernel_is_that_of_the_closed_loop():
    s = subject(PLANT, LAW, "sway_roll_yaw")
    measures = GroupMeasures(HYBRID.setting, s)
    theta = np.array(list(GAINS.as_dict().values()))
    peak = measures.responses(theta).peak
    A, B, C, D = s.sensitivity(s.close(GAINS))
    n = np.eye(len(A))
    direct = [np.linalg.norm(C @ np.linalg.solve(1j * w * n - A, B) + D, 2) for w in measures.omega]
    # 2e-6: the smoothing where two singular values meet, √1e-12 of σ²
    assert np.sqrt(peak.value) == pytest.approx(direct, rel=2e-6)
    exact = peak_gain(A, B, C, D)
    assert np.sqrt(peak.value.max()) <= exact.upper * (1 + 2e-6)


def test_sensitivity_and_mean_squares_fall_with_the_gains_as_their_gradients_say():
    measures = GroupMeasures(HYBRID.setting, subject(PLANT, LAW, "sway_roll_yaw"))
    theta = np.array(list(GAINS.as_dict().values()))
    found = measures.responses(theta)
    mean, peak = found.mean, found.peak
    middle = int(np.argmax(peak.value))
    slope = peak.gradient[middle]
    for name in ("K_sway", "K_yaw", "K_roll", "K_hp", "tau_y", "K_zdot"):
        k, step = GAIN_NAMES.index(name), 1e-5
        move = np.zeros(17)
        move[k] = step
        ends = [measures.responses(theta + sign * move) for sign in (1, -1)]
        (m1, p1), (m0, p0) = ((found.mean.value, found.peak.value) for found in ends)
        # central differences: step² × third derivatives and 1e-16/step of rounding
        assert (p1[middle] - p0[middle]) / (2 * step) == pytest.approx(slope[k], rel=1e-4, abs=1e-6)
        assert (m1 - m0) / (2 * step) == pytest.approx(mean.gradient[:, k], rel=1e-4, abs=1e-9)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_largest_singular_value_in_closed_form_is_that_of_the_decomposition(order):
    generator = np.random.default_rng(5)
    re, im, det_re, det_im = (
        ca.SX.sym(n, *shape)
        for n, shape in (("r", (order, order)), ("i", (order, order)), ("dr", (1, 1)), ("di", (1, 1)))
    )
    formula = ca.Function("f", [re, im, det_re, det_im], [largest_square(Complex(re, im), Complex(det_re, det_im))])
    unitary = np.linalg.qr(generator.normal(size=(order, order)) + 1j * generator.normal(size=(order, order)))[0]
    matrices = [generator.normal(size=(order, order)) + 1j * generator.normal(size=(order, order)) for _ in range(50)]
    matrices += [
        np.eye(order),
        1.3 * unitary,
        unitary @ np.diag([2.0, 2.0, 0.5][:order]),
        unitary @ np.diag([2.0, 0.5, 0.5][:order]),
    ]
    for S in matrices:
        det = 1 / np.linalg.det(S)
        value = float(formula(S.real, S.imag, det.real, det.imag))
        # 3e-6: the smoothing, √1e-12 in the worst case of equal singular values
        assert np.sqrt(value) == pytest.approx(np.linalg.norm(S, 2), rel=3e-6)


def test_largest_singular_value_has_a_finite_slope_where_singular_values_meet():
    re, im = ca.SX.sym("r", 3, 3), ca.SX.sym("i", 3, 3)
    value = largest_square(Complex(re, im), None)
    slope = ca.Function("slope", [re, im], [ca.gradient(value, re)])
    for S in (np.eye(3), np.diag([2.0, 2.0, 0.5]), np.diag([2.0, 0.5, 0.5])):
        assert np.all(np.isfinite(slope(S, np.zeros((3, 3))).full()))


@pytest.mark.parametrize(
    ("actuators", "sentence"),
    [
        ((Actuator("a", "sway", 1.0), Actuator("a", "yaw", 1.0)), "actuators must differ in their name"),
        ((Actuator("a", "sway", 1.0), Actuator("b", "sway", 1.0)), "actuators must differ in their signal"),
    ],
)
def test_actuators_that_share_a_name_or_a_signal_are_refused(actuators, sentence):
    with pytest.raises(InputError, match=sentence):
        ModalLaw(LAW.positions, LAW.depth, actuators)


def test_an_actuator_for_roll_or_without_lever_is_refused():
    with pytest.raises(InputError, match="must take one of sway, yaw; 'a' got 'roll'"):
        Actuator("a", "roll", 1.0)
    with pytest.raises(InputError, match="lever of 'a' must be finite and not zero"):
        Actuator("a", "yaw", 0.0)


def test_single_columns_of_a_split_law_are_refused():
    with pytest.raises(InputError, match="no single column for each channel"):
        LAW.command_columns()


def test_yaw_alone_can_be_handed_over():
    law = ModalLaw(LAW.positions, LAW.depth, (Actuator("motor_q", "yaw", 8.0),))
    kept = commands_per_channel(law, GAINS)[:4, :4]
    # the coils keep heave, pitch, roll and sway as without actuators
    assert kept == pytest.approx(commands_per_channel(COILS.law, GAINS)[:, :4], abs=1e-14)
    assert law.references == ("K_heave", "K_sway")


def test_the_start_of_a_split_law_lies_within_the_problems_bounds():
    for name, (low, high) in HYBRID.bounds.items():
        assert low <= SPLIT_CENTRE[name] <= high
