"""Every shipped problem of a plant of one's own loads, names its sources, and its plant is the published one."""

import numpy as np
import pytest

import workbench as wb
from workbench.files.problem import load_problem, shipped_problems, shipped_vehicles
from workbench.physics.forces.actuator import VoltageFed
from workbench.physics.forces.attraction import AttractionMagnet
from workbench.physics.guideway.span import Span
from workbench.physics.vehicle.suspension import suspension

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


def test_the_magnet_is_the_linearised_suspension_on_both_guideways():
    magnet, supply = AttractionMagnet(turns=270, pole_area=0.011), VoltageFed(resistance=0.8)
    span = Span(length=24.0, bending_stiffness=1.14e9, mass_per_length=200.0, damping=0.01)
    for found, beam in zip(load_problem("attraction_magnet").systems, (None, span), strict=True):
        modes = () if beam is None else ("mode_1", "mode_2", "mode_3")
        held = {"gap": 0.01, "current": 30.0} | ({} if beam is None else {"place": 9.0})
        rest = suspension(250.0, magnet, supply, span=beam).rest(held, ("current", "voltage", *modes))
        ours = rest.linearise().plant.select(inputs=found.inputs, outputs=found.outputs)
        assert found.plant.states == ours.states
        for letter in "ABCD":
            ours_here, printed = getattr(ours, letter), getattr(found.plant, letter)
            size = np.abs(ours_here).max(initial=1.0, axis=1, keepdims=True)
            assert np.all(np.abs(printed - ours_here) <= 1e-8 * size)  # nine printed digits


def test_the_magnet_holds_on_both_guideways_with_the_gains_that_a_design_finds(tmp_path):
    problem = load_problem("attraction_magnet")
    assert all(model.plant.poles().real.max() > 20 for model in problem.systems)  # it falls by itself
    found = wb.design(problem, starts=1)
    assert found.met
    assert found.values["Kp"] > 3120.0  # k_x/k_i
    found.table().write(tmp_path / "magnet.json")
    report = wb.verify(tmp_path / "magnet.json")
    assert report.proved
    assert {finding.name for finding in report.findings if finding.verdict == "proved"} >= {"stability", "decay rate"}
