"""Every file that the guide shows is one that the workbench reads."""

import json
import subprocess
import tomllib

import numpy as np
import pytest
from guide_page import fences

from workbench.control import Gains
from workbench.files.gains import read_gains
from workbench.files.problem import ProblemData, load_problem, parse_problem, shipped_problems
from workbench.handover.code.formats import render
from workbench.handover.table.schema import Promise
from workbench.handover.table.table import read_table
from workbench.study.file import read_study


def shown(kind: str):
    """A test's parameters: every block of a kind, at least one."""
    found = fences(kind)
    assert found, f"the guide shows no {kind!r}"
    return pytest.mark.parametrize("fence", found, ids=[fence.place for fence in found])


@shown("toml problem")
def test_a_data_file_shown_builds_a_problem(fence):
    problem = ProblemData(parse_problem(tomllib.loads(fence.text), fence.place), "shown", "0" * 64, None).build()
    assert problem.free
    assert problem.requirements


@shown("toml blocks")
def test_blocks_shown_fit_into_the_problem_they_name(fence):
    name = fence.kind.split()[-1]
    data = tomllib.loads((shipped_problems()[name] / "data.toml").read_text("utf-8"))
    blocks = tomllib.loads(fence.text)
    parse_problem({**data, **blocks}, fence.place)
    assert blocks != {key: data.get(key) for key in blocks}  # else the block shows nothing


@shown("toml plant")
def test_a_plants_data_file_shown_builds_a_problem(fence, tmp_path):
    (tmp_path / "data.toml").write_text(fence.text, "utf-8")
    problem = load_problem(str(tmp_path))
    assert problem.free
    assert {goal.hard for goal in problem.goals} == {True, False}


@shown("toml model")
def test_a_model_shown_builds_a_problem(fence, tmp_path):
    f = np.geomspace(0.05, 20.0, 60)
    G = 3 / (2j * np.pi * f) * np.exp(-0.08j * np.pi * f) / (0.1j * np.pi * f + 1)
    rows = (f"{at!r},{g.real!r},{g.imag!r}" for at, g in zip(f.tolist(), G.tolist(), strict=True))
    (tmp_path / "response.csv").write_text("\n".join(["frequency_hz,real,imaginary", *rows]))
    (tmp_path / "plant.csv").write_text("0.9,0.1\n2.0,0.0")
    signals = tomllib.loads(fence.text)
    reads, drives = signals["outputs"][0], signals["inputs"][0]
    (tmp_path / "data.toml").write_text(
        f'[problem]\ntitle = "A model of the guide"\nsource = "the guide"\n[[model]]\n{fence.text}\n[structure]\n'
        f'[[structure.block]]\nkind = "gain"\ninputs = ["{reads}"]\noutputs = ["{drives}"]\n'
        "parameters = { K = -0.01 }",
        "utf-8",
    )
    assert load_problem(str(tmp_path)).systems[0].outputs == tuple(signals["outputs"])


@shown("toml gains")
def test_a_gains_file_shown_holds_the_seventeen(fence, tmp_path):
    (tmp_path / "gains.toml").write_text(fence.text, "utf-8")
    assert isinstance(read_gains(tmp_path / "gains.toml"), Gains)


@shown("toml study")
def test_a_study_file_shown_plans_rows(fence, tmp_path):
    (tmp_path / "study.toml").write_text(fence.text, "utf-8")
    assert read_study(tmp_path / "study.toml").rows_planned > 1


@shown("json promise")
def test_a_promise_shown_is_one_of_a_gain_table(fence):
    promise = Promise.model_validate(json.loads(fence.text))
    low, high = promise.enclosure
    assert low >= promise.limit if promise.sense == ">=" else high <= promise.limit


def test_every_file_in_the_guide_is_loaded_by_a_test():
    loaded = {
        "toml problem",
        "toml blocks",
        "toml gains",
        "toml study",
        "toml plant",
        "toml model",
        "json promise",
    }
    for fence in fences():
        if fence.kind.startswith(("toml", "json")):
            assert " ".join(fence.kind.split()[:2]) in loaded, fence.place


@shown("c")
def test_the_c_program_shown_compiles_and_commands(fence, tmp_path):
    table = read_table(shipped_problems()["comfort_limit"] / "approved.json")
    (tmp_path / "gains.h").write_bytes(render(table, "c", accept=True))
    (tmp_path / "main.c").write_text(fence.text, "utf-8")
    strict = ("-std=c99", "-Wall", "-Wextra", "-Werror")
    subprocess.run(["cc", *strict, "main.c", "-o", "main"], cwd=tmp_path, check=True)
    said = subprocess.run([tmp_path / "main"], capture_output=True, text=True, check=True).stdout
    sensors = np.zeros(len(table.to_law().sensors))
    sensors[0] = 0.01
    command = table.to_discrete().state_space()[3] @ sensors  # the first step from rest: feedthrough alone
    assert said == f"comfort_limit: command 1 is {command[0]:.4f} of the main current\n"
