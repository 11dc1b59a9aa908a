"""Promises over all speeds of a schedule travel in the table and are proved again from it."""

import json

import numpy as np
import pytest
from flint import fmpq

from workbench.files.problem import load_problem, shipped_problems
from workbench.handover.table.certificate import force_difference
from workbench.handover.table.promise import with_schedule
from workbench.handover.table.table import GainTable, digest_of
from workbench.verify.check import verify_document
from workbench.verify.exact.failure import TableError
from workbench.verify.vehicle.loop import closed_loop
from workbench.verify.vehicle.scheduled import ScheduledLoop
from workbench.verify.vehicle.table import table_of

SPEEDS = (100.0, 134.0)


def speed_part(coefficients):
    return {
        "variable": "speed", "unit": "m/s", "range": ["100.0", "134.0"], "centre": "117.0", "scale": "17.0",
        "coefficients": coefficients,
    }  # fmt: skip


def falling_forces(document):
    """The certificate's forces at the upper end, a tenth less force per current at the lower one."""
    physics = document["certificate"]["physics"]
    out = {}
    for kind in ("lift", "lateral", "moment"):
        for k, text in enumerate(physics[kind]):
            value = float(text)
            out[f"{kind},{k}"] = [repr(0.95 * value), repr(0.05 * value)] if k == 4 else [repr(value)]
    out["lift_to_drag"] = [repr(1 / float(physics["drag_ratio"]))]
    return {**speed_part(out), "relative_error": dict.fromkeys(out, 0.0), "nodes": ["100.0", "134.0"]}


@pytest.fixture(scope="module")
def scheduled(heave):
    document = heave.document
    document["schedule"] = speed_part({name: [text] for name, text in document["gains"].items()}) | {"points": []}
    table = with_schedule(GainTable.model_validate(document), falling_forces(document))
    written = table.to_dict()

    def changed(change=lambda d: None):
        copy = json.loads(json.dumps(written))
        change(copy)
        copy["digest"] = digest_of(copy)
        return copy

    return changed


def over_speeds(report):
    return {f.name: f for f in report.findings if f.box}


def test_promises_over_all_speeds_are_proved_again_from_the_table(scheduled):
    report = verify_document(scheduled())
    assert report.proved
    found = over_speeds(report)
    assert set(found) == {"damping ratio", "peak sensitivity, heave_pitch"}
    assert found["damping ratio"].box == {"speed": SPEEDS}


def test_at_the_certificates_own_speed_the_rebuilt_loop_is_the_printed_one(scheduled):
    table = table_of(scheduled())
    loop = ScheduledLoop(table, "heave", {"speed": (fmpq(100), fmpq(134))})
    p = loop.poles.at((fmpq(134),))
    roots = np.roots([float(c) for c in reversed(p.coeffs())])
    printed = np.linalg.eigvals([[float(x) for x in row] for row in closed_loop(table, "heave").A.tolist()])
    # 1e-6: roots of a polynomial in doubles
    np.testing.assert_allclose(np.sort_complex(roots), np.sort_complex(printed), rtol=1e-6)


def test_a_schedule_that_fails_between_its_ends_is_refused(scheduled):
    def dips(document):  # the same gains at both ends; in the middle the integrated acceleration has the other sign
        value = float(document["gains"]["K_zdot"])
        document["schedule"]["coefficients"]["K_zdot"] = [repr(-0.2 * value), "0", repr(1.2 * value)]

    report = verify_document(scheduled(dips))
    assert not any(f.holds for f in over_speeds(report).values())
    nominal = [f for f in report.findings if not f.box]
    assert all(f.holds for f in nominal)  # at cruise all is well: only the range fails


def test_a_claim_for_more_speeds_than_the_schedule_has_is_not_proved(scheduled):
    def wider(document):
        for p in document["promises"]:
            if p["box"]:
                p["box"] = {"speed": [90.0, 134.0]}

    found = over_speeds(verify_document(scheduled(wider)))
    assert {f.verdict for f in found.values()} == {"not proved"}
    assert "must rise and lie within the schedule's" in found["damping ratio"].reason


def test_without_forces_nothing_is_proved_over_speeds(scheduled):
    found = over_speeds(verify_document(scheduled(lambda d: d["schedule"].update(forces=None))))
    assert "does not say how the coil forces change" in found["damping ratio"].reason
    found = over_speeds(verify_document(scheduled(lambda d: d.update(schedule=None))))
    assert "needs a schedule in the table" in found["damping ratio"].reason


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda s: s.update(variable="mass"), "schedule.variable must be 'speed'"),
        (lambda s: s["coefficients"].pop("K_h"), "schedule.coefficients.K_h must be a list of 1 to 13"),
        (lambda s: s["coefficients"].update(K_h=["1"] * 14), "must be a list of 1 to 13 entries; got 14"),
        (lambda s: s.update(scale="0"), "schedule is not usable"),
        (lambda s: s["forces"]["coefficients"].pop("lift,4"), "schedule.forces.coefficients.lift,4 must be a list"),
    ],
)
def test_a_schedule_of_wrong_shape_is_refused_by_key(scheduled, change, sentence):
    with pytest.raises(TableError, match=sentence):
        verify_document(scheduled(lambda d: change(d["schedule"])))


@pytest.mark.slow
def test_forces_over_speed_that_are_not_the_problems_are_noticed():
    folder = shipped_problems()["scheduled_vehicle"]
    forces = json.loads((folder / "approved.json").read_text(encoding="utf-8"))["schedule"]["forces"]
    problem = load_problem("scheduled_vehicle")
    largest, wrong = force_difference(forces, problem, speeds=3)
    assert wrong == ""
    assert largest < 1e-4  # what degree 8 leaves from 30 to 134 m/s
    forces["coefficients"]["lateral,4"][0] = repr(1.01 * float(forces["coefficients"]["lateral,4"][0]))
    assert "'lateral,4' at" in force_difference(forces, problem, speeds=3)[1]
