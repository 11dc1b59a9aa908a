"""Facts about roughness spectra: closed forms, shaping filters, limits of validity, catalogue."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.linalg import solve_continuous_lyapunov

from workbench.errors import InputError
from workbench.physics.guideway.catalogue import KINDS, american, german
from workbench.physics.guideway.spectrum import PowerLaw, Rational, band_mean_square
from workbench.physics.guideway.tabulated import Tabulated

SPEED = 134.0
LAW = PowerLaw(roughness=1.5e-6, corner_frequency_hz=0.1)

FILTERED = {
    "power law, corner in hertz": LAW,
    "power law, corner as wavenumber": PowerLaw(roughness=1e-6, corner_wavenumber=0.01),
    "power law without corner": PowerLaw(roughness=1e-6, corner_wavenumber=0.0),
    **{f"american {kind}": american(4, kind, extrapolate=True) for kind in KINDS},
    **{f"german {kind}": german("high", kind, track_width=1.5) for kind in KINDS},
}


def two_sided_response(spectrum, frequency_hz):
    A, B, C = spectrum.shaping_filter(SPEED)
    s = 2j * np.pi * frequency_hz
    return np.array([(C @ np.linalg.solve(x * np.eye(len(A)) - A, B))[0, 0] for x in s])


@pytest.mark.parametrize("name", FILTERED)
def test_twice_the_squared_response_of_the_shaping_filter_is_the_spectrum_per_hertz(name):
    f = np.geomspace(0.05, 50, 40)
    response = two_sided_response(FILTERED[name], f)
    # a handful of roundings in a chain of three first-order blocks
    np.testing.assert_allclose(2 * np.abs(response) ** 2, FILTERED[name].psd_frequency(f, SPEED), rtol=1e-12)


def test_the_shaping_filter_of_the_power_law_has_the_gain_sqrt_pi_A_V_and_the_pole_at_the_corner():
    A, B, C = LAW.shaping_filter(SPEED)
    assert A[0, 0] == pytest.approx(-2 * np.pi * 0.1, rel=1e-14)
    assert (C @ B)[0, 0] ** 2 == pytest.approx(np.pi * 1.5e-6 * SPEED, rel=1e-14)


def test_the_spectrum_seen_at_a_speed_is_the_printed_form():
    f = np.array([0.01, 0.1, 1.0, 10.0])
    omega = 2 * np.pi * f
    printed = 2 * np.pi * 1.5e-6 * SPEED / (omega**2 + (0.2 * np.pi) ** 2)
    np.testing.assert_allclose(LAW.psd_frequency(f, SPEED), printed, rtol=1e-13)  # roundings


def test_a_corner_in_hertz_moves_with_the_speed_and_one_in_wavenumber_stays():
    assert LAW.at_speed(100.0).corners[0] == pytest.approx(2 * np.pi * 0.1 / 100)
    assert PowerLaw(roughness=1e-6, corner_wavenumber=0.01).at_speed(100.0).corners == (0.01,)


@pytest.mark.parametrize(
    "spectrum",
    [
        LAW.at_speed(SPEED),
        german("low", "vertical"),
        german("low", "gauge"),
        Rational(strength=2.0, corners=(0.1, 0.1, 0.1), zeros=2, provenance="coinciding corners"),
        Rational(strength=2.0, corners=(0.1, 0.3, 1.0), zeros=0, provenance="three corners"),
        Rational(strength=2.0, corners=(0.1, 0.1), zeros=1, provenance="a zero"),
        Rational(strength=2.0, corners=(0.0, 0.2), zeros=1, provenance="a zero that cancels a bare Ω²"),
    ],
)
def test_the_closed_mean_square_is_the_area_under_the_spectrum(spectrum):
    area = sum(quad(spectrum.psd, a, b, epsabs=0, epsrel=1e-11)[0] for a, b in ((1e-12, 0.05), (0.05, 1), (1, np.inf)))
    # 1e-9: what lies below 1e-12 rad/m is 2e-12/(π·0.0047 rad/m) = 1.4e-10 of the area of the lowest corner
    assert spectrum.mean_square() == pytest.approx(area, rel=1e-9)


@pytest.mark.parametrize("spectrum", [LAW, german("high", "cross_level", track_width=1.5), german("low", "alignment")])
def test_the_mean_square_of_the_shaping_filter_is_the_one_of_the_spectrum(spectrum):
    A, B, C = spectrum.shaping_filter(SPEED)
    P = solve_continuous_lyapunov(A, -B @ B.T)
    closed = spectrum.mean_square(SPEED) if isinstance(spectrum, PowerLaw) else spectrum.mean_square()
    assert (C @ P @ C.T)[0, 0] == pytest.approx(closed, rel=1e-10)  # conditioning of the chain of blocks, about 1e4


@given(
    corner=st.floats(1e-3, 1.0), speed=st.floats(1.0, 300.0), frequency_hz=st.floats(1e-2, 1e2), A=st.floats(1e-9, 1e-3)
)
@settings(max_examples=50, deadline=None)
def test_mean_squares_do_not_depend_on_the_speed_and_densities_keep_f_times_S(corner, speed, frequency_hz, A):
    law = PowerLaw(roughness=A, corner_wavenumber=corner)
    wavenumber = 2 * np.pi * frequency_hz / speed
    assert frequency_hz * law.psd_frequency(frequency_hz, speed) == pytest.approx(wavenumber * law.psd(wavenumber))
    assert law.mean_square() == pytest.approx(np.pi * A / (2 * corner))


def test_numbers_arrays_dm_and_symbols_pass_through_the_same_formula():
    table = Tabulated(wavenumber=(0.01, 0.1, 1.0), density=(1e-2, 1e-4, 1e-7), provenance="assumed")
    wavenumber = ca.SX.sym("Omega")
    for spectrum in (LAW.at_speed(SPEED), german("low", "gauge"), table):
        compiled = ca.Function("psd", [wavenumber], [spectrum.psd(wavenumber)])
        number = spectrum.psd(0.3)
        assert float(compiled(0.3)) == pytest.approx(number, rel=1e-14)
        assert float(spectrum.psd(ca.DM(0.3))) == pytest.approx(number, rel=1e-14)
        assert spectrum.psd(np.array([[0.3, 0.3]])) == pytest.approx(np.full((1, 2), number), rel=1e-14)
        assert isinstance(number, float)


# GENSYS manual, trc_ipsd: high level at 0.02 1/m, per 1/m; five printed digits


def test_german_high_vertical_is_the_value_tabulated_by_gensys():
    assert 2 * np.pi * german("high", "vertical").psd(2 * np.pi * 0.02) == pytest.approx(4.0897e-4, abs=1e-8)


def test_german_high_alignment_is_the_value_tabulated_by_gensys():
    assert 2 * np.pi * german("high", "alignment").psd(2 * np.pi * 0.02) == pytest.approx(2.3194e-4, abs=1e-8)


@pytest.mark.parametrize(("track_class", "level"), [(6, 8.475e-7), (5, 5.24e-6), (4, 1.344e-5)])
def test_american_vertical_is_a_power_law_at_long_waves(track_class, level):
    # S Ω² → k A_v for Ω ≪ Ω_c; at 300 m, (Ω/Ω_c)² = 6.5e-4; the levels are given to four digits at most
    omega = 2 * np.pi / 300
    assert american(track_class, "vertical").psd(omega) * omega**2 == pytest.approx(level, rel=2e-3)


def test_german_levels_are_the_power_laws_of_their_roughness_in_mid_band():
    # between the corners 0.0206 and 0.8246 rad/m S Ω² comes within a twentieth of A
    omega = 0.13
    assert german("low", "vertical").psd(omega) * omega**2 == pytest.approx(4.03e-7, rel=0.05)
    assert german("high", "vertical").psd(omega) * omega**2 == pytest.approx(1.08e-6, rel=0.05)


def test_a_better_american_class_has_the_smoother_vertical_profile():
    levels = [american(number, "vertical").psd(0.1) for number in range(1, 7)]
    assert levels == sorted(levels, reverse=True)


def test_german_cross_level_is_the_angle_spectrum_times_the_squared_track_width():
    omega, Ar, Oc, Or, Os = 0.2, 4.032e-7, 0.8246, 0.0206, 0.4380
    angle = Ar / 0.75**2 * Oc**2 * omega**2 / ((omega**2 + Or**2) * (omega**2 + Oc**2) * (omega**2 + Os**2))
    assert german("low", "cross_level", track_width=1.93).psd(omega) == pytest.approx(angle * 1.93**2, rel=1e-12)


def test_numbers_without_a_second_source_are_marked_unverified():
    assert american(6, "vertical").verified
    assert not american(6, "alignment").verified
    assert not american(6, "gauge").verified
    assert "not checked against a primary source" in american(6, "cross_level").provenance
    assert german("low", "vertical").verified


def test_a_table_follows_a_power_law_between_and_beyond_its_points():
    omega = np.geomspace(0.01, 1, 5)
    table = Tabulated(wavenumber=tuple(omega), density=tuple(1e-6 / omega**2), provenance="assumed", extrapolate=True)
    points = np.geomspace(0.001, 10, 23)
    np.testing.assert_allclose(table.psd(points), 1e-6 / points**2, rtol=1e-12)  # logarithm and exponential
    assert table.wavelength_min == pytest.approx(2 * np.pi)


def test_the_mean_square_of_a_band_is_the_difference_of_closed_forms():
    # ∫ A/(Ω² + c²) dΩ = (A/c) arctan(Ω/c)
    law = PowerLaw(roughness=1e-6, corner_wavenumber=0.02)
    ends = 2 * np.pi / np.array([2000.0, 5.0])
    closed = 1e-6 / 0.02 * np.diff(np.arctan(ends / 0.02))[0]
    assert band_mean_square(law, 5.0, 2000.0) == pytest.approx(closed, rel=1e-9)


def test_the_mean_square_of_a_table_is_the_area_between_its_ends():
    table = Tabulated(wavenumber=(0.01, 0.1, 1.0), density=(1e-2, 1e-4, 1e-7), provenance="assumed")
    by_pieces = sum(quad(table.psd, a, b, epsabs=0, epsrel=1e-11)[0] for a, b in ((0.01, 0.1), (0.1, 1.0)))
    assert table.mean_square() == pytest.approx(by_pieces, rel=1e-10)


def test_scaling_a_spectrum_scales_its_density():
    for spectrum in (PowerLaw(roughness=1e-6, corner_wavenumber=0.01), american(3, "gauge"), german("low", "gauge")):
        assert spectrum.scaled(0.25).psd(0.5) == pytest.approx(spectrum.psd(0.5) / 4, rel=1e-14)


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: american(6, "vertical").psd(0.001), "wavelengths must lie within 1.524…304.8 m"),
        (lambda: american(6, "vertical").psd_frequency(100.0, SPEED), "set extrapolate=True"),
        (lambda: american(6, "vertical").shaping_filter(SPEED), "valid at all wavelengths"),
        (lambda: american(6, "gauge").mean_square(), "Set extrapolate=True"),
        (lambda: american(6, "vertical", extrapolate=True).mean_square(), "finite only with a corner"),
        (lambda: band_mean_square(LAW.at_speed(SPEED), 5.0, 5.0), "0 < wavelength_min < wavelength_max"),
        (lambda: american(7, "vertical"), "must be one of 1…6; got 7"),
        (lambda: american(6, "verticle"), "did you mean 'vertical'"),
        (lambda: german("medium", "vertical"), "unknown disturbance level"),
        (lambda: german("low", "cross_level"), r"needs track_width > 0 \[m\]; got None"),
        (lambda: LAW.psd(0.1), r"Ask at_speed\(V\)"),
        (lambda: LAW.psd_frequency(1.0, 0.0), "speed must be positive"),
        (lambda: LAW.psd_frequency(np.nan, SPEED), "wavenumber must be finite"),
        (lambda: german("low", "vertical").psd(-0.1), "not negative"),
        (lambda: PowerLaw(roughness=1e-6, corner_wavenumber=0.0).psd(0.0), "must be finite and positive"),
        (lambda: PowerLaw(roughness=-1e-6, corner_wavenumber=0.0), "roughness must be positive"),
        (lambda: PowerLaw(roughness=1e-6), "exactly one corner"),
        (lambda: PowerLaw(roughness=1e-6, corner_wavenumber=np.nan), "finite and not negative"),
        (lambda: Rational(strength=1.0, corners=(0.1,), zeros=1, provenance="x"), "below the number of corners"),
        (lambda: Rational(strength=1.0, corners=(), provenance="x"), "one to three wavenumbers"),
        (lambda: Rational(strength=1.0, corners=(0.1,), provenance=" "), "provenance must name the source"),
        (lambda: Tabulated(wavenumber=(1, 1), density=(1, 1), provenance="x"), "finite and increasing"),
        (lambda: Tabulated(wavenumber=(1, 2), density=(1, 0), provenance="x"), "values of a log-log table"),
        (lambda: Tabulated(wavenumber=(1, 2), density=(1,), provenance="x"), "as many values as points"),
        (
            lambda: Tabulated(wavenumber=(1, 2), density=(1, 1), provenance="x").psd(3.0),
            "must lie within 3.142…6.283 m",
        ),
        (
            lambda: PowerLaw(roughness=1.0, corner_wavenumber=0, wavelength_min=5.0, wavelength_max=2.0),
            "wavelength limits must be positive and in order",
        ),
    ],
)
def test_what_cannot_be_answered_is_refused_with_the_cure(ask, sentence):
    with pytest.raises(InputError, match=sentence):
        ask()
