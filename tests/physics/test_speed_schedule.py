"""The schedule of least peak power: closed form, optimal control and quadrature against each other."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from workbench.constants import GRAVITY
from workbench.errors import InfeasibleError, InputError
from workbench.physics.propulsion import (
    Demand,
    DragLaw,
    constant_acceleration,
    least_power_schedule,
    optimised_schedule,
)

PRINTED = DragLaw(magnetic=2e5, aerodynamic=1.3)  # report, Appendix F, 3.2
RUN = constant_acceleration(PRINTED, mass=45_400.0, initial_speed=30.0, final_speed=134.0, acceleration=0.05 * GRAVITY)


def demand(**changed) -> Demand:
    given = {
        "law": PRINTED,
        "mass": 45_400.0,
        "initial_speed": 30.0,
        "final_speed": 134.0,
        "acceleration_limit": 0.15 * GRAVITY,
    }
    if "distance" not in changed:
        given["time"] = RUN.time
    return Demand(**(given | changed))


CASES = {
    "same time": (demand(), 5.872e6),
    "same time, motor's thrust": (demand(thrust_limit=64.32e3), 6.168e6),
    "same distance": (demand(distance=RUN.distance), 6.235e6),
}


@pytest.mark.parametrize(("case", "power"), CASES.values(), ids=CASES)
def test_least_peak_power_is_the_one_of_an_independent_calculation(case, power):
    # worked out separately by quadrature and root finding; four digits
    assert least_power_schedule(case).peak_power == pytest.approx(power, abs=0.5e3)


@pytest.mark.parametrize("case", [case for case, _ in CASES.values()], ids=CASES)
def test_optimal_control_finds_the_closed_form(case):
    exact, solved = least_power_schedule(case), optimised_schedule(case)
    # trapezoidal rule at 400 elements: 1.6e-5 at most; it overestimates time, so the power is above
    assert 0 < solved.peak_power / exact.peak_power - 1 < 3e-5
    assert solved.marginal_power == pytest.approx(exact.marginal_power, rel=2e-3)  # first order in the element
    assert solved.distance == pytest.approx(exact.distance, rel=1e-4)
    assert solved.energy == pytest.approx(exact.energy, rel=1e-4)


def test_error_of_the_optimal_control_falls_with_the_square_of_the_element():
    exact = least_power_schedule(demand()).peak_power
    coarse, fine = (optimised_schedule(demand(), elements=n).peak_power - exact for n in (50, 200))
    assert coarse / fine == pytest.approx(16, rel=0.2)  # the corner falls inside an element, hence not exactly 16


def by_partial_fractions(numerator, denominator, start, end):
    """∫ N(u)/Q(u) du: every root r of Q contributes N(r)/Q'(r) log((end − r)/(start − r))."""
    r = np.roots(denominator)
    residue = np.polyval(numerator, r) / np.polyval(np.polyder(denominator), r)
    return float((residue @ (np.log(end - r + 0j) - np.log(start - r + 0j))).real)


@pytest.mark.parametrize("case", [case for case, _ in CASES.values()], ids=CASES)
def test_every_stretch_takes_the_time_and_distance_of_its_antiderivative(case):
    # with u = √v, the integrands m dv/(T − D) and m v dv/(P − D v) are rational in u: C_m u and C_a u⁶ are D v
    m, schedule = 2 * case.mass, least_power_schedule(case)
    for stretch in schedule.stretches:
        ends = math.sqrt(stretch.initial_speed), math.sqrt(stretch.final_speed)
        if stretch.limit == "power":
            numerators, Q = ([m, 0, 0, 0], [m, 0, 0, 0, 0, 0]), [-1.3, 0, 0, 0, 0, -2e5, schedule.peak_power]
        elif stretch.limit == "thrust":
            numerators, Q = ([m, 0, 0], [m, 0, 0, 0, 0]), [-1.3, 0, 0, 0, case.thrust_limit, -2e5]
        else:
            assert stretch.time * case.acceleration_limit == pytest.approx(ends[1] ** 2 - ends[0] ** 2, rel=1e-12)
            continue
        # quadrature asked for 1e-12; the logarithms lose three digits by cancellation
        assert stretch.time == pytest.approx(by_partial_fractions(numerators[0], Q, *ends), rel=1e-10)
        assert stretch.distance == pytest.approx(by_partial_fractions(numerators[1], Q, *ends), rel=1e-10)


def test_time_given_is_the_time_taken_and_power_is_constant_from_the_corner_on():
    schedule = least_power_schedule(demand())
    assert schedule.time == pytest.approx(RUN.time, rel=1e-12)  # root of a smooth function
    assert [stretch.limit for stretch in schedule.stretches] == ["acceleration", "power"]
    late = schedule.speeds > schedule.corner_speed
    assert schedule.powers[late] == pytest.approx(schedule.peak_power, rel=1e-12)
    assert np.all(schedule.powers[~late] <= schedule.peak_power * (1 + 1e-12))


def test_the_schedule_needs_30_percent_less_power_than_constant_acceleration_and_more_distance():
    schedule = least_power_schedule(demand())
    assert 1 - schedule.peak_power / RUN.peak_power == pytest.approx(0.303, abs=5e-3)
    assert schedule.distance == pytest.approx(22.65e3, abs=10)


def test_energy_is_kinetic_energy_plus_the_work_of_drag_along_the_sampled_way():
    schedule = least_power_schedule(demand(thrust_limit=64.32e3), samples=2000)
    drag = 2e5 / np.sqrt(schedule.speeds) + 1.3 * schedule.speeds**2
    work = np.sum((drag[1:] + drag[:-1]) / 2 * np.diff(schedule.positions))
    kinetic = 45_400.0 * (134.0**2 - 30.0**2) / 2
    assert schedule.energy == pytest.approx(kinetic + work, rel=1e-6)  # trapezoidal rule over 4000 steps


@pytest.mark.parametrize("kind", ["time", "distance"])
def test_marginal_power_is_the_slope_of_the_peak_power(kind):
    allowed = RUN.time if kind == "time" else RUN.distance
    step = 1e-4 * allowed
    less, more = (least_power_schedule(demand(**{kind: allowed + sign * step})).peak_power for sign in (-1, 1))
    slope = least_power_schedule(demand(**{kind: allowed})).marginal_power
    assert slope == pytest.approx((more - less) / (2 * step), rel=1e-6)  # central difference, error of second order


def test_thrust_and_acceleration_limits_exchange_where_drag_dips():
    # drag is least at 68 m/s: between two speeds on either side, and only there, 98 kN allow 0.15 g
    schedule = least_power_schedule(demand(thrust_limit=98e3, time=130.0))
    assert [stretch.limit for stretch in schedule.stretches] == ["thrust", "acceleration", "power"]
    hurried = least_power_schedule(demand(thrust_limit=98e3, time=75.0))
    assert [stretch.limit for stretch in hurried.stretches] == ["thrust", "acceleration", "thrust", "power"]
    _, inside, outside, _ = hurried.stretches
    for speed in (inside.initial_speed, outside.initial_speed):
        # both limits hold at the exchange; root to 1e-12 m/s
        assert float(PRINTED.force(speed)) + 45_400.0 * 0.15 * GRAVITY == pytest.approx(98e3, rel=1e-10)


@settings(max_examples=15, deadline=None)
@given(
    magnetic=st.floats(0.0, 3e5),
    aerodynamic=st.floats(0.0, 2.0),
    slack=st.floats(1.001, 5.0),
    thrust=st.floats(1.01, 5.0),
)
def test_every_schedule_keeps_all_limits_and_meets_the_time(magnetic, aerodynamic, slack, thrust):
    assume(magnetic + aerodynamic > 1e-3)
    law = DragLaw(magnetic=magnetic, aerodynamic=aerodynamic)
    cap = thrust * law.largest(30.0, 134.0)[1]
    fastest = demand(law=law, thrust_limit=cap, time=1e9)
    with pytest.raises(InfeasibleError) as refusal:
        least_power_schedule(demand(law=law, thrust_limit=cap, time=1e-3))
    least = float(str(refusal.value).split("at least ")[1].split(" s")[0])
    schedule = least_power_schedule(demand(law=law, thrust_limit=cap, time=slack * least))
    drag = magnetic / np.sqrt(schedule.speeds) + aerodynamic * schedule.speeds**2
    acceleration = (schedule.thrusts - drag) / 45_400.0
    assert schedule.time <= slack * least * (1 + 1e-9)
    assert np.all(acceleration <= fastest.acceleration_limit * (1 + 1e-9))
    assert np.all(acceleration > 0)
    assert np.all(schedule.thrusts <= cap * (1 + 1e-12))
    assert np.all(np.diff(schedule.times) > 0)


def test_a_drag_that_only_falls_lets_the_acceleration_limit_in_late():
    law = DragLaw(magnetic=2e5, aerodynamic=0.0)
    schedule = least_power_schedule(demand(law=law, thrust_limit=95e3, time=80.0))
    assert [stretch.limit for stretch in schedule.stretches] == ["thrust", "acceleration", "power"]
    # D(v) = 95 kN − 0.15 m g at the exchange, solved by hand for v
    assert schedule.stretches[1].initial_speed == pytest.approx(
        (2e5 / (95e3 - 45_400.0 * 0.15 * GRAVITY)) ** 2, rel=1e-10
    )


def test_unlimited_time_ends_at_the_power_that_holds_the_final_speed():
    schedule = least_power_schedule(demand(time=1e5))
    assert schedule.peak_power == pytest.approx(134.0 * float(PRINTED.force(134.0)), rel=2e-12)  # 1e-12 above it
    assert schedule.time < 1e5
    assert schedule.marginal_power is None


def test_the_fastest_schedule_itself_is_allowed():
    with pytest.raises(InfeasibleError) as refusal:
        least_power_schedule(demand(time=1.0))
    least = 104.0 / (0.15 * GRAVITY)  # constant acceleration throughout: no thrust limit
    assert f"must be at least {least:.6g} s" in str(refusal.value)
    schedule = least_power_schedule(demand(time=least))
    assert schedule.marginal_power is None
    assert schedule.peak_power == pytest.approx(
        134.0 * (45_400.0 * 0.15 * GRAVITY + float(PRINTED.force(134.0))), rel=1e-12
    )


@pytest.mark.parametrize(
    ("changed", "error", "sentence"),
    [
        ({"thrust_limit": 37e3}, InfeasibleError, "limit is 37000 N and the drag at 134 m/s is 40620.2 N"),
        ({"final_speed": 20.0}, InputError, "final speed must exceed the initial one"),
        ({"time": None}, InputError, "give a time or a distance, one of the two"),
        ({"time": 100.0, "distance": 1e4}, InputError, "give a time or a distance, one of the two"),
        ({"acceleration_limit": math.inf}, InputError, "acceleration_limit must be a finite number"),
        ({"mass": -1.0}, InputError, "mass must be positive; got -1 kg"),
    ],
)
def test_demands_that_cannot_be_met_or_make_no_sense_are_refused(changed, error, sentence):
    with pytest.raises(error, match=sentence):
        demand(**changed)


@pytest.mark.parametrize("solve", [least_power_schedule, optimised_schedule])
def test_too_short_a_distance_is_refused_with_the_shortest_one(solve):
    with pytest.raises(InfeasibleError, match=r"the distance must be at least 12\d{3}\.?\d* m"):
        solve(demand(distance=5e3, thrust_limit=64.32e3))


def test_too_few_elements_are_refused():
    with pytest.raises(InputError, match="elements must be a whole number of at least 10; got 3"):
        optimised_schedule(demand(), elements=3)
