"""The ride of the 444.8 kN vehicle's heave motion alone, over five guideways and with four dampings.

Independent figures: rms and Wk-weighted acceleration [m/s²] and rms gap [mm], 0.05 … 30 Hz, 134 m/s, K_h = −2.155,
rate gain 0.15 s/m. One unit of their last digit is allowed, for the frequency grid they were computed on.
"""

import numpy as np
import pytest

from workbench.analysis.ride import rms
from workbench.physics.guideway.catalogue import american, german
from workbench.physics.guideway.spectrum import PowerLaw

SPEED, BAND = 134.0, {"low_hz": 0.05, "high_hz": 30.0}
MASS = 444.8e3 / 9.80665
STIFFNESS = (4 * 8.9372e5 - 2.155 * 4 * 3.3981e5) / MASS  # report, A.3: F_Lh and F_Lα of one coil set
RATE = 0.15 * 4 * 3.3981e5 / MASS

GUIDEWAYS = {
    "A = 1e-6 m": PowerLaw(roughness=1e-6, corner_wavenumber=0.0),
    "German low": german("low", "vertical"),
    "German high": german("high", "vertical"),
    "FRA 6": american(6, "vertical", extrapolate=True),
    "FRA 4": american(4, "vertical", extrapolate=True),
}
KNOWN = {
    ("A = 1e-6 m", "absolute"): (0.105, 0.055, 12.9),
    ("A = 1e-6 m", "relative, no filter"): (0.717, 0.547, 6.8),
    ("A = 1e-6 m", "relative"): (0.439, 0.212, 21.2),
    ("A = 1e-6 m", "both"): (0.140, 0.080, 10.7),
    ("German low", "absolute"): (0.055, 0.031, 6.1),
    ("German low", "relative, no filter"): (0.352, 0.288, 3.7),
    ("German low", "relative"): (0.240, 0.117, 11.6),
    ("German low", "both"): (0.078, 0.046, 5.4),
    ("German high", "absolute"): (0.090, 0.051, 9.9),
    ("German high", "relative, no filter"): (0.576, 0.471, 6.1),
    ("German high", "relative"): (0.392, 0.191, 19.0),
    ("German high", "both"): (0.127, 0.075, 8.8),
    ("FRA 6", "absolute"): (0.095, 0.049, 11.9),
    ("FRA 6", "relative, no filter"): (0.516, 0.420, 6.2),
    ("FRA 6", "relative"): (0.403, 0.194, 19.5),
    ("FRA 6", "both"): (0.127, 0.071, 9.8),
    ("FRA 4", "absolute"): (0.380, 0.196, 47.2),
    ("FRA 4", "relative, no filter"): (2.06, 1.67, 24.6),
    ("FRA 4", "relative"): (1.61, 0.773, 77.7),
    ("FRA 4", "both"): (0.507, 0.283, 38.9),
}


def transmitted(f, damping):
    """Height of the vehicle over height of the guideway: (k + relative rate)/(s² + k + relative + absolute rate)."""
    s = 2j * np.pi * f
    filtered = 1 / (1 + (0.0 if damping == "relative, no filter" else 0.637) * s)
    relative = 0.0 if damping == "absolute" else RATE * s * filtered
    absolute = RATE * 0.637 * s**2 * filtered if damping in ("absolute", "both") else 0.0
    return (STIFFNESS + relative) / (s**2 + STIFFNESS + relative + absolute)


@pytest.mark.parametrize(("guideway", "damping"), KNOWN)
def test_heave_rides_as_known(guideway, damping):
    spectrum = GUIDEWAYS[guideway]

    def acceleration(f):
        return spectrum.psd_frequency(f, SPEED) * np.abs((2 * np.pi * f) ** 2 * transmitted(f, damping)) ** 2

    def gap(f):
        return spectrum.psd_frequency(f, SPEED) * np.abs(transmitted(f, damping) - 1) ** 2

    ours = (rms(acceleration, **BAND), rms(acceleration, "Wk", **BAND), 1e3 * rms(gap, **BAND))
    for figure, known in zip(ours, KNOWN[guideway, damping], strict=True):
        digit = 0.1 if known > 3 else 0.01 if known > 1 else 0.001
        assert figure == pytest.approx(known, abs=digit)


def test_damping_against_the_sky_trades_gap_for_comfort():
    sky, ground = (KNOWN["A = 1e-6 m", damping] for damping in ("absolute", "relative, no filter"))
    assert ground[0] / sky[0] > 6
    assert sky[2] / ground[2] == pytest.approx(1.9, abs=0.1)
