"""Reserves asked of a plant of one's own: steered as judged, held against the loop, in data files and designs."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from workbench.analysis.change import Change
from workbench.analysis.plant_reserves import changed, listed, sampled
from workbench.control.structure.blocks import pid
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.design.design import design
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.files.goal import goal_of
from workbench.goals.goal import Closed
from workbench.goals.poles import Poles
from workbench.goals.registry import data_of
from workbench.goals.ride.break_point import DelayBorne, DiskMargin, GainMargin, PhaseMargin
from workbench.goals.ride.other_loop import (
    SampledDamping,
    SampledDecay,
    SampledPeak,
    VariedDamping,
    VariedDecay,
    VariedPeak,
    VariedRms,
)
from workbench.lti.make import tf

EXAMPLES = [
    DiskMargin(0.6), GainMargin(1.5, points=("commands",)), PhaseMargin(0.6, points=("sensor:angle",)),
    DelayBorne(0.01, points=("sensors",)),
    VariedDamping(0.3), VariedDecay(0.2, variations=("scale:angle:0.8", "weak:torque:0.7")),
    VariedPeak(1.6, variations=("scale:*", "weak:*")),
    VariedRms(0.8, inputs=("torque",), outputs=("angle",), variations=("scale:*", "weak:torque:0.7")),
    SampledDamping(0.3, sample_time=0.05), SampledDecay(0.2, sample_time=0.05, delay_samples=0.5),
    SampledPeak(1.8, sample_time=0.02),
]  # fmt: skip
IDS = [g.kind for g in EXAMPLES]
THETA = {"Kp": 2.0, "Ki": 0.4, "Kd": 1.2, "Tf": 0.1}


def loop_of(dead_time=0.0):
    plant = tf([1.0], [0.05, 1.015, 0.3, 0.0], input="torque", output="angle", dead_time=dead_time)
    return Loop(plant, Structure(pid("r - angle", "torque"), references="r").with_values(THETA))


@pytest.fixture(scope="module")
def loop():
    return loop_of()


@pytest.mark.parametrize("asked", EXAMPLES, ids=IDS)
def test_a_reserve_of_a_plant_is_steered_as_it_is_judged(asked, loop):
    K = loop.structure.controller()
    bound = asked.bind(loop)
    exact, steered = bound.exact(K), bound.evaluate(K)
    (verdict,) = asked.judge(Closed((loop,), K))
    better = 1.02 if asked.sense == "<=" else 0.98
    for factor in (better, 1 / better):
        limit = verdict.value * factor
        assert replace(asked, limit=limit, name="").judge(Closed((loop,), K))[0].met == (factor == better)
    if isinstance(asked, PhaseMargin | GainMargin):  # steered by the disk that guarantees them: it misses no later
        missed = replace(asked, limit=verdict.value / better, name="")
        assert missed.bind(loop).evaluate(K).value > 1
    else:
        assert steered.value == pytest.approx(exact.value, rel=1e-6)


@pytest.mark.parametrize("asked", EXAMPLES, ids=IDS)
def test_rows_of_a_reserve_of_a_plant_have_the_gradients_of_differences(asked, loop):
    structure, bound = loop.structure, asked.bind(loop)
    theta, step = structure.start, 1e-6
    value = bound.evaluate(structure.controller(theta))
    slope = structure.pullback(theta, value.gradients[0][1])
    for k in range(len(theta)):
        moved = [theta + s * step * np.eye(len(theta))[k] for s in (1, -1)]
        high, low = (bound.evaluate(structure.controller(t)).value for t in moved)
        # central differences of a smooth piece: 1e-5 of the largest slope; dead times follow a crossing, 1e-4
        assert abs((high - low) / (2 * step) - slope[k]) < 1e-4 * (1 + np.abs(slope).max())


@pytest.mark.parametrize("asked", EXAMPLES, ids=IDS)
def test_what_data_say_of_a_plants_reserve_gives_the_same_goal(asked):
    again = goal_of(json.loads(json.dumps(data_of(asked))))
    assert data_of(again) == data_of(asked)


def test_a_signal_may_have_a_colon_in_its_name():
    assert Change.named("scale:a:b:0.9") == Change("scale", "a:b", 0.9)
    assert Change.named("dead:a:b").name == "dead:a:b"


def test_a_changed_plant_is_the_plant_with_that_signal_changed(loop):
    K = loop.structure.controller()
    assert [c.name for c in listed(loop)] == [
        "scale:angle:0.9", "scale:angle:1.1", "lost:torque", "dead:angle", "weak:torque:0.8",
    ]  # fmt: skip
    by_sensor, by_command = (changed(loop, Change(kind, name, 0.8)) for kind, name in
                             (("scale", "angle"), ("weak", "torque")))  # fmt: skip
    # one loop: a factor anywhere in it moves the same roots
    assert np.sort_complex(by_sensor.poles(K)) == pytest.approx(np.sort_complex(by_command.poles(K)))
    lost = changed(loop, Change("lost", "torque")).poles(K)
    assert np.abs(lost).min() == pytest.approx(0, abs=1e-12)  # the plant's integrator, left alone


def test_the_sampled_loop_of_a_plant_is_that_of_matrices_by_hand(loop):
    # 1/(0.05 s³ + 1.015 s² + 0.3 s) held over T with one sample of delay; PID by Tustin's rule
    T, g = 0.05, THETA
    A, B = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, -6.0, -20.3]]), np.array([[0.0], [0.0], [20.0]])
    whole = expm(np.block([[A, B], [np.zeros((1, 4))]]) * T)
    F, G = whole[:3, :3], whole[:3, 3:]
    z = np.array([0.9 * np.exp(0.2j), 1.1 * np.exp(0.05j)])
    s = 2 / T * (z - 1) / (z + 1)
    C = g["Kp"] + g["Ki"] / s + g["Kd"] * s / (1 + g["Tf"] * s)
    P = np.array([np.linalg.solve(w * np.eye(3) - F, G)[0, 0] / w for w in z])
    there = sampled(loop, T, 1.0)
    S = there.sensitivity(("torque",)).system(there.structure.controller())
    found = [(S.D + S.C @ np.linalg.solve(w * np.eye(len(S.A)) - S.A, S.B))[0, 0] for w in z]
    assert found == pytest.approx(1 / (1 + P * C), rel=1e-9)  # rounding


def test_reserves_of_a_late_plant_count_its_dead_time():
    loop = loop_of(dead_time=0.1)
    K = loop.structure.controller()
    (verdict,) = DelayBorne(0.01).judge(Closed((loop,), K))
    assert verdict.value == pytest.approx(DelayBorne(0.01).judge(Closed((loop_of(),), K))[0].value - 0.1, rel=1e-6)
    # of infinitely many roots the damping falls to zero: a band is asked for, and given
    assert "focus" in VariedDamping(0.05).judge(Closed((loop,), K))[0].where
    (verdict,) = VariedDamping(0.05, focus=(0.0, 5.0)).judge(Closed((loop,), K))
    poles = np.concatenate([changed(loop, Change("scale", "angle", f)).poles(K) for f in (0.9, 1.1)])
    slow = poles[np.abs(poles) < 5.0]
    assert verdict.value == pytest.approx((-slow.real / np.abs(slow)).min(), rel=1e-6)


@pytest.mark.parametrize(
    ("asked", "sentence"),
    [
        (DiskMargin(0.5, points=("command:torqe",)), "unknown break point 'command:torqe'; did you mean"),
        (VariedDamping(0.5, variations=("mass:0.9",)), "is one of a vehicle; a plant of its own has"),
        (VariedDamping(0.5, variations=("dead:torque",)), "unknown variation 'dead:torque'"),
        (VariedDamping(0.5, variations=("scale:angle",)), "is written scale:<sensor>:<number>"),
        (GainMargin(2.0, points=("all:commands",)), "unknown break point 'all:commands'"),
        (SampledDamping(0.5, sample_time=1e-5, delay_samples=2.0), None),
    ],
)
def test_what_a_plant_does_not_have_is_refused(asked, sentence, loop):
    if sentence is None:
        assert asked.bind(loop).exact(loop.structure.controller()).value > 0
        return
    with pytest.raises(InputError, match=sentence):
        asked.bind(loop)


def test_a_design_keeps_the_reserves_it_is_asked_for(loop):
    asked = [
        DiskMargin(0.9), SampledDamping(0.5, sample_time=0.02), VariedDamping(0.45, variations=("scale:*", "weak:*")),
        Poles(decay=0.2, hard=True),
    ]  # fmt: skip
    bounds = {"Kp": (0.1, 20.0), "Ki": (0.05, 5.0), "Kd": (0.1, 20.0)}
    structure = loop.structure.freeze("Tf", 0.05)
    for name, (low, high) in bounds.items():
        structure = structure.with_bounds(name, low, high)
    found = design(Problem(models=loop.model, structure=structure, goals=asked), starts=1, seed=1)
    assert found.met, found.verdicts
    points = {b.point: b for b in found.margins().points}
    assert points.keys() == {"command:torque", "sensor:angle"}
    assert min(b.disk for b in points.values()) >= 0.9
