"""The report's selection of gains (C.4 to C.6) and the physics it leaves out."""

import numpy as np
import pytest

from workbench.control.loop.polynomial import loop_polynomial, roots_of
from workbench.design.procedure import double_root, filtered_start, heave_choice, unfiltered
from workbench.errors import InfeasibleError, InputError
from workbench.ledger.baseline import report_gains, report_law, report_model, report_vehicle
from workbench.ledger.effects import drag, effects
from workbench.physics.vehicle import linearise


def test_the_position_gain_of_a_0_6_hz_heave_mode_is_the_printed_one():
    # C.5: −2.155 and 0.15, with 0.6 Hz and 0.6 given to one digit; exactly −2.1558 and 0.1510
    choice = heave_choice(report_model().plant, report_law(), frequency_hz=0.6, damping=0.6)
    assert choice.K_h == pytest.approx(-2.1558, abs=5e-5)
    assert choice.rate == pytest.approx(0.1510, abs=5e-5)
    assert choice.passive_frequency_hz == pytest.approx(1.413, abs=5e-4)


@pytest.mark.parametrize(("frequency", "damping"), [(0.4, 0.7), (0.6, 0.6), (1.2, 0.3)])
def test_the_chosen_gains_give_the_wanted_root(frequency, damping):
    plant, law = report_model().plant, report_law()
    choice = heave_choice(plant, law, frequency_hz=frequency, damping=damping)
    gains = unfiltered(report_gains()).with_values(K_h=choice.K_h, K_hdot=choice.rate)
    root = roots_of(plant, law, "heave", gains)[0]
    assert abs(root) / (2 * np.pi) == pytest.approx(frequency, rel=1e-9)
    assert -root.real / abs(root) == pytest.approx(damping, rel=1e-9)


def test_the_double_root_lies_at_the_printed_gains():
    # C.6: K_Y ≈ 0.518, rate gain ≈ 0.294, three digits; the roll inertia was inferred from them
    found = double_root(report_model().plant, report_law(), report_gains(), free=("K_sway", ("K_hpdot", "K_ydot")))
    assert found.values == pytest.approx((0.5179, 0.2945), abs=5e-5)
    assert found.frequency_hz == pytest.approx(0.615, abs=5e-4)
    assert found.damping == pytest.approx(0.815, abs=5e-4)
    assert found.others[0] == pytest.approx([1.014, 0.685], abs=5e-4)


def test_with_and_without_filters_the_double_root_is_the_same():
    plant, law = report_model().plant, report_law()
    bare = double_root(plant, law, unfiltered(report_gains()), free=("K_sway", "K_hpdot"))
    filtered = double_root(plant, law, report_gains(), free=("K_sway", ("K_hpdot", "K_ydot")))
    assert filtered.values == pytest.approx(bare.values, rel=1e-8)
    assert filtered.root == pytest.approx(bare.root, rel=1e-6)  # a double root is known to half the digits


def test_at_a_double_root_polynomial_and_slope_vanish():
    plant, law = report_model().plant, report_law()
    found = double_root(plant, law, unfiltered(report_gains()), free=("K_sway", "K_hpdot"))
    p = np.polynomial.Polynomial(loop_polynomial(plant, law, "sway_roll_yaw", found.gains).characteristic())
    s = found.root
    for q, order in ((p, 6), (p.deriv(), 5)):
        largest = max(abs(c) * abs(s) ** k for k, c in enumerate(q.coef))
        assert abs(q(s)) < 1e-10 * largest, order  # residual of the solver, 1e-13, and rounding


def test_the_filtered_start_keeps_the_unfiltered_roots():
    plant, law = report_model().plant, report_law()
    bare = unfiltered(report_gains())
    for part in ("heave_pitch", "sway_roll_yaw"):
        slow = roots_of(plant, law, part, bare)
        filtered = roots_of(plant, law, part, filtered_start(bare, 0.637))
        nearest = np.abs(slow[:, None] - filtered[None, :]).min(axis=1)
        assert nearest.max() < 1e-8


def test_a_double_root_that_is_not_there_is_said_to_be_missing():
    plant, law = report_model().plant, report_law()
    with pytest.raises(InfeasibleError, match="needs two oscillating roots"):
        double_root(plant, law, report_gains(), free=("K_heave", "K_h"), part="heave")
    with pytest.raises(InfeasibleError, match="no double root was found"):
        double_root(plant, law, unfiltered(report_gains()), free=("K_heave", "K_pitch"))  # neither moves this group


def test_bad_wishes_are_refused():
    with pytest.raises(InputError, match="must be positive"):
        heave_choice(report_model().plant, report_law(), frequency_hz=-0.6, damping=0.6)
    with pytest.raises(InputError, match="time constant of the filters must be positive"):
        filtered_start(report_gains(), 0.0)
    with pytest.raises(InputError, match="unknown gain 'K_Y'; did you mean"):
        double_root(report_model().plant, report_law(), report_gains(), free=("K_Y", "K_hpdot"))


def test_the_gravity_term_makes_the_printed_gains_unstable_and_the_lag_barely_stable():
    # guide, Definitions: damping −0.023 without lag, +0.002 with 10 ms
    found = effects(report_vehicle(), report_law(), report_gains())
    assert found.effect("gravity in accelerometers").least_damping == pytest.approx(-0.023, abs=5e-4)
    assert found.effect("lag and gravity").least_damping == pytest.approx(0.002, abs=5e-4)
    assert not found.effect("gravity in accelerometers").stable
    assert found.effect("report").largest_shift == 0.0


def test_each_switch_acts_in_its_own_direction():
    found = effects(report_vehicle(), report_law(), report_gains())
    least = {name: found.effect(name).least_damping for name in ("report", "lift damping +", "lift damping -")}
    assert least["lift damping -"] < least["report"] < least["lift damping +"]
    assert found.effect("body-fixed thrust").largest_shift < 0.01  # T is 1 % of the stiffness over a metre
    assert len(found.effect("current lag").roots) == len(found.effect("report").roots) + 4
    with pytest.raises(InputError, match="unknown effect 'wind'"):
        found.effect("wind")


def test_what_the_vehicle_switches_on_is_listed_last():
    vehicle = report_vehicle().with_extras(current_lag=0.01, gravity_term=True)
    found = effects(vehicle, report_law(), report_gains())
    last = found.effects[-1]
    assert last.name == "as the vehicle has it"
    assert last.least_damping == pytest.approx(found.effect("lag and gravity").least_damping, rel=1e-9)


def test_the_drag_at_the_nominal_pose_is_that_of_appendix_a():
    # guide, Definitions: 4 (F_L0 + F_G0)/61.505 = 9.8 kN
    assert drag(report_vehicle()) == pytest.approx(9.8e3, abs=50)


def test_shorter_lateral_filters_cure_the_gravity_term():
    # our own number with 10 ms lag: 0.334 in place of 0.002; the tilt acts through the integrated acceleration
    tilted = linearise(report_vehicle().with_extras(gravity_term=True, current_lag=0.01)).plant
    roots = roots_of(tilted, report_law(), "sway_roll_yaw", report_gains().with_values(tau_y=0.2, tau_hp=0.2))
    assert (-roots.real / np.abs(roots)).min() == pytest.approx(0.334, abs=5e-4)
