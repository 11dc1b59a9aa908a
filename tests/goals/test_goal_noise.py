"""Variances, spectra and rms limits against Lyapunov solvers of others, closed formulas and a simulation."""

import math

import control
import numpy as np
import pytest
from goal_cases import loop_of, plant, random_plant
from scipy import integrate, signal

from workbench.constants import GRAVITY
from workbench.control.structure.block import Controller
from workbench.errors import InputError
from workbench.goals.spectrum import RmsLimit, Spectrum
from workbench.goals.variance import Variance, WeightedVariance

ONE = {"inputs": "w", "outputs": "z"}


def _case(system, sample_time=None, **delays):
    """The plant from w to z with a further u and y that K may join."""
    loop = loop_of(system, controls=["u"], measured=["y"], sample_time=sample_time, **delays)
    return loop


def _plant(seed, n=6, sample_time=None):
    P = random_plant(seed, n, 2, 2)
    A, B = P.A, P.B
    if sample_time is not None:
        A, B = np.eye(n) + 0.0, B
        from scipy.linalg import expm

        A = expm(P.A * sample_time)
    return plant(A, B, P.C, inputs=["w", "u"], outputs=["z", "y"])


def _closed(system, k):
    """A, B, C of w → z under u = k y, written out."""
    A = system.A + k * system.B[:, 1:] @ system.C[1:]
    return A, system.B[:, :1], system.C[:1]


def test_the_variance_is_that_of_python_control():
    system, k = _plant(1), -0.05
    A, B, C = _closed(system, k)
    bound = Variance(**ONE, limit=2.0).bind(_case(system))
    K = Controller.static([[k]])
    expected = control.system_norm(control.ss(A, B, C, 0), p=2)
    assert bound.evaluate(K).value == pytest.approx(expected / 2, rel=1e-9)
    exact = bound.exact(K)
    assert exact.value == pytest.approx(expected / 2, rel=1e-9)
    assert exact.value <= exact.upper <= exact.value * (1 + 1e-6)


def test_a_first_order_lag_passes_half_its_bandwidth():
    # ∫ |1/(τs + 1)|² df over all f is 1/(2τ)
    system = plant([[-2.0]], [[2.0, 0.0]], [[1.0], [0.0]], inputs=["w", "u"], outputs=["z", "y"])
    value = Variance(**ONE).bind(_case(system)).evaluate(Controller.static([[0.0]])).value
    assert value == pytest.approx(math.sqrt(1 / (2 * 0.5)), rel=1e-12)


def test_a_sampled_variance_is_that_of_the_discrete_lyapunov_equation():
    system, k = _plant(2, sample_time=0.1), -0.01
    A, B, C = _closed(system, k)
    P = control.dlyap(A, B @ B.T)
    expected = math.sqrt((C @ P @ C.T)[0, 0] / 0.1)  # a flat density of 1 up to Nyquist is a sequence of variance 1/h
    bound = Variance(**ONE).bind(_case(system, sample_time=0.1))
    K = Controller.static([[k]])
    assert bound.evaluate(K).value == pytest.approx(expected, rel=1e-9)
    assert bound.exact(K).value == pytest.approx(expected, rel=1e-9)


def test_weights_shape_the_variance():
    system, k = _plant(3), -0.05
    A, B, C = _closed(system, k)
    bound = WeightedVariance(**ONE, left=([1.0, 1.0], [1.0, 4.0]), right=([2.0], [1.0, 2.0])).bind(_case(system))
    # 1 of (s + 1)/(s + 4) passes straight through, so the product needs the lag before it
    product = control.tf([1.0, 1.0], [1.0, 4.0]) * control.ss(A, B, C, 0) * control.tf([2.0], [1.0, 2.0])
    expected = control.system_norm(control.ss(product), p=2)
    assert bound.evaluate(Controller.static([[k]])).value == pytest.approx(expected, rel=1e-8)


def test_noise_that_passes_straight_through_has_no_finite_variance():
    system = plant([[-1.0]], [[1.0, 0.0]], [[1.0], [0.0]], np.diag([0.1, 0.0]), inputs=["w", "u"], outputs=["z", "y"])
    loop = _case(system)
    K = Controller.static([[0.0]])
    value = Variance(**ONE).bind(loop).evaluate(K)
    assert value.value == math.inf
    assert "straight to the output" in value.reason
    assert math.isfinite(WeightedVariance(**ONE, left=([1.0], [1.0, 1.0])).bind(loop).evaluate(K).value)
    flat = RmsLimit(**ONE, limit=1.0).bind(loop).evaluate(K)
    assert flat.value == math.inf
    assert "does not fall off" in flat.reason


def test_the_exact_variance_of_a_delayed_loop_is_close_to_its_pade_model():
    system = _plant(1)
    bound = Variance(**ONE).bind(_case(system, input_delay={"u": 0.2}))
    K = Controller.static([[-0.05]])
    # fourth-order Padé fractions of a weak loop; the quadrature's own error is 1e-9
    assert bound.exact(K).value == pytest.approx(bound.evaluate(K).value, rel=1e-5)
    assert "dead times exact" in bound.exact(K).method


def test_the_rms_of_white_noise_is_the_variance():
    system, K = _plant(4), Controller.static([[-0.05]])
    loop = _case(system)
    # one-sided density 2 per hertz is unit two-sided intensity
    rms = RmsLimit(**ONE, limit=1.0, density=2.0).bind(loop)
    variance = Variance(**ONE).bind(loop).evaluate(K).value
    assert rms.evaluate(K).value == pytest.approx(variance, rel=1e-6)  # 6-node panels
    assert rms.exact(K).value == pytest.approx(variance, rel=1e-10)


def test_the_rms_within_a_band_is_the_integral_over_it():
    system, K = _plant(5), Controller.static([[-0.05]])
    A, B, C = _closed(system, -0.05)

    def psd(f):
        T = (C @ np.linalg.solve(2j * math.pi * f * np.eye(6) - A, B))[0, 0]
        return abs(T) ** 2 * math.exp(np.interp(math.log(f), np.log([0.1, 2.0]), np.log([1.0, 0.04])))

    expected, _ = integrate.quad(psd, 0.1, 2.0, epsabs=0, epsrel=1e-10, limit=200)
    found = RmsLimit(**ONE, limit=0.5, density={0.1: 1.0, 2.0: 0.04}).bind(_case(system)).evaluate(K)
    assert found.value == pytest.approx(math.sqrt(expected) / 0.5, rel=1e-6)


def test_the_spectrum_touches_its_mask_where_the_value_is_one():
    system, K = _plant(6), Controller.static([[-0.05]])
    loop = _case(system)
    mask, density = {0.05: 0.3, 0.5: 0.1, 5.0: 1e-4}, {0.05: 1.0, 5.0: 0.2}
    f = np.unique(np.r_[np.geomspace(1e-3, 1e2, 200001), list(mask)])  # the peak may sit at a corner of the mask

    def level(points):
        return np.exp(np.interp(np.log(f), np.log(list(points)), np.log(list(points.values()))))

    T = loop.channel("w", "z").response(K, 2 * math.pi * f)[:, 0, 0]
    ratio = np.abs(T) ** 2 * level(density) / level(mask)
    bound = Spectrum(**ONE, mask=mask, density=density).bind(loop)
    assert bound.evaluate(K).value == pytest.approx(math.sqrt(ratio.max()), rel=1e-6)  # 4e-5 between neighbours
    assert bound.exact(K).value == pytest.approx(math.sqrt(ratio.max()), rel=1e-6)
    assert bound.evaluate(K).frequency == pytest.approx(2 * math.pi * f[np.argmax(ratio)], rel=1e-3)


def test_a_mask_in_g_squared_is_larger_by_g_squared():
    system, K = _plant(6), Controller.static([[-0.05]])
    plain = Spectrum(**ONE, mask=1.0, density={0.1: 1.0, 1.0: 1.0}).bind(_case(system)).evaluate(K).value
    in_g = Spectrum(**ONE, mask=1.0, density={0.1: 1.0, 1.0: 1.0}, unit="g").bind(_case(system)).evaluate(K).value
    assert in_g == pytest.approx(plain / GRAVITY, rel=1e-12)


def test_the_rms_is_that_of_a_simulated_noise():
    system = plant([[-3.0]], [[3.0, 0.0]], [[1.0], [0.0]], inputs=["w", "u"], outputs=["z", "y"])
    random, h, count = np.random.default_rng(0), 0.01, 400_000
    white = random.standard_normal(count) * math.sqrt(2.0 / (2 * h))  # one-sided density 2 per hertz
    decay = math.exp(-3 * h)
    z = signal.lfilter([0.0, 1 - decay], [1.0, -decay], white)
    value = RmsLimit(**ONE, limit=1.0, density=2.0).bind(_case(system)).evaluate(Controller.static([[0.0]])).value
    assert value == pytest.approx(z.std(), rel=0.03)  # 4000 s of a process with 1/3 s memory: 1 % twice over


def test_wrong_spectra_are_refused():
    with pytest.raises(InputError, match="positive frequencies"):
        Spectrum(**ONE, mask={0.0: 1.0, 1.0: 1.0})
    with pytest.raises(InputError, match="one for all or one per input"):
        RmsLimit(**ONE, limit=1.0, density=(1.0, 2.0))
    with pytest.raises(InputError, match="'output' or 'g'"):
        RmsLimit(**ONE, limit=1.0, unit="mg")
    with pytest.raises(InputError, match="Variance looks at all frequencies"):
        Variance(**ONE, focus=(1.0, 2.0))


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_a_sampled_variance_tends_to_the_continuous_one(unit):
    h = 1e-3 / unit
    slow = control.c2d(control.ss([[-2.0 * unit]], [[2.0 * unit]], [[1.0]], 0), h)
    system = plant(
        slow.A, np.hstack([slow.B, [[0.0]]]), [[1.0], [0.0]], inputs=["w", "u"], outputs=["z", "y"]
    )  # fmt: skip
    bound = Variance(**ONE).bind(_case(system, sample_time=h))
    for found in (bound.evaluate(Controller.static([[0.0]])), bound.exact(Controller.static([[0.0]]))):
        assert found.value == pytest.approx(math.sqrt(2.0 * unit / 2), rel=1e-6)  # error of the second order in h


def test_the_variance_behind_a_dead_time_is_that_without_it():
    system = plant([[-2.0]], [[2.0, 0.0]], [[1.0], [0.0]], inputs=["w", "u"], outputs=["z", "y"])
    found = Variance(**ONE).bind(_case(system, input_delay={"w": 0.7})).exact(Controller.static([[0.0]]))
    assert found.value == pytest.approx(1.0, rel=1e-9)
    assert "dead times exact" in found.method


def test_the_smallest_feedthrough_passes_noise_straight_through():
    for delays in ({}, {"input_delay": {"w": 0.7}}):
        system = plant(
            [[-2.0]], [[2.0, 0.0]], [[1.0], [0.0]], np.diag([1e-13, 0.0]), inputs=["w", "u"], outputs=["z", "y"]
        )  # fmt: skip
        found = Variance(**ONE).bind(_case(system, **delays)).exact(Controller.static([[0.0]]))
        assert found.value == math.inf
        assert "straight to the output" in found.reason
