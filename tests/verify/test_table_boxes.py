"""Promises over boxes of factors travel in the table and are proved again from it."""

import json
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from flint import fmpq, fmpq_poly

from workbench.handover.table.promise import with_box
from workbench.handover.table.table import GainTable, digest_of
from workbench.verify.check import verify_document
from workbench.verify.exact.failure import NotProved
from workbench.verify.family.polynomial import ParameterBox, interpolate
from workbench.verify.vehicle.loop import closed_loop
from workbench.verify.vehicle.table import table_of
from workbench.verify.vehicle.uncertain import UncertainLoop, interval_holds, worst_over_box

BOX = {"mass": (0.9, 1.1), "current_force": (0.95, 1.05)}


@pytest.fixture(scope="module")
def boxed(heave):
    """The heave table with promises over a box of two factors."""
    document = with_box(GainTable.model_validate(heave.document), BOX).to_dict()

    def changed(change=lambda d: None):
        copy = json.loads(json.dumps(document))
        change([p for p in copy["promises"] if p["box"]])
        copy["digest"] = digest_of(copy)
        return copy

    return changed


def over_box(report):
    return {f.name: f for f in report.findings if f.box}


def test_promises_over_a_box_are_proved_again_from_the_table(boxed):
    report = verify_document(boxed())
    assert report.proved
    found = over_box(report)
    assert set(found) == {"damping ratio", "peak sensitivity, heave_pitch"}
    assert found["damping ratio"].box == BOX
    for f in found.values():
        low, high = f.proved or (1.0, 2.0)
        assert high / low - 1 < 3e-3  # the enclosures a table promises are 0.2 % wide


@pytest.mark.slow
def test_the_enclosed_worst_damping_is_that_of_a_dense_grid(boxed, heave):
    table = table_of(heave.document)
    worst = 1.0
    for m in range(90, 111, 2):
        for c in range(95, 106, 2):
            A = closed_loop(table, "heave", {"mass": fmpq(m, 100), "current_force": fmpq(c, 100)}).A
            poles = np.linalg.eigvals([[float(x) for x in row] for row in A.tolist()])
            worst = min(worst, float((-poles.real / np.abs(poles)).min()))
    low, high = over_box(verify_document(boxed()))["damping ratio"].proved or (1.0, 0.0)
    assert low <= worst
    assert worst <= high * (1 + 1e-9)  # the grid holds the corner that attains it


@pytest.mark.parametrize("factor", [1.001, 1.01])
def test_a_bound_beyond_the_true_worst_damping_is_refused(boxed, factor):
    def bolder(promises):
        for p in promises:
            if p["name"] == "damping ratio":
                p["enclosure"] = [p["enclosure"][1] * factor, 1.0]
                p["limit"] = 0.1

    found = over_box(verify_document(boxed(bolder)))["damping ratio"]
    assert found.verdict == "fails"
    assert "is claimed to lie in" in found.reason


def test_a_wider_box_under_the_same_claim_is_refused(boxed):
    def wider(promises):
        for p in promises:
            p["box"]["mass"] = [0.6, 1.4]

    report = verify_document(boxed(wider))
    assert {f.verdict for f in over_box(report).values()} == {"fails"}


def test_a_box_that_holds_static_divergence_is_never_passed(boxed):
    def upside_down(promises):
        for p in promises:
            p["box"] = {"gap_force": [-1.0, 1.0]}  # a gap force that pushes away: a real root through zero

    report = verify_document(boxed(upside_down))
    assert not any(f.holds for f in over_box(report).values())


def test_a_box_over_what_the_checker_does_not_know_is_not_proved(boxed):
    def unknown(promises):
        for p in promises:
            p["box"] = {"wind": [0.9, 1.1]}

    found = over_box(verify_document(boxed(unknown)))
    assert {f.verdict for f in found.values()} == {"not proved"}
    assert "a box over 'wind' is not known to the checker" in found["damping ratio"].reason


def test_what_is_not_promised_over_boxes_is_refused_by_name(heave):
    table = table_of(heave.document)
    loop = UncertainLoop(table, "heave", {"mass": (fmpq(9, 10), fmpq(11, 10))})
    with pytest.raises(NotProved, match="damping, decay and peak sensitivity alone"):
        worst_over_box([loop], "rms gap, front")
    with pytest.raises(NotProved, match="must rise"):
        UncertainLoop(table, "heave", {"mass": (fmpq(1), fmpq(1))})


def test_what_does_not_hold_over_the_box_is_said_with_its_open_share_and_worst_member(boxed):
    document = boxed()
    said = {u["name"]: u for u in document["undecided"]}
    assert set(said) == {"damping ratio", "peak sensitivity, heave_pitch"}
    for name, u in said.items():
        nominal, promised = (
            next(p for p in document["promises"] if p["name"] == name and bool(p["box"]) is boxed_one)
            for boxed_one in (False, True)
        )
        assert u["limit"] == nominal["limit"] != promised["limit"]
        assert 0 < u["share"] < 1  # part of the box keeps the nominal limit
        assert u["box"] == promised["box"]
        assert "the member at mass" in u["reason"]
    assert [u.name for u in verify_document(document).undecided] == list(said)


def test_nothing_is_promised_where_the_box_is_not_stable_and_the_table_says_so(heave):
    box = {"gap_force": (-0.5, 1.5)}  # less than no force: static divergence
    table = with_box(GainTable.model_validate(heave.document), box)
    assert not [p for p in table.promises if p.box]
    assert {u.name for u in table.undecided} == {"damping ratio", "peak sensitivity, heave_pitch"}
    assert all("no bound holds over the whole box" in u.reason or "stable" in u.reason for u in table.undecided)
    assert verify_document(table.to_dict()).proved  # of what is promised nothing fails


def test_a_table_without_the_vehicle_is_told_that_no_box_can_be_proved(hybrid):
    table = with_box(GainTable.model_validate(hybrid.document), BOX)
    assert not [p for p in table.promises if p.box]
    over_a_box = [u for u in table.undecided if u.box]
    assert {u.share for u in over_a_box} == {1.0}
    assert all("needs the vehicle behind the plant" in u.reason for u in over_a_box)


def test_a_worst_member_inside_the_box_is_named_and_found_again(boxed):
    def claims(at):
        def change(promises):
            for p in promises:
                if p["name"] == "damping ratio":
                    p["at"] = at

        return over_box(verify_document(boxed(change)))["damping ratio"]

    assert claims({"mass": 1.0, "current_force": 1.0}).method  # proved anew from its own worst member
    assert claims({}).holds  # left out: corners are looked at
    beyond = claims({"mass": 1.3, "current_force": 1.0})
    assert beyond.claimed != beyond.proved  # a member outside the box proves nothing of the claim


def test_an_interior_worst_member_verifies_from_its_place():
    # s² + 2 ζ s + 1 with ζ = (t − 1/3)² + 0.1: worst at t = 1/3, which is no corner and not the centre
    box = ParameterBox.of(t=("0", "0.9"))
    (family,) = interpolate(
        lambda t: (fmpq_poly([1, 2 * ((t[0] - fmpq(1, 3)) ** 2 + fmpq(1, 10)), 1]),), box, (2,)
    )  # fmt: skip
    loop = cast(UncertainLoop, SimpleNamespace(box=box, poles=family, corners=[box.centre, *box.vertices()]))
    worst = worst_over_box([loop], "damping ratio")
    at = {"t": fmpq(1, 3)}
    assert float(worst.low) <= 0.1 <= float(worst.high)
    assert interval_holds([loop], "damping ratio", fmpq(999, 10000), fmpq(1001, 10000), at)
    assert not interval_holds([loop], "damping ratio", fmpq(999, 10000), fmpq(1001, 10000))  # no corner attains it


@pytest.mark.slow
def test_four_factors_of_the_comfort_limit_are_enclosed_and_proved_again(revenue):
    box = {"mass": (0.85, 1.15), "inertia": (0.9, 1.1), "current_force": (0.9, 1.1), "gap_force": (0.92, 1.08)}
    table = with_box(GainTable.model_validate(revenue.document), box)
    report = verify_document(table.to_dict())
    assert report.proved
    found = over_box(report)
    assert set(found) == {
        "damping ratio", "decay rate", "peak sensitivity, heave_pitch", "peak sensitivity, sway_roll_yaw"
    }  # fmt: skip
    # the nominal limits do not hold over the whole box: what is proved is promised instead
    assert found["damping ratio"].limit < 0.4
    assert found["peak sensitivity, sway_roll_yaw"].limit > 2.0
    assert found["decay rate"].limit == 0.3
