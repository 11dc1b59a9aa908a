"""Margins of every loop: put to the proof by making the loop worse by what it is said to bear, and a little more."""

import math

import numpy as np
import pytest

from workbench.control.structure.block import Controller
from workbench.control.structure.blocks import gain, pid
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.design.loop_margins import loop_margins
from workbench.errors import InputError
from workbench.lti.hold import held
from workbench.lti.make import tf

JUST = 1e-4  # beside a margin: far more than its rounding, far less than the distance to the next crossing


def pendulum(dead_time=0.0):
    model = tf([400], [1, 2.8, 401.6, 800, 0], input="torque", output="angle", dead_time=dead_time, name="arm")
    return model, Structure(pid("r - angle", "torque", Kp=0.5, Kd=0.1, parts="PD", Tf=0.02), "r")


def oven(dead_time=0.3):
    """Unstable without control, so that there is a gain margin downwards."""
    return tf([2.0], [1.0, -0.5], input="u", output="y", dead_time=dead_time, name="oven"), Structure(
        gain("r - y", "u", 1.0), "r"
    )


def sampled(model, structure, h):
    return held(model, h), structure.sampled(h)


CASES = {
    "continuous": pendulum(), "dead time": pendulum(0.004), "unstable plant with dead time": oven(),
    "unstable plant": oven(0.0), "sampled": sampled(*pendulum(), 0.01), "sampled slowly": sampled(*oven(0.05), 0.1),
}  # fmt: skip


def times(K, factor):
    return Controller(K.A, K.B, factor * K.C, factor * K.D)


@pytest.mark.parametrize("name", CASES)
def test_the_loop_is_lost_at_its_gain_margins_and_not_before(name):
    model, structure = CASES[name]
    loop, K = Loop(model, structure), structure.controller()
    found = loop_margins((loop,), K).single
    assert {m.channel.channel for m in found} == {*model.inputs, *model.outputs}
    for m in found:
        limits = [(m.channel.gain_up, 1 + JUST), (m.channel.gain_down, 1 - JUST)]
        for factor, beyond in [(k, b) for k, b in limits if 0 < k < math.inf]:
            assert loop.unstable_poles(times(K, factor * beyond)) > 0
            assert loop.unstable_poles(times(K, 1 + (factor - 1) * (1 - JUST))) == 0
        for inside in (0.3, 0.9):
            down = max(m.channel.gain_down, 1e-3)
            assert loop.unstable_poles(times(K, 1 + inside * (down - 1))) == 0
            if m.channel.gain_up < math.inf:
                assert loop.unstable_poles(times(K, 1 + inside * (m.channel.gain_up - 1))) == 0
    assert any(m.channel.gain_up < math.inf for m in found) or name == "unstable plant"


@pytest.mark.parametrize("make", [pendulum, oven])
def test_the_loop_is_lost_at_its_dead_time_and_not_before(make):
    model, structure = make(0.004)
    K = structure.controller()
    (margin, *_) = loop_margins((Loop(model, structure),), K).single
    late = margin.channel.delay
    for share, lost in ((1 - JUST, 0), (1 + JUST, 1)):
        later, _ = make(0.004 + share * late)
        assert (Loop(later, structure).unstable_poles(K) > 0) == lost
    assert margin.channel.phase <= late * margin.channel.delay_frequency * (1 + 1e-9)


def test_one_loop_has_one_set_of_margins_wherever_it_is_broken():
    for name, (model, structure) in CASES.items():
        torque, angle = loop_margins((Loop(model, structure),), structure.controller()).single
        for key in ("gain_up", "gain_down", "phase", "delay"):
            one, other = getattr(torque.channel, key), getattr(angle.channel, key)
            assert one == pytest.approx(other, rel=1e-7), (name, key)  # the crossings' rounding
        assert torque.peak_sensitivity.value == pytest.approx(angle.peak_sensitivity.value, rel=1e-6)


def test_the_sampled_integrator_has_the_margins_of_its_formulas():
    # L = kT/(z − 1): real and −kT/2 at z = −1; |L| = 1 where 2 sin(ωT/2) = kT, its lag π/2 + ωT/2
    k, T = 3.0, 0.1
    model = held(tf([1.0], [1.0, 0.0], input="u", output="y"), T)
    structure = Structure(gain("r - y", "u", k), "r")
    (m, _) = loop_margins((Loop(model, structure),), structure.controller()).single
    omega = 2 / T * math.asin(k * T / 2)
    assert m.channel.gain_up == pytest.approx(2 / (k * T), rel=1e-9)
    assert m.channel.phase == pytest.approx(math.pi / 2 - omega * T / 2, rel=1e-9)
    assert m.channel.delay == pytest.approx((math.pi / 2 - omega * T / 2) / omega, rel=1e-9)
    assert m.channel.phase_frequency == pytest.approx(omega, rel=1e-9)
    assert m.peak_sensitivity.upper == pytest.approx(2 / (2 - k * T), rel=1e-6)


def test_disks_guarantee_less_than_each_margin_alone_and_peaks_bound_them():
    model = tf(
        [[[2.0], [0.5]], [[0.4], [1.5]]], [[[1.0, 1.4, 1.0], [1.0, 2.0]], [[1.0, 3.0], [1.0, 1.0]]],
        dead_time=[[0.1, 0.1], [0.3, 0.3]], input=("u", "v"), output=("y", "z"),
    )  # fmt: skip
    structure = Structure(gain(("y", "z"), ("u", "v"), [[-0.6, 0.1], [0.2, -0.8]]))
    found = loop_margins((Loop(model, structure),), structure.controller())
    assert [j.what for j in found.joint] == ["commands", "measurements"]
    for m in found.single:
        alpha = m.disk.lower
        assert (2 + alpha) / (2 - alpha) <= m.channel.gain_up * (1 + 1e-9)
        assert 2 * math.atan(alpha / 2) <= m.channel.phase * (1 + 1e-9)
        assert m.disk.lower <= m.disk.upper
        for j in found.joint:
            if m.channel.channel in j.points:
                assert j.disk.lower <= m.disk.upper
                assert j.peak_sensitivity.upper >= m.peak_sensitivity.lower
    assert np.isfinite([j.peak_sensitivity.upper for j in found.joint]).all()


def test_an_unstable_loop_has_no_margins():
    model, structure = oven(2.0)
    with pytest.raises(InputError, match="margins are of a stable loop; that of 'oven' is unstable"):
        loop_margins((Loop(model, structure),), structure.controller())


def test_the_table_gives_dead_time_in_seconds_so_that_slow_plants_keep_plain_numbers():
    import workbench as wb

    plant = wb.tf([1.0], [100.0, 1.0], input="u", output="y", name="tank")
    problem = wb.Problem(
        models=plant, structure=wb.gain("r - y", "u", 2.0), goals=[wb.goals.Sensitivity(points="u", limit=2.0)]
    )
    found = wb.margins(problem)
    heads, rows = found.table()
    # L = 2/(100 s + 1): |L| = 1 at √3/100 rad/s, where the phase is −60°, 120° before −180°
    assert float(rows[0][heads.index("delay [s]")]) == pytest.approx(np.radians(120) / np.sqrt(3) * 100, rel=1e-3)
