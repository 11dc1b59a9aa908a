"""A schedule: decimals that are what they print as, and gains that are the polynomials' values."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.control import GAIN_NAMES, Gains
from workbench.control.gains import TIME_CONSTANTS
from workbench.control.schedule import Schedule
from workbench.design.starts import CENTRE
from workbench.errors import InputError


def schedule(**changed) -> Schedule:
    coefficients = {name: (value, 0.1 * value, 0.01) for name, value in CENTRE.items()}
    return Schedule(centre=82.0, scale=52.0, range=(30.0, 134.0), coefficients=coefficients | changed, points=(30.0,))


@given(speed=st.floats(30.0, 134.0))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_the_gains_at_a_speed_are_the_exact_values_of_the_printed_polynomials(speed):
    s = schedule()
    printed = s.to_dict()
    t = (Fraction(repr(speed)) - Fraction(printed["centre"])) / Fraction(printed["scale"])
    for name, value in s.gains_at(speed).as_dict().items():
        exact = sum(Fraction(c) * t**k for k, c in enumerate(printed["coefficients"][name]))
        assert value == float(exact), name


def test_a_schedule_survives_its_own_decimals():
    s = schedule(K_h=(1.23456789, -np.pi, 1e-7 / 3))
    again = Schedule.from_dict(s.to_dict())
    assert again == s
    assert s.coefficients["K_h"] == (1.23457, -3.14159, 3.33333e-08)  # six significant digits, as printed
    assert set(s.to_dict()["coefficients"]) == set(GAIN_NAMES)


def test_a_constant_schedule_gives_the_same_gains_everywhere():
    gains = Gains(**CENTRE)
    s = Schedule.constant(gains, (30.0, 134.0), degree=2)
    assert s.degree == 2
    assert s.gains_at(30.0) == s.gains_at(99.9) == gains


@pytest.mark.parametrize("name", TIME_CONSTANTS)
def test_a_time_constant_that_vanishes_within_the_range_is_refused(name):
    # positive at both ends, −0.1 in the middle
    with pytest.raises(InputError, match=f"{name} must stay positive over the whole range .* falls to -0.1 s"):
        schedule(**{name: (-0.1, 0.0, 0.4)})


def test_a_speed_outside_the_range_is_refused():
    with pytest.raises(InputError, match=r"holds from 30 to 134 m/s; got 20\.0 m/s"):
        schedule().gains_at(20.0)


def test_a_schedule_without_one_of_the_seventeen_is_refused():
    with pytest.raises(InputError, match="missing K_yaw"):
        Schedule(centre=82.0, scale=52.0, range=(30.0, 134.0), coefficients=dict.fromkeys(GAIN_NAMES[:-1], (1.0,)))
    with pytest.raises(InputError, match="unknown gain 'K_hh'"):
        schedule(K_hh=(1.0, 0.0, 0.0))


def test_a_mapping_that_is_no_schedule_is_refused():
    with pytest.raises(InputError, match="must hold centre, scale, range"):
        Schedule.from_dict({"centre": "1"})
