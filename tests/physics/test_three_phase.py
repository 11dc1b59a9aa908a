"""Three phases: the identities of section 5.1.1 and Appendix I, ripple, slip and unbalance."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.physics.motor import components, force_lines, pose_forces
from workbench.physics.motor.three_phase import (
    BALANCED,
    direction,
    phase_product,
    symmetrical_components,
    synchronous_sum,
    three_phase_sum,
    travelling_sum,
)

HARMONICS = {1: 1340.0, 3: 232.0, 5: 41.0, 7: 7.0, 9: 1.3, 11: 0.5, 13: 0.2}
angle = st.floats(-10, 10)
rounding = 1e-11 * 1340  # sums of a few dozen cosines of arguments up to 200


@given(electrical=angle, time=angle)
def test_equation_8_is_the_sum_of_equation_4(electrical, time):
    direct = float(three_phase_sum(HARMONICS, electrical, time))
    assert float(travelling_sum(HARMONICS, electrical, time)) == pytest.approx(direct, abs=rounding)


@given(time=angle, lag=angle)
def test_equation_10_is_equation_8_seen_by_a_coil_that_keeps_pace(time, lag):
    seen = float(travelling_sum(HARMONICS, time - lag, time))
    assert float(synchronous_sum(HARMONICS, lag, time)) == pytest.approx(seen, abs=rounding)


@given(electrical=angle, time=angle, n=st.sampled_from([1, 3, 5, 7, 11]), m=st.sampled_from([0, 1, 2]))
def test_the_identity_of_appendix_i_holds_with_a_minus_before_its_last_term(electrical, time, n, m):
    shift = 2 * m * np.pi / 3
    product = np.cos(n * (electrical - shift)) * np.cos(time - shift)
    assert float(phase_product(n, m, electrical, time)) == pytest.approx(product, abs=1e-12)


def test_the_identity_of_appendix_i_as_printed_is_wrong_by_the_last_term():
    # found at m = 1, n = 3; the two signs differ by sin(γ − nα) sin (n − 1)β, which vanishes only in the sum over m
    electrical, time, n, shift = 0.3, 0.7, 3, 2 * np.pi / 3
    term = np.sin(time - n * electrical) * np.sin((n - 1) * shift)
    printed = float(phase_product(n, 1, electrical, time)) + term
    product = np.cos(n * (electrical - shift)) * np.cos(time - shift)
    assert abs(printed - product) > 0.1
    assert sum(np.sin((n - 1) * 2 * m * np.pi / 3) for m in range(3)) == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize("n", range(1, 22, 2))
def test_the_printed_table_of_sums_decides_the_direction(n):
    # Appendix F, 5.1.1: 3 where n ± 1 is a multiple of 3, else 0; n = 15 reads n + 1 = 16, printed 17
    plus, minus = (sum(np.cos((n + s) * 2 * m * np.pi / 3) for m in range(3)) for s in (1, -1))
    assert round(minus - plus) == 3 * direction(n)
    assert plus * minus == pytest.approx(0, abs=1e-12)


def test_the_fifth_harmonic_travels_backward_and_the_seventh_forward():
    # 5.3 says both travel forward; equation (8) has ωt + 5κz
    assert direction(5) == -1
    assert direction(7) == 1


def test_sums_take_symbols():
    time = ca.SX.sym("t")
    slope = ca.Function("slope", [time], [ca.jacobian(synchronous_sum(HARMONICS, 0.0, time), time)])
    assert float(slope(0.0)) == pytest.approx(0, abs=1e-9)


def test_constant_force_is_three_halves_of_the_fundamental_and_ripple_is_at_six_and_twelve_omega():
    lines = force_lines()
    single = components()
    assert lines.amplitude[0, 2] == pytest.approx(1.5 * single.amplitude[0, 2])
    loud = [int(k) for k, row in zip(lines.multiple, lines.amplitude, strict=True) if row[2] > 1e-6]
    assert loud == [0, 6, 12, 18, 24]
    # in the thrust the fifth and seventh add or subtract, so their line lies between
    fifth, seventh = 1.5 * single.amplitude[[2, 3], 2]
    assert abs(fifth - seventh) - 1e-9 <= lines.amplitude[3, 2] <= fifth + seventh + 1e-9


def test_slip_turns_thrust_into_normal_force():
    # equations (11) and (12)
    slip, kappa = 0.2, np.pi / 1.1
    lines = force_lines(slip=slip)
    found = pose_forces()
    assert lines.complex[0, 2].real == pytest.approx(1.5 * found.force[2] * np.cos(kappa * slip))
    assert lines.complex[0, 1].real == pytest.approx(1.5 * found.force[1] * np.sin(kappa * slip))


def test_force_lines_are_the_spectrum_of_the_direct_sum():
    # 64 instants of one period of the current, any currents, any pose; rounding
    pose, slip = (0.05, 0.3, 0.0, 0.02, 0.01, 0.03), 0.15
    currents = np.array([1.0, 0.6 - 0.4j, -0.2 + 0.9j])
    single = components(pose, highest=25)
    lines = force_lines(pose, slip=slip, currents=currents)
    for time in np.arange(5) * 0.37:
        direct = np.zeros(6)
        for m in range(3):
            place = 1.1 / np.pi * time - 0.55 - slip - 2 * m * 1.1 / 3
            direct += single.at(place)[0] * np.real(currents[m] * np.exp(1j * time))
        summed = np.real(np.exp(1j * lines.multiple * time) @ lines.complex)
        assert summed == pytest.approx(direct, abs=1e-9 * np.abs(direct).max())


def test_an_unbalanced_winding_lets_the_third_harmonic_in_at_twice_and_four_times_omega():
    # 7.4 e expects the third harmonic to dominate: zero-sequence current brings it, negative sequence the fundamental
    zero = force_lines(currents=np.array(BALANCED) + 0.1)
    negative = force_lines(currents=np.array(BALANCED) + 0.1 * np.conj(BALANCED))
    third, first = components().amplitude[1, 2], components().amplitude[0, 2]
    assert zero.amplitude[1, 2] == pytest.approx(0.15 * third)
    assert zero.amplitude[2, 2] == pytest.approx(0.15 * third)
    assert negative.amplitude[1, 2] > 0.9 * 0.15 * first


def test_symmetrical_components_tell_the_sequences_apart():
    assert symmetrical_components(BALANCED) == pytest.approx([0, 1, 0], abs=1e-15)
    assert symmetrical_components(np.conj(BALANCED)) == pytest.approx([0, 0, 1], abs=1e-15)
    assert symmetrical_components([1, 1, 1]) == pytest.approx([1, 0, 0], abs=1e-15)


def test_two_currents_and_even_harmonics_are_refused():
    with pytest.raises(InputError, match="three finite complex numbers"):
        force_lines(currents=(1, 2))
    with pytest.raises(InputError, match="odd and positive; got 4"):
        direction(4)
