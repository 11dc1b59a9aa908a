"""Trade-offs: no limit stays in the valley of its neighbour, and a looser limit never costs more."""

import pytest

from workbench.analysis.analysis import analyse
from workbench.design.design import design
from workbench.design.tradeoff import trade_off, with_limit
from workbench.design.verdict import verdicts
from workbench.errors import InputError
from workbench.files.problem import load_problem

BIAS = "static gap error from bias"


@pytest.fixture(scope="module")
def heave():
    return load_problem("heave")


@pytest.fixture(scope="module")
def curve(heave):
    return trade_off(heave, BIAS, [0.002, 0.020, 0.010], start=heave.approved, starts=4)


@pytest.mark.slow
def test_no_limit_costs_more_than_designs_from_random_starts_of_its_own(heave, curve):
    for limit, cost in zip(curve.limits, curve.costs, strict=True):
        alone = design(with_limit(heave, BIAS, limit), starts=4).analysis.cost
        assert cost <= alone * (1 + 1e-3)  # starts whose costs are closer count as one valley
    assert curve.costs[0] < 0.1  # 0.177 in the valley of the approved gains, 0.090 outside it


@pytest.mark.slow
def test_a_looser_limit_costs_no_more(curve):
    assert curve.limits == (0.020, 0.010, 0.002)
    assert list(curve.costs) == sorted(curve.costs)


@pytest.mark.slow
def test_every_point_meets_its_own_limit(heave, curve):
    for limit, gains in zip(curve.limits, curve.gains, strict=True):
        assert all(v.met for v in verdicts(with_limit(heave, BIAS, limit), analyse(heave.setting, gains)))


def test_a_limit_out_of_reach_leaves_a_reason_and_the_others(heave):
    swept = trade_off(heave, "peak sensitivity", [2.0, 0.9], start=heave.approved, starts=1)
    assert swept.costs[1] is None
    assert swept.costs[0] <= analyse(heave.setting, heave.approved).cost * (1 + 1e-6)
    assert swept.reasons[0] == ""
    assert "'peak sensitivity' must be <= 0.9; best found 1" in swept.reasons[1]  # it is 1 at high frequency


def test_doubled_limits_are_refused(heave):
    with pytest.raises(InputError, match=r"limits of a trade-off must differ; got 2, 2"):
        trade_off(heave, "peak sensitivity", [2.0, 2.0])
