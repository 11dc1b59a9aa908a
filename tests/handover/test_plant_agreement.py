"""A table of any plant held against its problem: another plant, structure, goal or figure is noticed."""

import copy

import pytest

from workbench.control.structure.blocks import pid
from workbench.control.structure.structure import Structure
from workbench.design.problem import Problem
from workbench.design.record import given
from workbench.errors import InputError
from workbench.goals import DelayMargin, Gain, Sensitivity
from workbench.handover.table.agreement import agreement
from workbench.handover.table.plant import plant_table
from workbench.lti.make import tf


@pytest.fixture(scope="module")
def problem():
    return Problem(
        models=tf([1.0], [1.0, 0.6, 1.0], input="u", output="y", dead_time=0.05),
        structure=Structure((pid("r - y", "u", Kp=0.5, Ki=0.3, parts="PI"),), ("r",)),
        goals=[
            Sensitivity(points="u", limit=2.0, hard=True), Gain(inputs="r", outputs="y", limit=1.7),
            DelayMargin(points="u", delay=0.1),
        ],
        name="loop", title="A loop", data_sha256="a" * 64,
    )  # fmt: skip


@pytest.fixture(scope="module")
def document(problem):
    return plant_table(given(problem, {"Kp": 0.4})).to_dict()


def test_a_table_agrees_with_its_problem(document, problem):
    found = agreement(document, problem)
    assert found.disagreements == ()
    assert found.plant_difference == 0.0


def change(document, at, value):
    changed = copy.deepcopy(document)
    inner = changed
    for key in at[:-1]:
        inner = inner[key]
    inner[at[-1]] = value
    return changed


@pytest.mark.parametrize(
    ("at", "value", "sentence"),
    [
        (("data_sha256",), "b" * 64, "SHA-256"),
        (("title",), "Another", "title"),
        (("models", 0, "A", 0, 0), "-0.60000001", "A of model 'model'"),
        (("models", 0, "name"), "other", "the models must be"),
        (("models", 0, "lines", 0, "dead_time_s"), "0.0500001", "lines"),
        (("models", 0, "inputs", 0), "w", "inputs"),
        (("structure", "blocks", 0, "inputs", 0), "y - r", "inputs of block 0"),
        (("structure", "blocks", 0, "kind"), "lead_lag", "kind of block 0"),
        (("structure", "blocks", 0, "options", "parts"), "PD", "options of block 0"),
        (("structure", "blocks", 0, "parameters", "Kd", "value"), "0.1", "'Kd' must be held at 0"),
        (("structure", "blocks", 0, "parameters", "Kp", "value"), "0.40001", "value of"),
        (("requirements", 0, "limit"), 3.0, "limit of"),
        (("requirements", 0, "hard"), False, "met or not"),
        (("requirements", 1, "value"), 1.0, "value of"),
        (("promises", 1, "limit"), 2.5, "must be promised"),
        (("promises", 1, "subject"), {"points": ["u"], "band": [0.0, 0.1]}, "must be promised"),
        (("promises", 1, "subject"), {"points": ["u"], "models": ["model"]}, "must be promised"),
        (("promises", 2, "subject", "openings"), ["y"], "must be promised"),
        (("requirements", 0, "promises"), [0], "must name the promises that hold it"),
        (("requirements", 0, "promises"), [], "must name the promises that hold it"),
    ],
)
def test_what_differs_is_said(document, problem, at, value, sentence):
    found = agreement(change(document, at, value), problem)
    assert any(sentence in words for words in found.disagreements), found.disagreements


def test_a_goal_left_out_is_said(document, problem):
    changed = copy.deepcopy(document)
    del changed["requirements"][2]
    assert any("does not" in words for words in agreement(changed, problem).disagreements)


def test_a_goal_that_the_problem_has_not_or_a_second_one_is_said(document, problem):
    entry = document["requirements"][0]
    for more, sentence in (({**entry, "name": "Comfort"}, "'Comfort' must be a goal"), (entry, "stands twice")):
        changed = change(document, ("requirements",), [*document["requirements"], more])
        assert any(sentence in words for words in agreement(changed, problem).disagreements)


def test_a_vehicles_table_is_no_table_of_a_plant_of_ones_own(problem):
    with pytest.raises(InputError, match="of the kind that 'loop' is"):
        agreement({"version": 1}, problem)
