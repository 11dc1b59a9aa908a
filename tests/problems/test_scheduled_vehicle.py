"""The shipped schedule: it holds from lift-off to cruise, and its file says so."""

import json

import numpy as np
import pytest

from workbench import cli
from workbench.analysis.analysis import analyse
from workbench.control.schedule import Schedule
from workbench.design.design import Design, refine
from workbench.design.plan import Plan
from workbench.design.record import given
from workbench.design.scheduled import dense_check, schedule_design
from workbench.design.speed_family import force_numbers, plant_family, speed_family
from workbench.design.verdict import margin_verdicts
from workbench.errors import InfeasibleError, InputError
from workbench.files.gains import read_gains, read_schedule
from workbench.files.problem import load_problem, parse_problem, shipped_problems
from workbench.goals.ride.requirement import requirement
from workbench.handover.table.table import read_table
from workbench.machine.reading import read_mapping

FOLDER = shipped_problems()["scheduled_vehicle"]
APPROVED = FOLDER / "approved.json"


@pytest.fixture(scope="module")
def problem():
    return load_problem("scheduled_vehicle")


@pytest.fixture(scope="module")
def schedule() -> Schedule:
    found = read_schedule(APPROVED)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def plants(problem):
    return plant_family(problem, problem.plan.range, nodes=8)


def test_lift_off_lies_just_below_the_schedule(problem):
    # report, Appendix F, 3: lift-off at 30 m/s; below it the vehicle rolls
    assert problem.plan.range == (30.0, 134.0)
    with pytest.raises(InputError, match=r"must not be below lift-off \(29.8 m/s"):
        load_problem("scheduled_vehicle", speed=29.7)


def test_the_held_current_lifts_the_vehicle_from_27_to_30_centimetres(problem):
    slow = load_problem("scheduled_vehicle", speed=30.0)
    assert slow.setting.main_current == pytest.approx(problem.setting.main_current, rel=1e-12)
    # the control coil hangs 10 cm below the main coil and is the nearest part
    assert problem.setting.clearance[0] == pytest.approx(0.2, abs=1e-9)
    assert 0.17 <= slow.setting.clearance[0] < 0.171


def test_the_plan_asks_every_speed_for_the_margins_of_the_comfort_limit(problem):
    margins = {r.name: r.limit for r in problem.plan.requirements}
    assert margins == pytest.approx(
        {"damping ratio": 0.4, "decay rate": 0.3, "peak sensitivity": 2.0, "delay margin": 0.002}, rel=1e-12
    )
    assert {r.name: r.limit for r in problem.requirements} == {
        r.name: r.limit for r in load_problem("comfort_limit").requirements
    }


@pytest.mark.parametrize("speed", [30.0, 47.3, 90.1])
def test_the_approved_schedule_keeps_its_margins_on_exact_plants(problem, schedule, speed):
    one = load_problem("scheduled_vehicle", speed=speed).with_requirements(problem.plan.requirements)
    assert [v.sentence() for v in margin_verdicts(one, schedule.gains_at(speed)) if not v.met] == []
    assert one.approved == schedule.gains_at(speed)  # what `analyse --speed` takes


@pytest.mark.slow
def test_the_approved_schedule_keeps_every_margin_at_209_speeds(problem, plants, schedule):
    curves = dense_check(plants, schedule, problem.plan)
    assert all(curve.met for curve in curves)
    assert len(curves[0].speed) == 209


def test_the_table_holds_the_gains_at_cruise(problem, schedule):
    table = read_table(APPROVED)
    assert table.to_gains() == schedule.gains_at(134.0) == problem.approved == read_gains(APPROVED)
    assert read_gains(APPROVED, speed=60.0) == schedule.gains_at(60.0)


def test_the_cruise_cost_is_two_per_cent_above_the_best_single_speed_gains_at_most(problem):
    # 23.07 is the cost of gains for cruise alone from six starts; the schedule pays for the other speeds
    cost = analyse(problem.setting, problem.approved).cost
    assert cost is not None
    assert cost <= 1.02 * 23.07


@pytest.mark.slow
def test_interpolated_plants_are_the_exact_ones(problem, plants):
    exact = problem.at({"speed_m_s": 77.7}).setting.plant
    ours = plants.problem_at(77.7).setting.plant
    row = np.abs(exact.A).max(axis=1, keepdims=True)
    # eight nodes leave 3e-8 of a row's largest entry, as measured between the nodes
    assert (np.abs(ours.A - exact.A) / row).max() <= 2 * plants.error + 1e-15
    assert plants.error < 1e-6


@pytest.mark.slow
def test_a_schedule_that_fails_between_its_points_is_caught(problem, plants, schedule):
    # exact at both ends and in the middle; an extra bump of the pitch gain between them loses its sensitivity margin
    c = {name: (*values, 0.0, 0.0) for name, values in schedule.coefficients.items()}
    bump = 40.0  # t² − t⁴ vanishes at −1, 0 and 1 and is 1/4 between
    c["K_yaw"] = tuple(a + b for a, b in zip(c["K_yaw"], (0.0, 0.0, bump, 0.0, -bump), strict=True))
    wrong = Schedule(centre=82.0, scale=52.0, range=(30.0, 134.0), coefficients=c)
    at_points = [margin_verdicts(plants.problem_at(v).with_requirements(problem.plan.requirements),
                                 wrong.gains_at(v)) for v in (30.0, 82.0, 134.0)]  # fmt: skip
    assert all(v.met for judged in at_points for v in judged)
    assert not all(curve.met for curve in dense_check(plants, wrong, problem.plan, every=16))


@pytest.mark.slow
def test_printed_force_polynomials_carry_their_measured_error(problem):
    laws = {}

    def numbers(speed):
        if speed not in laws:
            laws[speed] = force_numbers(problem.at({"speed_m_s": speed}).vehicle.force_law)
        return laws[speed]

    family = speed_family(numbers, (100.0, 134.0), degree=3, nodes=5)
    exact, ours = numbers(117.0 + 8.5), family.at(117.0 + 8.5)
    largest = {name: max(abs(one[name]) for one in laws.values()) for name in ours}
    for name, value in ours.items():
        # measured at the nodes and midway between them; elsewhere it may be a little larger
        assert abs(value - exact[name]) <= 2 * family.error[name] * largest[name] + 1e-9 * largest[name], name
    assert family.largest_error < 1e-4
    printed = family.to_dict()["coefficients"]["lift,1"]
    assert tuple(map(float, printed)) == family.coefficients["lift,1"]
    assert 1 / ours["lift_to_drag"] == pytest.approx(ours["drag_ratio"], rel=1e-4)


def test_a_polynomial_is_fitted_to_itself_exactly():
    family = speed_family(lambda v: {"p": 2.0 + 0.5 * v - 0.01 * v**2}, (30.0, 134.0), degree=2)
    assert family.largest_error < 1e-9  # ten printed digits
    assert family.at(50.0)["p"] == pytest.approx(2.0 + 25.0 - 25.0, rel=1e-7)


@pytest.mark.slow
def test_a_plan_that_cannot_be_kept_names_the_worst_speed(problem, plants):
    asked = (requirement("peak sensitivity", 1.02),)
    plan = Plan(range=(100.0, 134.0), requirements=asked, points=2, degree=1, dense=9)
    cruise = as_it_is(problem)
    with pytest.raises(InfeasibleError, match=r"no schedule of degree 1 over 100 … 134 m/s keeps .*'peak sensitivity'"):
        schedule_design(problem, plan, cruise=cruise, plants=plants, time_budget=1.0)


def as_it_is(problem) -> Design:
    """The approved gains as a design, without another optimisation."""
    return given(problem, problem.approved, solver="slsqp")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"range_m_s": [134.0, 30.0]}, "range_m_s must rise"),
        ({"range_m_s": [30.0, 100.0]}, "must hold the vehicle's speed"),
        ({"limits": {"rms_gap_front_at_most_mm": 3.0}}, "unknown limit 'rms_gap_front_at_most_mm'"),
        ({"degree": 9}, "less than or equal to 6"),
    ],
)
def test_a_schedule_block_that_makes_no_sense_is_refused(change, words):
    data = read_mapping(FOLDER / "data.toml")
    data["schedule"] |= change
    with pytest.raises(InputError, match=words):
        parse_problem(data)


def test_a_problem_without_a_plan_is_refused():
    with pytest.raises(InputError, match="has no schedule to design"):
        schedule_design(load_problem("heave"))


@pytest.mark.slow
def test_analyse_takes_the_scheduled_gains_of_the_speed(capsys, schedule):
    assert cli.run(["analyse", "scheduled_vehicle", "--speed", "60", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["stable"] is True
    assert document["gains"] == schedule.gains_at(60.0).as_dict()


@pytest.mark.slow
def test_a_new_schedule_from_the_approved_gains_holds_and_costs_no_more(problem):
    cruise = refine(problem, problem.approved)
    found = schedule_design(problem, cruise=cruise)
    assert all(m.met for m in found.margins)
    assert all(v.met for _, judged in found.exact for v in judged)
    assert all(v.met for v in found.cruise.requirements)
    cost, single = found.cruise.analysis.cost, found.single_cost
    assert cost is not None
    assert single is not None
    assert cost <= 1.02 * single  # reference: 2 % above the best single-speed gains
