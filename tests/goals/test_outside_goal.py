"""A goal of one's own, one class outside the package: steered, judged, refused by name, in a table, not proved.

Resistive control power: the I²R losses of all control coils, an affine function of the mean-square currents.
"""

import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.design.design import design
from workbench.design.record import given
from workbench.design.steering import Programme
from workbench.design.verdict import verdicts
from workbench.errors import InfeasibleError, InputError
from workbench.files.problem import load_problem
from workbench.goals.key import Key
from workbench.goals.registry import GOALS, data_of, goal, register
from workbench.goals.ride.requirement import Requirement
from workbench.handover.table.table import digest_of, read_table, table_from_design
from workbench.study.quantity import document_of, limits_of
from workbench.verify.check import verify_document

KIND, KEY = "resistive control power", "resistive_power_at_most_w"
HEAVE = Path(__file__).parents[2] / "problems" / "heave"


@pytest.fixture(autouse=True)
def resistive():
    """The whole of the addition; forgotten again after each test."""

    @register
    @dataclass(frozen=True, slots=True, kw_only=True)
    class ResistivePower(Requirement):
        """The resistance of all control coils takes at most this [W]."""

        kind, sense, unit = KIND, "<=", "W"
        keys = (Key(KEY, "limit"),)

        def steer(self, point):
            watts = point.setting.coil_resistance * point.setting.main_current**2 / self.asked_at(point.back_off)
            return [
                (self.name, np.array([1 - watts * point.squares["currents"]]), -watts * point.slopes["currents"][None])
            ]

        def found(self, loop):
            return [(loop.analysis.control_power_w["resistive"], "all control coils")]

    yield ResistivePower
    del GOALS[KIND]


@pytest.fixture(scope="module")
def revenue():
    return load_problem("comfort_limit")


@pytest.fixture(scope="module")
def heave():
    return load_problem("heave")


def test_it_is_judged_with_the_power_and_not_with_another_quantity(resistive, revenue):
    asked = revenue.with_requirements([resistive(80e3)])
    (verdict,) = verdicts(asked, analyse(revenue.setting, revenue.approved))
    # ρ l / A = 1.7e-8 Ω m · 7 m / 50 cm² of each coil, at 429.69 kA-turns and the mean squares of the approved gains
    squares = analyse(revenue.setting, revenue.approved).sum_alpha_squared
    assert verdict.value == pytest.approx(1.7e-8 * 7.0 / 50e-4 * 429.69e3**2 * squares, rel=1e-3)
    assert verdict.value == pytest.approx(73.8e3, rel=2e-3)
    assert (verdict.name, verdict.unit, verdict.met, verdict.where) == (KIND, "W", True, "all control coils")


def test_it_has_no_value_in_an_unstable_loop_and_says_so(resistive, heave):
    gains = heave.approved.with_values(K_h=-20.0, K_hdot=0.0, K_zddot=0.0, K_zdot=0.0)
    (verdict,) = verdicts(heave.with_requirements([resistive(1e3)]), analyse(heave.setting, gains))
    assert (verdict.value, verdict.met, verdict.where) == (None, False, "unstable loop")


def test_it_steers_and_its_gradient_is_that_of_its_rows(resistive, revenue):
    programme = Programme(revenue.with_requirements([resistive(80e3)]))
    theta = np.array(list(revenue.approved.as_dict().values()))
    (row,) = [r for r in programme.measure(theta).rows if r[0] == KIND]
    assert row[1][0] == pytest.approx(1 - verdict_value(revenue, resistive) / (80e3 * 0.998), abs=2e-3)
    for k in programme.free:
        step = 1e-6 * max(abs(theta[k]), 1e-2)
        ends = [theta + sign * step * np.eye(17)[k] for sign in (1, -1)]
        up, down = (next(r[1][0] for r in programme.measure(x).rows if r[0] == KIND) for x in ends)
        # rounding of a row of size one over the step, and the curvature along it
        assert (up - down) / (2 * step) == pytest.approx(row[2][0, k], rel=1e-4, abs=1e-5)


def verdict_value(problem, resistive):
    asked = problem.with_requirements([resistive(80e3)])
    return verdicts(asked, analyse(problem.setting, problem.approved))[0].value


@pytest.mark.slow
def test_what_cannot_be_met_is_refused_by_its_name(resistive, heave):
    with pytest.raises(InfeasibleError, match=rf"'{KIND}' must be <= 0.01 W; best found .* W \(all control coils\)"):
        design(heave.with_requirements([*heave.requirements, resistive(0.01)]), starts=1)


def test_a_design_keeps_it_where_it_can_be_kept(resistive, heave):
    free = design(heave, starts=1)
    limit = 0.8 * free.analysis.control_power_w["resistive"]
    found = design(heave.with_requirements([*heave.requirements, resistive(limit)]), starts=1)
    assert found.analysis.control_power_w["resistive"] <= limit
    assert found.analysis.cost >= free.analysis.cost * (1 - 1e-6)  # a limit more never makes it cheaper


def test_it_is_read_from_data_under_its_key_while_it_is_registered(resistive, tmp_path):
    folder = tmp_path / "mine"
    shutil.copytree(HEAVE, folder)
    data = folder / "data.toml"
    data.write_text(data.read_text("utf8").replace("[requirements]\n", f"[requirements]\n{KEY} = 500\n"), "utf8")
    found = next(r for r in load_problem(str(folder)).requirements if r.name == KIND)
    assert found == resistive(500.0) == goal(KIND, {KEY: 500.0})
    assert data_of(found) == {"kind": KIND, KEY: 500.0}
    del GOALS[KIND]
    with pytest.raises(InputError, match=KEY):
        load_problem(str(folder))
    register(resistive)


def test_a_table_carries_it_and_the_checker_says_that_it_is_not_proved(resistive, heave, tmp_path):
    problem = heave.with_requirements([*heave.requirements, resistive(1e6)])
    table = table_from_design(given(problem, heave.approved))
    file = tmp_path / "gains.json"
    file.write_text(json.dumps(table.to_dict()), "utf8")
    assert [r.name for r in read_table(file).requirements][-1] == KIND
    report = verify_document(json.loads(file.read_text("utf8")))
    last = (
        report.findings[-1] if report.findings[-1].name == KIND else next(f for f in report.findings if f.name == KIND)
    )
    assert (last.verdict, last.proved) == ("not proved", None)
    assert "the checker has no proof for this quantity" in last.reason
    assert not report.proved
    assert all(f.verdict == "proved" for f in report.findings if f.name != KIND)
    # nobody may take it for proved by leaving the promise out either
    document = table.to_dict()
    document["promises"] = [p for p in document["promises"] if p["name"] != KIND]
    document["digest"] = digest_of(document)
    assert any(KIND in fault and "not promised" in fault for fault in verify_document(document).faults)


def test_a_study_records_it_and_holds_it_against_its_limit(resistive, heave):
    problem = heave.with_requirements([resistive(1e6)])
    (limit,) = limits_of(problem)
    document = document_of(problem, heave.approved, (limit.quantity,))
    assert document[limit.quantity] == analyse(heave.setting, heave.approved).control_power_w["resistive"]
