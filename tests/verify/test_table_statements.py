"""What a table says besides its limits holds too, or is marked as said by its author alone."""

import copy
from fractions import Fraction
from math import comb

import pytest

from workbench.verify.check import verify_document
from workbench.verify.exact.failure import TableError
from workbench.verify.vehicle import tie
from workbench.verify.vehicle.table import table_of


def fault_of(heave, change) -> str:
    report = verify_document(heave.changed(change))
    assert not report.proved
    return " ".join(report.faults)


def test_a_pole_stated_in_the_place_of_another_is_a_fault(heave):
    def change(document):
        document["measured"]["poles"][0] = document["measured"]["poles"][-1]

    assert "stated twice" in fault_of(heave, change)


def test_a_mode_stated_twice_is_a_fault(heave):
    def change(document):
        document["measured"]["modes"] *= 2

    assert "stated twice" in fault_of(heave, change)


def boxed(document, **more):
    """A promise over a box that holds, with more in the box."""
    damping = next(p for p in document["promises"] if p["name"] == "damping ratio")
    low, high = damping["enclosure"]
    document["promises"].append(
        {**damping, "limit": 0.5 * low, "enclosure": [0.5 * low, high], "box": {"mass": [0.99, 1.01], **more},
         "at": {"mass": 1.0}}
    )  # fmt: skip
    return document["promises"][-1]


def test_the_box_with_nothing_wrong_holds(heave):
    assert verify_document(heave.changed(lambda d: boxed(d, yaw_inertia=[0.9, 1.1]))).proved


def test_a_member_lies_in_its_box_in_factors_that_reach_no_group_too(heave):
    def change(document):
        boxed(document, yaw_inertia=[0.9, 1.1])["at"]["yaw_inertia"] = 50.0

    assert "'yaw_inertia' = 50, outside its box" in fault_of(heave, change)


@pytest.mark.parametrize("interval", [[-5.0, 1.1], [0.0, 1.1], [1.1, 1.1]])
def test_a_box_is_one_of_vehicles_in_factors_that_reach_no_group_too(heave, interval):
    assert "'yaw_inertia' from" in fault_of(heave, lambda d: boxed(d, yaw_inertia=interval))


def test_what_is_left_undecided_may_be_so_for_a_factor_that_the_checker_does_not_know(heave):
    left = {
        "name": "damping ratio", "sense": ">=", "limit": 0.4, "box": {"cg_forward_m": [-0.5, 0.5]}, "share": 1.0,
        "reason": "no proof",
    }  # fmt: skip
    assert verify_document(heave.changed(lambda d: d["undecided"].append(left))).proved


@pytest.mark.parametrize("box", [{"mass": [-1e9, 1e9]}, {"mass": [1.1, 0.9]}, {"cg_forward_m": [0.5, -0.5]}])
def test_what_is_left_undecided_is_so_over_a_box_of_vehicles(heave, box):
    left = {"name": "damping ratio", "sense": ">=", "limit": 0.4, "box": box, "share": 0.0, "reason": ""}
    assert "known factors that rise" in fault_of(heave, lambda d: d["undecided"].append(left))


def test_words_of_the_author_are_marked_as_such(heave):
    def change(document):
        document["promises"][0]["method"] = "ball arithmetic: as I say"

    report = verify_document(heave.changed(change))
    assert report.proved
    where = {
        f"requirements.{i} ({r.name}).where" for i, r in enumerate(table_of(heave.document).requirements) if r.where
    }
    assert where
    assert {"promises.0.method", "law.sample_time_s", "data_sha256", "problem", *where} <= set(report.stated)
    assert "promises.1.method" not in report.stated


def test_a_current_that_the_plant_does_not_name_is_refused_by_name(heave):
    def change(document):
        names = document["plant"]["outputs"]
        names[names.index("current_1")] += " "

    with pytest.raises(TableError, match="must have 'current_1' among its outputs"):
        verify_document(heave.changed(change))


def far_off(part: dict, scale: int) -> dict:
    """The same polynomials in units of a much larger scale: exact, with coefficients as large as one likes."""
    part = copy.deepcopy(part)
    old = Fraction(part["scale"])
    part["scale"] = str(scale)
    for name, texts in part["coefficients"].items():
        grown = [Fraction(text) * (Fraction(scale) / old) ** k for k, text in enumerate(texts)]
        part["coefficients"][name] = [f"{float(c):.17g}" for c in grown]
    return part


def test_scheduled_gains_are_tied_to_the_tables_whatever_the_size_of_their_coefficients(heave):
    document = heave.document
    gains, speed = document["gains"], float(document["certificate"]["guideway"]["speed_m_s"])
    shape = [comb(4, k) * 1e-3 * (-1) ** k for k in range(5)]
    coefficients = {name: [text] for name, text in gains.items()}
    coefficients["K_h"] = [repr(float(gains["K_h"])), *(repr(c) for c in shape[1:])]
    schedule = {
        "variable": "speed", "unit": "m/s", "range": [repr(speed - 50), repr(speed)], "centre": repr(speed),
        "scale": "50", "points": [], "coefficients": coefficients, "forces": None,
    }  # fmt: skip

    def faults(part):
        return tie._schedule(table_of(document | {"schedule": part}))

    assert not faults(schedule)
    assert not faults(far_off(schedule, 10**9))
    schedule["coefficients"]["K_h"][0] = repr(float(gains["K_h"]) * (1 + 1e-6))
    assert "K_h" in faults(schedule)[0]
    assert "K_h" in faults(far_off(schedule, 10**9))[0]


def test_a_motor_is_stated_only_of_a_plant_that_has_one(heave, hybrid):
    motor = hybrid.document["certificate"]["motor"]
    assert "has no 'current_motor_d_right'" in fault_of(heave, lambda d: d["certificate"].update(motor=motor))
    assert not tie.faults_of(table_of(hybrid.document))


def test_speeds_of_the_schedule_that_no_promise_reaches_are_said(heave):
    document = heave.document
    gains = {name: [text] for name, text in document["gains"].items()}
    document["schedule"] = {
        "variable": "speed", "unit": "m/s", "range": ["1", "500"], "centre": "0", "scale": "1", "points": [],
        "coefficients": gains, "forces": None,
    }  # fmt: skip
    boxed(document)["box"] = {"speed": [100.0, 134.0]}
    document["promises"][-1]["at"] = {}
    said = verify_document(document).not_promised
    assert "speeds of the schedule outside 100 to 134 m/s; it goes from 1 to 500 m/s" in said


@pytest.mark.parametrize("kept", [1, 2])
def test_a_vehicle_with_fewer_coil_sets_than_commands_is_a_fault(heave, kept):
    def change(document):
        physics = document["certificate"]["physics"]
        physics["positions_m"] = physics["positions_m"][:kept]

    assert f"the law's 4 commands; its coil sets make {kept}" in fault_of(heave, change)


def test_a_vehicle_without_coil_sets_is_refused(heave):
    with pytest.raises(TableError, match="must be a list of 1 to 100 entries"):
        verify_document(heave.changed(lambda d: d["certificate"]["physics"].update(positions_m=[])))
