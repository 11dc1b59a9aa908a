"""Poles of loops with dead time, located and counted, against Lambert's function and roots followed from none."""

import numpy as np
import pytest
from delay_cases import companion, late_loop, predicted_loop, unstable_by_crossings
from goal_cases import slope_error
from scipy.special import lambertw

from workbench.control.structure.blocks import gain
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.errors import InputError
from workbench.goals.loop_shape import Sensitivity
from workbench.goals.margin import DelayMargin
from workbench.goals.poles import Poles
from workbench.lti import Plant
from workbench.lti.model import Model

LAG = Plant.from_matrices([[-1.0]], [[1.0]], [[1.0]])


def count(loop):
    return loop.unstable_poles(loop.structure.controller())


def decay(loop):
    return loop.abscissa(loop.structure.controller())


def fractions(loop):
    """Poles with Padé fractions of order 4."""
    return np.linalg.eigvals(loop.channel((), ()).system(loop.structure.controller()).A)


@pytest.mark.parametrize(("k", "limit"), [(2.0, 1.2091996), (5.0, 0.3617395), (10.0, 0.1679382)])
def test_a_lag_with_dead_time_is_stable_up_to_the_printed_dead_time(k, limit):
    # 3e-7: half a unit of the last printed digit, relative
    assert count(late_loop(LAG, k, limit * (1 - 3e-7))) == 0
    assert count(late_loop(LAG, k, limit * (1 + 3e-7))) == 2
    assert decay(late_loop(LAG, k, limit * (1 - 3e-7))) < 0 < decay(late_loop(LAG, k, limit * (1 + 3e-7)))


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_a_light_oscillator_is_stable_in_two_windows_of_the_dead_time_in_any_unit_of_time(unit):
    # s² + 0.1 s + 1 + 0.5 e^(−sT): printed windows up to 0.202035 and from 4.219819 to 5.358212
    A = np.array([[0, 1 / unit], [-1 / unit, -0.1 / unit]])
    plant = Plant.from_matrices(A, [[0], [1 / unit]], [[1.0, 0]])
    found = [
        count(late_loop(plant, 0.5, limit * unit * factor))
        for limit in (0.202035, 4.219819, 5.358212)
        for factor in (1 - 5e-6, 1 + 5e-6)
    ]
    assert found == [0, 2, 2, 0, 0, 2]


def test_light_modes_far_above_the_crossover_are_counted_where_fractions_say_nothing():
    # Four modes of damping 1e-3 at 50 … 200 rad/s above a crossover of 1.7 rad/s; Walton and Marshall's crossings
    num, den = np.array([1.0]), np.array([1.0, 1.0])
    for omega in (50.0, 73.0, 111.0, 200.0):
        mode = [1.0, 2e-3 * omega, omega**2]
        num = np.polyadd(np.polymul(num, mode), 3e-3 * omega**2 * den)
        den = np.polymul(den, mode)
    differ = 0
    for dead_time in (0.003, 0.1, 0.3, 1.0, 2.0):
        loop = late_loop(companion(2 * num, den), 1.0, dead_time)
        expected = unstable_by_crossings(2 * num, den, dead_time)
        assert count(loop) == expected
        assert (decay(loop) < 0) == (expected == 0)
        for goal in (Sensitivity(points="u1", limit=100.0), DelayMargin(points="u1", delay=1e-3)):
            assert np.isfinite(goal.bind(loop).exact(loop.structure.controller()).value) == (expected == 0)
        differ += expected != np.sum(fractions(loop).real > 0)
    assert differ >= 2  # Padé fractions of order 4 are wrong here


@pytest.mark.slow
def test_random_loops_over_twelve_decades_of_time_agree_with_the_roots_followed_from_zero_dead_time():
    random = np.random.default_rng(11)
    seen = set()
    for _ in range(40):
        n = int(random.integers(1, 6))
        unit = 10 ** random.uniform(-6, 6)
        poles = -(10 ** random.uniform(-2, 1, n // 2)) + 1j * 10 ** random.uniform(-1, 1, n // 2)
        poles = np.r_[poles, poles.conj(), -(10 ** random.uniform(-1, 1, n % 2))]
        den = np.real(np.poly(poles))
        zeros = np.poly(-random.uniform(0.1, 3, int(random.integers(0, n))))
        num = 10 ** random.uniform(-1, 1) * den[-1] * np.atleast_1d(zeros)
        dead_time = 10 ** random.uniform(-2, 1.3)
        slower = [p * unit ** np.arange(len(p) - 1, -1, -1.0) for p in (num, den)]  # s → s · unit
        loop = late_loop(companion(*slower), 1.0, dead_time * unit)
        expected = unstable_by_crossings(num, den, dead_time)
        assert count(loop) == expected
        assert (decay(loop) < 0) == (expected == 0)
        seen.add(expected)
    assert {0, 2, 4} <= seen


@pytest.mark.parametrize(
    ("k", "dead_time"), [(2.0, 1e-3), (2.0, 1.2), (5.0, 0.4), (10.0, 30.0), (-0.5, 2.0), (0.1, 100.0)]
)
def test_the_roots_of_a_lag_with_dead_time_are_lamberts(k, dead_time):
    # s + 1 + k e^(−sT) = 0: s = −1 + W_j(−k T e^T)/T
    loop = late_loop(LAG, k, dead_time)
    expected = np.array([-1 + lambertw(-k * dead_time * np.exp(dead_time), j) / dead_time for j in range(-3, 4)])
    assert decay(loop) == pytest.approx(expected.real.max(), rel=1e-9)
    K = loop.structure.controller()
    roots = loop.channel((), ()).modes(K).poles
    for root in expected[np.argsort(-expected.real)][:4]:
        assert np.abs(roots - root).min() <= 1e-9 * abs(root)


def test_a_double_root_is_located_and_its_decay_proved_to_a_thousandth():
    # −k T e^T = −1/e: the two real branches meet at s = −1 − 1/T
    loop = late_loop(LAG, np.exp(-2.0), 1.0)
    value = Poles(decay=2.0).bind(loop).exact(loop.structure.controller())
    assert value.value == pytest.approx(1.0, abs=1e-6)  # a double root is known to the root of the rounding
    assert 0 <= value.upper - value.value <= 2e-3


def test_smiths_predictor_with_the_right_dead_time_moves_the_poles_as_if_there_were_none():
    loop = predicted_loop(20.0, 1.0, 1.0)
    assert count(loop) == 0
    assert decay(loop) == pytest.approx(-1.0, rel=1e-6)  # the plant's own pole, a double one in the predictor
    assert Poles(decay=0.9).bind(loop).exact(loop.structure.controller()).upper < 1


@pytest.mark.parametrize("k", [1.5, 3.0, 20.0])
def test_smiths_predictor_with_a_wrong_dead_time_is_stable_exactly_where_nyquist_says(k):
    for assumed in (0.7, 1.01, 2.0):
        omega = np.linspace(0, 200 * k, 100_001)
        L = k * (1 + np.exp(-1j * omega) - np.exp(-1j * omega * assumed)) / (1j * omega + 1)
        turns = np.angle((1 + L[1:]) / (1 + L[:-1])).sum() / np.pi
        assert count(predicted_loop(k, 1.0, assumed)) == round(-turns)


def test_two_dead_times_lose_a_pair_exactly_on_the_printed_boundary():
    # s + a e^(−s) + b e^(−√2 s) has jω as a root for a, b of two linear equations; around it the count differs by 2
    plant = Plant.from_matrices([[0.0]], [[1.0, 1.0]], [[1.0]])
    for omega in (0.3, 0.9, 1.4, 1.9):
        second = np.sqrt(2) * omega
        a, b = np.linalg.solve([[np.cos(omega), np.cos(second)], [np.sin(omega), np.sin(second)]], [0.0, omega])

        def at(factor, a=a, b=b):
            structure = Structure((gain("-y1", "u1", a * factor, name="a"), gain("-y1", "u2", b * factor, name="b")))
            return count(Loop(Model("two", plant, {"u1": 1.0, "u2": np.sqrt(2)}), structure))

        assert abs(at(1 + 1e-6) - at(1 - 1e-6)) == 2


def test_weakly_coupled_twin_channels_of_light_damping_count_twice_or_not_at_all():
    # Two modes of damping 1e-4 alike to 1e-9, each with k y late by T: s² + 2ζs + 1 + k e^(−sT), T = 3π/2 damps
    zeta, k = 1e-4, 1e-3
    mode = np.array([[0, 1], [-1, -2 * zeta]])
    A = np.block([[mode, 1e-9 * np.ones((2, 2))], [1e-9 * np.ones((2, 2)), mode]])
    plant = Plant.from_matrices(A, np.kron(np.eye(2), [[0], [1.0]]), np.kron(np.eye(2), [[1.0, 0]]))
    for dead_time, expected in ((1.5 * np.pi, 0), (0.5 * np.pi, 4), (40.5 * np.pi, 4), (41.5 * np.pi, 0)):
        structure = Structure((gain("-y1", "u1", k, name="a"), gain("-y2", "u2", k, name="b")))
        assert count(Loop(Model("twin", plant, {"u1": dead_time, "u2": dead_time}), structure)) == expected


def test_a_dead_time_outside_the_loop_leaves_the_eigenvalues():
    loop = Loop(Model("seen late", LAG, output_delay={"y1": 1e9}), Structure(gain("-r", "u1", 1.0), references="r"))
    assert count(loop) == 0
    assert decay(loop) == -1.0


def test_limits_on_poles_hold_with_dead_time_exactly():
    # s + 1 + 2 e^(−s/2): its rightmost roots are Lambert's
    loop, T = late_loop(LAG, 2.0, 0.5), 0.5
    K = loop.structure.controller()
    roots = np.array([-1 + lambertw(-2 * T * np.exp(T), j) / T for j in range(-4, 4)])
    first = roots[np.argmax(roots.real)]
    second = roots[(roots.real < first.real - 1e-6)].real.max()
    cases = [
        (Poles(decay=0.5), 1 + (0.5 + first.real) / 0.5),
        (Poles(damping=0.3, focus=(0, 10)), 2 + first.real / abs(first) / 0.3),
        (Poles(frequency=5.0, focus=(0, 10)), abs(first) / 5),
        (Poles(decay=1.0, focus=(5, 20)), 2 + second),
        (Poles(decay=1.0, focus=(4, 5)), 0.0),
    ]
    for goal, expected in cases:
        value = goal.bind(loop).exact(K)
        assert value.value == pytest.approx(expected, rel=1e-8)
        assert value.value <= value.upper <= value.value + 1e-6 * abs(value.value)
        assert "argument principle" in value.method


def test_damping_of_infinitely_many_poles_asks_for_a_focus_band():
    loop = late_loop(LAG, 2.0, 0.5)
    with pytest.raises(InputError, match="must have a focus band with an upper end"):
        Poles(damping=0.3).bind(loop)
    idle = late_loop(LAG, 0.0, 0.5)  # no circle at the start: said where the roots are
    value = Poles(frequency=3.0).bind(idle).exact(loop.structure.controller())
    assert value.value == np.inf
    assert "must have a focus band with an upper end" in value.reason


@pytest.mark.parametrize(
    "goal", [Poles(decay=1.0), Poles(damping=0.5, focus=(0, 20)), Poles(frequency=2.0, focus=(0, 20))]
)
def test_a_limit_on_poles_with_dead_time_is_steered_by_the_roots_that_judge_it(goal):
    loop = predicted_loop(3.0, 1.0, 1.3)
    bound, K = goal.bind(loop), loop.structure.controller()
    assert bound.evaluate(K).value == pytest.approx(bound.exact(K).value, rel=1e-9)
    assert slope_error(bound, K) < 1e-5  # differences with a step of 1e-6
