"""The integrated error: closed forms of integral control, a simulated step, gradients, refusals."""

import numpy as np
import pytest

from workbench.control.structure.block import Controller
from workbench.control.structure.blocks import gain, pid
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.goals import IntegratedError
from workbench.goals.registry import data_of, goal
from workbench.lti.make import tf

KI = 0.3


def loop(dead_time: float, sample_time: float | None) -> Loop:
    """2/(5 s + 1) with a dead time under a PID controller; sampled, another lag of the same static gain."""
    num, den = ([2.0], [5.0, 1.0]) if sample_time is None else ([0.1], [1.0, -0.95])
    plant = tf(num, den, input="u", output="y", dead_time=dead_time, sample_time=sample_time)
    structure = Structure([pid("r - y", "u", Kp=0.5, Ki=KI, Kd=0.1, Tf=0.3)], references=("r",))
    return Loop(plant, structure if sample_time is None else structure.sampled(sample_time))


KINDS = pytest.mark.parametrize(("dead_time", "sample_time"), [(0.0, None), (0.7, None), (0.5, 0.25)])


@KINDS
@pytest.mark.parametrize(
    ("inputs", "outputs", "expected"),
    [("y", "y", 1 / (2 * KI)), ("u", "y", 1 / KI), ("r", "r - y", 1 / (2 * KI))],
)
def test_it_is_the_inverse_of_integral_gain_times_static_gain(dead_time, sample_time, inputs, outputs, expected):
    own = loop(dead_time, sample_time)
    bound = IntegratedError(inputs, outputs, limit=3.0).bind(own)
    K = own.structure.controller()
    assert 3 * bound.evaluate(K).value == pytest.approx(expected, rel=1e-12)  # a linear system of order 4
    assert 3 * bound.exact(K).value == pytest.approx(expected, rel=1e-9)  # of fourth order in a thousandth of a rate


def test_it_is_the_sum_of_a_simulated_step():
    own = loop(0.5, 0.25)
    K = own.structure.controller()
    T = own.channel("r", "r - y").system(K)
    x, total = np.zeros(len(T.A)), 0.0
    for _ in range(4000):
        total += 0.25 * float((T.C @ x + T.D[:, 0])[0])
        x = T.A @ x + T.B[:, 0]
    assert IntegratedError("r", "r - y").bind(own).exact(K).value == pytest.approx(total, rel=1e-9)


@KINDS
def test_gradients_are_derivatives(dead_time, sample_time):
    own = loop(dead_time, sample_time)
    structure, theta, step = own.structure, own.structure.start, 1e-6
    bound = IntegratedError("y", "y").bind(own)
    ((_, G), *_) = bound.evaluate(structure.controller(theta)).gradients
    slope = structure.pullback(theta, G)
    for i, e in enumerate(np.eye(len(theta))):
        up, down = (bound.evaluate(structure.controller(theta + s * step * e)).value for s in (1, -1))
        assert slope[i] == pytest.approx((up - down) / (2 * step), rel=1e-6, abs=1e-7)  # 1e-16/1e-6, and h²


def test_two_channels_take_the_worse_direction():
    plant = tf(
        [[[2.0], [0.5]], [[0.0], [1.0]]], [[[5.0, 1.0], [3.0, 1.0]], [[1.0], [2.0, 1.0]]],
        input=("u1", "u2"), output=("y1", "y2"),
    )  # fmt: skip
    structure = Structure(
        [pid(f"r{k} - y{k}", f"u{k}", Kp=0.2, Ki=0.1 * k, parts="PI", name=f"c{k}") for k in (1, 2)],
        references=("r1", "r2"),
    )
    K = structure.controller()
    expected = np.linalg.norm(np.linalg.inv(np.array([[2.0, 0.5], [0.0, 1.0]]) @ np.diag([0.1, 0.2])), 2)
    bound = IntegratedError(("y1", "y2"), ("y1", "y2")).bind(Loop(plant, structure))
    assert bound.exact(K).value == pytest.approx(expected, rel=1e-8)


def test_without_integral_action_or_stability_there_is_none():
    plant = tf([2.0], [5.0, 1.0], input="u", output="y")
    proportional = Loop(plant, Structure([gain("r - y", "u", 1.0)], references=("r",)))
    found = IntegratedError("y", "y").bind(proportional).exact(proportional.structure.controller())
    assert np.isinf(found.value)
    assert "needs integral action" in found.reason
    own = loop(0.7, None)
    K = own.structure.controller()
    wild = IntegratedError("y", "y").bind(own).exact(Controller(K.A, K.B, -K.C, -K.D))
    assert np.isinf(wild.value)
    assert "unstable" in wild.reason


def test_it_is_written_in_seconds():
    one = goal("integrated_error", inputs=["y"], outputs=["y"], limit_s=135.0)
    assert one == IntegratedError("y", "y", limit=135.0)
    assert data_of(one) == {"kind": "integrated_error", "inputs": ["y"], "outputs": ["y"], "limit_s": 135.0}
