import numpy as np
import pytest

from workbench.control.structure.blocks import gain
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.errors import InputError
from workbench.lti import Plant
from workbench.lti.make import tf
from workbench.lti.model import Model


def unstable(plant, k, dead_time, **options):
    loop = Loop(Model("late", plant, {"u1": dead_time}, **options), Structure(gain("-y1", "u1", k)))
    return loop.unstable_poles(loop.structure.controller())


@pytest.mark.parametrize("dead_time", [1e-3, 1.0, 300.0])
def test_a_late_integrator_loses_pairs_of_poles_at_the_printed_gains(dead_time):
    plant = Plant.from_matrices([[0.0]], [[1.0]], [[1.0]])
    # s + k exp(−sT): a pair crosses the axis at kT = π/2 + 2πm (Lambert)
    for m in (0, 1, 2, 40):
        at = (np.pi / 2 + 2 * np.pi * m) / dead_time
        assert unstable(plant, 0.999 * at, dead_time) == 2 * m
        assert unstable(plant, 1.001 * at, dead_time) == 2 * (m + 1)
    assert unstable(plant, -0.01 / dead_time, dead_time) == 1
    assert unstable(plant, 0.0, dead_time) == 1  # the integrator itself, on the axis


def test_an_unstable_lag_is_held_only_within_its_window_of_gains():
    # s − 1 + k exp(−sT), T = 0.5: stable for 1 < k < ω / sin(ωT) with ω = tan(ωT), that is ω = 2.331, k = 2.537
    plant = Plant.from_matrices([[1.0]], [[1.0]], [[1.0]])
    omega = 2.0
    for _ in range(60):
        omega -= (omega - np.tan(0.5 * omega)) / (1 - 0.5 / np.cos(0.5 * omega) ** 2)
    limit = np.hypot(1, omega)
    assert [unstable(plant, k, 0.5) for k in (0.999, 1.001, 0.999 * limit, 1.001 * limit)] == [1, 0, 0, 2]


def test_a_light_resonance_far_above_the_loop_is_not_overlooked():
    # Loop gain k / (s + 1) with a mode at 50 rad/s, damping 1e-4; peak gain 5 of unknown phase, read off exactly
    zeta, omega, late = 1e-4, 50.0, 3.0
    A = [[-1.0, 0, 0], [0, 0, 1], [0, -(omega**2), -2 * zeta * omega]]
    plant = Plant.from_matrices(A, [[1.0], [0], [1.0]], [[1.0, 0, 1e-3 * omega]])
    grid = omega + np.linspace(-0.2, 0.2, 40001)
    L = 0.5 * plant.response(grid)[:, 0, 0] * np.exp(-1j * grid * late)
    turns = np.angle((1 + L[1:]) / (1 + L[:-1])).sum() / (2 * np.pi)  # of the resonance alone; Nyquist
    expected = 2 * round(-turns)
    assert unstable(plant, 0.5, late) == expected
    assert expected in (0, 2)
    assert unstable(plant, 0.5, late) + unstable(plant, 0.5, late + np.pi / omega) == 2  # half a turn more: the other


@pytest.mark.parametrize("k", [0.3, 0.6, 1.2, 2.4])
def test_the_count_agrees_with_fractions_of_high_order_where_these_are_exact(k):
    num, den, times = [[12.8, -18.9], [6.6, -19.4]], [[[16.7, 1], [21, 1]], [[10.9, 1], [14.4, 1]]], [[1, 3], [7, 3]]
    model = tf(num, den, dead_time=times, pade_order=10, name="column")
    structure = Structure((gain("-y1", "u1", k, name="k1"), gain("-y2", "u2", -k / 2, name="k2")))
    loop = Loop(model, structure)
    poles = np.linalg.eigvals(loop.channel((), ()).system(structure.controller()).A)
    assert np.abs(poles.real).min() > 1e-3  # none is near the axis
    assert loop.unstable_poles(structure.controller()) == np.sum(poles.real > 0)


def test_a_dead_time_that_feeds_itself_directly_is_counted_below_a_gain_of_one_and_refused_above():
    # 1 + k e^(−sT) (1 + 1/(s + 1)): far out a gain k at every phase; near rest 2k > 1 makes half a turn's pairs
    plant = Plant.from_matrices([[-1.0]], [[1.0]], [[1.0]], [[1.0]])
    for k, T in ((0.3, 1.0), (0.45, 1.0), (0.7, 1.0), (0.7, 5.0), (0.95, 3.0)):
        omega = np.linspace(1e-4, 400, 100_001)  # Nyquist, the rest of the curve is a circle of radius k about 0
        L = k * np.exp(-1j * omega * T) * (1 + 1 / (1j * omega + 1))
        assert unstable(plant, k, T) == round(-np.angle((1 + L[1:]) / (1 + L[:-1])).sum() / np.pi)
    with pytest.raises(InputError, match="must feed each other at once by a gain below 1"):
        unstable(plant, 1.0, 1.0)


def test_dead_times_that_feed_each_other_count_with_the_gain_of_their_worst_phases():
    # Two feedthroughs crossed by 0.7·[[1, 1], [1, −1]]: entries' sizes have the radius 1.4, the worst phases 0.99
    H = np.array([[1.0, 1.0], [1.0, -1.0]])
    lag = Plant.from_matrices(-np.eye(2), 0.01 * np.eye(2), np.eye(2), np.eye(2))

    def count(size):
        block = gain(["y1", "y2"], ["u1", "u2"], size * H)
        loop = Loop(Model("crossed", lag, {"u1": 1.0, "u2": np.sqrt(2)}), Structure(block))
        return loop.unstable_poles(loop.structure.controller())

    assert count(0.7) == 0
    with pytest.raises(InputError, match="below 1, whatever their phases"):
        count(0.71)


def test_without_dead_times_the_eigenvalues_are_counted():
    loop = Loop(Model("lag", Plant.from_matrices([[1.0]], [[1.0]], [[1.0]])), Structure(gain("-y1", "u1", 0.5)))
    assert loop.unstable_poles(loop.structure.controller()) == 1
    assert loop.unstable_poles(loop.structure.controller([2.0])) == 0
