"""Every shipped problem of a plant of one's own loads, names its sources, and its plant is the published one."""

import numpy as np
import pytest

from workbench.files.problem import load_problem, shipped_problems, shipped_vehicles

NAMES = sorted(set(shipped_problems()) - set(shipped_vehicles()))


@pytest.mark.parametrize("name", NAMES)
def test_a_shipped_plant_has_title_sources_and_goals_of_both_kinds(name):
    problem = load_problem(name)
    assert problem.name == name
    assert len(problem.title) > 10
    assert set(problem.sources) >= {"problem", *(model.name for model in problem.systems)}
    assert {goal.hard for goal in problem.goals} == {True, False}


def test_the_motor_is_the_transfer_function_of_the_tutorial():
    # speed/voltage = K/((J s + b)(L s + R) + K²) with J = 0.01, b = 0.1, K = 0.01, R = 1, L = 0.5
    omega = np.array([0.0, 0.5, 3.0, 40.0])
    s = 1j * omega
    published = 0.01 / ((0.01 * s + 0.1) * (0.5 * s + 1) + 0.01**2)
    found = load_problem("dc_motor").systems[0].response(omega)[:, 0, 0]
    assert found == pytest.approx(published, rel=1e-13)


def test_the_exchanger_is_the_published_one():
    omega = np.array([0.0, 0.02, 0.3])
    s = 1j * omega
    found = load_problem("heat_exchanger").systems[0].response(omega)[:, 0]
    assert found[:, 0] == pytest.approx(np.exp(-14.7 * s) / (21.3 * s + 1), rel=1e-13)
    assert found[:, 1] == pytest.approx(np.exp(-35 * s) / (25 * s + 1), rel=1e-13)


def test_the_transmission_keeps_its_static_gain_and_slows_down_under_load():
    # a position follows a position: the load changes the vibrations, not the gain at rest
    models = load_problem("flexible_transmission").systems
    assert [m.name for m in models] == ["no load", "half load", "full load"]
    assert [m.response(0.0).real.item() for m in models] == pytest.approx([1.06, 1.06, 1.06], rel=0.02)
    first = [np.sort(np.abs(np.log(m.plant.poles())))[0] / m.sample_time for m in models]
    assert first == sorted(first, reverse=True)
    assert all(np.abs(m.plant.poles()).max() < 1 for m in models)
