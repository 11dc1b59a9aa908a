"""A problem is models, a structure and goals: whatever the plant, the same record and the same road."""

import pickle

import numpy as np
import pytest

import workbench as wb
from workbench.design.models import Made
from workbench.design.record import given
from workbench.errors import InfeasibleError, InputError


def motor(values):
    return wb.tf([values["gain"]], [values["lag"], 1, 0], input="voltage", output="angle", name="motor")


def pd(**starts):
    return wb.pid("r - angle", "voltage", parts="PD", **{"Kp": 2.0, "Kd": 0.5, "Tf": 0.05, **starts})


@pytest.fixture(scope="module")
def servo():
    tracking = wb.goals.StepTracking("r", "angle", time_constant=0.3)
    goals = [wb.goals.Margins("voltage", gain_db=6, phase_deg=45), tracking]
    return wb.Problem(models=Made(motor, {"gain": 2.0, "lag": 0.5}), structure=pd(), goals=goals, name="servo")


@pytest.fixture(scope="module")
def found(servo):
    return wb.design(servo, starts=1, seconds=10)


def test_what_no_model_makes_is_a_reference(servo):
    assert servo.structure.references == ("r",)
    assert servo.free == ("Kp", "Kd", "Tf")
    assert servo.fixed == {"Ki": 0.0}


def test_a_name_that_is_nearly_a_signal_is_refused():
    with pytest.raises(InputError, match="unknown signal 'angel'; did you mean 'angle'"):
        wb.Problem(models=motor({"gain": 1, "lag": 1}), structure=wb.pid("r - angel", "voltage"), goals=[])


def test_a_structure_that_measures_nothing_is_refused():
    with pytest.raises(InputError, match="must read a signal that a model makes"):
        wb.Problem(models=motor({"gain": 1, "lag": 1}), structure=wb.pid("r - x", "voltage"), goals=[])


def test_a_design_keeps_its_hard_goals_as_printed(servo, found):
    assert [v.name for v in found.verdicts] == [goal.name for goal in servo.goals]
    assert found.verdicts[0].met
    assert found.verdicts[0].value >= 45
    for name, value in found.values.items():
        assert value == float(f"{value:.6g}") or name in found.binding
    # the balanced disk margin by hand: S of the printed gains on a fine grid
    K = found.structure.controller()
    omega = np.geomspace(1e-3, 1e4, 20001)
    S = servo.loops[0].sensitivity(("voltage",)).response(K, omega)[:, 0, 0]
    alpha = 1 / np.abs(S - 0.5).max()
    assert found.verdicts[0].value == pytest.approx(np.degrees(2 * np.arctan(alpha / 2)), rel=1e-4)  # the grid's step


def test_given_values_are_judged_met_or_not(servo):
    loose = given(servo, {"Kp": 200.0, "Kd": 0.0})
    assert not loose.verdicts[0].met
    unstable = given(servo, {"Kp": -1.0})
    assert [v.value for v in unstable.verdicts] == [None, None]
    assert "unstable" in unstable.verdicts[0].where


def test_the_same_problem_in_other_units_is_the_same_design(servo, found):
    model = servo.systems[0].scaled(outputs={"angle": 1000.0})  # milliradians
    same = servo.with_models(model)
    scaled = {n: v / 1000 if n.startswith("K") else v for n, v in found.values.items()}
    for own, other in zip(found.verdicts, given(same, scaled).verdicts, strict=True):
        assert other.value == pytest.approx(own.value, rel=1e-6)


def test_goals_say_how_they_are_followed(servo):
    with pytest.raises(InputError, match="pieces with corners, which ipopt does not follow"):
        wb.design(servo, method="ipopt")
    with pytest.raises(InputError, match="unknown method 'slsq'; did you mean 'slsqp'"):
        wb.design(servo, method="slsq")
    with pytest.raises(InputError, match="smooth rows, which nonsmooth does not follow"):
        wb.design(wb.load("heave"), method="nonsmooth")


def test_a_goal_out_of_reach_is_named(servo):
    asked = servo.with_goals([wb.goals.Poles(name="fast", decay=1e5, hard=True), *servo.goals])
    with pytest.raises(InfeasibleError, match="hard goal 'fast'"):
        wb.design(asked, starts=1, seconds=5)


def test_models_are_made_elsewhere_by_name(servo):
    heavier = servo.at({"lag": 1.0})
    assert heavier.systems[0].plant.A.min() == -1.0
    with pytest.raises(InputError, match="unknown value of the models 'lga'; did you mean 'lag'"):
        servo.at({"lga": 1.0})
    fixed = servo.with_models(servo.systems)
    with pytest.raises(InputError, match="given as they are"):
        fixed.at({"lag": 1.0})


def test_what_only_a_vehicle_has_is_refused_by_name(servo, found):
    with pytest.raises(InputError, match="this asks for a vehicle"):
        _ = servo.setting
    with pytest.raises(InputError, match="seventeen gains belong to a vehicle"):
        _ = found.gains


def test_a_vehicle_is_the_same_three_things():
    heave = wb.load("heave")
    assert [p.name for p in heave.structure.parameters if p.free] == list(heave.free)
    assert heave.fixed["K_pitch"] == heave.structure.parameter("K_pitch").value
    assert len(heave.systems) == 1
    fixed = heave.with_fixed({"K_h": -1.0})
    assert fixed.fixed["K_h"] == -1.0
    assert "K_h" not in fixed.free
    with pytest.raises(InputError, match="unknown gain 'K_hh'; did you mean 'K_h'"):
        heave.with_fixed({"K_hh": 1.0})


def test_the_vehicle_seen_whole_has_the_margins_of_its_analysis():
    problem = wb.load("comfort_limit")
    from workbench.design.loop_margins import loop_margins

    K = problem.structure.with_values(problem.approved.as_dict()).controller()
    (loop,) = problem.loops
    first = loop_margins((loop,), K).single[0].channel
    own = wb.analyse(problem).current_margins[0]
    assert first.phase == pytest.approx(own.phase, rel=1e-6)  # two assemblies of one loop, of 34 and more states
    assert first.delay == pytest.approx(own.delay, rel=1e-6)


def test_a_problem_travels_to_another_process():
    plain = wb.Problem(models=motor({"gain": 2.0, "lag": 0.5}), structure=pd(), goals=[wb.goals.Poles(decay=0.1)])
    again = pickle.loads(pickle.dumps(plain))
    assert again.structure.references == ("r",)
    assert again.bounds == plain.bounds


@pytest.mark.slow
def test_a_box_of_models_is_borne(servo):
    borne = wb.robust(servo, {"gain": (1.5, 3.0)}, starts=1, seconds=10)
    assert borne.design.verdicts[0].met
    assert len(borne.visited) >= 1
    for values in borne.visited.values():
        assert given(servo.at(values), borne.design.values).verdicts[0].met
    with pytest.raises(InputError, match="one model and a box"):
        wb.robust(servo)


def test_a_looser_limit_is_swept_by_name(servo, found):
    asked = servo.with_goals([wb.goals.Sensitivity("voltage", limit=1.5, hard=True), servo.goals[1]])
    curve = wb.trade_off(asked, "Sensitivity voltage", [1.2, 1.6], starts=1, seconds=5)
    assert curve.limits == (1.6, 1.2)
    assert all(d.verdicts[-1].value <= limit for d, limit in zip(curve.designs, curve.limits, strict=True))
    with pytest.raises(InputError, match="unknown goal 'Sensitivty"):
        wb.trade_off(asked, "Sensitivty voltage", [1.2])


def test_everything_is_handed_over_in_one_call(servo, tmp_path):
    done = wb.complete(servo, tmp_path / "out", starts=1, workers=1)
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["gains.json", "report.html"]
    table = wb.read_table(tmp_path / "out" / "gains.json")
    assert table.values() == dict(done.design.values)
    assert "servo" in done.report
    with pytest.raises(InputError, match="no box of vehicles"):
        wb.complete(servo, robust=True)
