"""A table from anybody: whatever is wrong with it is said in one sentence, quickly, and nothing else happens."""

import json
import subprocess
import sys

import pytest
from flint import fmpq
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.handover.table.table import digest_of as digest_of_the_workbench
from workbench.verify.check import verify, verify_document
from workbench.verify.exact.failure import TableError
from workbench.verify.reading import decimal, digest_of, number


def written(tmp_path, text):
    path = tmp_path / "table.json"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (b"\xff\xfe", "must be UTF-8 text; byte 0 is not"),
        ("", "must be valid JSON"),
        ("[1, 2]", "must hold a JSON mapping; got a list"),
        ("{}", "must be of format 'maglev-workbench gain table', version 1 or 2; got 'None'"),
        ('{"format": "maglev-workbench gain table", "version": 3}', "version 1 or 2; got .* version 3"),
        ('{"format": "maglev-workbench gain table", "version": true}', "version 1 or 2; got .* version True"),
        ('{"format": "maglev-workbench gain table", "version": 2.0}', "version 1 or 2; got .* version 2.0"),
        ('{"a": NaN}', "NaN is not a number JSON allows"),
        ('{"a": 1, "a": 2}', "key 'a' is given twice"),
        ('{"a": ' + "[" * 100_000 + "]" * 100_000 + "}", "must not be nested deeply"),
        ('{"a": ' + "9" * 10_000 + "}", "a number has thousands of digits"),
        ("{" + " " * 4_000_001 + "}", "must be at most 4000000 bytes"),
    ],
)
def test_what_is_no_table_is_refused_in_one_sentence(tmp_path, text, sentence):
    with pytest.raises(TableError, match=sentence) as refusal:
        verify(written(tmp_path, text))
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 500


def test_a_missing_file_is_refused_in_one_sentence(tmp_path):
    with pytest.raises(TableError, match="must be a readable file; No such file"):
        verify(tmp_path / "none.json")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda d: d.pop("gains"), "it lacks 'gains'"),
        (lambda d: d["gains"].pop("K_yaw"), "'K_yaw' is missing or unknown"),
        (lambda d: d["gains"].update(K_h=-1.0), "gains.K_h must be a decimal string"),
        (lambda d: d["gains"].update(K_h="1e999"), "gains.K_h must be a decimal string"),
        (lambda d: d["gains"].update(K_h="1" * 61), "gains.K_h must be a decimal string"),
        (lambda d: d["gains"].update(K_h="0x10"), "gains.K_h must be a decimal string"),
        (lambda d: d["gains"].update(K_h="١"), "gains.K_h must be a decimal string"),
        (lambda d: d["gains"].update(tau_h="-0.4"), "gains.tau_h must not be negative"),
        (lambda d: d["law"].update(positions_m=[["1", "1"]]), "law.positions_m must be a list of 4 to 100"),
        (lambda d: d["law"]["positions_m"].__setitem__(0, ["9.0", "0"]), "must lie on one side"),
        (
            lambda d: d["law"].update(actuators=[{"name": "m", "signal": "heave", "lever": "1"}]),
            "signal must be 'sway' or 'yaw'",
        ),
        (lambda d: d.update(plant=None), "a table to verify must hold its plant"),
        (lambda d: d["plant"]["A"].pop(), "plant.A must be a list of 14 to 14 entries; got 13"),
        (lambda d: d["plant"]["A"][0].append("0"), "plant.A.0 must be a list of 14 to 14 entries; got 15"),
        (lambda d: d["plant"]["states"].__setitem__(0, "Theta"), "plant.states must be distinct names"),
        (lambda d: d["plant"].update(states=["x"] * 61), "plant.states must be a list of 1 to 60"),
        (lambda d: d["plant"]["states"].__setitem__(0, "heave"), "must have 'Z' among its states"),
        (lambda d: d.update(promises="all"), "promises must be a list"),
        (lambda d: d["promises"][0].update(sense="<"), "sense must be '>=', as of every limit on 'damping ratio'"),
        (lambda d: d["promises"][0].update(name="wear", sense="<<"), "sense must be '<= or >='"),
        (lambda d: d.update(remark="approved"), "it does not know 'remark'"),
        (lambda d: d["certificate"]["physics"].update(wind="0"), "it does not know 'wind'"),
        (lambda d: d["promises"][0].update(valid="always"), "it does not know 'valid'"),
        (lambda d: d["certificate"]["sensors"].update(accelerometer_bias_m_s2="-0.02"), "no negative bias or noise"),
        (lambda d: d["certificate"]["guideway"]["spectra"]["A1"].update(strength="0"), "a positive strength"),
        (
            lambda d: d["certificate"]["guideway"].update(
                correlation=[["1", "1", "0", "0"], ["1", "1", "1", "0"], ["0", "1", "1", "0"], ["0", "0", "0", "1"]]
            ),
            "no negative eigenvalue",
        ),
        (lambda d: d["certificate"]["physics"].update(gravity_m_s2="9.81"), "gravity_m_s2 must be 9.80665"),
        (lambda d: d["certificate"].update(groups=["heave", "heave_pitch"]), "must move each motion once"),
        (lambda d: d["units"].update(K_h="1/cm"), "units must be those of the seventeen gains"),
        (lambda d: d["requirements"][0].update(unit="%"), "must be a requirement with its unit"),
        (lambda d: d["gains"].update(K_h="1e330"), "must be zero or of a size between 1e-40 and 1e40"),
        (lambda d: d["promises"][0].update(enclosure=[1.0, 0.0]), "must hold intervals from low to high"),
        (lambda d: d["promises"][0].update(limit=True), "limit must be a finite number"),
        (lambda d: d["certificate"].update(groups=["wheels"]), "certificate.groups must be of"),
        (lambda d: d["certificate"].update(groups=[]), "certificate.groups must be a list of 1 to"),
        (lambda d: d["certificate"]["guideway"].update(speed_m_s="0"), "must have a positive speed"),
        (lambda d: d["certificate"]["guideway"]["spectra"]["A1"].update(zeros=1), "fewer zeros than corners"),
        (lambda d: d["certificate"]["guideway"]["spectra"].update(A5={}), "it lacks 'strength'"),
        (lambda d: d["certificate"]["physics"].update(mass_kg="0"), "must hold a positive mass"),
        (lambda d: d["certificate"]["physics"].update(joined=[[0, 0]]), "must name each coil set once"),
        (lambda d: d["certificate"]["physics"].update(bank_reading=[]), "bank_reading must be one of"),
    ],
)
def test_a_resigned_table_of_wrong_types_or_shapes_is_refused_by_key(revenue, change, sentence):
    with pytest.raises(TableError, match=sentence) as refusal:
        verify_document(revenue.changed(change))
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 500


def test_numbers_without_end_are_refused(revenue):
    document = revenue.document
    document["seed"] = float("inf")
    with pytest.raises(TableError, match="must hold finite numbers"):
        verify_document(document)


def test_a_table_of_absurd_numbers_is_refused_before_anything_is_computed(revenue):
    def absurd(document):
        plant = document["plant"]
        for letter in "ABCD":
            plant[letter] = [["-9.7312345678901234567890123456789e-307"] * len(row) for row in plant[letter]]
        document["gains"] = dict.fromkeys(document["gains"], "7.77777777777777777777777777777777777777777e307")

    with pytest.raises(TableError, match="of a size between 1e-40 and 1e40"):
        verify_document(revenue.changed(absurd))


@given(st.one_of(st.just(0.0), st.floats(1e-39, 1e39), st.floats(-1e39, -1e-39)))
def test_a_doubles_shortest_decimal_is_read_as_that_exact_decimal(value):
    from fractions import Fraction

    exact = Fraction(repr(value))
    assert decimal(repr(value), "x") == fmpq(exact.numerator, exact.denominator)
    double = Fraction(value)
    assert number(value, "x") == fmpq(double.numerator, double.denominator)


@settings(max_examples=20, deadline=None)
@given(st.data())
@pytest.mark.slow
def test_no_change_of_any_one_entry_gives_anything_but_a_report_or_a_sentence(heave, data):
    document = heave.document
    node, key, deeper = document, None, True
    while deeper:
        key = data.draw(st.sampled_from(list(node) if isinstance(node, dict) else list(range(len(node)))))
        deeper = (
            isinstance(node[key], dict | list) and bool(node[key]) and (node is document or data.draw(st.booleans()))
        )
        node = node[key] if deeper else node
    node[key] = data.draw(st.sampled_from([None, -1, 1e300, True, "", "0", "-1", "1e300", [], {}, [[]], "x" * 2000]))
    said = ""
    try:
        assert verify_document(document).digest_ok == (json.dumps(document) == json.dumps(heave.document))
    except TableError as error:
        said = str(error)
    assert "\n" not in said


def test_the_digest_is_the_one_the_workbench_signs_with(revenue):
    assert digest_of(revenue.document) == digest_of_the_workbench(revenue.document) == revenue.document["digest"]
    odd = {"a": "ä\ud800", "b": [1.5, True, None], "digest": "x"}
    assert digest_of(odd) == digest_of_the_workbench(odd)


def test_the_checker_needs_nothing_but_python_flint_and_the_standard_library():
    code = (
        "import sys, json; import workbench.verify.check; "
        "print(json.dumps(sorted({name.split('.')[0] for name in sys.modules} - set(sys.stdlib_module_names))))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    foreign = {name for name in json.loads(done.stdout) if not name.startswith(("_", "sitecustomize"))}
    assert foreign <= {"flint", "workbench", "cython_runtime"}
    code = "import sys, workbench.verify.check; print(*[m for m in sys.modules if m.startswith('workbench.')])"
    ours = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    # the package's own face names where its exits lead and imports none of them
    assert all(name.startswith("workbench.verify") for name in ours.stdout.split() if name != "workbench.exits")
