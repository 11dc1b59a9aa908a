"""What a limit costs a plant of one's own: any goal with a limit is swept in its own unit."""

import pytest

import workbench as wb
from workbench.errors import InputError

PLANT = wb.tf([1.0], [1.0, 1.0, 0.0], input="u", output="y")


@pytest.fixture(scope="module")
def problem():
    goals = [
        wb.goals.Margins("u", gain_db=6.0, phase_deg=45.0, name="margins"),
        wb.goals.Poles(decay=0.1, hard=True, name="decay"),
        wb.goals.StepTracking("r", "y", time_constant=0.5, name="tracking"),
        wb.goals.Gain("r", "u", limit=20.0, name="effort"),
    ]
    return wb.Problem(models=PLANT, structure=wb.pid("r - y", "u", parts="PD"), goals=goals)


@pytest.mark.parametrize(
    ("name", "limits", "unit"),
    [("margins", [70.0, 40.0], "deg"), ("decay", [0.5, 0.2], "1/s"),
     pytest.param("effort", [4.0, 12.0], "1", marks=pytest.mark.slow),
     pytest.param("tracking", [3.0, 6.0], "1", marks=pytest.mark.slow)],
)  # fmt: skip
def test_every_goal_with_a_limit_is_swept_from_its_loosest(problem, name, limits, unit):
    curve = wb.trade_off(problem, name, limits, starts=1, seconds=2.0)
    assert curve.unit == unit
    assert list(curve.limits) == sorted(limits, reverse=curve.sense == "<=")
    assert all(curve.designs)
    assert curve.costs[0] <= curve.costs[1]
    for limit, found in zip(curve.limits, curve.designs, strict=True):
        verdict = next(v for v in found.verdicts if v.name == name)
        assert verdict.met
        if name != "tracking":  # whose measure is normalised by the limit
            assert verdict.limit == limit


def test_a_limit_that_cannot_be_met_has_no_design_and_says_why(problem):
    curve = wb.trade_off(problem, "margins", [45.0, 170.0], starts=1, seconds=2.0)
    assert curve.designs[1] is None
    assert "hard goal 'margins' must be at least 170 deg" in curve.reasons[1]
    assert curve.reasons[0] == ""


@pytest.mark.parametrize(
    ("name", "limits", "said"),
    [("margin", [45.0], "did you mean 'margins'"), ("margins", [], "at least one limit"),
     ("margins", [45.0, 45.0], "must differ"), ("margins", [float("nan")], "positive, finite"),
     ("margins", ["45"], "positive, finite"), ("margins", [400.0], "below 180"), ("decay", [-1.0], "positive, finite")],
)  # fmt: skip
def test_what_cannot_be_swept_is_one_sentence(problem, name, limits, said):
    with pytest.raises(InputError, match=said):
        wb.trade_off(problem, name, limits, starts=1)
