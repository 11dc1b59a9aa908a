"""Studies of a plant of one's own: every row is the analysis of its own problem."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

from workbench.commands.app import app
from workbench.design.plant_analysis import plant_analysis
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.lti.model import Model
from workbench.study.file import read_study
from workbench.study.report import study_report_html
from workbench.study.run import run_study

TWO = """
[[parameter]]
name = "Kp"
values = [10.0, 30.0, 30.0]
[[parameter]]
name = "{name}"
values = [{values}]
"""
HEAD = '[study]\nproblem = "dc_motor"\nsampling = "list"\noutput = "csv"\n'


def study(tmp_path, text, name="s.toml"):
    (tmp_path / name).write_text(text)
    return read_study(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "values", "factors"), [("factor.model.0.A.0.0", "1.0, 0.8, 1.2", (1, 0.8, 1.2)),
                                    ("model.0.A.0.0", "-10.0, -8.0, -12.0", (1, 0.8, 1.2))]
)  # fmt: skip
def test_each_row_is_the_analysis_of_the_plant_with_its_numbers(tmp_path, name, values, factors):
    found = run_study(study(tmp_path, HEAD + TWO.format(name=name, values=values)), tmp_path / "out")
    problem = load_problem("dc_motor")
    for row, (kp, factor) in enumerate(zip((10.0, 30.0, 30.0), factors, strict=True)):
        (old,) = problem.systems
        A = old.plant.A.copy()
        A[0, 0] *= factor
        plant = type(old.plant)(
            A=A, B=old.plant.B, C=old.plant.C, D=old.plant.D, states=old.plant.states, inputs=old.plant.inputs,
            outputs=old.plant.outputs,
        )  # fmt: skip
        own = Problem(models=Model("motor", plant), structure=problem.structure, goals=problem.goals)
        alone = plant_analysis(own, {"Kp": kp})
        assert found.columns["peak_sensitivity"][row] == pytest.approx(alone.to_dict()["peak_sensitivity"], rel=1e-9)
        for verdict in alone.design.verdicts:
            assert found.columns[f"goals.{verdict.name}"][row] == pytest.approx(verdict.value, rel=1e-9)
        assert bool(found.failed[row]) == any(not v.met for v in alone.design.verdicts if v.name in _hard(problem))


def _hard(problem):
    return {goal.name for goal in problem.goals if goal.hard}


def test_rows_of_unstable_loops_have_no_peak_and_fail(tmp_path):
    text = HEAD + TWO.format(name="Ki", values="50.0, 50.0, 4000.0").replace("30.0, 30.0]", "30.0, 1.0]")
    found = run_study(study(tmp_path, text), tmp_path / "out")
    assert found.columns["stable"] == [True, True, False]
    assert found.columns["peak_sensitivity"][2] is None
    assert found.failed[2]


def test_a_study_goes_on_where_it_ended_and_refuses_another_in_its_folder(tmp_path):
    asked = study(tmp_path, HEAD + TWO.format(name="Kd", values="1.0, 2.0, 3.0"))
    first = run_study(asked, tmp_path / "out")
    again = run_study(asked, tmp_path / "out")
    assert first.columns == again.columns
    other = study(tmp_path, HEAD + TWO.format(name="Kd", values="1.0, 2.0, 4.0"), "t.toml")
    with pytest.raises(InputError):
        run_study(other, tmp_path / "out")


def test_given_values_stand_in_the_middle_of_the_study(tmp_path):
    (tmp_path / "mine.toml").write_text("Ki = 80.0\n")
    text = HEAD.replace("[study]\n", '[study]\ngains = "mine.toml"\nquantities = ["values.Ki", "damping"]\n')
    found = run_study(study(tmp_path, text + TWO.format(name="Kd", values="1.0, 2.0, 3.0")), tmp_path / "out")
    assert found.columns["values.Ki"] == [80.0] * 3
    assert np.isfinite(found.columns["damping"]).all()


@pytest.mark.slow
def test_a_study_of_designs_records_values_and_verdicts(tmp_path):
    text = HEAD.replace("[study]\n", '[study]\ntask = "design"\nstarts = 1\n')
    text += '[[parameter]]\nname = "factor.model.0.A.0.0"\nvalues = [1.1]\n'
    found = run_study(study(tmp_path, text), tmp_path / "out")
    assert found.columns["error"] == [""]
    assert not found.failed[0]
    assert {"values.Kp", "values.Ki", "values.Kd"} <= set(found.columns)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (TWO.format(name="Kq", values="1.0, 2.0, 3.0"), "unknown parameter 'Kq'; did you mean 'Kp'"),
        (TWO.format(name="factor.model.0.A.9.9", values="1.0, 2.0, 3.0"), "unknown parameter 'model.0.A.9.9'"),
        (TWO.format(name="K_h", values="1.0, 2.0, 3.0"), "unknown parameter 'K_h'"),
    ],
)
def test_parameters_that_the_plant_does_not_have_are_one_sentence(tmp_path, text, said):
    with pytest.raises(InputError) as refusal:
        run_study(study(tmp_path, HEAD + text), tmp_path / "out")
    assert said in str(refusal.value)


def test_quantities_and_tasks_that_a_plant_does_not_have_are_refused(tmp_path):
    ride = HEAD.replace("[study]\n", '[study]\nquantities = ["cost"]\n') + TWO.format(name="Kd", values="1.0, 2.0, 3.0")
    with pytest.raises(InputError, match="unknown quantity 'cost'"):
        run_study(study(tmp_path, ride), tmp_path / "out")
    front = HEAD.replace('sampling = "list"', 'task = "pareto"')
    for name, said in (("Sensitivity volt", "did you mean 'Sensitivity voltage'"), ("Pole", "did you mean 'Poles'")):
        sweep = f'[[pareto]]\nrequirement = "{name}"\nlimits = [0.5]\n'
        with pytest.raises(InputError, match=said):
            run_study(study(tmp_path, front + sweep), tmp_path / "out")


CART = """
[problem]
title = "A cart on a track"
source = "a double integrator with friction"
[model]
name = "cart"
kind = "transfer_function"
inputs = ["force"]
outputs = ["place"]
entry = [{ numerator = [1.0], denominator = [1.0, 1.0, 0.0] }]
[structure]
references = ["r"]
[[structure.block]]
kind = "pid"
inputs = ["r - place"]
outputs = ["force"]
options = { parts = "PD" }
parameters = { Tf_s = { value = 0.05, free = false } }
[[goal]]
kind = "margins"
points = ["force"]
phase_deg = 50.0
[[goal]]
kind = "gain"
name = "effort"
hard = true
inputs = ["r"]
outputs = ["force"]
limit = 30.0
[[goal]]
kind = "step_tracking"
name = "tracking"
inputs = ["r"]
outputs = ["place"]
time_constant_s = 0.5
"""
FRONT = """
[study]
problem = "cart"
task = "pareto"
starts = 1
output = "csv"
[[pareto]]
requirement = "effort"
limits = [20.0, 40.0, 80.0]
[[pareto]]
requirement = "Margins force"
limits = [60.0, 75.0]
"""


@pytest.fixture(scope="module")
def front(tmp_path_factory):
    place = tmp_path_factory.mktemp("pareto")
    (place / "cart").mkdir()
    (place / "cart" / "data.toml").write_text(CART)
    return run_study(study(place, FRONT), place / "out"), place


@pytest.mark.slow
def test_a_front_over_the_limits_of_goals_costs_less_where_they_are_looser(front):
    found, _ = front
    assert found.columns["limit"] == [80.0, 40.0, 20.0, 60.0, 75.0]  # a margin is loosest where it is least
    assert found.columns["error"] == [""] * 5
    cost = found.numbers("goals.tracking")
    assert cost[0] <= cost[1] <= cost[2]
    assert cost[3] <= cost[4]
    assert (found.numbers("goals.effort")[:3] <= np.array([80.0, 40.0, 20.0]) * (1 + 1e-9)).all()
    assert found.failing.count == 0  # 80 is more than the problem's own 30, which that row was not designed for
    assert list(found.front) == ["tracking", "effort", "minus Margins force"]
    assert any(found.columns["nondominated"])


def test_a_front_goes_on_where_it_ended_and_has_its_report(front):
    found, place = front
    assert run_study(study(place, FRONT), place / "out").columns == found.columns
    assert "goals.tracking" in found.columns
    page = study_report_html(found)
    assert "tracking against minus Margins force" in page


def test_the_command_runs_it_and_writes_its_report(tmp_path):
    (tmp_path / "s.toml").write_text(HEAD + TWO.format(name="Kd", values="1.0, 2.0, 3.0"))
    given = ["study", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out"), "--workers", "1", "--json"]
    result = CliRunner().invoke(app, given)
    assert result.exit_code == 0, result.output
    document = json.loads(result.stdout)
    assert document["provenance"]["problem"] == "dc_motor"
    assert (tmp_path / "out" / "report.html").stat().st_size > 5000
