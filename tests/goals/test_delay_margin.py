"""Dead times that a loop bears: against counted poles, closed forms and whole samples."""

import numpy as np
import pytest
from delay_cases import companion, late_loop
from goal_cases import loop_of, plant

from workbench.control.structure.block import Controller
from workbench.goals.margin import DelayMargin
from workbench.lti import Plant

LAG = Plant.from_matrices([[-1.0]], [[1.0]], [[1.0]])


def judged(loop, delay, point="u1", K=None):
    return DelayMargin(points=point, delay=delay).bind(loop).exact(loop.structure.controller() if K is None else K)


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_a_late_lag_bears_what_is_left_of_its_printed_dead_time(unit):
    # K/(s + 1) e^(−sT): T < 1.2091996 for K = 2, of which 0.5 are used up
    lag = Plant.from_matrices([[-1 / unit]], [[1 / unit]], [[1.0]])
    value = judged(late_loop(lag, 2.0, 0.5 * unit), 0.7091996 * unit)
    assert value.value == pytest.approx(1.0, rel=1e-6)  # printed to 1e-7
    assert value.value <= value.upper <= value.value * (1 + 1e-8)


@pytest.mark.parametrize("dead_time", [0.0, 0.4])
def test_a_loop_gain_of_exactly_one_at_rest_bears_any_dead_time(dead_time):
    value = judged(late_loop(LAG, 1.0, dead_time), 1e6)
    assert value.value == value.upper == 0.0
    assert "any dead time is borne" in value.reason
    assert judged(late_loop(LAG, 0.999, dead_time), 1e6).upper == 0.0
    # 1.001/(s + 1): |L| = 1 at √(1.001² − 1), π − arctan of it before −1, over it
    omega = np.sqrt(1.001**2 - 1)
    margin = (np.pi - np.arctan(omega)) / omega - dead_time
    assert judged(late_loop(LAG, 1.001, dead_time), margin).value == pytest.approx(1.0, rel=1e-9)


def test_the_margin_of_light_modes_is_where_the_count_of_poles_changes():
    random = np.random.default_rng(2)
    for _ in range(6):
        zeta, omega = 10 ** random.uniform(-4, -1), random.uniform(2, 30)
        mode = [1.0, 2 * zeta * omega, omega**2]
        num = np.polyadd(1.5 * np.array(mode), 3 * zeta * omega**2 * np.array([1.0, 1.0]))
        system, used = companion(num, np.polymul([1.0, 1.0], mode)), random.uniform(0.01, 0.05)
        loop = late_loop(system, 1.0, used)
        if loop.unstable_poles(loop.structure.controller()):
            continue
        margin = 1 / judged(loop, 1.0).value
        for factor, stable in ((1 - 1e-5, True), (1 + 1e-5, False)):
            later = late_loop(system, 1.0, used + margin * factor)
            assert (later.unstable_poles(later.structure.controller()) == 0) == stable


def test_a_sampled_loop_gain_above_one_everywhere_does_not_bear_a_sample():
    # y = k u at once: 1 + k z^(−d), k = 3: outside of the circle from the first sample on
    system = plant([[0.0]], [[0.0]], [[0.0]], [[1.0]], inputs=["u"], outputs=["y"])
    loop = loop_of(system, controls=["u"], measured=["y"], sample_time=0.1)
    K = Controller.static([[-3.0]])
    value = judged(loop, 0.1, "u", K)
    assert value.value >= 1
    assert value.upper == np.inf
    weak = judged(loop, 0.1, "u", Controller.static([[-0.5]]))
    assert weak.upper == 0.0


def test_the_margin_of_a_sampled_loop_lies_between_the_whole_samples_that_tell():
    # x' = x + 0.3 u a sample, u = −x: z^(d+1) − z^d + 0.3
    system = plant([[1.0]], [[0.3]], [[1.0]], inputs=["u"], outputs=["y"])
    loop = loop_of(system, controls=["u"], measured=["y"], sample_time=0.1)
    stable = [np.abs(np.roots(np.polyadd([1.0, -1.0, *np.zeros(d)], [0.3]))).max() < 1 for d in range(9)]
    last = stable.index(False) - 1
    margin = 0.1 / judged(loop, 0.1, "u", Controller.static([[-1.0]])).value
    assert last * 0.1 < margin < (last + 1) * 0.1


def test_a_sharp_resonance_that_just_reaches_one_is_not_overlooked():
    # peak of the loop gain 1.0001 at a mode of damping 1e-5, far above a weak lag
    zeta, omega = 1e-5, 300.0
    for top, borne in ((0.9999, True), (1.0001, False)):
        loop = late_loop(companion([2 * zeta * omega * top, 0.0], [1.0, 2 * zeta * omega, omega**2]), 1.0, 0.0)
        value = judged(loop, 10.0)
        assert (value.upper == 0.0) == borne


def test_a_sampled_loop_that_is_strong_everywhere_and_bears_no_sample_is_never_met_nor_steered_as_if_it_were():
    # L = 3z/(z + 0.5): |L| from 2 to 6, pole at −0.125; with one sample more z² + 0.5z + 3z has a root at −3.5
    P = plant([[-0.5]], [[1.0]], [[-1.5]], [[3.0]], inputs=["u"], outputs=["y"])
    loop = loop_of(P, controls=["u"], measured=["y"], sample_time=0.1)
    K = Controller.static([[-1.0]])
    bound = DelayMargin(points="u", delay=0.1).bind(loop)
    assert loop.poles(K) == pytest.approx([-0.125])
    for value in (bound.evaluate(K), bound.exact(K)):
        assert value.upper == np.inf
        assert "one more sample" in value.reason
