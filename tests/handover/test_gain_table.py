"""Gain tables: what is written is what is read, a change is noticed, and a refusal says what is wrong."""

import json
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from importlib.resources import files

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.design.verdict import verdicts
from workbench.errors import InputError
from workbench.files.gains import read_gains
from workbench.files.problem import load_problem
from workbench.goals.ride.requirement import requirement
from workbench.handover.table.table import digest_of, read_table, schema, table_from_design


@pytest.fixture
def path(table, tmp_path):
    file = tmp_path / "gains.json"
    table.write(file)
    return file


def altered(path, change):
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    return path


def resigned(path, change):
    def both(document):
        change(document)
        document["digest"] = digest_of(document)

    return altered(path, both)


def test_a_table_read_back_is_the_table_written(table, path):
    assert read_table(path) == table


def test_the_gains_read_back_are_the_same_doubles_through_either_reader(design, path):
    assert read_table(path).to_gains() == design.gains
    assert read_gains(path) == design.gains


def test_a_table_read_back_gives_the_same_analysis(table, path):
    again = analyse(load_problem("comfort_limit").setting, read_table(path).to_gains(), "comfort_limit").to_dict()
    measured = table.measured
    assert set(measured) == set(again) - {"gains"}

    def compare(one, two):
        if isinstance(one, dict):
            assert set(one) == set(two)
            for key in one:
                compare(one[key], two[key])
        elif isinstance(one, list):
            assert len(one) == len(two)
            for a, b in zip(one, two, strict=True):
                compare(a, b)
        elif isinstance(one, float):
            assert two == pytest.approx(one, rel=1e-12, abs=1e-12)  # the promise of the format; the same code runs
        else:
            assert one == two

    compare(measured, {key: again[key] for key in measured})


def test_the_law_needs_no_problem(design, path):
    table, problem = read_table(path), design.problem
    for ours, theirs in zip(table.to_law().numeric(table.to_gains()), problem.law.numeric(design.gains), strict=True):
        np.testing.assert_array_equal(ours, theirs)
    assert table.to_discrete().sample_time == problem.sample_time


def test_the_plant_in_the_table_is_the_problems_and_the_same_right_and_left_in_every_digit(design, path):
    ours, theirs = read_table(path).to_plant(), design.problem.setting.plant
    assert ours is not None
    for matrix in "ABCD":
        own, given = getattr(ours, matrix), getattr(theirs, matrix)
        # 1e-15 of the largest entry: what the problem's own doubles leave where a zero belongs
        np.testing.assert_allclose(own, given, rtol=1e-15, atol=1e-15 * np.abs(given).max())
    swapped = [ours.states.index(f"current_{k}") for k in (2, 1, 4, 3)]
    currents = [ours.states.index(f"current_{k}") for k in (1, 2, 3, 4)]
    for name, sign in (("Z_rate", 1), ("Theta_rate", 1), ("Y_rate", -1), ("Phi_rate", -1), ("Psi_rate", -1)):
        row = ours.A[ours.states.index(name)]
        np.testing.assert_array_equal(row[currents], sign * row[swapped])
    assert (ours.states, ours.inputs, ours.outputs) == (theirs.states, theirs.inputs, theirs.outputs)


def test_every_promise_holds_its_requirements_value_and_keeps_its_limit(design, table):
    own = [p for p in table.promises if p.name != "delay margin, uniform"]
    for promise, verdict in zip(own, design.requirements, strict=True):
        low, high = promise.enclosure
        assert promise.name.startswith(verdict.name)
        # 1e-9: the floating value's own error; the peak sensitivity's verdict is the upper end of a bracket 1e-9 wide
        assert low <= verdict.value * (1 + 2e-9)
        assert verdict.value * (1 - 2e-9) <= high
        assert high <= promise.limit if promise.sense == "<=" else low >= promise.limit
        assert promise.method.startswith("ball arithmetic: ")
        assert promise.box == {}
        assert 0 < high - low < 1.1e-9 * abs(high)  # a proof, not the value twice, and a narrow one


def test_a_peak_gap_is_promised_from_its_static_part_and_three_sigma(design):
    problem = design.problem.with_requirements([requirement("peak gap change", 0.2)])
    one = replace(design, problem=problem, verdicts=verdicts(problem, design.analysis))
    (promise,) = table_from_design(one).promises
    low, high = promise.enclosure
    value = design.analysis.peak_gap_change["gap"]
    assert low * (1 - 1e-9) <= value <= high * (1 + 1e-9)  # the floating value's own error
    assert high - low < 1e-9 * value
    assert "exact static gains" in promise.method


def test_what_the_prover_cannot_prove_is_promised_in_floating_point_and_says_so(design):
    problem = design.problem.with_requirements([requirement("vertical ride mask ratio", 10.0)])
    one = replace(design, problem=problem, verdicts=verdicts(problem, design.analysis))
    (promise,) = table_from_design(one).promises
    assert promise.method == "floating point: figure of the analysis"
    assert promise.enclosure == [one.requirements[0].value] * 2


def test_a_peak_of_coupled_groups_stays_a_floating_bracket(design):
    setting = design.problem.setting
    A = setting.plant.A.copy()
    A[setting.plant.index("states", ["Z_rate"])[0], setting.plant.index("states", ["Phi"])[0]] = 1e-5  # beyond 1e-9
    coupled = replace(setting, plant=replace(setting.plant, A=A))
    promises = table_from_design(replace(design, problem=design.problem.with_setting(coupled))).promises
    peak = next(p for p in promises if p.name == "peak sensitivity, heave_pitch")
    assert peak.method == "floating point: Hamiltonian eigenvalues, bracket"
    assert 0 < peak.enclosure[1] - peak.enclosure[0] < 1e-6


def test_an_unstable_design_promises_only_what_has_a_value(unstable_design):
    table = table_from_design(unstable_design)
    assert {p.name for p in table.promises} == {"damping ratio", "decay rate"}
    assert [r.value for r in table.requirements if r.name == "peak sensitivity"] == [None]
    assert table.measured["cost"] is None


def test_the_date_is_universal_time_whatever_the_clock_shows(design):
    noon = datetime(2026, 3, 1, 12, 0, tzinfo=timezone(timedelta(hours=9)))
    assert table_from_design(design, created=noon).created == "2026-03-01T03:00:00Z"
    now = datetime.strptime(table_from_design(design).created, "%Y-%m-%dT%H:%M:%SZ").replace(tzinfo=UTC)
    assert abs((datetime.now(UTC) - now).total_seconds()) < 600


def test_equal_designs_at_one_time_make_equal_digests_and_order_does_not_matter(design, path):
    when = datetime(2026, 1, 1, tzinfo=UTC)
    assert table_from_design(design, created=when).digest == table_from_design(design, created=when).digest
    document = json.loads(path.read_text())
    path.write_text(json.dumps(dict(reversed(document.items())), indent=3))
    assert read_table(path).digest == document["digest"]


def test_the_digest_is_the_sha256_of_sorted_compact_json(path):
    import hashlib

    document = json.loads(path.read_text())
    digest = document.pop("digest")
    text = json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    assert hashlib.sha256(text.encode()).hexdigest() == digest


def test_writing_signs_what_was_added(table, tmp_path):
    more = table.model_copy(update={"robustness": {"lost command": {"stable": False}}})
    written = more.write(tmp_path / "more.json")
    assert written.digest != table.digest
    assert read_table(tmp_path / "more.json") == more.signed()


def test_the_published_schema_is_the_models_and_accepts_a_written_table(path):
    published = json.loads(
        files("workbench.handover.table").joinpath("gain_table.schema.json").read_text(encoding="utf-8")
    )
    assert published == schema()
    document = json.loads(path.read_text())
    import jsonschema  # a second to import

    validator = jsonschema.Draft202012Validator(published)
    validator.check_schema(published)
    validator.validate(document)
    document["gains"]["K_h"] = "minus one"
    assert not validator.is_valid(document)


@pytest.mark.parametrize("part", ["gain", "plant", "law"])
def test_a_changed_digit_of_a_gain_the_plant_or_the_law_is_noticed(path, part):
    text = path.read_text()
    document = json.loads(text)
    entries = {
        "gain": document["gains"]["K_h"],
        "plant": max((x for row in document["plant"]["A"] for x in row), key=len),  # all the digits of a double
        "law": document["law"]["sample_time_s"],
    }
    digits = entries[part]
    others = digits[:-1] + str((int(digits[-1]) + 1) % 10)
    assert digits in text
    path.write_text(text.replace(f'"{digits}"', f'"{others}"', 1))
    with pytest.raises(InputError, match=r"the digest of .* the table was changed after it was signed"):
        read_table(path)


@pytest.mark.parametrize("keep", [0.02, 0.5, 0.999])
def test_a_truncated_table_is_refused(path, keep):
    text = path.read_text()
    path.write_text(text[: int(keep * len(text))])
    with pytest.raises(InputError, match="must be valid JSON"):
        read_table(path)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('"version": 1', '"version": 3', r"must be a gain table of version 1 or 2; got '3'"),
        (
            '"format": "maglev-workbench gain table"',
            '"format": "other"',
            r"must be a gain table, .*; got format 'other'",
        ),
        ('"seed": 3', '"seed": NaN', "NaN is not a number JSON allows"),
        ('"seed": 3', '"seed": 1e999', "must hold finite numbers"),
        ('"seed": 3', '"seed": -Infinity', "-Infinity is not a number JSON allows"),
    ],
)
def test_what_is_not_this_format_is_refused_in_one_sentence(path, old, new, sentence):
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=sentence):
        read_table(path)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda d: d.pop("seed"), "seed is missing; add it"),
        (lambda d: d.update(note="x"), "note is not known; remove it"),
        (lambda d: d["gains"].pop("K_yaw"), "gains must name all seventeen parameters; missing K_yaw"),
        (lambda d: d["gains"].update(K_h="nan"), r"gains\.K_h is not usable"),
        (lambda d: d["gains"].update(K_h=-1.03219), r"gains\.K_h is not usable"),
        (lambda d: d["gains"].update(K_h="1e309"), "a decimal must be a finite double"),
        (lambda d: d["gains"].update(tau_h="-0.4"), "tau_h must not be negative"),
        (lambda d: d["units"].update(K_h="1/mm"), "units must be those of the seventeen gains"),
        (lambda d: d["law"].update(positions_m=[["1", "1"]]), "the modal law needs coil sets"),
        (lambda d: d["plant"]["A"].pop(), r"matrix A must have shape \(14, 14\)"),
        (lambda d: d["promises"][0].update(enclosure=[1.0, 0.0]), "an interval must go from low to high"),
        (lambda d: d["requirements"][0].update(sense="<"), r"requirements\.0\.sense is not usable"),
        (lambda d: d.update(created="yesterday"), "created is not usable"),
        (lambda d: d.update(seed="3"), "seed is not usable"),
        (lambda d: d.update(title="x" * 501), "title is not usable"),
    ],
)
def test_a_resigned_table_that_makes_no_sense_is_refused_by_key(path, change, sentence):
    with pytest.raises(InputError, match=sentence) as refusal:
        read_table(resigned(path, change))
    message = str(refusal.value)
    assert "\n" not in message
    assert len(message) < 700
    assert "http" not in message


def test_deep_nesting_and_great_size_are_refused(path, table):
    nested = "[" * 100_000 + "]" * 100_000
    path.write_text(path.read_text().replace('"robustness": {', f'"robustness": {{"deep": {nested},', 1))
    with pytest.raises(InputError, match="nested deeply"):
        read_table(path)
    path.write_text("{" + " " * 4_000_001 + "}")
    with pytest.raises(InputError, match="at most 4000000 bytes"):
        read_table(path)


def test_a_deeply_nested_entry_that_json_can_hold_is_still_refused_in_one_sentence(path):
    deep: list = []
    for _ in range(400):
        deep = [deep]
    with pytest.raises(InputError, match="must not be nested deeply"):
        read_table(resigned(path, lambda d: d["robustness"].update(deep=deep)))


def test_a_table_shows_itself_shortly(table):
    assert len(repr(table)) < 400
    assert len(table._repr_html_()) < 10_000
    assert "K_h" in table.to_frame().to_string()
