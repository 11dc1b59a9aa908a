"""The sampled law: Tustin's rule against SciPy's, limits, the bound on its step response, refusals."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.signal import cont2discrete, dlsim

from workbench.control import Gains, ModalLaw
from workbench.control.discrete import discrete_acceleration, discrete_gap, discretise
from workbench.errors import InputError

LAW = ModalLaw(((9.0, 0.965), (9.0, -0.965), (-7.65, 0.965), (-7.65, -0.965)), 1.21)
GAINS = Gains(
    K_h=-1.03219, K_hdot=0.32547, tau_h=0.399399, K_hp=0.366128, K_hpdot=0.632934, tau_hp=0.105972,
    K_zddot=0.16238, K_zdot=0.328058, tau_z=0.841518, K_yddot=-0.156948, K_ydot=1.1661, tau_y=0.209657,
    K_heave=1.0, K_pitch=0.975784, K_sway=1.0, K_roll=2.21167, K_yaw=0.470042,
)  # fmt: skip
T = 1e-3


def test_the_law_is_scipys_bilinear_transform_of_the_continuous_law():
    A, B, C, D, _ = cont2discrete(LAW.numeric(GAINS), T, method="bilinear")
    own = discretise(LAW, GAINS, T)
    noise = np.random.default_rng(1).normal(size=(3000, 16))
    _, theirs, _ = dlsim((A, B, C, D, T), noise)
    # 3000 steps of rounding around commands of size 10: two routes agree to 1e-12 relative
    np.testing.assert_allclose(own.commands(noise), theirs, atol=1e-11)
    z = np.exp(1j * np.array([0.01, 0.5, 3.0]))
    for point in z:
        a, b, c, d = own.state_space()
        H = [m[2] @ np.linalg.solve(point * np.eye(10) - m[0], m[1]) + m[3] for m in ((a, b, c, d), (A, B, C, D))]
        np.testing.assert_allclose(H[0], H[1], atol=1e-11)  # resolvents of size 1/(1 − |p|) ≈ 1e3 on rounding 1e-16


def test_a_law_with_motors_is_sampled_as_one_without():
    law = ModalLaw.with_motor(LAW.positions, LAW.depth)
    A, B, C, D, _ = cont2discrete(law.numeric(GAINS), T, method="bilinear")
    noise = np.random.default_rng(2).normal(size=(500, 16))
    own = discretise(law, GAINS, T).commands(noise)
    assert own.shape == (500, 8)
    # motor commands reach 200 (the lever of yaw is 8 m): 1e-12 relative, as above
    np.testing.assert_allclose(own, dlsim((A, B, C, D, T), noise)[1], atol=1e-10)


def test_low_frequencies_pass_as_in_continuous_time_and_tustins_warp_says_where():
    # H_d(e^{jωT}) = H(j (2/T) tan(ωT/2)) is what Tustin without prewarping means
    A, B, C, D = LAW.numeric(GAINS)
    a, b, c, d = discretise(LAW, GAINS, T).state_space()
    for omega in (0.1, 10.0, 1000.0):
        s = 2j / T * np.tan(omega * T / 2)
        continuous = C @ np.linalg.solve(s * np.eye(len(A)) - A, B) + D
        sampled = c @ np.linalg.solve(np.exp(1j * omega * T) * np.eye(len(a)) - a, b) + d
        # the resolvent at ωT = 1e-4 divides by 1e-3, so rounding grows from 1e-16 to 1e-12
        np.testing.assert_allclose(sampled, continuous, atol=1e-11)


def test_a_constant_input_is_passed_exactly_by_every_filter():
    law = discretise(LAW, GAINS, T)
    expected = [GAINS.K_h] * 3 + [GAINS.K_hp] * 2
    np.testing.assert_allclose((law.direct + law.memory)[:5], expected, atol=1e-15)  # one addition's rounding


def test_numerators_and_denominators_are_those_of_the_substitution_in_symbols():
    K, K_dot, tau, sample, z = (ca.SX.sym(n) for n in ("K", "K_dot", "tau", "T", "z"))
    s = 2 / sample * (z - 1) / (z + 1)
    for rule, exact in (
        (discrete_gap, K + K_dot * s / (1 + tau * s)),
        (discrete_acceleration, K + K_dot * tau / (1 + tau * s)),
    ):
        advance, direct, memory = rule(K, K_dot, tau, sample)
        ours = direct + memory * advance / (z - 1 + advance)
        difference = ca.Function("d", [K, K_dot, tau, sample, z], [ours - exact])
        assert abs(float(difference(-1.3, 0.7, 0.4, 0.01, 1.7))) < 1e-14  # rounding of numbers of size one


@settings(max_examples=60, deadline=None)
@given(
    ratio=st.floats(1e-4, 1.0),
    tau=st.floats(0.01, 4.0),
    rate=st.floats(0.01, 5.0),
)
def test_no_sample_of_a_step_response_leaves_the_stated_bound(ratio, tau, rate):
    sample = ratio * tau
    gains = GAINS.with_values(K_hdot=rate, tau_h=tau, K_zdot=rate, tau_z=tau, tau_hp=5.0, tau_y=5.0)
    law = discretise(LAW, gains, sample)
    k = np.arange(400)
    low_pass = 1 - np.exp(-k * sample / tau)
    exact = {0: gains.K_h + rate / tau * (1 - low_pass), 5: gains.K_zddot + rate * tau * low_pass}
    for filter_number, wanted in exact.items():
        state = 1 - (1 - law.advance[filter_number]) ** k  # s after k samples of a unit step
        step = law.direct[filter_number] + law.memory[filter_number] * state
        worst = np.abs(step - wanted).max()
        assert worst <= law.step_bound[filter_number] * (1 + 1e-9) + 1e-12  # rounding
        # met to 1/(1 + T/2τ) at the first sample, so the bound cannot be made smaller by more than a third
        assert worst >= law.step_bound[filter_number] / 1.5 * (1 - 1e-9) - 1e-12


def test_commands_stay_within_their_bound_of_the_continuous_law_and_come_near_it():
    A, B, C, D = LAW.numeric(GAINS)
    law = discretise(LAW, GAINS, T)
    bound, steps = law.command_step_bound(), 1500
    turn = expm(A * T)
    worst = np.zeros_like(bound)
    for sensor in range(16):
        unit = np.zeros((steps, 16))
        unit[:, sensor] = 1.0
        own = law.commands(unit)
        state, exact = np.zeros(len(A)), []
        settled = -np.linalg.solve(A, B[:, sensor])
        for _ in range(steps):
            exact.append(C @ state + D[:, sensor])
            state = settled + turn @ (state - settled)
        worst[:, sensor] = np.abs(own - np.array(exact)).max(axis=0)
    assert np.all(worst <= bound + 1e-12)
    assert worst.max() > 0.5 * bound.max()


def test_a_filter_without_rate_gain_keeps_no_state():
    law = discretise(LAW, GAINS.with_values(K_zdot=0.0, K_hpdot=0.0, tau_hp=0.0), T)
    assert (
        np.flatnonzero(law.advance).tolist()
        == LAW.kept_filters(GAINS.with_values(K_zdot=0.0, K_hpdot=0.0, tau_hp=0.0)).tolist()
        == [0, 1, 2, 8, 9]
    )
    assert law.direct[5] == GAINS.K_zddot


@pytest.mark.parametrize("sample", [0.0, -1e-3, float("nan"), float("inf")])
def test_an_impossible_sample_time_is_refused(sample):
    with pytest.raises(InputError, match="sample time must be positive and finite"):
        discretise(LAW, GAINS, sample)


def test_a_sample_time_longer_than_a_filter_is_refused_by_name():
    with pytest.raises(InputError, match=r"at most the filter's time constant tau_hp = 0\.105972 s; got 0\.2 s"):
        discretise(LAW, GAINS, 0.2)
    with pytest.raises(InputError, match="tau_h = 0 s"):
        discretise(LAW, GAINS.with_values(tau_h=0.0), T)


def test_sensor_samples_of_another_width_are_refused():
    with pytest.raises(InputError, match=r"shape \(samples, 16\); got \(5, 4\)"):
        discretise(LAW, GAINS, T).commands(np.zeros((5, 4)))
