"""What a model says of itself: dead times and sampling against formulas."""

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.lti.connect import connect, feedback
from workbench.lti.make import ss, tf


@pytest.mark.parametrize("time", [1.0, 1e-3, 60.0])
def test_the_peak_of_a_loop_with_dead_time_is_bracketed_in_any_unit_of_time(time):
    # S = 1/(1 + e^{−sT}/(2 s T)): |1/S|² = 1 + (2x)^-2 − sin x/x; an independent dense search, parabola at the top
    plant = tf([0.5 / time], [1.0, 0.0], input="u", output="y", dead_time=time)
    loop = connect([plant, tf([1.0], [1.0], input="r - y", output="u")], inputs="r", outputs={"e": "u"})
    x = np.linspace(0.1, 20, 2_000_001)
    expected = (1 / np.sqrt(1 + 1 / (4 * x**2) - np.sin(x) / x)).max()
    peak = loop.peak()
    assert peak.lower <= expected * (1 + 1e-9)  # the grid's own distance from the top is below 1e-11
    assert peak.upper >= expected
    assert peak.upper / peak.value - 1 < 2e-3  # what may lie beyond the last interval
    assert peak.frequency * time == pytest.approx(x[np.argmin(1 + 1 / (4 * x**2) - np.sin(x) / x)], rel=1e-4)


def test_a_sampled_peak_is_that_of_the_response_on_the_circle():
    model = tf([1.0], [1.0, -0.8], sample_time=0.1, dead_time=0.2)
    assert model.peak().value == pytest.approx(5.0, rel=1e-9)
    assert tf([1.0], [1.0, 0.8], sample_time=0.1).peak().frequency == pytest.approx(np.pi / 0.1, rel=1e-6)


def test_white_noise_through_a_lag_and_a_dead_time_has_the_variance_of_the_lag():
    # ∫ (e^{−t/T}/T)² dt = 1/(2T)
    assert tf([1.0], [0.3, 1.0]).variance() == pytest.approx(1 / 0.6, rel=1e-12)
    assert tf([1.0], [0.3, 1.0], dead_time=2.0).variance() == pytest.approx(1 / 0.6, rel=1e-8)  # pieces' accuracy
    # sampled, variance 1/h: Σ a^{2k}/h = 1/(h (1 − a²))
    assert tf([1.0], [1.0, -0.5], sample_time=0.1).variance() == pytest.approx(1 / (0.1 * 0.75), rel=1e-12)
    with pytest.raises(InputError, match="pass straight"):
        tf([1.0, 2.0], [0.3, 1.0], dead_time=0.1).rms()
    with pytest.raises(InputError, match="pass straight"):
        tf([1.0, 2.0], [0.3, 1.0]).rms()


def test_margins_of_an_integrator_with_lag_are_those_of_the_textbook():
    # L = 2/(s (s + 1)): |L| = 1 at ω² = (√17 − 1)/2
    channel = tf([2.0], [1.0, 1.0, 0.0], input="u", output="y").margins().channels[0]
    omega = np.sqrt((np.sqrt(17) - 1) / 2)
    assert channel.phase == pytest.approx(np.pi / 2 - np.arctan(omega), rel=1e-12)
    assert channel.channel == "u"
    with pytest.raises(InputError, match="without dead times"):
        tf([2.0], [1.0, 1.0, 0.0], dead_time=0.1).margins()


def test_an_unstable_system_has_no_peak_and_no_rms():
    model = feedback(tf([2.0], [1.0, 0.0], dead_time=1.0), tf([1.0], [1.0]))  # unstable from π/2 on
    for ask in (model.peak, model.rms, ss([[1.0]], [[1.0]], [[1.0]]).peak):
        with pytest.raises(InputError, match="exists if it is stable"):
            ask()
