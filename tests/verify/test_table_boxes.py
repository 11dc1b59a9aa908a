"""Promises over boxes of factors travel in the table and are proved again from it."""

import json

import numpy as np
import pytest
from flint import fmpq

from workbench.export.promise import with_box
from workbench.export.table import GainTable, digest_of
from workbench.verify.check import verify_document
from workbench.verify.failure import NotProved
from workbench.verify.loop import state_matrix
from workbench.verify.table import table_of
from workbench.verify.uncertain import UncertainLoop, worst_over_box

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


def test_the_enclosed_worst_damping_is_that_of_a_dense_grid(boxed, heave):
    table = table_of(heave.document)
    worst = 1.0
    for m in range(90, 111, 2):
        for c in range(95, 106, 2):
            A = state_matrix(table, "heave", {"mass": fmpq(m, 100), "current_force": fmpq(c, 100)})
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


@pytest.mark.slow
def test_four_factors_of_the_revenue_vehicle_are_enclosed_and_proved_again(revenue):
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
