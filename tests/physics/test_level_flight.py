"""Force law against speed and height: ratios, ampere-turns, trim, lift-off, drag."""

import math
from dataclasses import replace

import pytest

from workbench.errors import InfeasibleError, InputError
from workbench.physics.coils import Conductor, plane_forces
from workbench.physics.forces.energy import REPORT_COILS
from workbench.physics.forces.flight import REPORT_LEVITATION, Levitation, drag_at, drag_peak, lift_off_speed, trim
from workbench.physics.forces.operating import REPORT_WEIGHT, ampere_turns, law_at, speed_ratios
from workbench.physics.forces.pose import coil_set_forces


def test_the_printed_ampere_turns_carry_the_printed_weight():
    # A.3: KNI = (444800/2.4091)^½ = 429.69, five printed digits
    assert ampere_turns(law_at(), REPORT_WEIGHT) == pytest.approx(429.69e3, abs=5.0)


def test_report_ratios_hold_at_one_speed_and_height_only():
    ratios = speed_ratios(134.0, 0.3, "report")
    assert (ratios.lift_ratio, ratios.lift_to_drag) == (0.8380, 61.505)  # A.3
    for speed, gap in ((133.0, 0.3), (134.0, 0.31)):
        with pytest.raises(InputError, match=r"physics 'report' must stay at 134 m/s and h = 0.3 m"):
            speed_ratios(speed, gap, "report")


def test_scaled_ratios_are_the_reports_at_the_reports_point():
    scaled, report = (speed_ratios(134.0, 0.3, physics) for physics in ("scaled", "report"))
    assert scaled.lift_ratio == pytest.approx(report.lift_ratio, rel=1e-14)
    assert scaled.lift_to_drag == pytest.approx(report.lift_to_drag, rel=1e-14)


def test_scaled_and_slab_ratios_differ_by_one_factor_everywhere():
    factors = [
        speed_ratios(speed, gap, "scaled").lift_ratio / speed_ratios(speed, gap, "slab").lift_ratio
        for speed, gap in ((20.0, 0.3), (134.0, 0.4), (60.0, 0.25))
    ]
    assert factors == pytest.approx([0.8380 / speed_ratios(134.0, 0.3, "slab").lift_ratio] * 3, rel=1e-12)


def test_slab_ratios_are_those_of_the_endless_plate():
    plate = plane_forces(0.5, 3.0, 0.35, 80.0, REPORT_LEVITATION.conductor)
    law = law_at(80.0, 0.35, 0.3, "slab")
    assert law.lift_ratio == plate.lift_ratio
    assert law.drag_ratio == pytest.approx(plate.drag_ratio, rel=1e-14)


def test_the_trimmed_vehicle_carries_its_weight():
    for hold in ("current", "gap"):
        flight = trim(60.0, "slab", hold)
        assert 4 * flight.law.forces(0.0, 0.0, 0.0, 0.0)[0] == pytest.approx(REPORT_WEIGHT, rel=1e-8)
    assert trim(60.0, "slab", "gap").gap == 0.3
    assert trim(60.0, "slab", "current").current == 429.69e3


def test_at_134_metres_per_second_the_scaled_vehicle_flies_at_the_reports_height():
    flight = trim(134.0, "scaled")
    # 429.69 kA-turns is rounded to 2e-8 of (KNI)²·…: 1e-5 of the weight, over 8/m of relative stiffness
    assert flight.gap == pytest.approx(0.3, abs=2e-6)
    # guide, Definitions: drag by Appendix A: 4 (F_L0 + F_G0)/61.505
    assert flight.drag == pytest.approx(9810, abs=2)


def test_a_faster_vehicle_flies_higher_with_less_drag():
    slow, fast = trim(40.0), trim(120.0)
    assert fast.gap > slow.gap
    assert fast.drag < slow.drag


def test_lift_off_is_where_the_trim_gap_is_the_minimum():
    speed = lift_off_speed(0.2, "slab")
    assert trim(speed, "slab").gap == pytest.approx(0.2, abs=1e-7)  # root tolerances 1e-8 in ln v, 1e-10 in gap


def test_the_drag_peak_is_higher_than_drag_beside_it():
    speed, peak = drag_peak("slab")
    assert peak >= max(drag_at(0.95 * speed, "slab"), drag_at(1.05 * speed, "slab"))
    assert drag_at(speed, "slab") == pytest.approx(peak, rel=1e-9)


def test_drag_of_a_vehicle_on_a_thin_sheet_is_lift_times_w_over_v():
    sheet = Conductor(thickness=0.0254, conductivity=3.422e7, model="thin")
    levitation = replace(REPORT_LEVITATION, conductor=sheet)
    lift, lateral, _ = levitation.law(50.0, "slab").forces(0.0, 0.0, 0.0, 0.0)
    expected = 4 * (lift + lateral) * sheet.characteristic_speed / 50.0
    assert drag_at(50.0, "slab", levitation) == pytest.approx(expected, rel=1e-12)  # L/D = v/w exactly


def test_a_load_too_heavy_is_infeasible_and_says_by_how_much():
    heavy = replace(REPORT_LEVITATION, weight=1e8)
    with pytest.raises(InfeasibleError, match=r"lift must reach the weight of 1e\+08 N; at 134 m/s it reaches"):
        trim(134.0, "slab", levitation=heavy)
    with pytest.raises(InfeasibleError, match=r"at a gap of 0.3 m; at any speed it stays below"):
        lift_off_speed(0.3, "slab", replace(REPORT_LEVITATION, current=3e5))


def test_the_record_of_a_pose_agrees_with_the_law():
    record = coil_set_forces(0.32, 0.28, 0.01, 0.1, 100.0, "slab")
    law = law_at(100.0, 0.32, 0.28, "slab")
    assert (record.lift_n, record.lateral_n, record.roll_moment_n_m) == law.forces(0.0, 0.0, 0.01, 0.1)
    assert record.drag_n == law.drag(0.0, 0.0, 0.01, 0.1)
    assert record.current[0] == law.current_action(roll=0.01, alpha=0.1)[0]


def test_the_stiffness_leaves_out_the_slope_of_the_lift_ratio_and_says_how_much():
    above, here, below = (coil_set_forces(h=h, physics="slab") for h in (0.3005, 0.3, 0.2995))
    full = (above.lift_n - below.lift_n) / 0.001
    left_out = here.lift_n * here.lift_ratio_by_height / here.lift_ratio
    assert here.stiffness[0][0] + left_out == pytest.approx(full, rel=1e-5)  # third derivative times (0.5 mm)²
    assert left_out / here.stiffness[0][0] == pytest.approx(-0.028, abs=0.001)  # three percent, softer


@pytest.mark.parametrize(
    ("build", "sentence"),
    [
        (lambda: coil_set_forces(h=math.nan), "h must be a finite number; got nan"),
        (lambda: coil_set_forces(h=-0.3), "h must be positive, the coil flies above the floor; got -0.3 m"),
        (lambda: coil_set_forces(h_prime=-0.3), "the wall stands on the side of the near winding"),
        (lambda: coil_set_forces(h=0.08, physics="slab"), "the coils must stay clear of the guideway"),
        (lambda: coil_set_forces(h=0.2, roll=0.6, physics="slab"), "the coils must stay clear of the guideway"),
        (lambda: coil_set_forces(speed=2.0, physics="slab"), r"must not be below lift-off \(4.66 m/s for 444800 N"),
        (lambda: coil_set_forces(speed=0.0, physics="slab"), "the speed must be positive and finite; got 0.0 m/s"),
        (lambda: coil_set_forces(physics="slabs"), "unknown physics 'slabs'; did you mean 'slab'"),
        (lambda: trim(134.0, "report"), "physics 'report' must hold the gap"),
        (lambda: trim(134.0, hold="height"), "unknown quantity to hold 'height'"),
        (lambda: Levitation(weight=0.0), "Levitation.weight must be positive and finite; got 0.0 N"),
        (lambda: Levitation(sets=0), "Levitation.sets must be at least 1; got 0"),
        (lambda: ampere_turns(law_at(), -1.0), "weight and number of coil sets must be positive; got -1.0 N"),
    ],
)
def test_what_cannot_fly_is_refused_with_a_sentence(build, sentence):
    with pytest.raises(InputError, match=sentence):
        build()


def test_report_coils_are_the_printed_ones():
    # A.3: 0.5 m × 3.0 m, control coil 0.1 m below
    assert (REPORT_COILS.width, REPORT_COILS.length, REPORT_COILS.control_offset[2]) == (0.5, 3.0, -0.1)
