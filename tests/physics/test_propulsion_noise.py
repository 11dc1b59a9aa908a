"""Noise of fans and engines: report, Appendix E."""

import casadi as ca
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.physics.propulsion import Source, Step, at_distance, energy_sum, noise_budget, of_units, report_sources

level = st.floats(20.0, 130.0)


def test_two_fans_and_two_engines_of_86_decibels_make_92():
    sources = report_sources(fan_level=86.0, engine_level=86.0)
    assert noise_budget(sources).overall == pytest.approx(92, abs=0.5)  # E.5


def test_two_fans_and_two_engines_of_80_decibels_make_86():
    assert noise_budget(report_sources()).overall == pytest.approx(86, abs=0.5)  # E.5


def test_fans_of_63_and_engines_of_68_decibels_make_69():
    assert energy_sum((63.0, 68.0)) == pytest.approx(69, abs=0.5)  # E.5


def test_all_steps_of_technology_lead_to_the_printed_69_decibels():
    last = noise_budget(report_sources(), technology="cleaner inlet").projections[-1]
    assert last.levels == pytest.approx((63, 68), abs=0.5)  # E.5
    assert last.overall == pytest.approx(69, abs=0.5)


def test_steps_with_a_number_in_the_text_leave_the_fans_at_68_not_63():
    before = noise_budget(report_sources()).projections[2]
    assert before.technology == "better treatment"
    assert before.levels == pytest.approx((68, 68), abs=0.5)


def test_treatment_hides_20_decibels_of_the_fan_and_13_of_the_engine():
    fans, engines = report_sources(fan_level=86.0, engine_level=86.0)
    assert (fans.untreated_level, engines.untreated_level) == (106.0, 99.0)  # E.3, E.4: 20 and 13 dB


@given(levels=st.lists(level, min_size=1, max_size=6))
def test_sum_is_at_least_the_loudest_and_at_most_as_if_all_were(levels):
    total = energy_sum(levels)
    # 1e-9 dB: rounding of logarithms
    assert max(levels) - 1e-9 <= total <= of_units(max(levels), len(levels)) + 1e-9


@given(a=level, b=level, c=level)
def test_order_and_grouping_of_a_sum_do_not_matter(a, b, c):
    assert energy_sum((a, energy_sum((b, c)))) == pytest.approx(energy_sum((c, b, a)), abs=1e-9)  # rounding


def test_equal_units_are_a_sum_of_equal_levels():
    assert of_units(70.0, 4) == pytest.approx(energy_sum([70.0] * 4), abs=1e-12)


def test_doubling_the_distance_takes_off_six_decibels():
    assert at_distance(80.0, 2 * 15.24) == pytest.approx(80 - 6.0206, abs=5e-5)  # 20 log₁₀ 2
    assert at_distance(80.0, 15.24) == 80.0


def test_levels_take_symbols():
    x = ca.SX.sym("x")
    f = ca.Function("f", [x], [energy_sum([x, at_distance(x, 30.48)]), ca.gradient(energy_sum([x, x + 3]), x)])
    total, slope = f(80.0)
    assert float(total) == pytest.approx(energy_sum([80.0, at_distance(80.0, 30.48)]), abs=1e-12)
    assert float(slope) == pytest.approx(1.0, abs=1e-12)  # all sources a decibel louder: the sum too


def test_a_limit_between_two_steps_is_met_by_the_later_one_only():
    kept = {
        t: noise_budget(report_sources(), limit=70.0, technology=t).met for t in ("better treatment", "cleaner inlet")
    }
    assert kept == {"better treatment": False, "cleaner inlet": True}


def test_without_a_limit_there_is_no_margin_and_nothing_to_miss():
    budget = noise_budget(report_sources())
    assert budget.met
    assert budget.margin is None


def test_a_step_applies_only_to_the_sources_that_have_it():
    quiet = Source(name="blower", level=70.0, units=1, steps=(Step(name="lining", reduction=7.0),))
    plain = Source(name="pump", level=60.0, units=1)
    last = noise_budget((quiet, plain), technology="lining").projections[-1]
    assert last.levels == pytest.approx((63.0, 60.0), abs=1e-12)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: noise_budget(()), "at least one source"),
        (lambda: noise_budget(report_sources(), technology="cleaner inlett"), "did you mean 'cleaner inlet'"),
        (lambda: noise_budget(report_sources(), distance=0.0), "distance must be positive"),
        (lambda: report_sources(fans=0), "units of the fans must be a whole number of at least 1; got 0"),
        (lambda: report_sources(fan_level=float("nan")), "level of the fans must be a finite number"),
        (lambda: Step(name="lining", reduction=-1.0), "reduction of step 'lining' must not be negative"),
    ],
)
def test_input_that_makes_no_sense_is_refused(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()
