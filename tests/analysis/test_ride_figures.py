"""Facts about rms values and third octaves of acceleration densities."""

import numpy as np
import pytest

from workbench.analysis.density import samples
from workbench.analysis.ride import motion_sickness_dose, ride, rms, third_octaves, weight
from workbench.errors import InputError
from workbench.physics.guideway.spectrum import PowerLaw

A, SPEED, OMEGA_N, ZETA = 8.475e-7, 134.0, 2 * np.pi * 0.6, 0.6


def skyhook(f, zeta=ZETA):
    """Acceleration density of a mass damped against the sky, over a guideway of velocity density 2πAV per hertz."""
    omega = 2 * np.pi * f
    height = OMEGA_N**2 / np.abs(OMEGA_N**2 - omega**2 + 2j * zeta * OMEGA_N * omega)
    law = PowerLaw(roughness=A, corner_wavenumber=0.0)
    return law.psd_frequency(f, SPEED) * height**2 * omega**4


def test_the_skyhook_rms_is_the_closed_form():
    closed = np.sqrt(A * SPEED * np.pi * OMEGA_N**3 / (4 * ZETA))
    assert closed == pytest.approx(0.0892, abs=5e-5)  # the figure in the notes on ride, four digits
    # the density falls as f⁻²: 2e4 Hz leaves out 4e-5 of the power, panels are right to 1e-5
    assert rms(skyhook, low_hz=1e-3, high_hz=2e4) == pytest.approx(closed, rel=3e-5)


@pytest.mark.parametrize("zeta", [0.1, 1e-3, 1e-6])
def test_a_resonance_is_resolved_however_lightly_damped(zeta):
    closed = np.sqrt(A * SPEED * np.pi * OMEGA_N**3 / (4 * zeta))
    assert rms(lambda f: skyhook(f, zeta), high_hz=2e4) == pytest.approx(closed, rel=3e-5)  # as above


def test_the_skyhook_gap_is_the_closed_form():
    def gap(f):
        omega = 2 * np.pi * f
        relative = np.abs(
            (omega**2 - 2j * ZETA * OMEGA_N * omega) / (OMEGA_N**2 - omega**2 + 2j * ZETA * OMEGA_N * omega)
        )
        return 2 * np.pi * A * SPEED / omega**2 * relative**2

    closed = np.sqrt(A * SPEED * np.pi * (4 * ZETA**2 + 1) / (4 * ZETA * OMEGA_N))
    assert closed == pytest.approx(9.81e-3, abs=5e-6)  # the figure in the notes on ride, three digits
    # flat below 0.6 Hz and ∝ f⁻² above: 1e-4 and 1e4 Hz leave out 4e-4 of the power together
    assert rms(gap, low_hz=1e-5, high_hz=1e4) == pytest.approx(closed, rel=3e-4)


def test_an_array_on_a_fine_grid_has_the_rms_of_its_function():
    f = np.geomspace(0.05, 100, 1500)
    for weighting in (None, "Wk", "Wd", "Wf"):
        exact = rms(skyhook, weighting, low_hz=0.05, high_hz=100)
        assert rms((f, skyhook(f)), weighting) == pytest.approx(exact, rel=2e-5)  # panels; interpolation error ∝ step²


def test_a_power_law_array_of_two_points_is_integrated_exactly():
    assert rms((np.array([1.0, 10.0]), np.array([1.0, 0.01]))) ** 2 == pytest.approx(0.9, rel=1e-9)
    assert rms((np.array([1.0, 10.0]), np.array([1.0, 0.1]))) ** 2 == pytest.approx(np.log(10), rel=1e-9)


def test_an_array_with_zeros_is_linear_beside_them():
    assert rms((np.array([1.0, 2.0, 3.0]), np.array([0.0, 1.0, 0.0]))) == pytest.approx(1.0, rel=1e-9)


def test_bands_add_up_to_the_whole_in_power():
    bands = third_octaves(skyhook, low_hz=10**-0.95, high_hz=10**1.95)
    assert len(bands.frequency_hz) == 29
    whole = rms(skyhook, low_hz=10**-0.95, high_hz=10**1.95)
    assert np.sum(bands.rms**2) == pytest.approx(whole**2, rel=2e-5)


def test_bands_of_white_noise_grow_by_a_decibel_a_band():
    bands = third_octaves(lambda f: np.ones_like(f), low_hz=0.1, high_hz=10)
    np.testing.assert_allclose(bands.rms**2, (10**0.05 - 10**-0.05) * bands.frequency_hz, rtol=1e-9)
    np.testing.assert_allclose(np.diff(20 * np.log10(bands.rms)), 1.0, rtol=1e-8)


def test_a_band_given_by_its_rounded_edges_is_one_band():
    bands = third_octaves((np.array([0.8912509, 1.122018455]), np.array([1.0, 1.0])))
    assert bands.frequency_hz == pytest.approx([1.0])


def test_a_weighted_band_carries_the_weight_at_its_centre():
    f0 = 10**0.3
    plain, felt = (third_octaves(lambda f: np.ones_like(f), w, low_hz=1.7, high_hz=2.3).rms for w in (None, "Wd"))
    # the weight bends little within a band: to second order in its half width 0.115, times its curvature of order 1
    assert felt[0] / plain[0] == pytest.approx(weight("Wd").magnitude(f0), rel=5e-3)


def test_what_the_weighting_hides_is_shown_beside_it():
    vertical = ride(skyhook, "vertical")
    below, above = vertical.rms_below_1_hz, rms(skyhook, low_hz=1.0)
    assert vertical.rms**2 == pytest.approx(below**2 + above**2, rel=2e-5)
    assert vertical.rms_weighted < 0.65 * vertical.rms
    assert vertical.weighting == "Wk"
    assert vertical.rms_motion_sickness is not None
    lateral = ride(skyhook, "lateral")
    assert lateral.weighting == "Wd"
    assert lateral.rms_motion_sickness is None
    assert "lateral rms 0.0891" in repr(lateral)


def test_the_worst_band_is_the_largest():
    bands = third_octaves(skyhook)
    vertical = ride(skyhook, "vertical")
    assert vertical.worst_band_rms == bands.rms.max()
    assert vertical.worst_band_hz in bands.frequency_hz


def test_motion_sickness_dose_grows_with_the_root_of_time():
    one, four = (motion_sickness_dose(skyhook, hours * 3600) for hours in (1, 4))
    assert four == pytest.approx(2 * one)
    assert one == pytest.approx(rms(skyhook, "Wf") * 60)


def test_nodes_and_widths_integrate_polynomials_and_powers():
    f, width, density = samples(lambda f: f**-1.5, 0.1, 30.0)
    assert width @ density == pytest.approx(2 * (0.1**-0.5 - 30**-0.5), rel=1e-12)
    assert width @ (density * f**1.5) == pytest.approx(29.9, rel=1e-12)


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: rms((np.array([0.0, 1.0]), np.ones(2))), "increasing positive frequencies"),
        (lambda: rms((np.array([1.0, 2.0]), np.array([1.0, -1.0]))), "finite densities ≥ 0"),
        (lambda: rms((np.array([1.0, 2.0]), np.ones(3))), "equally many"),
        (lambda: rms((np.array([1.0, 2.0]), np.ones(2)), high_hz=3.0), "must lie within the PSD's 1…2 Hz"),
        (lambda: rms(skyhook, low_hz=2.0, high_hz=1.0), "0 < low_hz < high_hz"),
        (lambda: rms(lambda f: 1.0), "one finite value ≥ 0 per frequency"),
        (lambda: rms(lambda f: -np.ones_like(f)), "one finite value ≥ 0 per frequency"),
        (lambda: rms(lambda f: 2 + np.sin(1e9 * f)), "smooth enough to integrate"),
        (lambda: rms(skyhook, "Wx"), "unknown frequency weighting"),
        (lambda: ride(skyhook, "sideways"), "unknown direction"),
        (lambda: third_octaves(skyhook, low_hz=1.0, high_hz=1.1), "a one-third-octave band must fit in"),
        (lambda: motion_sickness_dose(skyhook, 0.0), "duration must be positive"),
    ],
)
def test_what_is_no_density_is_refused(ask, sentence):
    with pytest.raises(InputError, match=sentence):
        ask()
