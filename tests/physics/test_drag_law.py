"""Drag, power and the run at constant acceleration: report, Appendix F, 3.1 and 3.2."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.constants import GRAVITY
from workbench.errors import InputError
from workbench.physics.propulsion import DragLaw, constant_acceleration, drag_curves

MASS, G05 = 45_400.0, 0.05 * GRAVITY
LAW = DragLaw.from_thrusts(mass=MASS, slow=(30.0, 60e3), acceleration=G05, fast=(134.0, 41e3))
PRINTED = DragLaw(magnetic=2e5, aerodynamic=1.3)


def test_two_thrusts_give_the_printed_constants():
    # 3.2 prints 2 × 10⁵ and 1.3: half a unit of the last digit
    assert LAW.magnetic == pytest.approx(2e5, abs=5e4)
    assert LAW.aerodynamic == pytest.approx(1.3, abs=0.05)


def test_lift_off_thrust_read_as_drag_alone_misses_the_printed_constant():
    assert DragLaw.from_drags(slow=(30.0, 60e3), fast=(134.0, 41e3)).magnetic > 3e5


def test_the_law_passes_through_the_points_it_is_made_from():
    # two linear equations solved in closed form: rounding only
    assert float(LAW.force(30.0)) == pytest.approx(60e3 - MASS * G05, rel=1e-13)
    assert float(LAW.force(134.0)) == pytest.approx(41e3, rel=1e-13)


def test_both_parts_are_equal_at_the_crossover_speed():
    v = PRINTED.crossover_speed
    assert v == pytest.approx(118.8, abs=0.05)  # 3.2 prints 117; its printed constants give 118.8
    assert float(PRINTED.magnetic_drag(v)) == pytest.approx(float(PRINTED.aerodynamic_drag(v)), rel=1e-13)


def test_the_drag_derivative_vanishes_at_the_speed_of_least_drag():
    v = ca.SX.sym("v")
    slope = ca.Function("slope", [v], [ca.gradient(LAW.force(v), v)])
    # two terms of about 180 N/(m/s) cancel: 1e-9 is rounding
    assert float(slope(LAW.least_drag_speed)) == pytest.approx(0.0, abs=1e-9)


def test_lift_to_drag_ratio_reaches_far_beyond_the_printed_11_to_12():
    curves = drag_curves(LAW, np.linspace(30.0, 134.0, 209), mass=MASS)
    best = curves.lift_to_drag.argmax()
    assert curves.lift_to_drag[0] == pytest.approx(11.8, abs=0.05)
    assert curves.lift_to_drag[best] == pytest.approx(14.65, abs=0.05)
    assert curves.lift_to_drag[-1] == pytest.approx(10.86, abs=0.05)
    assert curves.speed[best] == pytest.approx(LAW.least_drag_speed, abs=0.5)  # grid of 0.5 m/s


def test_aerodynamic_part_of_the_frontal_area_has_a_drag_coefficient_of_a_quarter():
    assert PRINTED.drag_coefficient(8.5) == pytest.approx(0.25, abs=0.005)  # 2·1.3/(1.225·8.5) = 0.2497


def test_numbers_and_symbols_give_the_same_drag():
    v = ca.SX.sym("v")
    symbolic = ca.Function("drag", [v], [LAW.force(v), LAW.power(v)])
    curves = drag_curves(LAW, [40.0, 90.0], mass=MASS)
    for speed, drag, power in zip(curves.speed, curves.drag, curves.power, strict=True):
        # same operations on the same numbers, in another order
        assert [float(x) for x in symbolic(speed)] == pytest.approx([drag, power], rel=1e-14)
        assert float(LAW.force(speed)) == pytest.approx(drag, rel=1e-14)


@given(v=st.floats(1.0, 200.0), scale=st.floats(0.1, 10.0))
def test_each_part_scales_with_its_own_power_of_speed(v, scale):
    # exponents −1/2 and 2 of eq. (1); rounding only
    assert float(LAW.magnetic_drag(scale * v)) == pytest.approx(float(LAW.magnetic_drag(v)) * scale**-0.5, rel=1e-12)
    assert float(LAW.aerodynamic_drag(scale * v)) == pytest.approx(float(LAW.aerodynamic_drag(v)) * scale**2, rel=1e-12)


def test_constant_acceleration_takes_the_printed_time_and_power_but_a_shorter_distance():
    run = constant_acceleration(LAW, mass=MASS, initial_speed=30.0, final_speed=134.0, acceleration=G05)
    assert run.time == pytest.approx(212, abs=0.5)  # 3.2
    assert run.peak_power == pytest.approx(8.5e6, abs=5e4)  # 3.2
    assert run.distance == pytest.approx(17.39e3, abs=5)  # 3.2 prints 17.6 km


def test_energy_of_the_run_is_the_integral_of_thrust_over_distance():
    from scipy.integrate import quad

    run = constant_acceleration(LAW, mass=MASS, initial_speed=30.0, final_speed=134.0, acceleration=G05)
    work, _ = quad(lambda v: (MASS * G05 + float(LAW.force(v))) * v / G05, 30.0, 134.0)
    assert run.energy == pytest.approx(work, rel=1e-10)  # quad's own tolerance is 1.5e-8, reached far better here


def test_fast_drag_outside_the_law_is_refused_with_the_range_it_must_lie_in():
    with pytest.raises(InputError, match=r"must lie between 5000 N \(all magnetic\) and 160000 N \(all aerodynamic\)"):
        DragLaw.from_drags(slow=(20.0, 10e3), fast=(80.0, 4e3))
    with pytest.raises(InputError, match="must lie between"):
        DragLaw.from_drags(slow=(20.0, 10e3), fast=(80.0, 170e3))


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: DragLaw(magnetic=-1.0, aerodynamic=1.0), "DragLaw.magnetic must not be negative; got -1"),
        (lambda: DragLaw(magnetic=float("nan"), aerodynamic=1.0), "DragLaw.magnetic must be a finite number"),
        (lambda: DragLaw(magnetic=0.0, aerodynamic=0.0), "must have some drag"),
        (lambda: DragLaw.from_drags(slow=(30.0, 1e4), fast=(30.0, 2e4)), "slower than the fast one"),
        (
            lambda: DragLaw.from_thrusts(mass=MASS, slow=(30.0, 2e4), acceleration=G05, fast=(134.0, 41e3)),
            "must exceed mass times acceleration, 22261.1 N; got 20000 N",
        ),
        (lambda: drag_curves(LAW, [0.0, 1.0], mass=MASS), "must be a list of positive numbers"),
        (
            lambda: constant_acceleration(LAW, mass=MASS, initial_speed=5.0, final_speed=5.0, acceleration=1.0),
            "final speed must exceed the initial one",
        ),
    ],
)
def test_input_that_makes_no_sense_is_refused(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()


def test_a_law_with_one_part_only_has_no_crossover():
    assert DragLaw(magnetic=0.0, aerodynamic=1.0).crossover_speed is None
    assert DragLaw(magnetic=1.0, aerodynamic=0.0).least_drag_speed is None
