"""Pareto studies: what is swept is an objective, and every design is held against the limit it was made for."""

import numpy as np
import pytest

from workbench.study.file import read_study
from workbench.study.pareto import nondominated, objectives
from workbench.study.run import run_study

SWEEPS = """
[[pareto]]
requirement = "static_gap_error_at_most_mm"
limits = [2.0, 20.0, 10.0]

[[pareto]]
requirement = "delay_margin_at_least_ms"
limits = [5.0, 1.0]
"""


@pytest.fixture(scope="module")
def front(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pareto")
    head = '[study]\nproblem = "heave"\ntask = "pareto"\nstarts = 2\nseed = 0\noutput = "csv"\n'
    (folder / "study.toml").write_text(head + SWEEPS, encoding="utf-8")
    return run_study(read_study(folder / "study.toml"), folder / "out")


@pytest.mark.slow
def test_looser_limits_cost_no_more_and_leave_the_valley_of_the_approved_gains(front):
    assert front.columns["limit"] == pytest.approx([0.020, 0.010, 0.002, 0.001, 0.005])
    costs = front.numbers("cost")
    assert list(costs[:3]) == sorted(costs[:3])
    assert costs[3] <= costs[4]
    assert costs[0] < 0.1  # 0.177 in the valley of the approved gains


@pytest.mark.slow
def test_what_is_swept_is_an_objective(front):
    names, values = objectives(front.columns)
    assert {"static gap error from bias", "minus delay margin"} <= set(names)
    bias, delay = names.index("static gap error from bias"), names.index("minus delay margin")
    np.testing.assert_array_equal(values[:, bias], front.numbers("static_error.gap"))
    np.testing.assert_array_equal(values[:, delay], -front.numbers("delay_margin"))


@pytest.mark.slow
def test_the_design_with_the_least_of_what_was_swept_is_on_the_front(front):
    best = int(np.argmin(front.numbers("static_error.gap")))
    assert front.columns["limit"][best] == pytest.approx(0.002)
    assert front.columns["nondominated"][best]


@pytest.mark.slow
def test_a_design_is_held_against_the_limit_that_was_swept(front):
    # 20 mm of error and 1 ms of margin miss the problem's own limits, which these rows were not designed for
    assert front.numbers("static_error.gap")[0] > 0.010
    assert front.columns["error"] == [""] * 5
    assert front.failing.count == 0
    quantities = [limit.quantity for limit in front.limits]
    assert quantities.count("static_error.gap") == 3  # of its sweep, where the problem's own 10 mm are one of them
    assert quantities.count("delay_margin") == 3  # two of its sweep, and the problem's for the other sweep


def test_an_unlimited_margin_is_on_the_front():
    points = np.array([[1.0, -np.inf], [2.0, -1.0], [0.5, -1.0]])
    assert nondominated(points).tolist() == [True, False, True]
