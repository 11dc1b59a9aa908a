"""Designs: what they promise is measured by algorithms the optimiser did not use."""

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.design.design import design
from workbench.design.problem import Problem
from workbench.design.robustness import robustness
from workbench.design.solve import cost, stable_start
from workbench.design.starts import CENTRE
from workbench.design.steering import Programme
from workbench.design.tradeoff import trade_off
from workbench.design.verdict import verdicts
from workbench.errors import InfeasibleError, InputError
from workbench.files.problem import load_problem
from workbench.goals.ride.requirement import requirement
from workbench.physics.vehicle import varied
from workbench.solve.smooth import Options, minimise


@pytest.fixture(scope="module")
def heave() -> Problem:
    return load_problem("heave")


@pytest.fixture(scope="module")
def heave_design(heave):
    return design(heave, starts=4)


def test_the_heave_design_meets_every_requirement_by_the_exact_measures(heave, heave_design):
    again = verdicts(heave, analyse(heave.setting, heave_design.gains))
    assert [v.name for v in again] == [v.name for v in heave_design.requirements]
    assert all(v.met for v in again)


def test_the_printed_gains_are_the_verified_ones(heave_design):
    for name, value in heave_design.gains.as_dict().items():
        assert value == float(f"{value:.6g}"), name


def test_the_same_seed_gives_the_same_cost(heave, heave_design):
    # the valley is flat: rounding that depends on memory alignment moves the gains by a per cent, the cost by 1e-6
    assert design(heave, starts=4).analysis.cost == pytest.approx(heave_design.analysis.cost, rel=1e-4)


def test_no_point_nearby_that_meets_the_requirements_is_cheaper(heave, heave_design):
    generator = np.random.default_rng(1)
    base = np.array([heave_design.gains.as_dict()[name] for name in heave.free])
    for _ in range(60):
        moved = dict(zip(heave.free, base * (1 + 0.03 * generator.normal(size=len(base))), strict=True))
        analysis = analyse(heave.setting, heave_design.gains.with_values(**moved))
        if analysis.stable and all(v.met for v in verdicts(heave, analysis)):
            # the design keeps up to 1 % from its limits, which is worth at most about 2 % of cost
            assert analysis.cost > 0.98 * heave_design.analysis.cost


def test_an_unreachable_requirement_is_named_with_what_was_reached(heave):
    # 2 mm of stroke over this guideway needs a stiffness that the margins forbid
    others = [r for r in heave.requirements if r.name != "rms gap, front"]
    asked = heave.with_requirements([*others, requirement("rms gap, front", 0.002)])
    with pytest.raises(InfeasibleError, match=r"'rms gap, front' must be <= 0.002 m; best found .*, a miss of \d"):
        design(asked, starts=2)


def test_a_design_may_start_from_unstable_gains(heave):
    unstable = Gains(**CENTRE).with_values(K_hdot=-0.6, K_zdot=-0.6)
    assert not analyse(heave.setting, unstable).stable
    found = design(heave, starts=1, start=unstable)
    assert found.analysis.stable
    assert all(v.met for v in found.requirements)


def test_no_start_is_refused(heave):
    with pytest.raises(InputError, match="number of starts must be at least 1; got 0"):
        design(heave, starts=0)


def test_a_problem_without_free_parameters_is_refused():
    with pytest.raises(InputError, match="no free parameter"):
        design(load_problem("report_1975"))


def test_a_vehicle_without_current_lag_is_refused_because_the_optimum_has_infinite_bandwidth(heave):
    with pytest.raises(InputError, match="needs the current-loop lag"):
        design(heave.with_vehicle(heave.vehicle.with_extras(current_lag=0.0)))


@pytest.mark.slow
def test_ipopt_and_slsqp_reach_the_same_heave_cost_from_the_same_start(heave):
    programme = Programme(heave)
    x = stable_start(programme, programme.x(Gains(**CENTRE)), np.random.default_rng(0), 0.3)
    ends = {solver: minimise(programme, x, Options(solver)) for solver in ("slsqp", "ipopt")}
    assert ends["slsqp"].feasible
    # IPOPT's limited-memory Hessian may stop short of the optimum, but must not end below it
    assert cost(ends["ipopt"]) > cost(ends["slsqp"]) * 0.999 or not ends["ipopt"].feasible


@pytest.mark.slow
def test_a_looser_limit_never_costs_more(heave, heave_design):
    curve = trade_off(heave, "peak sensitivity", [1.8, 2.0, 3.0], start=heave_design.gains)
    assert curve.limits == (3.0, 2.0, 1.8)
    costs = [c for c in curve.costs if c is not None]
    assert len(costs) == 3
    assert costs == sorted(costs)


def test_fixed_parameters_stay_where_they_were_put(heave):
    found = design(heave.with_fixed({"K_zddot": 0.1}), starts=2)
    assert found.gains.K_zddot == 0.1


def test_robustness_reports_the_nominal_case_as_the_analysis_does(heave, heave_design):
    cases = {c.name: c for c in robustness(heave, heave_design.gains)}
    assert cases["nominal"].damping == pytest.approx(heave_design.analysis.damping, rel=1e-12)
    assert {"nominal", "mass −15 %", "mass +15 %", "current force −10 %", "current force +10 %"} <= set(cases)


def test_losing_every_vertical_sensor_in_scale_is_losing_loop_gain(heave, heave_design):
    cases = {c.name: c for c in robustness(heave, heave_design.gains)}
    # heave alone sees vertical sensors only: 10 % less signal is 10 % less force per current
    assert cases["vertical sensors −10 %"].damping == pytest.approx(cases["current force −10 %"].damping, rel=1e-9)
    assert cases["lateral sensors −10 %"].damping == pytest.approx(cases["nominal"].damping, rel=1e-12)


def test_more_current_force_is_the_same_as_larger_modal_gains(heave, heave_design):
    # heave alone: scaling the force per current scales the loop gain, as a larger K_heave does
    stronger = heave.with_vehicle(varied(heave.vehicle, current_force=1.1)).setting
    scaled = heave_design.gains.with_values(K_heave=1.1)
    ours = np.sort_complex(analyse(stronger, heave_design.gains).poles)
    theirs = np.sort_complex(analyse(heave.setting, scaled).poles)
    np.testing.assert_allclose(ours, theirs, rtol=1e-9)


def test_every_gain_is_either_free_or_fixed(heave):
    assert set(heave.bounds) | set(heave.fixed) == set(GAIN_NAMES)
    with pytest.raises(InputError, match="unknown gain 'K_hh'; did you mean 'K_h'"):
        heave.with_fixed({"K_hh": 1.0})
