"""Data files of tuning problems: read into a record, refused by the key at fault."""

import pytest

from workbench.errors import InputError
from workbench.files.problem import is_tuning_problem
from workbench.files.tuning_problem import load_tuning_problem

DATA = """
[problem]
kind = "tuning"
title = "two lags"
source = "made up"
[plant]
outputs = ["y"]
inputs = ["u"]
gain = [[2.0]]
time_constant_min = [[5.0]]
dead_time_min = [[1.0]]
source = "made up"
[controller]
kind = "pid"
filter_time_min = 0.3
structure = [[1]]
source = "made up"
[limits]
peak_sensitivity_at_most = 1.4
peak_control_sensitivity_times_smallest_static_gain_at_most = 3.0
source = "made up"
"""


def folder(tmp_path, text: str):
    (tmp_path / "data.toml").write_text(text)
    return tmp_path


def test_a_file_becomes_the_problem_it_describes(tmp_path):
    problem = load_tuning_problem(folder(tmp_path, DATA))
    assert is_tuning_problem(tmp_path)
    assert problem.limits == {"S": 1.4, "Q": 1.5}  # 3 over a static gain of 2
    assert problem.law.names == ("P11", "I11", "D11")
    assert problem.plant.static_gain() == pytest.approx(2.0)
    assert problem.sources["plant"] == "made up"


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("filter_time_min = 0.3", "filter_time_min = 0.0", "controller.filter_time_min"),
        ('title = "two lags"', 'title = "two lags"\nwidth = 3', "problem.width"),
        ("gain = [[2.0]]", "gain = [[2.0, 1.0]]", "plant.gain must have 1 rows of 1 numbers"),
        ("structure = [[1]]", "structure = [[1, 1]]", "controller.structure must have 1 rows of 1"),
        ("[limits]", "[limits]\npeak_control_sensitivity_at_most = 1.0", "given once"),
    ],
)
def test_a_slip_in_the_file_is_named(tmp_path, old, new, sentence):
    with pytest.raises(InputError, match=sentence):
        load_tuning_problem(folder(tmp_path, DATA.replace(old, new)))
