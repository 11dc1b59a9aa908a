"""Facts about random guideways: seed, spectrum, correlation, wheel base."""

import numpy as np
import pytest
from scipy.stats import kstest

from workbench.errors import InputError
from workbench.physics.guideway.catalogue import american
from workbench.physics.guideway.realisation import realisation
from workbench.physics.guideway.roughness import Roughness
from workbench.physics.guideway.spectrum import PowerLaw

FOUR = ((9.00, 0.965), (9.00, -0.965), (-7.65, 0.965), (-7.65, -0.965))
LAW = PowerLaw(roughness=1.5e-6, corner_wavenumber=0.02)
LONG = {"length": 2.0**15, "spacing": 1.0}


def periodogram(heights, spacing):
    """One-sided densities (4, n/2 − 1) [m²/(rad/m)] of periodic heights at 2πm/length, m = 1…n/2 − 1."""
    n = heights.shape[1]
    lines = np.fft.rfft(heights, axis=1)[:, 1 : n // 2] * 2 / n
    return np.abs(lines) ** 2 / 2 / (2 * np.pi / (n * spacing))


def test_the_sample_spectrum_scatters_about_the_spectrum_as_a_gaussian_one_must():
    drawn = realisation(Roughness.alike(LAW), **LONG, seed=3)
    wavenumber = 2 * np.pi * np.arange(1, 2**14) / 2**15
    ratio = periodogram(drawn.heights, 1.0) / LAW.psd(wavenumber)
    # each ratio is exponentially distributed with mean 1: the mean of 4·16383 scatters by 0.0039; five of those
    assert ratio.mean() == pytest.approx(1, abs=0.02)
    # in 32 bands of 512 lines: standard deviation 1/√512 = 0.044 each; 4.5 of them for the worst of 128
    bands = ratio[:, : 32 * 511].reshape(4, 32, 511).mean(axis=2)
    assert np.abs(bands - 1).max() < 0.2
    assert kstest(ratio.ravel(), "expon").pvalue > 1e-3


def test_a_wrong_spectrum_would_be_noticed():
    drawn = realisation(Roughness.alike(LAW.scaled(1.1)), **LONG, seed=3)
    wavenumber = 2 * np.pi * np.arange(1, 2**14) / 2**15
    assert abs((periodogram(drawn.heights, 1.0) / LAW.psd(wavenumber)).mean() - 1) > 0.05


def test_the_same_seed_draws_the_same_guideway_and_another_seed_another():
    draw = [realisation(Roughness.alike(LAW), length=256.0, spacing=1.0, seed=s).heights for s in (1, 1, 2)]
    assert np.array_equal(draw[0], draw[1])
    assert not np.array_equal(draw[0], draw[2])


def test_different_types_are_uncorrelated_unless_a_correlation_is_given():
    independent = realisation(Roughness.alike(PowerLaw(roughness=1e-6, corner_wavenumber=1.0)), **LONG, seed=5).heights
    R = np.eye(4)
    R[0, 3] = R[3, 0] = 0.8
    correlated = Roughness(
        **dict.fromkeys(("A1", "A2", "A3", "A4"), PowerLaw(roughness=1e-6, corner_wavenumber=1.0)),
        correlation=tuple(map(tuple, R)),
    )
    together = realisation(correlated, **LONG, seed=5).heights
    # about 1e4 independent stretches of 1/Ω_c: coefficients scatter by 0.01; five of that
    np.testing.assert_allclose(np.corrcoef(independent), np.eye(4), atol=0.05)
    np.testing.assert_allclose(np.corrcoef(together), R, atol=0.05)


def test_the_rear_meets_what_the_front_met_a_wheel_base_before():
    drawn = realisation(Roughness.alike(LAW), length=4096.0, spacing=0.5, seed=7)
    speed, t = 134.0, np.linspace(1.0, 9.0, 200)
    front = drawn.inputs(FOUR, speed, t - 16.65 / speed)[[0, 1, 4, 5]]
    rear = drawn.inputs(FOUR, speed, t)[[2, 3, 6, 7]]
    # 1e-8 m: the same place computed along two ways, on centimetres of height
    np.testing.assert_allclose(rear, front, atol=1e-8)


def test_inputs_are_the_sums_and_differences_of_the_types_under_the_coil():
    drawn = realisation(Roughness.alike(LAW), length=512.0, spacing=1.0, seed=8)
    A1, A2, A3, A4 = drawn.height(100.0)
    inputs = drawn.inputs(FOUR, 50.0, np.array([2.0]))[:, 0]  # the foremost coils are at 100 m
    np.testing.assert_allclose(inputs[[0, 1, 4, 5]], [A1 + A2, A1 - A2, A4 + A3, A4 - A3], rtol=1e-12)


def test_the_spline_passes_through_the_points_and_repeats():
    drawn = realisation(Roughness.alike(LAW), length=128.0, spacing=1.0, seed=9)
    np.testing.assert_allclose(drawn.height(drawn.distance), drawn.heights, atol=1e-15)
    np.testing.assert_allclose(drawn.height(drawn.distance + 128.0), drawn.heights, atol=1e-15)


def test_between_points_a_wave_of_eight_spacings_is_met_to_a_thousandth():
    rough = Roughness(A1=LAW)
    band = {"wavelength_min": 8.0, "wavelength_max": 8.0}
    drawn = realisation(rough, length=128.0, spacing=1.0, seed=1, **band)
    finer = realisation(rough, length=128.0, spacing=0.125, seed=1, **band)
    x = np.linspace(0, 128, 999)
    error = np.std(drawn.height(x)[0] - finer.height(x)[0]) / np.std(finer.heights[0])
    assert error < 1e-3  # stated: 0.08 %


def test_outside_the_band_nothing_is_drawn():
    drawn = realisation(Roughness.alike(LAW), length=1024.0, spacing=1.0, seed=4, wavelength_min=10, wavelength_max=100)
    density = periodogram(drawn.heights, 1.0)
    wavelength = 1024 / np.arange(1, 512)
    inside = (wavelength >= 10) & (wavelength <= 100)
    assert density[:, ~inside].max() < 1e-25  # rounding of millimetres
    assert density[:, inside].min() > 0


def test_a_corner_in_hertz_draws_the_guideway_of_that_speed():
    in_hertz = Roughness.alike(PowerLaw(roughness=1e-6, corner_frequency_hz=0.1))
    as_wavenumber = Roughness.alike(PowerLaw(roughness=1e-6, corner_wavenumber=0.2 * np.pi / 134))
    grid = {"length": 512.0, "spacing": 1.0, "seed": 1}
    first, second = realisation(in_hertz, **grid, speed=134.0), realisation(as_wavenumber, **grid)
    np.testing.assert_allclose(first.heights, second.heights, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: realisation(Roughness.alike(LAW), length=5.0, spacing=1.0, seed=1), "at least 8 spacings"),
        (lambda: realisation(Roughness.alike(LAW), length=1e9, spacing=1.0, seed=1), "at most 4194304 points"),
        (
            lambda: realisation(Roughness.alike(LAW), length=100.0, spacing=1.0, seed=1, wavelength_min=101.0),
            "no line of the grid",
        ),
        (
            lambda: realisation(
                Roughness.alike(PowerLaw(roughness=1e-6, corner_frequency_hz=0.1)), length=100.0, spacing=1.0, seed=1
            ),
            "needs the speed",
        ),
        (
            lambda: realisation(Roughness(A1=american(6, "vertical")), length=1000.0, spacing=1.0, seed=1),
            "wavelengths must lie within 1.524…304.8 m",
        ),
    ],
)
def test_impossible_draws_are_refused(ask, sentence):
    with pytest.raises(InputError, match=sentence):
        ask()
