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
