"""Histories of loops after steps: closed forms, continuous, sampled and late; and what cannot be asked for."""

import numpy as np
import pytest

import workbench as wb
from workbench.errors import InputError
from workbench.simulation.response import Step


def lag(time=1.0, dead_time=0.0, gain=2.0, k=1.0):
    """y' = k u, u = gain · (r − y), in a unit of time: y = 1 − e^(−gain k t)."""
    model = wb.tf([k / time], [1.0, 0.0], input="u", output="y", dead_time=dead_time)
    return wb.Problem(models=model, structure=wb.gain("r - y", "u", gain), goals=[wb.goals.Poles(decay=0.1)])


def test_a_step_of_a_reference_is_its_formula():
    found = wb.simulate(lag(), 3.0, steps={"r": 0.5}).responses[0]
    np.testing.assert_allclose(found["y"], 0.5 * (1 - np.exp(-2 * found.time)), rtol=0, atol=1e-13)
    np.testing.assert_allclose(found["u"], np.exp(-2 * found.time), rtol=0, atol=1e-13)
    assert found.time[-1] == 3.0


def test_a_step_between_two_instants_begins_there():
    start = 0.7123456
    found = wb.simulate(lag(), 3.0, steps={"r": Step(size=-1.0, start=start)}, instants=50).responses[0]
    after = found.time - start
    wanted = np.where(after >= 0, -(1 - np.exp(-2 * np.maximum(after, 0))), 0.0)
    np.testing.assert_allclose(found["y"], wanted, rtol=0, atol=1e-13)


def test_a_disturbance_at_the_command_ends_where_the_gain_balances_it():
    # y' = u + d with u = −2 y: y = d (1 − e^(−2 t))/2, and what the structure asks for is −d at the end
    found = wb.simulate(lag(), steps={"u": 3.0}, outputs=["y", "before u"]).responses[0]
    np.testing.assert_allclose(found["y"], 1.5 * (1 - np.exp(-2 * found.time)), rtol=0, atol=1e-12)
    assert found["before u"][-1] == pytest.approx(-3.0, rel=1e-3)


def test_a_pulse_is_the_difference_of_two_steps_and_signals_add_up():
    pulse = (Step(size=1.0, start=0.2), Step(size=-1.0, start=0.9))
    both = wb.simulate(lag(), 4.0, steps={"r": pulse, "u": -0.3}).responses[0]
    one, other = (wb.simulate(lag(), 4.0, steps=s).responses[0] for s in ({"r": pulse}, {"u": -0.3}))
    np.testing.assert_allclose(both.values, one.values + other.values, rtol=0, atol=1e-14)
    assert both["y"][-1] == pytest.approx(-0.15, abs=1e-2)


def test_a_dead_time_is_exact_until_its_feedback_is_felt_and_after():
    # y(t) = 2 (t − T) until 2T, then less (t − 2T)² · 2: the method of steps by hand
    T = 0.1
    found = wb.simulate(lag(dead_time=T), 0.3, steps={"r": 1.0}).responses[0]
    t = found.time
    wanted = 2 * np.maximum(t - T, 0) - 2 * np.maximum(t - 2 * T, 0) ** 2
    np.testing.assert_allclose(found["y"], wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize("late", [0, 1])
def test_sampled_and_late_it_is_the_recursion_that_a_computer_runs(late):
    T = 0.05
    found = wb.simulate(lag(), 1.0, steps={"r": 1.0}, sample_time=T, computing_delay=late * T).responses[0]
    y, u_before, wanted = 0.0, 0.0, []
    for _ in found.time:
        wanted.append(y)
        u = 2 * (1 - y)
        y, u_before = y + T * (u_before if late else u), u
    np.testing.assert_allclose(found["y"], wanted, rtol=0, atol=1e-13)
    assert found.sample_time == T


def test_a_continuous_loop_is_the_limit_of_its_sampled_ones():
    exact = wb.simulate(wb.load("dc_motor"), 1.0, steps={"r": 1.0, "load": Step(size=0.2, start=0.5)})
    errors = []
    for T in (2e-3, 1e-3):
        sampled = wb.simulate(wb.load("dc_motor"), 1.0, steps={"r": 1.0, "load": Step(size=0.2, start=0.5)},
                              sample_time=T).responses[0]  # fmt: skip
        one = np.interp(sampled.time, exact.responses[0].time, exact.responses[0]["speed"])
        errors.append(np.abs(sampled["speed"] - one).max())
    assert errors[1] < 0.6 * errors[0] < 0.05


def test_another_unit_of_time_gives_the_same_history():
    one = wb.simulate(lag(), 3.0).responses[0]
    other = wb.simulate(lag(time=60.0), 180.0).responses[0]
    np.testing.assert_allclose(other["y"], one["y"], rtol=0, atol=1e-12)


def test_an_unstable_loop_has_a_history_as_long_as_it_is_asked_for():
    found = wb.simulate(lag(gain=-1.0), 2.0).responses[0]
    np.testing.assert_allclose(found["y"], 1 - np.exp(found.time), rtol=1e-12)
    with pytest.raises(InputError, match="unstable and never comes to rest; give a duration"):
        wb.simulate(lag(gain=-1.0))


def test_every_model_has_its_history_and_a_design_its_own_values():
    problem = wb.load("attraction_magnet")
    found = wb.simulate(problem, 0.2, values={"K": 12.0}, steps={"force": 100.0})
    assert [r.model for r in found.responses] == ["rigid guideway", "bending span"]
    assert found.values["K"] == 12.0
    # at rest the magnet carries the force with another gap: on the span it first gives way as well
    stiff, soft = (found[name]["gap_sensor"] for name in ("rigid guideway", "bending span"))
    assert stiff[-1] == pytest.approx(soft[-1], rel=0.2)
    assert found.plot().axes
    with pytest.raises(InputError, match="did you mean 'bending span'"):
        _ = found["bending spam"]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"steps": {"q": 1.0}}, "unknown point 'q'"),
        ({"steps": {}}, "name where a step comes"),
        ({"steps": {"r": float("nan")}}, "size of a step must be a finite number"),
        ({"steps": {"r": "1"}}, "size of a step must be a finite number"),
        ({"steps": {"r": ()}}, "1 to 1000 steps"),
        ({"steps": {"r": (1.0, 2.0)}}, "of the kind Step"),
        ({"outputs": ["z"]}, "unknown signal 'z'"),
        ({"outputs": []}, "at least one step and one output"),
        ({"duration": -1.0}, "duration must be positive"),
        ({"duration": "3"}, "duration must be positive"),
        ({"instants": 1}, "whole number from 2"),
        ({"computing_delay": 0.1}, "belongs to a sampled loop"),
        ({"sample_time": 0.0}, "sample time must be positive"),
        ({"sample_time": 0.1, "computing_delay": -1.0}, "computing delay must be zero or more"),
        ({"seed": 1}, "are of a vehicle's rig"),
        ({"values": {"G": 1.0}}, "unknown parameter 'G'"),
    ],
)
def test_what_cannot_be_simulated_is_one_sentence(options, said):
    with pytest.raises(InputError, match=said):
        wb.simulate(lag(), **{"duration": 1.0, **options})


def test_a_vehicle_is_simulated_by_its_rig():
    with pytest.raises(InputError, match="one history is simulated by a rig"):
        wb.simulate(wb.load("heave"), 1.0)
