"""One contract for every registered kind of goal: how it is said in data, how it steers, what it is judged by."""

import json
from dataclasses import replace

import numpy as np
import pytest
from goal_cases import EXAMPLES, loop_of, random_plant

from workbench.analysis.analysis import analyse
from workbench.design.design import design
from workbench.design.steering import Programme
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.goals.goal import Closed, Goal, Steered
from workbench.goals.integrated_error import IntegratedError
from workbench.goals.key import Key
from workbench.goals.poles import Poles
from workbench.goals.registry import data_of, goal, keys_of, known, register
from workbench.goals.ride.cost import RideCost
from workbench.goals.ride.flown import Flown
from workbench.goals.ride.nonlinear import NonlinearRideCost
from workbench.goals.ride.requirement import (
    Requirement,
    limit_keys,
    moves_sideways,
    required_kinds,
    requirement,
    requirement_of,
)
from workbench.goals.ride.reserve import Reserve

# the integrated error has a value only where T(0) = 0 (tests/goals/test_integrated_error.py): here its data and slopes
EVERY = [*EXAMPLES, IntegratedError("u3", "y3", limit=2.0)]
IDS = [f"{g.kind}-{k}" for k, g in enumerate(EVERY)]
PROBLEMS = ("heave", "sway_roll_yaw", "hybrid_motor")


def test_every_kind_is_looked_at_here():
    # a kind without an example would be checked by nothing below
    ours = {kind for kind, cls in known().items() if cls.__module__.startswith("workbench.")}
    reserves = {kind for kind, cls in known().items() if issubclass(cls, Reserve)}  # tests/goals/test_reserve_goals.py
    costs = {RideCost.kind, NonlinearRideCost.kind}  # the second: tests/goals/test_nonlinear_goals.py
    assert ({g.kind for g in EVERY} | set(required_kinds()) | reserves | costs) & ours == ours


@pytest.fixture(scope="module")
def case():
    """A stable loop with a weak state-space controller, and its parameters."""
    loop = loop_of(random_plant(1, 8, 3, 3), controls=["u1", "u2"], measured=["y1", "y2"], order=3)
    random = np.random.default_rng(3)
    theta = loop.structure.start + 0.1 * random.standard_normal(len(loop.structure.start))
    assert loop.abscissa(loop.structure.controller(theta)) < 0
    return loop, theta


@pytest.mark.parametrize("asked", EVERY, ids=IDS)
def test_what_data_say_of_a_goal_gives_the_same_goal(asked, case):
    data = json.loads(json.dumps(data_of(asked)))  # through a file's own types
    kind = data.pop("kind")
    again = goal(kind, data)
    assert data_of(again) == data_of(asked)
    loop, theta = case
    K = loop.structure.controller(theta)
    ours, theirs = again.bind(loop).evaluate(K), asked.bind(loop).evaluate(K)
    # frequencies go through hertz and back
    assert ours.value == pytest.approx(theirs.value, rel=1e-9)


UNLIMITED = {"loop_shape", "passivity", "weighted_passivity", "conic_sector"}  # in or out: no size to change
BETWEEN = {"min_loop_gain", "max_loop_gain"}  # asked for only where their profile is above, below 1


@pytest.mark.parametrize("asked", EVERY, ids=IDS)
def test_a_goal_with_another_limit_measures_the_same_against_it(asked, case):
    before = asked.asked()
    if asked.kind in UNLIMITED:
        with pytest.raises(InputError, match="has no limit of one size"):
            asked.with_limit(2.0)
        return
    loop, theta = case
    K = loop.structure.controller(theta)
    value = asked.bind(loop).evaluate(K).value
    for factor in (0.7, 1.0, 1.6):
        other = asked.with_limit(factor * before.limit)
        assert type(other) is type(asked)
        found = other.bind(loop).evaluate(K).value
        if before == type(before)():  # a number without a unit: so many times what was asked
            assert found == pytest.approx(value / factor, rel=1e-9) or asked.kind in BETWEEN
        else:
            assert other.asked().limit == factor * before.limit
            assert other.asked().value(found) == pytest.approx(before.value(value), rel=1e-9)
    for wrong in (0.0, -1.0, float("nan"), float("inf"), True, "2"):
        with pytest.raises(InputError, match="must be a positive, finite number"):
            asked.with_limit(wrong)


def test_limits_set_together_are_not_changed_as_one():
    with pytest.raises(InputError, match="sets decay and damping together"):
        Poles(decay=1.0, damping=0.5).with_limit(0.3)


@pytest.mark.parametrize("kind", known())
def test_every_kind_refuses_a_key_it_does_not_know_and_names_the_nearest(kind):
    key = keys_of(kind)[0].name
    with pytest.raises(InputError, match=rf"did you mean '{key}'"):
        goal(kind, {f"{key}_": 1.0})


@pytest.mark.parametrize("asked", EVERY, ids=IDS)
def test_the_rows_of_a_control_goal_have_the_gradient_of_their_parameters(asked, case):
    loop, theta = case
    rows = asked.steer(Steered((loop,), loop.structure, theta))
    if not rows:
        assert asked.bind(loop).evaluate(loop.structure.controller(theta)).reason  # no piece, and it says why
        return
    ((_, values, slopes),) = rows
    assert slopes.shape == (len(values), len(theta))
    random, step = np.random.default_rng(0), 1e-6
    direction = random.standard_normal(len(theta))
    direction /= np.linalg.norm(direction)
    up, down = (
        asked.steer(Steered((loop,), loop.structure, theta + sign * step * direction))[0][1].min() for sign in (1, -1)
    )
    # the least row is smooth here: rounding 1e-10 and curvature 1e-12 over the size of the gradient
    size = max(np.linalg.norm(slopes[np.argmin(values)]), 1e-9)
    assert abs((up - down) / (2 * step) - slopes[np.argmin(values)] @ direction) < 1e-4 * size


@pytest.mark.parametrize("asked", EVERY, ids=IDS)
def test_a_verdict_in_the_goals_own_unit_is_the_normalised_one(asked, case):
    loop, theta = case
    K = loop.structure.controller(theta)
    exact, (verdict,) = asked.bind(loop).exact(K), asked.judge(Closed((loop,), K))
    assert (verdict.name, verdict.model) == (asked.name, "case")
    assert verdict.met == (exact.upper <= 1)
    if verdict.value is None or verdict.upper is None or np.isinf(verdict.value):
        return
    # at the limit the measure is 1, and met means on its side
    assert asked.asked().value(1.0) == pytest.approx(verdict.limit, rel=1e-12, abs=1e-12)
    kept = verdict.upper <= verdict.limit if verdict.sense == "<=" else verdict.upper >= verdict.limit
    assert kept == verdict.met or abs(verdict.upper - verdict.limit) < 1e-9 * abs(verdict.limit)
    assert set(verdict.to_dict()) >= {"name", "sense", "limit", "value", "unit", "met", "where", "method"}


# ---- a vehicle's


@pytest.fixture(scope="module")
def vehicles():
    return {name: load_problem(name) for name in PROBLEMS}


def having(kind, vehicles):
    """The first of the problems that has the quantity."""
    for problem in vehicles.values():
        try:
            requirement(kind, 1.0).check(problem.name, problem.setting)
        except InputError:
            continue
        return problem
    raise AssertionError(f"no problem here has {kind}")


@pytest.mark.parametrize("kind", required_kinds())
def test_the_rows_of_a_requirement_have_the_gradient_of_their_gains(kind, vehicles):
    problem = having(kind, vehicles)
    theta = np.array(list(problem.approved.as_dict().values()))
    loop = Flown(problem.setting, problem.approved)
    value = requirement(kind, 1.0).judge(loop)[0].value
    limit = value if value and 0 < value < np.inf else 1.0
    programme = Programme(problem.with_requirements([requirement(kind, limit)]))
    direction = np.zeros(len(theta))
    direction[programme.free] = np.random.default_rng(1).standard_normal(len(programme.free)) * np.maximum(
        np.abs(theta[programme.free]), 0.01
    )

    def rows(at):
        return [(name, np.sort(v)) for name, v, _ in requirement(kind, limit).steer(programme.evaluated(at))]

    step = 1e-6
    own = requirement(kind, limit).steer(programme.evaluated(theta))
    assert own
    for (name, values, slopes), (_, up), (_, down) in zip(
        own, rows(theta + step * direction), rows(theta - step * direction), strict=True
    ):
        order = np.argsort(values)
        expected = (slopes @ direction)[order]
        size = np.abs(expected).max() + 1e-6
        # rounding 1e-16 of eigenvalues of size 1e3 over the step; where two rows cross, their order changes
        assert np.median(np.abs((up - down) / (2 * step) - expected)) < 1e-4 * size, name


@pytest.mark.parametrize("kind", required_kinds())
def test_a_requirement_is_read_from_its_key_and_written_back(kind):
    (key,) = [k for k, name in limit_keys().items() if name == kind]
    read = requirement_of(key, 3.0)
    assert read == goal(kind, {key: 3.0})
    data = data_of(read)
    assert data["kind"] == kind
    assert data[key] == pytest.approx(3.0, rel=1e-15)
    # the unit stands in the key, and the limit is in SI units
    factor = {"mm": 1e-3, "ms": 1e-3}.get(key.rpartition("_")[2], 1.0)
    assert read.limit == pytest.approx(3.0 * factor, rel=1e-15)


def test_the_ride_cost_steers_and_is_judged_by_two_algorithms(vehicles):
    problem = vehicles["heave"]
    theta = np.array(list(problem.approved.as_dict().values()))
    programme = Programme(problem)
    cost, slope = RideCost().cost(programme.evaluated(theta))
    (verdict,) = RideCost().judge(Flown(problem.setting, problem.approved))
    assert cost == pytest.approx(verdict.value, rel=2e-3)  # quadrature on the grid against the Lyapunov equation
    assert verdict.value == analyse(problem.setting, problem.approved).cost
    step = 1e-6
    for k in programme.free:
        h = step * max(abs(theta[k]), 0.01) * np.eye(17)[k]
        up, down = (RideCost().cost(programme.evaluated(theta + sign * h))[0] for sign in (1, -1))
        assert (up - down) / (2 * h[k]) == pytest.approx(slope[k], rel=1e-4, abs=1e-4 * cost)
    assert RideCost(limit=2 * cost).judge(Flown(problem.setting, problem.approved))[0].met
    assert not RideCost(limit=cost / 2).judge(Flown(problem.setting, problem.approved))[0].met


def test_a_vehicles_problem_makes_its_ride_cost_small(vehicles):
    assert [g.kind for g in vehicles["heave"].goals if not g.hard] == [RideCost.kind]


@pytest.mark.parametrize("kind", [k for k in required_kinds() if "lateral" in k])
def test_a_lateral_quantity_is_one_of_a_vehicle_that_sways(kind, vehicles):
    assert moves_sideways(having(kind, vehicles).setting)


# ---- the registry


def test_two_classes_cannot_share_a_kind():
    class Other(type(EXAMPLES[0])):
        pass

    with pytest.raises(InputError, match="'poles' is that of Poles"):
        register(Other)


def test_a_class_without_a_kind_is_refused():
    with pytest.raises(InputError, match="must name its kind"):
        register(type("Nameless", (type(EXAMPLES[0]),), {"kind": ""}))


def test_a_goal_that_data_cannot_say_is_refused_with_its_field():
    from workbench.goals.gain import Gain
    from workbench.lti.plant import Plant

    lag = Plant.from_matrices([[-1.0]], [[1.0]], [[1.0]])
    with pytest.raises(InputError, match=r"limit of goal .* must be a number, points or a fraction"):
        data_of(Gain("u3", "y3", limit=lag))


def test_a_goal_changed_by_replace_asks_for_the_same():
    # fields stay as given: a goal that overwrote one by what it made of it could not be made again
    for asked in EVERY:
        assert data_of(replace(asked, name="other")) == {**data_of(asked), "name": "other"}


@pytest.mark.parametrize("kind", known())
def test_every_kind_says_what_it_asks(kind):
    first = (known()[kind].__doc__ or "").strip().split("\n")[0]
    assert len(first) > 20, f"{kind} has no line for the guide's reference page"


@pytest.mark.parametrize(
    ("defined", "lacking"),
    [
        ({}, r"must define steer\(\), found\(\), one key"),
        ({"steer": lambda self, point: []}, r"must define found\(\), one key"),
        ({"found": lambda self, loop: []}, r"must define steer\(\), one key"),
        (
            {"found": lambda self, loop: [], "steer": lambda self, point: []} | {"keys": (Key("a"), Key("b"))},
            "must define one key",
        ),
        (
            {"found": lambda self, loop: [], "steer": lambda self, point: []}
            | {"keys": (Key("decay_rate_at_least_per_s"),)},
            "is that of 'decay rate'",
        ),
    ],
)
def test_a_requirement_that_would_not_be_looked_at_is_refused(defined, lacking):
    with pytest.raises(InputError, match=lacking):
        register(type("Half", (Requirement,), {"kind": "half of one", **defined}))
    assert "half of one" not in known()


def test_a_goal_without_a_measure_is_refused():
    with pytest.raises(InputError, match=r"must define bind\(\), or steer\(\) and judge\(\)"):
        register(type("Empty", (Goal,), {"kind": "empty"}))


def test_goals_of_a_ride_and_of_loops_are_not_mixed(vehicles):
    heave = vehicles["heave"]
    with pytest.raises(InputError, match="'damping ratio' is asked of a vehicle's ride"):
        design(heave.with_goals([*heave.goals, Poles(decay=0.1)]), starts=1)


def test_the_ride_cost_is_made_small_and_not_limited():
    with pytest.raises(InputError, match="it cannot be hard"):
        RideCost(hard=True)
