"""Tables that once passed and are false: each is refused, and by what it is false in."""

import copy
import json

import numpy as np
import pytest
from flint import fmpq, fmpq_mat
from plain_loop import PlainLoop

from workbench.files.problem import load_problem, shipped_problems
from workbench.handover.table.agreement import agreement
from workbench.handover.table.promise import with_box
from workbench.handover.table.table import GainTable, digest_of
from workbench.verify.check import verify_document
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.pole import boundary_kept
from workbench.verify.vehicle.physics import Physics
from workbench.verify.vehicle.scheduled import ScheduledLoop
from workbench.verify.vehicle.table import table_of
from workbench.verify.vehicle.uncertain import UncertainLoop


def faults(document):
    return verify_document(document).faults


def shipped(name):
    return json.loads((shipped_problems()[name] / "approved.json").read_text(encoding="utf-8"))


def signed(document):
    document["digest"] = digest_of(document)
    return document


def test_a_promise_listed_twice_hides_no_other(revenue):
    def twice(document):
        peaks = [p for p in document["promises"] if p["name"] == "peak sensitivity, heave_pitch"]
        document["promises"] = [p for p in document["promises"] if p["name"] != "peak sensitivity, sway_roll_yaw"]
        document["promises"] += copy.deepcopy(peaks)

    document = revenue.changed(twice)
    said = faults(document)
    assert any("'peak sensitivity, heave_pitch' is promised twice" in one for one in said)
    assert any("'peak sensitivity, sway_roll_yaw' <= 2 is required and not promised" in one for one in said)
    found = agreement(document, load_problem("comfort_limit"))
    assert any("'peak sensitivity, sway_roll_yaw' <= 2 is not" in one for one in found.disagreements)


def test_a_group_left_out_is_missed_in_the_figures_and_against_the_problem(revenue):
    def without(document):
        document["certificate"]["groups"] = ["heave_pitch"]
        for part in ("promises", "requirements"):
            said = [(p["name"] + p.get("where", ""), p) for p in document[part]]
            document[part] = [p for words, p in said if "lateral gap" not in words and "sway_roll_yaw" not in words]

    document = revenue.changed(without)
    report = verify_document(document)
    assert any("sway_roll_yaw is stated, and the table has no such group" in one for one in report.faults)
    assert "any motion in Psi: no group of the table moves it" in report.not_promised
    assert not agreement(document, load_problem("comfort_limit")).holds


def test_a_motion_held_is_said_and_is_not_the_problems(heave, revenue):
    assert "any motion in Theta: no group of the table moves it" in verify_document(heave.document).not_promised
    held = revenue.changed(lambda d: d["certificate"].update(groups=["heave", "sway_roll_yaw"]))
    assert any("derived again" in one or "stated" in one for one in faults(held))
    assert any("groups differ" in one for one in agreement(held, load_problem("comfort_limit")).disagreements)


@pytest.mark.parametrize(
    ("letter", "row", "column"),
    [
        ("A", "Phi_rate", "Z"),
        ("A", "Z_rate", "current_1"),
        ("B", "Z_rate", "zeta_1"),
        ("C", "gap_1", "Theta"),
        ("D", "gap_1", "zeta_1"),
    ],
)
def test_nothing_may_pass_between_the_groups_not_even_through_currents_and_inputs(revenue, letter, row, column):
    def coupled(document):
        plant = document["plant"]
        document["certificate"]["physics"] = None  # taken as printed: no vehicle to compare with
        i = plant["states" if letter in "AB" else "outputs"].index(row)
        j = plant["states" if letter in "AC" else "inputs"].index(column)
        plant[letter][i][j] = repr(float(plant[letter][i][j]) * (1 + 1e-12) + 1e-13)

    assert any("the same right and left in every digit" in one for one in faults(revenue.changed(coupled)))


@pytest.mark.parametrize(("at", "value", "sentence"), [
    (("measured", "peak_sensitivity", "sway_roll_yaw"), 1.2, "the peak derived again lies elsewhere"),
    (("measured", "rms", "gap", "front"), 0.01, "measured.rms.gap.front is stated as 0.01"),
    (("measured", "by_type", "A2", "current", "rear"), 0.01, "measured.by_type.A2.current.rear"),
    (("measured", "static_error", "gap"), 0.001, "measured.static_error.gap"),
    (("measured", "sensor_noise_rms", "current"), 1e-9, "measured.sensor_noise_rms.current"),
    (("measured", "stable"), False, "measured.stable is stated as False"),
    (("measured", "poles", 3), [-1.0, 0.5], "measured.poles.3 is no pole"),
    (("measured", "modes", 2, "damping"), 0.9, "measured.modes.2.damping"),
    (("requirements", 0, "value"), 0.45, "requirements.0 (damping ratio).value"),
    (("requirements", 0, "met"), False, "is said to be not met"),
])  # fmt: skip
def test_forged_figures_are_derived_again(revenue, at, value, sentence):
    def forged(document):
        node = document
        for key in at[:-1]:
            node = node[key]
        node[at[-1]] = value

    assert any(sentence in one for one in faults(revenue.changed(forged)))


def test_a_forged_case_of_the_robustness_is_derived_again_and_what_cannot_be_is_said():
    document = shipped("heave")
    document["robustness"]["mass +15 %"]["damping"] = 0.7
    assert any("robustness.mass +15 %.damping is stated as 0.7" in one for one in faults(signed(document)))
    document = shipped("heave")
    document["robustness"]["fog"] = {"damping": 0.9}
    report = verify_document(signed(document))
    assert report.proved
    assert "robustness.fog" in report.stated
    assert "measured.cost" in report.stated


def test_figures_that_the_checker_does_not_derive_are_derived_from_the_problem(heave):
    document = heave.changed(lambda d: d["measured"].update(cost=0.1))
    (sentence,) = agreement(document, load_problem("heave")).disagreements
    assert "measured.cost is stated as 0.1" in sentence


@pytest.mark.parametrize("lift", ["25000.0", "500000.0"])
def test_a_vehicle_that_its_coil_forces_do_not_carry_is_refused(revenue, lift):
    document = revenue.changed(lambda d: d["certificate"]["physics"]["lift"].__setitem__(0, lift))
    assert any("must carry the weight" in one for one in faults(document))


def test_a_vehicle_that_its_coil_forces_do_not_hold_level_is_refused(revenue):
    document = revenue.changed(lambda d: d["certificate"]["physics"].update(drag_ratio="10.0"))
    assert any("they leave a pitch moment of" in one for one in faults(document))


def test_the_laws_places_are_those_of_the_plants_sensors(revenue):
    def longer(document):  # with other modal gains the loop is the same, and the wheel base is not
        for place in document["law"]["positions_m"]:
            place[0] = repr(2 * float(place[0]))
        for name in ("K_pitch", "K_yaw"):
            document["gains"][name] = repr(float(document["gains"][name]))

    assert any("the plant's sensors stand elsewhere" in one for one in faults(revenue.changed(longer)))


def test_no_box_is_proved_of_a_loop_that_accelerations_close_at_once(heave):
    document = heave.document
    plant, states = document["plant"], document["plant"]["states"]
    document["certificate"]["physics"]["current_lag_s"] = "0.0"
    system = Physics.read(document["certificate"]["physics"]).plant()
    document["plant"] = {kind: list(getattr(system, kind)) for kind in ("states", "inputs", "outputs")} | {
        k: [[repr(float(int(e.p) / int(e.q))) for e in row] for row in getattr(system, k).tolist()] for k in "ABCD"
    }
    assert len(document["plant"]["states"]) == len(states) - 4 < len(plant["inputs"])
    table = table_of(document)
    with pytest.raises(NotProved, match="accelerations pass straight to the commands"):
        UncertainLoop(table, "heave", {"mass": (fmpq(9, 10), fmpq(11, 10))})


def test_a_true_box_over_the_yaw_inertia_alone_is_proved(revenue):
    table = with_box(GainTable.model_validate(revenue.document), {"yaw_inertia": (0.99, 1.01)})
    assert len([p for p in table.promises if p.box]) == 4
    assert verify_document(table.to_dict()).proved


def test_sensor_scales_are_factors_like_any_other_and_their_corners_attain_no_more(heave):
    table = with_box(GainTable.model_validate(heave.document), {"vertical_sensors": (0.95, 1.05)})
    promise = next(p for p in table.promises if p.box and p.name == "damping ratio")
    worst = []
    for scale in (0.95, 1.0, 1.05):
        document = heave.document
        for name in ("K_h", "K_hdot", "K_zddot", "K_zdot"):
            document["gains"][name] = repr(scale * float(document["gains"][name]))
        worst.append(PlainLoop(document).damping())
    assert promise.enclosure[0] <= min(worst)
    assert promise.enclosure[1] == pytest.approx(min(worst), rel=1e-9)


def test_a_pole_exactly_on_its_limit_keeps_it_and_one_beyond_does_not():
    slow = fmpq_mat([[fmpq(-1, 4), fmpq(3)], [fmpq(0), fmpq(-2)]])
    assert boundary_kept(slow, fmpq(1, 4), ray=False)
    assert not boundary_kept(slow, fmpq(250001, 1000000), ray=False)
    swinging = fmpq_mat([[fmpq(0), fmpq(1)], [fmpq(-1), fmpq(-1, 2)]])  # s² + s/2 + 1: ζ = 1/4, decay 1/4
    assert boundary_kept(swinging, fmpq(1, 4), ray=True)
    assert boundary_kept(swinging, fmpq(1, 4), ray=False)
    assert not boundary_kept(swinging, fmpq(250001, 1000000), ray=True)
    twin = fmpq_mat([[fmpq(-1, 4), fmpq(1)], [fmpq(0), fmpq(-1, 4)]])
    assert boundary_kept(twin, fmpq(1, 4), ray=False)


def scheduled(change):
    document = shipped("scheduled_vehicle")
    document["promises"] = [p for p in document["promises"] if not p["box"]]  # what is refused here needs no long proof
    document["robustness"] = {}
    change(document)
    return faults(signed(document))


@pytest.mark.slow
def test_scheduled_gains_and_forces_are_those_of_the_table_at_its_own_speed():
    assert scheduled(lambda d: None) == ()
    other = scheduled(lambda d: d["schedule"]["coefficients"]["K_roll"].__setitem__(0, "1.81"))
    assert any("the schedule's gains at 134 m/s must be the table's; K_roll" in one for one in other)

    def weaker(document):
        lift = document["schedule"]["forces"]["coefficients"]["lift,4"]
        lift[0] = repr(0.99 * float(lift[0]))

    assert any("coil forces at 134 m/s must be the vehicle's" in one for one in scheduled(weaker))


def erring(share, shift=0.0):
    """Heave and pitch at the upper speeds, the lift per current off by a share of its largest value."""
    document = shipped("scheduled_vehicle")
    forces = document["schedule"]["forces"]
    forces["relative_error"] = dict.fromkeys(forces["relative_error"], 0.0) | {"lift,4": share}
    loop = ScheduledLoop(table_of(document), "heave_pitch", {"speed": (fmpq(100), fmpq(134))})
    if shift:
        size = float(loop.forces.polynomials.largest("lift,4"))
        first = forces["coefficients"]["lift,4"]
        first[0] = repr(float(first[0]) + shift * size)
        loop = ScheduledLoop(table_of(document), "heave_pitch", {"speed": (fmpq(100), fmpq(134))})
    return loop


@pytest.mark.slow
def test_a_stated_error_of_the_forces_counts_against_what_is_promised_over_the_speeds():
    assert erring(0.0).error is None
    assert erring(0.2).error.keeps_region(fmpq(1, 10), fmpq(0))
    assert not erring(5.0).error.keeps_region(fmpq(1, 10), fmpq(0))


def response(loop, speed, omega):
    A, B, C = loop.loop(fmpq(speed), loop.schedule.at(speed), ())
    A, B, C = (np.array([[float(e) for e in row] for row in M.tolist()]) for M in (A, B, C))
    poles = np.linalg.eigvals(A)
    return np.eye(2) + C @ np.linalg.solve(1j * omega * np.eye(len(A)) - A, B), (-poles.real / np.abs(poles)).min()


@pytest.mark.slow
def test_no_vehicle_within_the_stated_error_is_worse_than_was_bounded():
    loop, farthest = erring(0.2), 0.0
    growth = float(loop.error.growth())
    for shift in (-0.2, 0.2):
        other = erring(0.2, shift)
        for speed in (100, 117, 134):
            for omega in np.geomspace(0.1, 300, 40):
                S, damping = response(other, speed, omega)
                assert damping > 0.1  # proved above for every one of them
                farthest = max(farthest, float(np.linalg.norm(S - response(loop, speed, omega)[0], 2)))
    assert 0.01 * growth < farthest < growth
    with pytest.raises(NotProved, match="too large for a bound"):
        erring(5.0).error.growth()


@pytest.mark.parametrize("name", ["robust_vehicle", "scheduled_vehicle"])
def test_boxes_and_ranges_narrower_than_the_problems_are_missed(name):
    problem, document = load_problem(name), shipped(name)
    if document["schedule"]:
        document["schedule"]["forces"] = None  # whose trims take half a minute and are another test's
    for part in ("promises", "undecided"):
        for one in document[part]:
            for key, (low, high) in one["box"].items():
                one["box"][key] = [low, low + 0.9 * (high - low)]
    found = agreement(document, problem)
    assert any("must be promised" in one and "or said to be undecided there" in one for one in found.disagreements)


def test_a_schedule_taken_out_is_missed_unless_one_speed_was_asked_for():
    problem, document = load_problem("scheduled_vehicle"), shipped("scheduled_vehicle")
    document["schedule"] = None
    for part in ("promises", "undecided"):
        document[part] = [one for one in document[part] if "speed" not in one["box"]]
    assert any("at every speed" in one for one in agreement(document, problem).disagreements)
    assert not any("at every speed" in one for one in agreement(document, problem, schedule=False).disagreements)


def test_numbers_of_the_figures_are_finite_words_in_a_report(revenue):
    report = verify_document(revenue.document)
    assert np.isfinite(report.coupling)
    assert report.coupling == 0.0
    assert "measured.clearance" in report.stated
    assert "peak gap change" in report.not_promised
