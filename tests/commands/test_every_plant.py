"""Every command on every shipped plant of one's own: it does its work or refuses in one sentence, nothing else."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

import workbench as wb
from workbench.errors import InfeasibleError, InputError
from workbench.files.problem import load_problem, shipped_problems, shipped_vehicles

PLANTS = sorted(set(shipped_problems()) - set(shipped_vehicles()))
UNSTABLE_START = {"wood_berry"}  # its gains begin at zero, its integrators at rest


@pytest.mark.parametrize("name", PLANTS)
def test_a_plant_is_analysed_as_one_document(command, name):
    done = command("analyse", name, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert found["stable"] is (name not in UNSTABLE_START)
    assert ("margins" in found) is found["stable"]
    assert "cost" not in found  # a ride is a vehicle's


@pytest.mark.parametrize("name", PLANTS)
def test_a_plant_is_simulated_or_said_to_be_unstable(command, name):
    done = command("simulate", name, "--json")
    if name in UNSTABLE_START:
        assert done.code == 2
        assert "unstable" in done.err
        return
    assert done.code == 0, done.err
    found = json.loads(done.out)["responses"]
    assert [one["model"] for one in found] == [m.name for m in load_problem(name).systems]
    assert all(np.isfinite(one["values"]).all() for one in found)


@pytest.mark.slow
def test_plants_are_compared_with_each_other(command):
    assert command("compare", *PLANTS, "--json").code == 0


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("design", "NAME", "--boxes"), "leave --boxes out"),
        (("design", "NAME", "--robust"), "no box of vehicles"),
        (("design", "NAME", "--trade-off"), "Leave it out"),
        (("design", "NAME", "--starts", "0"), "at least 1"),
        (("design", "NAME", "--fix", "Kpp=1"), "unknown parameter 'Kpp'"),
        (("design", "NAME", "--solver", "slqsp"), "did you mean 'slsqp'"),
        (("analyse", "NAME", "--speed", "30"), "Leave it out"),
        (("analyse", "NAME", "--gains", "WRONG"), "unknown parameter 'K_h'"),
        (("simulate", "NAME", "--step", "nowhere=1"), "unknown point 'nowhere'"),
        (("simulate", "NAME", "--duration-s", "nan"), "duration must be positive"),
    ],
    ids=lambda value: " ".join(value[:1] + value[2:]) if isinstance(value, tuple) else "",
)
def test_what_a_plant_has_not_is_refused_in_one_sentence(refused, tmp_path, name, words, said):
    (tmp_path / "wrong.toml").write_text("K_h = 1.0\n")
    places = {"NAME": name, "WRONG": tmp_path / "wrong.toml"}
    assert said in refused(
        *(places.get(w, w) for w in words), *(("--out", tmp_path / "o") if "design" in words else ())
    )
    assert not (tmp_path / "o").exists()  # a refused design leaves no empty folder


WRONG = {
    "nan": math.nan, "infinite": math.inf, "text": "1", "none": None, "true": True, "complex": 1j, "list": [1.0],
}  # fmt: skip


@pytest.mark.parametrize("name", PLANTS)
def test_values_that_are_none_are_refused_whatever_they_are_asked_for(name):
    problem = load_problem(name)
    one = problem.free[0]
    for call in (wb.analyse, wb.margins, lambda p, v: wb.simulate(p, 1.0, values=v)):
        for given in ({one: value} for value in WRONG.values()):
            with pytest.raises(InputError, match="must be a number"):
                call(problem, given)
        for given, said in (({"Kpp": 1.0}, "unknown parameter"), ([1.0], "must map names"), ("Kp", "must map names")):
            with pytest.raises(InputError, match=said):
                call(problem, given)
        with pytest.raises(InputError, match="takes a problem or a design"):
            call(None, {})


@pytest.mark.parametrize("name", PLANTS)
@pytest.mark.parametrize(
    "options",
    [{"starts": 0}, {"starts": 2.5}, {"starts": 10**9}, {"seed": -1}, {"seed": "a"}, {"method": "x"}, {"seconds": 0},
     {"seconds": math.nan}, {"start": {"q": 1.0}}, {"workers": 0}, {"workers": "2"}],
    ids=str,
)  # fmt: skip
def test_a_design_refuses_options_that_make_none(name, options):
    method = {} if "method" in options else {"method": "nonsmooth"}
    with pytest.raises(InputError) as refusal:
        wb.design(load_problem(name), **{"starts": 1, "seconds": 1.0, **method, **options})
    assert "\n" not in str(refusal.value)


def test_values_that_divide_by_zero_are_refused():
    with pytest.raises(InputError, match=r"Tf = 0 do not: none may divide by 0"):
        wb.analyse(load_problem("dc_motor"), {"Tf": 0.0})


def test_the_numbers_of_a_data_file_vary_by_their_paths():
    problem = load_problem("dc_motor")
    assert problem.at({"factor.model.0.A.0.0": 0.5}).systems[0].plant.A[0, 0] == -5.0
    assert problem.at({"model.0.A.0.0": -12.0}).at({"model.0.A.1.1": -3.0}).systems[0].plant.A.tolist() == [
        [-12.0, 1.0], [-0.02, -3.0]
    ]  # fmt: skip
    with pytest.raises(InputError, match=r"did you mean 'model\.0\.A\.0\.0'"):
        problem.at({"model.0.a.0.0": 1.0})
    with pytest.raises(InputError, match=r"unknown number of the models 'goal\.0\.percent'"):
        problem.at({"goal.0.percent": 1.0})


@pytest.mark.slow
def test_a_plant_of_a_data_file_is_designed_for_a_box_of_its_numbers():
    box = {"factor.model.0.A.0.0": (0.95, 1.05)}
    found = wb.robust(load_problem("dc_motor"), box, starts=1, seconds=30.0)
    assert found.visited
    for factor in (0.95, 1.05):
        there = load_problem("dc_motor").at({"factor.model.0.A.0.0": factor})
        hard = {goal.name for goal in there.goals if goal.hard}
        judged = wb.analyse(there, found.design.values).design.verdicts
        assert all(v.met for v in judged if v.name in hard)


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTS)
def test_a_plant_goes_the_whole_way_from_a_design_to_code_and_a_study(command, tmp_path, name):
    out = tmp_path / "out"
    done = command("design", name, "--starts", "1", "--out", out)
    assert done.code == 0, done.err
    table = out / "gains.json"
    assert command("verify", table, "--problem", name).code == 0
    assert command("analyse", name, "--gains", table, "--report", tmp_path / "r.html").code == 0
    assert command("simulate", name, "--gains", table, "--out", tmp_path / "history").code == 0
    for format in ("csv", "json", "mat", "c"):
        accept = ("--accept",) if format in ("mat", "c") else ()
        done = command("export", table, "--format", format, "--out", tmp_path / "code", *accept)
        assert done.code in (0, 1), done.err  # a loop may not bear the sampling that nobody stated
        assert done.code == 0 or "sampl" in done.err
    problem = load_problem(name)
    soft = next(goal for goal in problem.goals if not goal.hard)
    text = f'[study]\nproblem = "{name}"\nsampling = "list"\noutput = "csv"\n'
    text += f'[[parameter]]\nname = "{problem.free[0]}"\nvalues = [{problem.structure.values()[problem.free[0]]}]\n'
    (tmp_path / "s.toml").write_text(text)
    done = command("study", tmp_path / "s.toml", "--out", tmp_path / "study", "--workers", "1", "--json")
    assert done.code == 0, done.err
    assert any(soft.name.replace(".", "_") in q["quantity"] for q in json.loads(done.out)["quantities"])


def test_a_trade_off_of_every_plant_names_its_goals():
    for name in PLANTS:
        problem = load_problem(name)
        with pytest.raises(InputError, match=r"unknown goal 'nothing'; .*Known: "):
            wb.trade_off(problem, "nothing", [1.0])
        with pytest.raises((InputError, InfeasibleError)):
            wb.schedule(problem)


def test_a_structure_with_nothing_free_is_judged_as_it_is():
    problem = load_problem("wood_berry")  # its gains at zero: every error stays
    held = problem.with_fixed({name: problem.structure.values()[name] for name in problem.free})
    found = wb.design(held, starts=1, seconds=1.0)
    assert not found.met
    assert {v.name: v.value for v in found.verdicts}["Sensitivity distillate, bottoms"] == 1.0


@pytest.mark.slow
def test_flights_of_a_vehicle_leave_a_picture_and_a_report(command, tmp_path):
    done = command(
        "simulate", "revenue_vehicle", "--hours", "0.01", "--seeds", "2", "--out", tmp_path / "flown", "--json"
    )
    assert done.code == 0
    document = json.loads(done.out)
    assert Path(document["picture"]).read_bytes().startswith(b"\x89PNG")
    assert "Nonlinear over linear" in Path(document["report"]).read_text("utf-8")
