"""`workbench compare` and `workbench model` on plants of one's own."""

import json

import pytest
from typer.testing import CliRunner

from workbench.commands.app import app
from workbench.errors import InputError
from workbench.files.problem import load_problem


def run(*arguments):
    return CliRunner().invoke(app, ["compare", *map(str, arguments)])


def figures(result):
    document = json.loads(result.stdout)
    return document["problems"], {f["quantity"]: f["values"] for f in document["figures"]}


def test_two_designs_of_one_problem_stand_side_by_side_with_their_verdicts(tmp_path):
    for name, text in (("slow", "Kp = 10.0"), ("quick", "Kp = 30.0\nKd = 2.0")):
        (tmp_path / f"{name}.toml").write_text(text)
    given = ("--gains", tmp_path / "slow.toml", "--gains", tmp_path / "quick.toml")
    problems, found = figures(run("dc_motor", *given, "--json"))
    assert problems == ["slow", "quick"]
    assert found["Kp"] == [10.0, 30.0]
    slow, quick = found["Overshoot r → speed"]
    assert slow > quick >= 0
    one = json.loads(
        CliRunner().invoke(app, ["analyse", "dc_motor", "--gains", str(tmp_path / "slow.toml"), "--json"]).stdout
    )
    assert one["peak_sensitivity"] == found["peak sensitivity"][0]
    assert {v["name"]: v["value"] for v in one["requirements"]}["Margins voltage"] == found["Margins voltage"][0]


def test_a_plant_and_a_vehicle_leave_empty_what_the_other_has():
    problems, found = figures(run("dc_motor", "heave", "--json"))
    assert problems == ["dc_motor", "heave"]
    assert found["cost J"][0] is None
    assert found["Kp"] == [20.0, None]
    assert None not in found["smallest damping ratio"]


def test_one_design_twice_and_gains_of_two_problems_are_refused_or_told_apart(tmp_path):
    (tmp_path / "g.toml").write_text("Kp = 10.0")
    (tmp_path / "x").mkdir()
    (tmp_path / "x" / "g.toml").write_text("Kp = 11.0")
    problems, _ = figures(
        run("dc_motor", "--gains", tmp_path / "g.toml", "--gains", tmp_path / "x" / "g.toml", "--json")
    )
    assert problems == [str(tmp_path / "g.toml"), str(tmp_path / "x" / "g.toml")]
    again = run("dc_motor", "--gains", tmp_path / "g.toml", "--gains", tmp_path / "g.toml")
    assert isinstance(again.exception, InputError)
    assert "must have a name of its own" in str(again.exception)
    two = run("dc_motor", "heave", "--gains", tmp_path / "g.toml")
    assert "--gains are designs of one problem; got 2" in str(two.exception)


@pytest.mark.parametrize("name", ["dc_moto", "no_such_problem"])
def test_an_unknown_problem_is_one_sentence(name):
    result = run("heave", name)
    assert isinstance(result.exception, InputError)
    assert f"unknown problem {name!r}" in str(result.exception)


def test_the_model_written_out_is_the_one_of_the_problem(tmp_path):
    document = json.loads(CliRunner().invoke(app, ["model", "dc_motor", "--json"]).stdout)
    (model,) = document["models"]
    (own,) = load_problem("dc_motor").systems
    assert model["A"] == own.plant.A.tolist()
    assert model["outputs"] == ["speed"]
    # Kp + Ki/s + Kd s/(Tf s + 1) with the data's numbers: at infinity Kp + Kd/Tf
    assert document["controller"]["D"] == [[pytest.approx(20.0 + 1.0 / 0.01)]]
    (tmp_path / "g.toml").write_text("Kp = 30.0")
    given = ["--gains", str(tmp_path / "g.toml")]
    other = json.loads(CliRunner().invoke(app, ["model", "dc_motor", *given, "--json"]).stdout)
    assert other["controller"]["D"] == [[pytest.approx(30.0 + 1.0 / 0.01)]]
    shown = CliRunner().invoke(app, ["model", "heat_exchanger"])
    assert "Dead times" in shown.stdout
    refused = CliRunner().invoke(app, ["model", "dc_motor", "--latex"])
    assert isinstance(refused.exception, InputError)
