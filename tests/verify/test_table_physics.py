"""The plant derived a second time, from the vehicle beside it: every shipped vehicle and every extra effect."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.files.problem import load_problem, shipped_problems
from workbench.handover.table.agreement import agreement
from workbench.handover.table.certificate import certificate_of, exact_plant
from workbench.handover.table.table import table_from_design
from workbench.lti import Plant
from workbench.physics.vehicle.carried import check_carried
from workbench.verify.vehicle.physics import Physics, differences
from workbench.verify.vehicle.tie import _carried


@pytest.mark.parametrize(
    "name", sorted({*shipped_problems()} - {"hybrid_motor"} & {"report_1975", "heave", "comfort_limit"})
)
def test_the_plant_of_a_shipped_vehicle_follows_from_its_numbers(name):
    problem = load_problem(name)
    physics = certificate_of(problem)["physics"]
    assert physics is not None
    assert differences(exact_plant(problem.setting.plant), Physics.read(physics)) == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["coil_vehicle", "two_coil_corner"])
def test_the_plant_of_a_vehicle_on_exact_coils_follows_from_its_slopes(name):
    problem = load_problem(name)
    physics = certificate_of(problem)["physics"]
    assert physics is not None
    assert bool(physics["joined"]) == (name == "two_coil_corner")


@pytest.mark.parametrize(
    "extras",
    [
        {"current_lag": 0.0, "gravity_term": False},
        {"coil_length": 3.0},
        {"thrust": 35e3},
        {"lift_damping": 900.0, "lateral_damping": -400.0},
        {"bank_reading": "section"},
    ],
)
def test_every_extra_effect_of_the_vehicle_is_derived_alike(extras):
    problem = load_problem("comfort_limit")
    changed = problem.with_vehicle(problem.vehicle.with_extras(**extras))
    physics = certificate_of(changed)["physics"]
    assert physics is not None  # the checker rebuilds the plant with the effect …
    assert differences(exact_plant(problem.setting.plant), Physics.read(physics))  # … and sees that it matters


def test_a_millionth_of_one_stiffness_is_seen_and_named():
    problem = load_problem("heave")
    physics = Physics.read(certificate_of(problem)["physics"])
    plant = problem.setting.plant
    A = plant.A.copy()
    A[plant.index("states", ["Y_rate"])[0], plant.index("states", ["Psi"])[0]] *= 1 + 1e-6
    other = Plant(A=A, B=plant.B, C=plant.C, D=plant.D, states=plant.states, inputs=plant.inputs, outputs=plant.outputs)
    ((matrix, row, column, size),) = differences(exact_plant(other), physics)
    assert (matrix, row, column) == ("A", "Y_rate", "Psi")
    assert size == pytest.approx(1e-6, rel=1e-3)  # of 1e-6, as changed
    fewer = plant.select(outputs=plant.outputs[:-1])
    assert differences(exact_plant(fewer), physics)[0][:2] == ("outputs", plant.outputs[-1])


def test_a_vehicle_trimmed_away_from_its_nominal_pose_stands_without_physics():
    import dataclasses

    problem = load_problem("heave")
    plant = problem.setting.plant
    moved = Plant(
        A=plant.A * 1.001, B=plant.B, C=plant.C, D=plant.D, states=plant.states, inputs=plant.inputs,
        outputs=plant.outputs,
    )  # fmt: skip
    setting = dataclasses.replace(problem.setting, plant=moved)
    assert certificate_of(problem.with_setting(setting))["physics"] is None


def test_a_table_agrees_with_its_problem_and_not_with_another(heave):
    problem = load_problem("heave")
    same = agreement(heave.document, problem)
    assert same.holds
    assert same.data_sha256_ok
    assert same.plant_difference is not None
    assert same.plant_difference < 1e-15  # the table's plant is the same right and left; the problem's but for rounding
    other = agreement(heave.document, load_problem("report_1975"))
    assert not other.holds
    assert not other.data_sha256_ok
    assert any("the plant rebuilt from 'report_1975' must be the table's to 1e-9" in s for s in other.disagreements)
    assert "differs" in repr(other) or "data as in the table" in repr(other)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda d: d["certificate"]["guideway"]["spectra"]["A1"].update(strength="1e-9"), "guideway differ"),
        (lambda d: d["certificate"]["sensors"].update(accelerometer_bias_m_s2="0.001"), "sensors differ"),
        (lambda d: d["law"].update(depth_m="1.22"), "the control law's places and sample time"),
        (lambda d: d["promises"].pop(0), "every requirement of 'heave' must be promised; 'damping ratio' >= 0.5"),
        (lambda d: d["promises"][0].update(limit=0.1), "every requirement of 'heave' must be promised"),
        (lambda d: d["plant"]["outputs"].__setitem__(0, "other"), "their signals differ"),
        (lambda d: d.update(title="Certified for passengers"), "the title must be that of 'heave'"),
    ],
)
def test_what_a_forger_would_change_disagrees_with_the_problem(heave, change, sentence):
    found = agreement(heave.changed(change), load_problem("heave"))
    assert any(sentence in one for one in found.disagreements)


def test_a_table_is_written_with_its_certificate(heave):
    table = table_from_design(heave.design)
    assert table.certificate is not None
    assert table.certificate.groups == ["heave"]
    assert table.certificate.guideway is not None
    assert table.certificate.guideway.spectra["A1"].strength == "1.5e-06"
    # corner 0.1 Hz at 134 m/s
    assert float(table.certificate.guideway.spectra["A1"].corners_rad_m[0]) == pytest.approx(2 * np.pi * 0.1 / 134)
    assert table.certificate.motor is None


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        (lambda d: d["lift"].__setitem__(0, "111350"), "a force down of -600 N"),
        (lambda d: d.update(positions_m=[[str(float(x) + 1.2), y] for x, y in d["positions_m"]]), "a pitch moment of"),
        (lambda d: d.update(positions_m=[[x, "-0.5" if y[0] == "-" else y] for x, y in d["positions_m"]]), "a roll"),
        (lambda d: d.update(positions_m=[[x, y.lstrip("-")] for x, y in d["positions_m"]]), "a force to the right"),
    ],
)
def test_forces_that_do_not_carry_the_vehicle_are_a_fault_as_they_are_when_it_is_read(change, kind):
    document = certificate_of(load_problem("heave"))["physics"]
    assert _carried(Physics.read(document)) == []
    change(document)
    assert any(kind in fault for fault in _carried(Physics.read(document)))
    vehicle = load_problem("heave").vehicle
    law = replace(vehicle.force_law, lift=tuple(map(float, document["lift"])))
    places = tuple((float(x), float(y)) for x, y in document["positions_m"])
    with pytest.raises(InputError, match="must carry the weight"):
        check_carried(vehicle.with_values(force_law=law, positions=places))
