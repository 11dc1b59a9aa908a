"""Facts about the four types of irregularity at the coil sets: Table D-1, phases, wheel base."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.physics.guideway.irregularity import (
    TYPES,
    UNIT_INPUTS,
    Wave,
    leads,
    patterns,
    phasors,
    stations,
    table_d1,
)
from workbench.physics.guideway.roughness import Roughness
from workbench.physics.guideway.spectrum import PowerLaw

A_F, A_R, SPEED = 9.00, 7.65, 134.0
FOUR = ((A_F, 0.965), (A_F, -0.965), (-A_R, 0.965), (-A_R, -0.965))

# Report, Table D-1: columns A1 (c, s), A4 (c, s), A2 (c, s), A3 (c, s); rows ζ_1…ζ_4, η_1…η_4
PRINTED = np.array(
    [
        [1, 1, 0, 0, 1, 1, 0, 0],
        [1, 1, 0, 0, -1, -1, 0, 0],
        [1, -1, 0, 0, 1, -1, 0, 0],
        [1, -1, 0, 0, -1, 1, 0, 0],
        [0, 0, 1, 1, 0, 0, 1, 1],
        [0, 0, 1, 1, 0, 0, -1, -1],
        [0, 0, 1, -1, 0, 0, 1, -1],
        [0, 0, 1, -1, 0, 0, -1, 1],
    ]
)


@pytest.mark.parametrize("beta", [0.0, 0.3, np.pi / 4, 2.0])
def test_the_unit_inputs_are_those_of_table_d1(beta):
    effect = np.array([np.cos(beta), np.sin(beta)] * 4)  # its line "effect of wheel base": cβ, sβ
    assert np.array_equal(table_d1(beta), PRINTED * effect)


@given(omega=st.floats(0.0, 300.0))
@settings(max_examples=30, deadline=None)
def test_the_phases_about_the_midpoint_are_the_two_parts_of_table_d1(omega):
    beta = omega * (A_F + A_R) / (2 * SPEED)
    whole = phasors(FOUR, SPEED, omega, reference="midpoint")
    parts = table_d1(beta)
    for column, kind in enumerate(TYPES):
        at = UNIT_INPUTS.index(f"{kind} cos")
        # 1e-12: cosine of the same angle computed along two ways, angles up to 20 rad
        np.testing.assert_allclose(whole[:, column], parts[:, at] + 1j * parts[:, at + 1], atol=1e-12)


def test_right_and_left_surfaces_are_sum_and_difference_of_the_types():
    A1, A2, A3, A4 = amplitudes = np.array([1.0, 0.3, 0.07, 0.005])
    heights = patterns(FOUR) @ amplitudes
    np.testing.assert_allclose(heights[:4], [A1 + A2, A1 - A2] * 2)
    np.testing.assert_allclose(heights[4:], [A4 + A3, A4 - A3] * 2)


def test_the_four_types_are_orthogonal_over_the_coil_sets():
    assert np.array_equal(patterns(FOUR).T @ patterns(FOUR), 4 * np.eye(4))


def test_the_front_leads_the_rear_by_wheel_base_over_speed():
    lead = leads(FOUR, SPEED)
    assert np.array_equal(lead[[0, 1, 4, 5]], np.zeros(4))
    assert lead[2] == pytest.approx(-0.12425, abs=5e-6)  # 16.65 m at 134 m/s
    omega = 7.0
    G = phasors(FOUR, SPEED, omega)
    assert G[2, 0] / G[0, 0] == pytest.approx(np.exp(-1j * omega * 16.65 / SPEED))


@given(omega=st.floats(0.1, 300.0), x=st.floats(-20.0, 20.0))
@settings(max_examples=30, deadline=None)
def test_another_reference_turns_all_phases_alike(omega, x):
    turn = phasors(FOUR, SPEED, omega, reference=x) / np.where(patterns(FOUR) == 0, 1, phasors(FOUR, SPEED, omega))
    turned = turn[patterns(FOUR) != 0]
    np.testing.assert_allclose(turned, turned[0], atol=1e-11)  # angles up to 100 rad


def test_a_symmetric_type_reaches_all_eight_places_of_a_vehicle_with_four_axles():
    places = tuple((x, y) for x in (9.0, 3.0, -3.0, -8.0) for y in (1.0, -1.0))
    assert patterns(places).shape == (16, 4)
    groups = stations(places, 100.0)
    assert [delay for delay, _ in groups] == pytest.approx([0.0, 0.06, 0.12, 0.17])
    assert np.array_equal(sum(pattern for _, pattern in groups), patterns(places))


def test_stations_rebuild_the_phasors():
    omega = 11.0
    rebuilt = sum(np.exp(-1j * omega * delay) * pattern for delay, pattern in stations(FOUR, SPEED))
    np.testing.assert_allclose(rebuilt, phasors(FOUR, SPEED, omega), atol=1e-14)


def test_a_list_of_frequencies_gives_a_stack_of_phasors():
    omega = np.array([1.0, 2.0, 3.0])
    stack = phasors(FOUR, SPEED, omega)
    assert stack.shape == (3, 8, 4)
    np.testing.assert_allclose(stack[1], phasors(FOUR, SPEED, 2.0), atol=1e-15)


def test_a_wave_is_the_sine_of_appendix_d2_at_every_coil():
    wave = Wave(wavelength=80.0, amplitudes=(3e-3, 1e-3, 2e-3, 5e-4), phases=(0.4, -0.2, 0.0, 1.1))
    t = np.linspace(0, 2, 7)
    history = wave.history(FOUR, SPEED, t)
    omega, beta = 2 * np.pi * SPEED / 80, np.pi * (A_F + A_R) / 80
    rear_left = omega * t - beta
    zeta = 3e-3 * np.sin(rear_left - 0.4) - 1e-3 * np.sin(rear_left + 0.2)
    eta = 5e-4 * np.sin(rear_left - 1.1) - 2e-3 * np.sin(rear_left)
    # 1e-15 m: roundings of millimetres
    np.testing.assert_allclose(history[3], zeta, atol=1e-15)
    np.testing.assert_allclose(history[7], eta, atol=1e-15)


def law(A, corner=0.01):
    return PowerLaw(roughness=A, corner_wavenumber=corner)


def test_uncorrelated_types_add_in_power_at_each_coil():
    rough = Roughness(A1=law(1e-6), A2=law(2e-6), A3=law(3e-6), A4=law(4e-6))
    f = np.array([0.5, 2.0])
    density = rough.input_psd(f, SPEED, FOUR)
    unit = law(1e-6).psd_frequency(f, SPEED)
    np.testing.assert_allclose(density[:, 0, 0].real, 3 * unit, rtol=1e-12)
    np.testing.assert_allclose(density[:, 5, 5].real, 7 * unit, rtol=1e-12)
    # right against left: A1 − A2 in power; ζ against η: nothing in common
    np.testing.assert_allclose(density[:, 0, 1].real, -unit, rtol=1e-12)
    assert np.abs(density[:, :4, 4:]).max() == 0


def test_fully_correlated_profile_and_cross_level_leave_the_left_side_smooth():
    R = np.eye(4)
    R[0, 1] = R[1, 0] = 1.0
    rough = Roughness(A1=law(1e-6), A2=law(1e-6), correlation=tuple(map(tuple, R)))
    density = rough.input_psd(1.0, SPEED, FOUR)
    scale = law(1e-6).psd_frequency(1.0, SPEED)
    assert abs(density[1, 1]) < 1e-14 * scale
    assert density[0, 0].real == pytest.approx(4 * scale)


def test_the_shaping_filter_of_a_correlated_roughness_has_its_cross_spectra():
    R = np.array([[1, 0.5, 0, -0.2], [0.5, 1, 0.1, 0], [0, 0.1, 1, 0.3], [-0.2, 0, 0.3, 1]])
    rough = Roughness(A1=law(1e-6), A2=law(2e-6), A3=law(3e-6), A4=law(4e-6), correlation=tuple(map(tuple, R)))
    A, B, C = rough.shaping_filter(SPEED)
    f = 0.7
    H = C @ np.linalg.solve(2j * np.pi * f * np.eye(len(A)) - A, B)
    np.testing.assert_allclose(2 * H @ H.conj().T, rough.amplitude_psd(f, SPEED), atol=1e-13 * 1e-6)


def test_the_shaping_filter_of_uncorrelated_types_serves_types_of_different_order():
    rough = Roughness.german("low", track_width=1.5)
    A, B, C = rough.shaping_filter(SPEED)
    assert A.shape == (10, 10)
    f = 1.3
    H = C @ np.linalg.solve(2j * np.pi * f * np.eye(10) - A, B)
    np.testing.assert_allclose(np.diag(2 * np.abs(H) ** 2), np.diag(rough.amplitude_psd(f, SPEED)), rtol=1e-12)


def test_differences_of_two_sides_enter_as_a_quarter():
    from workbench.physics.guideway.catalogue import american, german

    assert Roughness.american(6).A2.psd(1.0) == pytest.approx(american(6, "cross_level").psd(1.0) / 4)
    assert Roughness.american(6).A4.psd(1.0) == pytest.approx(american(6, "gauge").psd(1.0) / 4)
    difference = german("low", "cross_level", track_width=1.93)
    assert Roughness.german("low", track_width=1.93).A2.psd(1.0) == pytest.approx(difference.psd(1.0) / 4)


def test_a_smooth_type_has_no_density():
    rough = Roughness(A1=law(1e-6))
    assert rough.types == ("A1",)
    assert np.count_nonzero(rough.amplitude_psd(1.0, SPEED)) == 1


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: patterns(((1.0, 0.0),)), "right .* or left"),
        (lambda: patterns((1.0, 2.0)), r"rows \(x, y\)"),
        (lambda: patterns(((1.0, np.nan),)), "finite metres"),
        (lambda: leads(FOUR, -1.0), "speed must be positive"),
        (lambda: leads(FOUR, 1.0, reference="rear"), "'front', 'midpoint' or a place"),
        (lambda: Wave(wavelength=0.0, amplitudes=(0, 0, 0, 0)), "wavelength must be positive"),
        (lambda: Wave(wavelength=1.0, amplitudes=(0, 0, 0)), "four finite amplitudes"),
        (lambda: Roughness(correlation=((1, 2), (2, 1))), "4×4 matrix with unit diagonal"),
        (lambda: Roughness(correlation=tuple(map(tuple, np.eye(4) * 2))), "unit diagonal"),
        (lambda: Roughness().shaping_filter(1.0), "at least one rough type"),
        (
            lambda: Roughness(A1=law(1e-6), A2=law(1e-6, 0.1), correlation=tuple(map(tuple, np.eye(4)))).shaping_filter(
                1.0
            ),
            "equal up to a factor",
        ),
    ],
)
def test_impossible_layouts_and_correlations_are_refused(ask, sentence):
    with pytest.raises(InputError, match=sentence):
        ask()
