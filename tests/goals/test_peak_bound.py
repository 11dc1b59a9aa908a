"""Peaks over frequency bracketed by branch and bound, against closed forms and dense sampling."""

import numpy as np
import pytest
from delay_cases import companion, late_loop
from goal_cases import loop_of, plant, random_plant

from workbench.control.structure.block import Controller
from workbench.control.structure.blocks import gain
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.goals.gain import Gain
from workbench.goals.loop_shape import MaxLoopGain, Sensitivity
from workbench.goals.margin import Margins
from workbench.goals.sector import ConicSector
from workbench.goals.spectrum import Spectrum
from workbench.lti import Plant
from workbench.lti.model import Model
from workbench.lti.peak_jet import Enclosure
from workbench.lti.realisation import spectral

LAG = Plant.from_matrices([[-1.0]], [[1.0]], [[1.0]])
OPEN = Controller.static([[0.0]])


def _modes(*pairs):
    """Σ 1/(s² + 2 ζ ω s + ω²) from w to z, alone."""
    A, B, C = np.zeros((2 * len(pairs),) * 2), np.zeros((2 * len(pairs), 1)), np.zeros((1, 2 * len(pairs)))
    for k, (zeta, omega) in enumerate(pairs):
        A[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[0, omega], [-omega, -2 * zeta * omega]]
        B[2 * k + 1], C[0, 2 * k] = 1 / omega, 1.0
    return loop_of(plant(A, B, C, inputs=["w"], outputs=["z"]), controls=["w"], measured=["z"])


@pytest.mark.parametrize("seed", range(2))
def test_a_response_with_dead_times_stays_within_its_enclosure(seed):
    random = np.random.default_rng(seed)
    structure = Structure(gain(["y1", "y2"], ["u1", "u2"], 0.1))
    loop = Loop(Model("m", random_plant(seed, 6, 2, 2, feedthrough=True), {"u1": 0.3, "u2": 1.1}), structure)
    K, channel = structure.controller(), loop.sensitivity(("u1", "u2"))
    enclosed = Enclosure.of(*channel.lined_system(K), channel.late(K))
    middle = 10 ** random.uniform(-2, 2, 200)
    radius = middle * 10 ** random.uniform(-5, -1, 200)
    jet = enclosed.jet(middle, radius)
    assert np.mean(np.isfinite(jet.bend)) > 0.5
    for part in (-1.0, -0.4, 0.7, 1.0):
        response = channel.response(K, middle + part * radius)
        rest = spectral(response - jet.value - (part * radius)[:, None, None] * jet.slope)
        assert np.all(rest <= jet.bend * radius**2 / 2 + 1e-12)  # rounding
        assert np.all(spectral(response) <= jet.largest(spectral) + 1e-12)
    for start in (30.0, 300.0):
        far = spectral(channel.response(K, np.linspace(start, 20 * start, 4_000)))
        assert far.max() <= sum(enclosed.beyond(start))


@pytest.mark.parametrize("zeta", [1e-2, 1e-3, 1e-4, 1e-5])
def test_a_density_of_light_damping_is_bracketed_at_its_peak(zeta):
    # |G| at its peak is 1/(2 ζ √(1 − ζ²) ω²); a mask flat in decibels around it
    omega = 7.0
    loop = _modes((zeta, omega), (3 * zeta, omega * (1 + 5 * zeta)))
    grid = omega * (1 + zeta * np.linspace(-40, 40, 400_001))
    size = np.abs(
        sum(1 / (w**2 - grid**2 + 2j * z * w * grid) for z, w in ((zeta, omega), (3 * zeta, omega * (1 + 5 * zeta))))
    )
    mask = {0.1: 4.0, 10.0: 4.0}
    value = Spectrum(inputs="w", outputs="z", mask=mask, density={0.01: 1.0, 100.0: 1.0}).bind(loop).exact(OPEN)
    assert value.value == pytest.approx(size.max() / 2, rel=1e-6)  # the sampling's own error is 1e-8
    assert value.value <= value.upper <= value.value * (1 + 2e-6)


def test_a_density_that_slopes_against_its_mask_is_bracketed_where_the_product_peaks():
    loop = _modes((1e-4, 3.0))
    grid = 3.0 * (1 + 1e-4 * np.linspace(-30, 30, 300_001))
    density, mask = {0.01: 1.0, 1.0: 4.0, 50.0: 1e-3}, {0.1: 1.0, 0.4: 3.0, 5.0: 0.2}
    # straight lines in log-log axes, hertz
    shaped = np.exp(0.5 * np.interp(np.log(grid / 2 / np.pi), np.log(list(density)), np.log(list(density.values()))))
    limit = np.exp(0.5 * np.interp(np.log(grid / 2 / np.pi), np.log(list(mask)), np.log(list(mask.values()))))
    expected = (np.abs(1 / (9 - grid**2 + 2j * 3e-4 * grid)) * shaped / limit).max()
    value = Spectrum(inputs="w", outputs="z", mask=mask, density=density).bind(loop).exact(OPEN)
    assert value.value == pytest.approx(expected, rel=1e-6)
    assert value.upper <= value.value * (1 + 2e-6)


def test_random_loops_with_dead_time_have_their_peak_within_the_bracket_in_any_unit_of_time():
    random = np.random.default_rng(5)
    seen = 0
    for _ in range(10):
        unit, T = 10 ** random.uniform(-6, 6), 10 ** random.uniform(-1.5, 1.5)
        k = random.uniform(0.2, 1.2) * (1 + 1.2 / T)
        zeta, omega = 10 ** random.uniform(-3, 0), 10 ** random.uniform(-0.5, 1)
        den = np.polymul([1.0, 1.0], [1.0, 2 * zeta * omega, omega**2])
        num = np.polyadd([0.1 * omega**2, 0.1 * omega**2], [1.0, 2 * zeta * omega, omega**2])
        slower = [p * unit ** np.arange(len(p) - 1, -1, -1.0) for p in (k * num, den)]
        loop = late_loop(companion(*slower), 1.0, T * unit)
        value = Sensitivity(points="u1", limit=1.0).bind(loop).exact(loop.structure.controller())
        if not np.isfinite(value.value):
            continue
        seen += 1
        around = omega * (1 + zeta * np.linspace(-20, 20, 40_001))
        grid = np.r_[np.linspace(0, 60, 150_001), around[around > 0]]
        L = k * np.polyval(num, 1j * grid) / np.polyval(den, 1j * grid) * np.exp(-1j * grid * T)
        largest = np.abs(1 / (1 + L)).max()
        assert largest * (1 - 1e-9) <= value.upper <= value.value * (1 + 2e-6)
        assert value.value == pytest.approx(largest, rel=3e-4)  # of the sampling
    assert seen >= 4


def test_a_comb_of_peaks_under_a_long_dead_time_is_searched_to_its_last_tooth():
    # S = 1/(1 + k e^(−sT)) beside a slow lag: teeth of 1/(1 − k) every 2π/T up to the corner; the largest is known
    T, corner, k = 200.0, 0.5, 0.99
    plant_ = Plant.from_matrices([[-corner]], [[corner]], [[1.0]])
    loop = late_loop(plant_, k, T)
    value = Sensitivity(points="u1", limit=1.0).bind(loop).exact(loop.structure.controller())
    grid = np.linspace(0, 0.1, 400_001)
    largest = np.abs(1 / (1 + k * corner / (1j * grid + corner) * np.exp(-1j * grid * T))).max()
    assert value.value == pytest.approx(largest, rel=1e-6)
    assert value.upper <= value.value * (1 + 2e-6)


def test_a_peak_on_a_narrow_band_and_a_sampled_profile_are_bracketed_too():
    loop = _modes((1e-3, 5.0))
    value = Gain(inputs="w", outputs="z", limit=2.0, focus=(5.02, 9.0)).bind(loop).exact(OPEN)
    assert value.value == pytest.approx(abs(1 / (25 - 5.02**2 + 1j * 1e-2 * 5.02)) / 2, rel=1e-9)
    assert value.upper <= value.value * (1 + 2e-6)
    h = 0.1
    A = [[0.0, 1.0], [-0.9999, 1.2]]  # poles of modulus 0.99995 at 0.93 rad a sample
    system = plant(A, [[0.0], [1.0]], [[1.0, 0.0]], inputs=["w"], outputs=["z"])
    sampled = loop_of(system, controls=["w"], measured=["z"], sample_time=h)
    z = np.exp(1j * np.linspace(0.9, 0.95, 1_000_001))
    omega = np.angle(z) / h
    expected = (np.abs(1 / (z**2 - 1.2 * z + 0.9999)) / (2.0 * omega**0.5)).max()
    limit = {0.01: 2.0 * 0.01**0.5, 100.0: 2.0 * 100.0**0.5}
    value = Gain(inputs="w", outputs="z", limit=limit).bind(sampled).exact(OPEN)
    assert value.value == pytest.approx(expected, rel=1e-6)
    assert expected * (1 - 1e-9) <= value.upper <= value.value * (1 + 2e-6)


@pytest.mark.slow
def test_loop_gains_and_margins_with_dead_time_are_bracketed():
    loop = late_loop(LAG, 2.0, 0.6)
    K, grid = loop.structure.controller(), np.linspace(1e-3, 40, 400_001)
    L = 2 / (1j * grid + 1) * np.exp(-0.6j * grid)
    most = MaxLoopGain(points="u1", profile=([3.0], [1.0, 0.0])).bind(loop).exact(K)
    beyond = grid >= 3.0  # where the profile is below 1
    assert most.value == pytest.approx((np.abs(L) * grid / 3)[beyond].max(), rel=2e-3)  # 2/3 at infinity
    assert 2 / 3 <= most.upper <= 2 / 3 * (1 + 1e-3)
    margins = Margins(points="u1", gain_db=6.0)
    value = margins.bind(loop).exact(K)
    assert value.value == pytest.approx(margins.alpha * np.abs(1 / (1 + L) - 0.5).max(), rel=1e-6)
    assert value.upper <= value.value * (1 + 2e-6)


def test_a_channel_on_the_far_side_of_a_sector_is_told_with_dead_time_exactly():
    # W₂'H = a y + b u has zeros where s + 1 + k e^(−sT), k = 4 a/b: on the right from T = arccos(−1/k)/√(k² − 1) on
    Q = -np.array([[1.0, 1.75], [1.75, 1.5]])
    a, b = np.linalg.eigh(Q)[1][:, 0]
    k = 4 * a / b
    limit = np.arccos(-1 / k) / np.sqrt(k**2 - 1)
    for T, far in ((0.999 * limit, False), (1.001 * limit, True)):
        loop = late_loop(Plant.from_matrices([[-1.0]], [[4.0]], [[1.0]]), 0.0, T)
        value = ConicSector(inputs="u1", outputs="y1", matrix=Q).bind(loop).exact(loop.structure.controller())
        assert ("far side" in value.reason) == far
