"""Degrees of families come from the equations: never below the truth, and no larger than they must be."""

import json

import pytest
from flint import fmpq

from workbench.files.problem import shipped_problems
from workbench.verify.vehicle.degree import degrees_of
from workbench.verify.vehicle.scheduled import ScheduledLoop
from workbench.verify.vehicle.table import table_of

SPEEDS = {"speed": (fmpq(30), fmpq(134))}


def test_degrees_in_the_factors_are_those_of_the_ranks():
    vertical, lateral = degrees_of("heave_pitch", 2), degrees_of("sway_roll_yaw", 2)
    assert (vertical["mass"], vertical["pitch_inertia"], vertical["inertia"]) == (1, 1, 1)
    assert (vertical["current_force"], vertical["gap_force"], vertical["vertical_sensors"]) == (2, 2, 2)
    assert (lateral["inertia"], lateral["gap_force"], lateral["current_force"]) == (2, 3, 2)
    assert (lateral["vertical_sensors"], lateral["lateral_sensors"]) == (1, 2)  # roll alone is read vertically
    assert degrees_of("heave", 1)["current_force"] == 1
    assert "pitch_inertia" not in degrees_of("heave", 1)


@pytest.fixture(scope="module")
def document():
    return json.loads((shipped_problems()["scheduled_vehicle"] / "approved.json").read_text(encoding="utf-8"))


def test_the_degree_in_the_speed_is_attained_by_the_shipped_schedule(document):
    loop = ScheduledLoop(table_of(document), "heave_pitch", SPEEDS)
    assert loop.poles.degrees == (loop.degree,)


def test_a_term_too_small_for_any_sample_still_raises_the_degree(document):
    plain = ScheduledLoop(table_of(document), "heave_pitch", SPEEDS).degree
    document = json.loads(json.dumps(document))
    document["schedule"]["coefficients"]["K_h"] += ["0"] * 9 + ["1e-35"]
    crafted = ScheduledLoop(table_of(document), "heave_pitch", SPEEDS)
    assert crafted.degree == plain + 2 * (12 - 2)  # K_h acts through heave and through pitch


def test_a_filter_whose_gain_passes_through_zero_stays(document):
    document = json.loads(json.dumps(document))
    document["schedule"]["coefficients"]["K_zdot"] = ["0.0", "1.0"]  # zero at 82 m/s, a node of every even degree
    loop = ScheduledLoop(table_of(document), "heave_pitch", SPEEDS)
    orders = {loop.closed(fmpq(v), loop.schedule.at(v)).A.nrows() for v in (56, 82, 108)}
    assert len(orders) == 1
    assert loop.poles.order == orders.pop()
