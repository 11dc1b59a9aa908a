"""A model between the samples of its controller, against a simulation whose steps divide every dead time."""

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.lti.hold import held
from workbench.lti.make import tf
from workbench.lti.model import DelayLine, Model
from workbench.lti.plant import Plant

FINE = 8  # steps of a sample; every dead time below is a whole number of them
T = 0.4


def entry(num, den, dead_time, commands, delay):
    """Output at kT⁻ of (num_1 s + num_0)/(den_1 s + den_0) e^(−s·dead time) under held commands, in fine steps."""
    h, (d1, d0), (n1, n0) = T / FINE, den, num
    late, out, x = round((dead_time + delay) / h), [], 0.0
    direct, pole = n1 / d1, d0 / d1
    fine = np.repeat(commands, FINE)
    for k in range(len(fine)):
        before = fine[k - late - 1] if k > late else 0.0  # what acted just before the sample
        if k % FINE == 0:
            out.append(x + direct * before)
        now = fine[k - late] if k >= late else 0.0
        settled = (n0 / d0 - direct) * now
        x = settled + np.exp(-pole * h) * (x - settled)
    return np.array(out)


NUM = [[(0.0, 12.8), (0.0, -18.9)], [(0.0, 6.6), (1.0, 1.0)]]
DEN = [[(4.0, 1.0), (3.0, 1.0)], [(2.0, 1.0), (5.0, 1.0)]]
LATE = [[0.1, 0.3], [0.7, 0.3]]  # [s]


def column():
    """Two by two, each entry with a dead time of its own, one direct."""
    return tf(NUM, DEN, dead_time=LATE, input=("a", "b"), output=("p", "q"), name="column")


@pytest.mark.parametrize("delay", [0.0, 0.15, 0.4, 0.55])
def test_held_outputs_are_those_of_a_simulation_in_fine_steps(delay):
    model = column()
    sampled = held(model, T, delay)
    steps = np.random.default_rng(3).normal(size=(40, 2))
    x, own = np.zeros(len(sampled.plant.A)), []
    for u in steps:
        own.append(sampled.plant.C @ x)
        x = sampled.plant.A @ x + sampled.plant.B @ u
    expected = np.zeros((40, 2))
    for i in range(2):
        for j in range(2):
            expected[:, i] += entry(NUM[i][j], DEN[i][j], LATE[i][j], steps[:, j], delay)
    np.testing.assert_allclose(own, expected, atol=1e-12 * np.abs(expected).max())  # rounding of a few hundred steps


def test_without_dead_time_and_direct_gain_no_state_is_added():
    model = tf([2.0], [1.0, 3.0, 0.0], input="u", output="y", name="plain")
    sampled = held(model, T)
    assert sampled.plant.A.shape == (2, 2)
    assert sorted(np.linalg.eigvals(sampled.plant.A)) == pytest.approx([np.exp(-3 * T), 1.0], rel=1e-12)


def test_a_delay_of_whole_samples_is_a_power_of_z_and_a_part_lies_between_its_neighbours():
    model = tf([1.0], [1.0, 1.0], input="u", output="y", name="lag")
    omega = np.array([0.3, 2.0, 5.0])
    now, later = (held(model, T, d).response(omega)[:, 0, 0] for d in (0.0, 3 * T))
    np.testing.assert_allclose(later, now * np.exp(-3j * omega * T), rtol=1e-12)
    # ∫ of the held pulse: the closed form of a lag behind a part of a sample (Åström & Wittenmark, example 3.3)
    part, a = 0.3 * T, np.exp(-T)
    z = np.exp(1j * omega * T)
    new, old = 1 - np.exp(-(T - part)), np.exp(-(T - part)) - a
    np.testing.assert_allclose(held(model, T, part).response(omega)[:, 0, 0], (new + old / z) / (z - a), rtol=1e-12)


def test_a_dead_time_between_states_is_refused_by_its_name():
    plant = Plant(
        A=np.diag([-1.0, -2.0]), B=[[1.0, 0.0], [0.0, 1.0]], C=[[0.0, 1.0], [1.0, 0.0]], D=np.zeros((2, 2)),
        states=("x1", "x2"), inputs=("u", "w"), outputs=("y", "z"),
    )  # fmt: skip
    with pytest.raises(InputError, match="into 'w' of model 'inside' stands between states"):
        held(Model("inside", plant, lines=(DelayLine("z", "w", 0.1),)), T)


def test_a_sampled_model_keeps_its_samples_and_takes_whole_delays():
    plant = Plant.from_matrices([[0.5]], [[1.0]], [[1.0]])
    model = Model("digital", plant, sample_time=T, output_delay={"y1": 2 * T})
    late = held(model, T, 3 * T)
    z = np.exp(1j * 0.7 * T)
    assert late.response(0.7)[0, 0, 0] == pytest.approx(z**-5 / (z - 0.5), rel=1e-12)
    with pytest.raises(InputError, match=r"sampled every 0\.4 s, and its controller must be too; got 0\.1 s"):
        held(model, 0.1)
    with pytest.raises(InputError, match=r"must be whole samples of 0\.4 s"):
        held(model, T, 0.1)


@pytest.mark.parametrize("bad", [0.0, -1.0, float("nan"), float("inf")])
def test_a_sample_time_that_is_none_is_refused(bad):
    with pytest.raises(InputError, match="sample time must be positive and finite"):
        held(column(), bad)


def test_a_delay_of_thousands_of_samples_is_refused():
    with pytest.raises(InputError, match="at most 2000 samples"):
        held(column(), 1e-4)
