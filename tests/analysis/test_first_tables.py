"""The tables that are read first: what is worst, what does not hold, what is alike."""

import math

import pytest

from workbench.analysis.first_tables import Limits, first_rows, first_tables
from workbench.analysis.frozen import Frozen
from workbench.analysis.nonlinear_ride import BentFigure, NonlinearRide
from workbench.analysis.reserves import NOTHING, Reserves
from workbench.analysis.sampled_cases import SampledCase
from workbench.analysis.variations import Varied
from workbench.lti.break_point import BreakPoint


def point(name, down, up, phase, delay, disk):
    return BreakPoint(point=name, gain_down=down, gain_up=up, phase=phase, delay=delay, disk=disk)


def varied(name, damping, decay, peak):
    return Varied(name=name, damping=damping, decay=decay, peaks={"one": peak})


def sampled(time, late, damping, decay, peak):
    return SampledCase(
        sample_time=time, delay_samples=late, damping=damping, decay=decay, peak_sensitivity={"one": peak}
    )


RESERVES = Reserves(
    break_points=(
        point("current:1", 0.0, 2.0, 0.6, 0.010, 0.9),
        point("current:2", 0.0, 2.0, 0.6, 0.010, 0.9),
        point("modal:sway", 0.5, math.inf, math.inf, 0.004, 0.3),
    ),
    variations=(
        varied("mass:0.85", 0.4, 0.3, 2.0), varied("lost:1", 0.05, 0.2, 2.5), varied("dead:gap_1", -1.0, -8.0, None),
    ),
    sampled=(sampled(1e-3, 0.0, 0.41, 0.31, 1.9), sampled(2e-3, 1.0, 0.35, 0.31, 2.2)),
    frozen=(
        Frozen(heave=0.0, sway=0.0, current=0.0, damping=0.4, decay=0.3),
        Frozen(heave=0.1, sway=0.0, current=0.1, damping=-0.2, decay=-1.0),
        Frozen(heave=0.2, sway=0.0, current=None, damping=None, decay=None),
    ),
)  # fmt: skip
RIDE = NonlinearRide(
    cost=44.0, cost_ratio=1.1, figures=(BentFigure("gap, front", "m", 0.02, 0.03, 1.5),), contacts_per_hour=2.5,
    distance=0.15, sigma=0.03, sigmas=5.0, where="floor, set 1",
)  # fmt: skip


def table(title, *arguments):
    return next(t for t in first_tables(*arguments) if t.title.startswith(title))


def words(row):
    return [cell.marked for cell in row]


def test_the_worst_margin_of_each_column_is_marked_and_equal_points_share_a_row():
    pair, sway = table("Margins", RESERVES).rows
    assert words(pair) == ["current:1, 2", "0", "▸2", "▸34.38", "10", "0.9"]
    assert words(sway) == ["modal:sway", "▸0.5", "–", "–", "▸4", "▸0.3"]  # what nothing limits is never the worst


def test_what_does_not_survive_is_named_and_bad():
    failures = table("What survives", RESERVES)
    assert failures.words == "1 of 3 are unstable: dead:gap_1"
    assert [row[1].text for row in failures.rows] == ["survives", "survives", "UNSTABLE"]
    assert [row[0].bad for row in failures.rows] == [False, False, True]
    assert [row[2].worst for row in failures.rows] == [False, False, True]
    assert [row[4].worst for row in failures.rows] == [False, True, False]  # an unstable loop has no peak


@pytest.mark.parametrize(
    ("limits", "verdicts"),
    [
        (None, ["kept", "kept"]),
        (Limits(damping=0.4, decay=0.3, peak_sensitivity=2.0), ["kept", "missed"]),
        (Limits(damping=0.42), ["missed", "missed"]),
        (Limits(peak_sensitivity=1.0), ["missed", "missed"]),
    ],
)
def test_a_sampled_loop_is_held_against_the_limits_of_the_nominal_one(limits, verdicts):
    found = table("The loop as it is sampled", RESERVES, None, limits)
    assert [row[1].text for row in found.rows] == verdicts
    assert found.words.startswith(f"{verdicts.count('kept')} of 2 keep")


def test_poses_that_are_unstable_or_cannot_be_flown_are_counted():
    frozen = table("The loop frozen", RESERVES)
    assert frozen.words == "1 of 3 are unstable; 1 cannot be flown."
    assert [row[1].marked for row in frozen.rows] == ["0.4", "▸-0.2", "–"]
    assert [row[1].bad for row in frozen.rows] == [False, True, False]


def test_contacts_and_ratios_of_the_ride_stand_beside_the_linear_figures():
    ride = table("Ride with forces that bend", RESERVES, RIDE)
    assert "2.5 contacts an hour" in ride.words
    assert "150 mm or 5.0 standard deviations" in ride.words
    assert words(ride.rows[0])[1:] == ["40", "44", "1.1"]
    assert words(ride.rows[1])[1:] == ["0.02", "0.03", "▸1.5"]


def test_the_first_rows_name_the_smallest_of_each_table():
    assert [(name, value) for name, value, _ in first_rows(RESERVES, RIDE)] == [
        ("smallest disk margin, modal:sway", 0.3),
        ("least damping under a change, dead:gap_1", -1.0),
        ("least damping as sampled, 2 ms, 1 sample late", 0.35),
        ("least damping at a gap offset, +0.10 m, +0.00 m", -0.2),
        ("contacts per hour, expected", 2.5),
        ("nonlinear over linear cost", 1.1),
    ]


def test_of_nothing_there_is_no_table():
    assert first_tables(NOTHING) == ()
    assert first_rows(NOTHING) == []
