"""Ratings of the motor and fuel of the fan: report, Appendix F, 4.3.1 and 6.2."""

import pytest

from workbench.errors import InfeasibleError, InputError
from workbench.physics.propulsion import MotorRating, coils_for, fuel_fraction

MOTOR = MotorRating(coil_force=1340.0, current=1500.0, coils=32)


def test_thirty_two_coils_give_the_printed_short_term_thrust():
    assert MOTOR.thrust == pytest.approx(64e3, abs=500)  # 6.2 prints 64 kN
    assert coils_for(64e3, 1340.0) == 32  # 6.2


def test_cruise_thrust_needs_the_printed_long_term_current():
    assert MOTOR.current_for(41e3) == pytest.approx(956, abs=0.5)  # 6.2 prints 0.956 kA-turns
    assert MOTOR.current_for(41e3) / MOTOR.current == pytest.approx(0.637, abs=5e-4)  # 6.2 prints 63.7 %


def test_current_is_proportional_to_thrust():
    assert MOTOR.current_for(MOTOR.thrust / 4) == pytest.approx(375.0, rel=1e-14)  # rounding


def test_thrust_above_the_rating_is_refused_with_the_coils_it_needs():
    with pytest.raises(InfeasibleError, match=r"32 coils give 64320 N at 1500 A\. Use at least 52 coils"):
        MOTOR.current_for(104e3)


def test_a_thrust_that_ten_coils_give_exactly_needs_ten():
    ten = MotorRating(coil_force=1143.3, current=1500.0, coils=10)
    assert coils_for(ten.thrust, ten.coil_force) == 10  # the quotient is 5.000000000000001 pairs in floating point


def test_fuel_for_two_hours_is_11_percent_of_the_vehicle_not_14():
    assert fuel_fraction(rate=2600 / 3600, duration=7200, mass=45_400) == pytest.approx(0.1145, abs=5e-5)
    assert fuel_fraction(rate=1.0, duration=10.0, mass=100.0, reserve=0.15) == pytest.approx(0.115, rel=1e-14)


def test_a_motor_without_coils_is_refused():
    with pytest.raises(InputError, match="coils must be a whole number of at least 1; got 0"):
        MotorRating(coil_force=1340.0, current=1500.0, coils=0)
