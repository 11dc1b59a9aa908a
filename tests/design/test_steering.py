"""What is steered is what is judged, for every quantity that may be required; what a start meets is not refused."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.control.gains import TIME_CONSTANTS, Gains
from workbench.design.design import design, refine
from workbench.design.starts import CENTRE, SPLIT_CENTRE
from workbench.design.steering import TYPICAL, Programme
from workbench.design.verdict import margin_verdicts, verdicts
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.goals.ride.motor_current import MotorCurrent
from workbench.goals.ride.requirement import required_kinds, requirement, requirement_class

# Points at which a quantity is looked at, and the share of itself within which steering and judging agree there:
# the back-off is half a thousandth, of which the exchange leaves half, and a limit is moved by four times as much.
BACK_OFF, APART = 5e-4, 2e-3


@pytest.fixture(scope="module")
def problems():
    return {name: load_problem(name) for name in ("heave", "sway_roll_yaw", "hybrid_motor")}


def of(name, problems):
    """A problem that has the quantity."""
    if name == MotorCurrent.kind:
        return problems["hybrid_motor"]
    return problems["sway_roll_yaw" if "lateral" in name else "heave"]


def stable_points(problem, count, seed=0):
    """Seeded stable gains around a start, and the approved ones."""
    generator, out = np.random.default_rng(seed), [problem.approved]
    base = Gains(**(SPLIT_CENTRE if problem.law.split else CENTRE))
    while len(out) < count + 1:
        moved = {}
        for name in problem.free:
            value = getattr(base, name)
            step = generator.normal()
            moved[name] = value * np.exp(0.3 * step) if name in TIME_CONSTANTS else value + 0.3 * step * TYPICAL[name]
        gains = base.with_values(**problem.fixed, **moved)
        if analyse(problem.setting, gains).stable:
            out.append(gains)
    return out


def worst(problem, gains, name):
    """The judged value of one quantity, the worst group's."""
    one = problem.with_requirements([requirement(name, 1.0)])
    values = [v.value for v in verdicts(one, analyse(problem.setting, gains))]
    return max(values) if requirement_class(name).sense == "<=" else min(values)


def steered(problem, gains, name, limit):
    """Smallest row of one requirement at gains, after the exchange has had its say there."""
    programme = Programme(problem.with_requirements([requirement(name, limit)]), back_off=BACK_OFF)
    theta = np.array(list(gains.as_dict().values()))
    for _ in range(4):
        unseen = programme.unseen_at(theta)
        if not unseen:
            break
        programme = programme.with_added(unseen)
    rows = [value.min() for row, value, _ in programme.measure(theta).rows if row.startswith(name)]
    assert rows, f"{name} is not steered"
    return min(rows)


@pytest.mark.parametrize("name", required_kinds())
def test_steering_and_judging_agree_to_the_back_off(name, problems):
    problem = of(name, problems)
    for gains in stable_points(problem, 2 if problem.name == "heave" else 1):
        value = worst(problem, gains, name)
        if not 0 < value < np.inf:
            continue
        looser = 1 if requirement_class(name).sense == "<=" else -1
        assert steered(problem, gains, name, value * (1 + looser * APART)) > 0
        assert steered(problem, gains, name, value * (1 - looser * APART)) < 0


@pytest.mark.parametrize("name", [n for n in required_kinds() if n != MotorCurrent.kind and "lateral" not in n])
def test_gains_that_meet_a_requirement_are_not_refused_and_not_worsened(name, problems):
    problem = of(name, problems)
    for gains in stable_points(problem, 2, seed=1)[1:]:
        value = worst(problem, gains, name)
        if not 0 < value < np.inf:
            continue
        found = refine(problem.with_requirements([requirement(name, value)]), gains)  # met to the last digit
        assert all(v.met for v in found.requirements)
        # six printed digits of the gains, times how fast the cost changes with them away from its valley
        assert found.analysis.cost <= analyse(problem.setting, gains).cost * (1 + 1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in required_kinds() if n == MotorCurrent.kind or "lateral" in n])
def test_the_same_of_quantities_of_whole_vehicles(name, problems):
    problem = of(name, problems)
    gains = stable_points(problem, 1, seed=2)[1]
    asked = problem.with_requirements([requirement(name, worst(problem, gains, name))])
    found = refine(asked, gains)
    assert all(v.met for v in found.requirements)
    assert found.analysis.cost <= analyse(problem.setting, gains).cost * (1 + 1e-4)


def test_a_delay_margin_ten_times_that_of_the_problem_is_designed(problems):
    heave = problems["heave"]
    others = [r for r in heave.requirements if r.name != "delay margin"]
    found = design(heave.with_requirements([*others, requirement("delay margin", 0.020)]), starts=2)
    assert {v.name: v.value for v in found.requirements}["delay margin"] >= 0.020


@pytest.mark.parametrize("name", [n for n in required_kinds() if "lateral" in n or n == MotorCurrent.kind])
def test_what_a_problem_does_not_have_cannot_be_required(name, problems):
    with pytest.raises(InputError, match=r"can be required only (where .* moves sideways|of a vehicle whose)"):
        problems["heave"].with_requirements([requirement(name, 1.0)])


def test_a_vertical_mask_needs_a_point_that_moves_up_and_down():
    sway = load_problem("sway_roll_yaw")
    middle = replace(sway.setting, points={n: (x, 0.0, z) for n, (x, _, z) in sway.setting.points.items()})
    with pytest.raises(InputError, match="only where a point of the ride moves up and down"):
        sway.with_setting(middle).with_requirements([requirement("vertical ride mask ratio", 1.0)])


@pytest.mark.parametrize("name", required_kinds())
def test_no_requirement_vanishes_under_an_unfiltered_rate(name, problems):
    problem = of(name, problems)
    asked = problem.with_requirements([requirement(name, 1.0)])
    analysis = analyse(problem.setting, problem.approved.with_values(tau_h=0.0))
    found = verdicts(asked, analysis)
    assert found
    if name not in ("damping ratio", "decay rate"):
        assert not any(v.met for v in found)
        assert all("unfiltered rate" in v.sentence() or not analysis.stable for v in found)


def test_a_real_root_beyond_the_axis_counts_as_a_damping_ratio_of_minus_one(problems):
    heave = problems["heave"]
    # a gap taken for its opposite: the force falls where it should rise
    falling = heave.approved.with_values(K_h=-20.0, K_hdot=0.0, K_zddot=0.0, K_zdot=0.0)
    analysis = analyse(heave.setting, falling)
    assert max(p.real for p in analysis.poles if p.imag == 0) > 0
    asked = heave.with_requirements([requirement("damping ratio", 0.1)])
    assert verdicts(asked, analysis)[0].value == -1.0
    assert margin_verdicts(asked, falling)[0].value == -1.0


def test_the_stricter_of_two_limits_on_one_quantity_steers(problems):
    heave = problems["heave"]
    for limits in ((0.01, 0.02), (0.02, 0.01)):
        asked = heave.with_requirements([requirement("static gap error from bias", x) for x in limits])
        assert {n: r.limit for n, r in Programme(asked).asked.items()} == {"static gap error from bias": 0.01}


@pytest.mark.parametrize("name", ["heave", "sway_roll_yaw", "hybrid_motor"])
def test_gains_that_are_the_same_loop_are_the_same_start(name, problems):
    problem = problems[name]
    programme, own = Programme(problem), problem.approved
    factors = (3.0, 3.0) if problem.law.split else (3.0, 0.2)  # a law with actuators keeps one free scale
    for vertical, lateral in (factors, tuple(1 / f for f in factors)):
        other = own.rescaled(vertical=vertical, lateral=lateral)
        # a product and a quotient of doubles on the way
        np.testing.assert_allclose(programme.x(other), programme.x(own), rtol=1e-13, atol=1e-13)


def test_a_refinement_does_not_depend_on_the_scale_of_the_gains(problems):
    heave = problems["heave"]
    own = refine(heave, heave.approved)
    other = refine(heave, heave.approved.rescaled(vertical=0.3, lateral=7.0))
    assert other.analysis.cost == pytest.approx(own.analysis.cost, rel=1e-6)


def test_a_filter_whose_gain_is_fixed_at_zero_adds_no_root(problems):
    # the law drops it; with 4 s its root alone would keep every decay rate above 0.25 1/s out of reach
    heave = problems["heave"].with_fixed({"K_zdot": 0.0, "tau_z": 4.0})
    programme = Programme(heave)
    theta = np.array(list(heave.approved.with_values(K_zdot=0.0, tau_z=4.0).as_dict().values()))
    values = np.concatenate([group.eigenvalues(theta)[0] for group in programme.groups])
    exact = analyse(heave.setting, programme.gains(programme.x(heave.approved))).poles
    assert len(values) == len(exact)
    assert not np.isclose(values, -0.25).any()


def test_judging_a_value_at_its_limit_is_met():
    assert requirement("delay margin", 0.002).said(0.002, "").met
