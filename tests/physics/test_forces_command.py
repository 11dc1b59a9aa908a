"""`workbench forces`, as scripts see it."""

import json

import pytest
import typer

from workbench.commands.forces import forces
from workbench.errors import InputError


def run(*arguments):
    app = typer.Typer(pretty_exceptions_enable=False)
    app.command()(forces)
    app(list(arguments), standalone_mode=False)


def test_the_document_holds_the_nominal_forces(capsys):
    run("--json")
    document = json.loads(capsys.readouterr().out)
    # A.3: 0.8380 × 0.7187 × 429.69² to five digits, and the moment within the 0.3 % that stay unexplained
    assert document["lift_n"] == pytest.approx(1.1120e5, abs=5)
    assert document["lateral_n"] == pytest.approx(3.9640e4, abs=8)
    assert document["roll_moment_n_m"] == pytest.approx(1.1768e4, rel=3e-3)
    assert document["stiffness"][0][0] == pytest.approx(-8.9372e5, rel=2e-5)
    assert document["current"][0] == pytest.approx(3.3981e5, rel=2e-5)
    assert document["drag_n"] == pytest.approx(9810 / 4, abs=0.5)
    assert (document["lift_ratio"], document["lift_to_drag"]) == (0.8380, pytest.approx(61.505, rel=1e-14))


def test_options_reach_the_document(capsys):
    pose = ("--h", "0.32", "--h-prime", "0.25", "--roll", "0.01", "--alpha", "0.1")
    run(*pose, "--speed", "60", "--physics", "slab", "--json")
    document = json.loads(capsys.readouterr().out)
    assert [document[key] for key in ("h", "h_prime", "roll", "alpha", "speed", "physics")] == [
        0.32, 0.25, 0.01, 0.1, 60.0, "slab",
    ]  # fmt: skip


def test_without_json_a_table_names_the_quantities(capsys):
    run()
    printed = capsys.readouterr().out
    assert "lift F_L" in printed
    assert "1.112e+05" in printed


def test_an_impossible_pose_is_refused():
    with pytest.raises(InputError, match="physics 'report' must stay at 134 m/s"):
        run("--h", "0.2")
    with pytest.raises(InputError, match="the coils must stay clear of the guideway"):
        run("--h", "0.05", "--physics", "slab")
