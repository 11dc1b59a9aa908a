"""Gains against closed formulas, ctrlsys and brute force; the cases in which norms are known to go wrong."""

import math

import control
import numpy as np
import pytest
from goal_cases import loop_of, plant, random_controller, random_plant

from workbench.control.structure.block import Controller
from workbench.errors import InputError
from workbench.goals.gain import Gain, Tracking, WeightedGain

NOTHING = Controller.static([[0.0]])


def _alone(A, B, C, D=None, sample_time=None):
    """A loop whose controller does nothing between a further input u and output y, so channels are the plant's own."""
    A, B, C = (np.atleast_2d(M) for M in (A, B, C))
    (n, m), p = B.shape, len(C)
    system = plant(
        A, np.hstack([B, np.zeros((n, 1))]), np.vstack([C, np.zeros((1, n))]),
        None if D is None else np.block([[np.atleast_2d(D), np.zeros((p, 1))], [np.zeros((1, m + 1))]]),
        inputs=[*(f"w{i + 1}" for i in range(m)), "u"], outputs=[*(f"z{i + 1}" for i in range(p)), "y"],
    )  # fmt: skip
    return loop_of(system, controls=["u"], measured=["y"], sample_time=sample_time)


def _oscillators(pairs):
    """Σ g/(s² + 2ζω s + ω²) as A, B, C, for (ω, ζ, g)."""
    blocks = [np.array([[0.0, 1.0], [-(w**2), -2 * z * w]]) for w, z, _ in pairs]
    n = 2 * len(pairs)
    A = np.zeros((n, n))
    for k, block in enumerate(blocks):
        A[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = block
    B = np.tile([[0.0], [1.0]], (len(pairs), 1))
    C = np.concatenate([[g, 0.0] for _, _, g in pairs])[None]
    return A, B, C


def test_the_narrow_higher_peak_beside_a_broad_one_is_found():
    # a broad peak of 5 at 1 rad/s and one of 50 at 137.035 rad/s, 3e-4 rad/s wide: no usual grid sees it
    w, zeta = 137.035, 1e-6
    A, B, C = _oscillators([(1.0, 0.1, 1.0), (w, zeta, 50.0 * 2 * zeta * w**2)])
    loop = _alone(A, B, C)
    goal = Gain(inputs="w1", outputs="z1").bind(loop)
    value, exact = goal.evaluate(NOTHING), goal.exact(NOTHING)
    # by hand: the narrow peak at its resonance, the broad one adds −1/w² there: relative 1e-6
    assert value.value == pytest.approx(50.0, rel=3e-6)
    assert value.value == pytest.approx(exact.value, rel=1e-9)
    assert value.frequency == pytest.approx(w, rel=1e-8)
    grid = np.geomspace(0.1, 1e4, 2000)
    assert np.abs(loop.channel("w1", "z1").response(NOTHING, grid)).max() < 6  # what a grid believes


def test_gains_agree_with_slicot_on_random_systems():
    import ctrlsys

    for seed in range(6):
        P = random_plant(seed, 7, 3, 2, feedthrough=seed % 2 == 1)
        loop = _alone(P.A, P.B, P.C, P.D)
        inputs, outputs = ("w1", "w2", "w3"), ("z1", "z2")  # not square
        peak, *_ = ctrlsys.ab13dd(
            "C", "I", "N", "D", 7, 3, 2, np.array([0.0, 1.0]), np.array(P.A, order="F"), np.eye(7, order="F"),
            np.array(P.B, order="F"), np.array(P.C, order="F"), np.array(P.D, order="F"), 1e-10,
        )  # fmt: skip
        bound = Gain(inputs=inputs, outputs=outputs).bind(loop)
        # ab13dd was asked for 1e-10
        assert bound.evaluate(NOTHING).value == pytest.approx(peak[0] / peak[1], rel=1e-8)
        assert bound.exact(NOTHING).upper >= peak[0] / peak[1] * (1 - 1e-9)


def test_a_badly_scaled_system_has_the_gain_of_a_well_scaled_one():
    P = random_plant(4, 6, 2, 2)
    scale = 10.0 ** np.array([-6, 5, 0, 3, -4, 6])
    one = Gain(inputs=("w1", "w2"), outputs=("z1", "z2"))
    plain = one.bind(_alone(P.A, P.B, P.C)).evaluate(NOTHING).value
    A, B, C = P.A * scale / scale[:, None], P.B / scale[:, None], P.C * scale
    # twelve orders of magnitude between states, undone by balancing: a few digits of sixteen are lost
    assert one.bind(_alone(A, B, C)).evaluate(NOTHING).value == pytest.approx(plain, rel=1e-8)


def test_a_double_pole_does_no_harm_where_eigenvectors_fail():
    A, B, C = [[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -1.0]], [[0.0], [0.0], [1.0]], [[1.0, 0.0, 0.0]]
    # 1/(s + 1)³: the largest gain is that at zero
    assert Gain(inputs="w1", outputs="z1").bind(_alone(A, B, C)).evaluate(NOTHING).value == pytest.approx(1.0, rel=1e-9)


def test_a_sampled_peak_is_that_on_the_unit_circle():
    h = 0.05
    discrete = control.c2d(control.tf([1.0], [1.0, 0.02, 30.0]), h)
    P = control.ss(discrete)
    loop = _alone(P.A, P.B, P.C, P.D, sample_time=h)
    bound = Gain(inputs="w1", outputs="z1").bind(loop)
    omega = np.sqrt(30.0) + np.linspace(-0.05, 0.05, 20001)
    brute = np.abs(control.frequency_response(discrete, omega).complex).max()
    # the brute grid is 5e-6 apart on a peak 0.02 wide: 1e-7 of its height
    assert bound.evaluate(NOTHING).value == pytest.approx(brute, rel=1e-6)
    assert bound.exact(NOTHING).upper >= brute


def test_a_peak_just_under_the_nyquist_frequency_is_found():
    h, angle, radius = 1.0, 3.1, 0.9999
    A = radius * np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    loop = _alone(A, [[1.0], [0.0]], [[1.0, 0.0]], sample_time=h)
    found = Gain(inputs="w1", outputs="z1").bind(loop).evaluate(NOTHING)
    grid = np.exp(1j * np.linspace(3.09, 3.11, 200001))
    brute = max(abs((z - A[1, 1]) / ((z - A[0, 0]) * (z - A[1, 1]) - A[0, 1] * A[1, 0])) for z in grid[::7])
    assert found.value == pytest.approx(brute, rel=1e-4)  # grid of 7e-7 on a peak 2e-4 wide


def test_the_focus_band_cuts_off_the_peak_outside():
    A, B, C = _oscillators([(1.0, 0.1, 1.0)])
    loop = _alone(A, B, C)
    found = Gain(inputs="w1", outputs="z1", focus=(2.0, 10.0)).bind(loop).evaluate(NOTHING)
    assert found.frequency == 2.0
    assert found.value == pytest.approx(1 / abs(1 - 4 + 0.4j), rel=1e-10)


def test_a_limit_over_frequency_divides_the_gain():
    A, B, C = [[-1.0]], [[1.0]], [[1.0]]  # 1/(s + 1)
    loop = _alone(A, B, C)
    goal = {"inputs": "w1", "outputs": "z1"}
    # 1/(s + 1) under (s + 2)/(s + 10): largest at zero, 1/0.2
    rational = Gain(**goal, limit=([1.0, 2.0], [1.0, 10.0])).bind(loop).evaluate(NOTHING)
    assert rational.value == pytest.approx(5.0, rel=1e-10)
    assert rational.frequency == 0.0
    # breakpoints 1 at 0.1 and 0.01 at 10: slope −1 through 0.1/ω, so ω/(0.1 √(1 + ω²)), largest at its end
    broken = Gain(**goal, limit={0.1: 1.0, 10.0: 0.01}).bind(loop).evaluate(NOTHING)
    assert broken.value == pytest.approx(10 / (0.1 * math.sqrt(101)), rel=1e-6)
    assert broken.frequency == pytest.approx(10.0, rel=1e-3)


def test_a_weighted_gain_is_that_of_the_product():
    P = random_plant(5, 5, 2, 2)
    loop = _alone(P.A, P.B, P.C)
    bound = WeightedGain(
        inputs=("w1", "w2"), outputs=("z1", "z2"), left=([1.0, 2.0], [1.0, 5.0]), right=control.tf([3.0], [1.0, 3.0])
    ).bind(loop)
    omega = np.geomspace(1e-3, 1e3, 4001)
    s = 1j * omega
    weights = np.abs((s + 2) / (s + 5) * 3 / (s + 3))
    brute = (np.linalg.svd(P.response(omega), compute_uv=False)[:, 0] * weights).max()
    assert bound.evaluate(NOTHING).value == pytest.approx(brute, rel=1e-4)  # 700 points a decade


def test_an_exact_dead_time_enters_the_gain():
    # 1 + e^{−sT} comes from feedthrough and a delayed copy; T/(1 + T) with L = k e^{−sT}/(s + 1)
    k, dead = 1.5, 0.4
    system = plant([[-1.0]], [[1.0]], [[1.0]], inputs=["u"], outputs=["y"])
    loop = loop_of(system, controls=["u"], measured=["y"], references=(), input_delay={"u": dead})
    K = Controller.static([[-k]])
    found = Gain(inputs="u", outputs="y").bind(loop).evaluate(K)
    omega = np.linspace(0, 30, 300001)
    L = np.exp(-1j * omega * dead) / (1j * omega + 1)
    assert found.value == pytest.approx(np.abs(L / (1 + k * L)).max(), rel=1e-7)  # grid of 1e-4 rad/s


def test_a_tracking_error_is_held_under_its_profile():
    # T = 1/(s + 1): error s/(s + 1); profile (s + 0.002)/(s + 2) for 1 s, 0.001, 1: ratio at infinity 1, else larger
    loop = _alone([[-1.0]], [[1.0]], [[1.0]])
    bound = Tracking(inputs="w1", outputs="z1", response_time=1.0).bind(loop)
    w = np.geomspace(1e-6, 1e6, 400001)
    ratio = w / np.hypot(w, 1) * np.hypot(w, 2) / np.hypot(w, 0.002)
    assert bound.evaluate(NOTHING).value == pytest.approx(ratio.max(), rel=1e-8)
    assert bound.exact(NOTHING).value == pytest.approx(ratio.max(), rel=1e-8)


def test_two_near_peaks_are_handed_over_as_two_pieces():
    A, B, C = _oscillators([(1.0, 0.01, 0.02), (10.0, 0.01, 2.004)])
    system = plant(A, B, C, inputs=["u"], outputs=["y"])
    loop = loop_of(system, controls=["u"], measured=["y"])
    found = Gain(inputs="u", outputs="y").bind(loop).evaluate(NOTHING)
    assert len(found.gradients) == 2
    first, second = (piece[1].D[0, 0] for piece in found.gradients)
    assert first != pytest.approx(second, rel=0.1)


def test_more_states_cost_milliseconds():
    from time import perf_counter

    loop = loop_of(random_plant(1, 40, 3, 3), controls=["u1", "u2"], measured=["y1", "y2"], order=3)
    K = random_controller(2, 3, 2, 2, size=0.02)
    bound = Gain(inputs=("u3", "u1"), outputs=("y3", "y1")).bind(loop)
    bound.evaluate(K)
    times = []
    for _ in range(5):
        start = perf_counter()
        bound.evaluate(K.scaled(1.0))
        times.append(perf_counter() - start)
    assert min(times) < 0.2  # 5 ms on an idle core; 43 states


def test_wrong_weights_and_limits_are_refused():
    with pytest.raises(InputError, match="limit must be positive and finite; got -1"):
        Gain(inputs="a", outputs="b", limit=-1)
    with pytest.raises(InputError, match="left must be stable"):
        WeightedGain(inputs="a", outputs="b", left=([1.0], [1.0, 0.0]))
    with pytest.raises(InputError, match="right must have 2 outputs"):
        WeightedGain(inputs=("a", "c"), outputs="b", right=np.eye(3))
    with pytest.raises(InputError, match="two or more breakpoints"):
        Gain(inputs="a", outputs="b", limit={1.0: 2.0})
    with pytest.raises(InputError, match="pair up"):
        Tracking(inputs=("a", "c"), outputs="b", response_time=1.0)
    with pytest.raises(InputError, match="left must be proper"):
        WeightedGain(inputs="a", outputs="b", left=([1.0, 0.0], [1.0]))


@pytest.mark.parametrize("unit", [1e-12, 1e-6, 1.0, 1e6, 1e12])
def test_a_sampled_loop_has_no_pole_at_minus_one_in_any_units_of_its_states(unit):
    system = plant(
        [[0.5, unit], [0, 0.6]], [[0, 0], [1 / unit, 1 / unit]], [[1.0, 0]], inputs=["u", "w"], outputs=["y"]
    )
    loop = loop_of(system, controls=["u"], measured=["y"], sample_time=0.1)
    bound = Gain(inputs="w", outputs="y").bind(loop)
    # 1/((z − 0.5)(z − 0.6) + 0.1): 1/|z² − 1.1 z + 0.4| on the circle
    z = np.exp(1j * np.linspace(0, np.pi, 200_001))
    peak = (1 / np.abs(z**2 - 1.1 * z + 0.4)).max()
    K = Controller.static([[-0.1]])
    assert bound.exact(K).value == pytest.approx(peak, rel=1e-8)
    assert bound.evaluate(K).value == pytest.approx(peak, rel=1e-8)


@pytest.mark.parametrize("distance", [1e-3, 1e-7, 1e-11])
def test_a_stable_pole_near_minus_one_is_stable(distance):
    system = plant([[distance - 1, 0], [0, 0.9]], [[0, 1], [1, 1]], [[1.0, 1.0]], inputs=["u", "w"], outputs=["y"])
    loop = loop_of(system, controls=["u"], measured=["y"], sample_time=0.1)
    found = Gain(inputs="w", outputs="y").bind(loop).exact(Controller.static([[0.0]]))
    # at z = −1: 1/d + 1/1.9, to the rounding of the pole's distance
    assert found.value == pytest.approx(1 / distance + 1 / 1.9, rel=1e-3)
