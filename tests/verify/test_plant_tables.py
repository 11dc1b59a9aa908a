"""Tables of plants of one's own: what is promised is true by a second evaluation, and nobody gets a false one past."""

import copy
import json

import numpy as np
import pytest
from adversary import HAIR, leaves, of_keys, put
from plain_plant import PlainPlant
from plant_cases import CASES, design_of

from workbench.errors import InputError
from workbench.files.digest import digest_of
from workbench.handover.table.plant import PlantTable, plant_table, schema
from workbench.handover.table.table import read_table, table_of
from workbench.verify.check import verify, verify_document
from workbench.verify.exact.failure import TableError

FAST = 3  # mutations of each table in the fast suite
MANY = 100  # and in the slow one
LARGE = ("blocks", "column")  # seconds to prove, so in the slow suite
FREE = ("problem", "title", "data_sha256", "created", "versions", "seed", "solver", "starts", "measured")
SUBJECT = ("inputs", "outputs", "openings", "points", "models")


@pytest.fixture(scope="module", params=[pytest.param(c, marks=pytest.mark.slow if c in LARGE else ()) for c in CASES])
def case(request):
    return request.param


@pytest.fixture(scope="module")
def document(case):
    return plant_table(design_of(case)).to_dict()


@pytest.fixture(scope="module")
def report(document):
    return verify_document(document)


def signed(document, mutate):
    changed = copy.deepcopy(document)
    mutate(changed)
    changed["digest"] = digest_of(changed)
    return changed


def passes(document):
    """The report of a table that is let through, else None."""
    try:
        report = verify_document(document)
    except TableError:
        return None
    return report if report.proved else None


def false_promises(document):
    """Names of the promises that the second evaluation finds false."""
    plain = PlainPlant(document)
    return [p["kind"] for p in document["promises"] if not plain.holds(p)]


def test_a_table_is_proved_from_its_file_alone(document, report, tmp_path):
    assert report.faults == ()
    assert {p["kind"] for p in document["promises"]} >= {"stability", "peak sensitivity"}
    table = plant_table(design_of(document["problem"])).write(tmp_path / "gains.json")
    assert verify(tmp_path / "gains.json").proved
    assert read_table(tmp_path / "gains.json") == table


def test_a_second_evaluation_lies_in_every_proved_interval(document, report):
    plain = PlainPlant(document)
    for promise, finding in zip(document["promises"], report.findings, strict=True):
        subject = {key: promise["subject"].get(key, []) for key in SUBJECT}
        values = [plain.value(plain.models[name], promise, subject) for name in subject["models"] or plain.models]
        worst = max(values) if promise["sense"] == "<=" else min(values)
        low, high = finding.proved
        slack = 2e-5 * abs(worst)  # of a grid's refined peak and of Padé's poles
        assert low - slack <= worst <= high + slack, finding.name


def test_the_table_gives_back_the_models_and_the_structure_digit_for_digit(case, document):
    design, table = design_of(case), PlantTable.model_validate(document)
    for ours, theirs in zip(table.to_models(), design.problem.systems, strict=True):
        omega = np.array([0.1, 1.0, 7.0])
        assert ours.response(omega) == pytest.approx(theirs.response(omega), rel=1e-12)
        assert (ours.inputs, ours.outputs, ours.sample_time) == (theirs.inputs, theirs.outputs, theirs.sample_time)
    K, ours = design.structure.controller(), table.to_structure().controller()
    assert all(np.array_equal(getattr(K, key), getattr(ours, key)) for key in "ABCD")
    assert table.values() == dict(design.values)


def mutations(document):
    """Every number of the loop and of the promises: a hair, half as large again, turned, from zero."""
    for at, value in leaves(document):
        place = ".".join(map(str, at))
        if at[0] not in ("models", "structure", "promises") or isinstance(value, bool):
            continue
        if isinstance(value, str) and (at[-1] in ("value", "dead_time_s", "sample_time_s") or at[-3] in (*"ABCD",)):
            number = float(value)
            for factor in (1 + HAIR, 1.5, -1.0) if number else ():
                yield f"{place} × {factor}", put(at, repr(number * factor))
            if not number:
                yield f"{place} from zero", put(at, "1.0")
        elif isinstance(value, int | float):
            for factor in (1 + HAIR, 0.3, 3.0, -1.0) if value else ():
                yield f"{place} × {factor}", put(at, value * factor)
        elif isinstance(value, str) and at[0] == "promises":
            yield f"{place} turned", put(at, {"<=": ">=", ">=": "<="}.get(value, "bending"))
        elif isinstance(value, str) and at[-2] in ("inputs", "outputs") and at[0] == "structure":
            yield f"{place} turned", put(at, value[1:] if value.startswith("-") else f"-{value}")


def assert_noticed(document, some):
    """Each mutated table is refused, or true all the same."""
    for words, mutate in some:
        changed = signed(document, mutate)
        if passes(changed):
            assert false_promises(changed) == [], words


def test_no_mutated_number_of_a_sample_makes_a_false_table_pass(document):
    every = list(mutations(document))
    assert len(every) > 40
    rng = np.random.default_rng(5)
    assert_noticed(document, [every[k] for k in rng.choice(len(every), FAST, replace=False)])


@pytest.mark.slow
def test_no_mutated_number_of_many_makes_a_false_table_pass(document):
    every = list(mutations(document))
    order = np.random.default_rng(1).permutation(len(every))
    assert_noticed(document, [every[k] for k in order[:MANY]])


def test_limits_beyond_the_truth_are_refused_and_limits_inside_pass(document, report):
    stability = document["promises"][0]
    for promise, finding in list(zip(document["promises"], report.findings, strict=True))[1:]:

        def limited(limit, promise=promise):
            def change(d):
                d["requirements"], d["promises"] = [], [stability, {**promise, "limit": limit}]

            return passes(signed(document, change))

        low, high = finding.proved
        upper = finding.sense == "<="
        known, inside = (low, high) if upper else (high, low)
        if np.isfinite(known) and known > 0:
            assert limited(known * (0.999 if upper else 1.001)) is None, finding.name
        assert limited(inside * (1.001 if upper else 0.999)), finding.name


def test_every_figure_that_nobody_proves_is_listed(document, report):
    for at, value in leaves(document):
        if at[0] in ("models", "structure", "promises", "undecided", "digest", "format", "version"):
            continue
        place = ".".join(map(str, at[:2] if at[0] in ("requirements", "measured") else at[:1]))
        assert place in report.stated, (at, value)


def test_a_requirement_that_contradicts_itself_is_a_fault():
    document = plant_table(design_of("motor")).to_dict()
    for k, entry in enumerate(document["requirements"]):
        if not (entry["met"] and entry["value"]):
            continue
        worse = entry["limit"] * (2 if entry["sense"] == "<=" else 0.5)
        assert passes(signed(document, put(("requirements", k, "value"), worse))) is None
        if entry["hard"]:
            assert passes(signed(document, put(("requirements", k, "met"), False))) is None


@pytest.mark.parametrize("every_kth", [35, pytest.param(7, marks=pytest.mark.slow)])
def test_a_key_too_many_or_too_few_is_refused(every_kth):
    document = plant_table(design_of("motor")).to_dict()
    every = [m for m in of_keys(document) if not m[0].startswith(("measured", "versions"))]
    may_lack = ("without outputs", "without inputs", "without points", "without openings", "without models",
                "without band", "without model", "without method", "without upper")  # fmt: skip
    for words, mutate in every[::every_kth]:
        changed = signed(document, mutate)
        if words.endswith(may_lack) or "versions" in words or "options" in words:
            assert passes(changed) is None or false_promises(changed) == [], words
        else:
            assert passes(changed) is None, words


def test_a_promise_of_an_unknown_kind_is_not_proved_with_the_reason():
    document = plant_table(design_of("motor")).to_dict()
    odd = {"kind": "resistive control power", "sense": "<=", "limit": 32.0, "subject": {}}
    changed = signed(document, lambda d: d["promises"].append(odd))
    finding = verify_document(changed).findings[-1]
    assert (finding.verdict, finding.holds) == ("not proved", False)
    assert "no proof of the kind 'resistive control power'" in finding.reason


def test_a_table_without_the_promise_of_stability_does_not_hold():
    document = plant_table(design_of("motor")).to_dict()

    def without(d):
        d["promises"] = [p for p in d["promises"] if p["kind"] != "stability"]
        d["requirements"] = []

    assert passes(signed(document, without)) is None


def test_an_unstable_loop_is_promised_nothing():
    from workbench.design.record import given

    problem = design_of("pd").problem
    table = table_of(given(problem, {"Kp": -1.0}))
    assert table.promises == []
    assert any("not on model" in u.reason for u in table.undecided)


@pytest.mark.parametrize("unit", [1e-3, 60.0])
def test_another_unit_of_time_keeps_every_promise(unit):
    """s → s/unit in the model of the column: dead times × unit, limits of decay / unit, gains of the integrals too."""
    document = plant_table(design_of("column")).to_dict()

    def slower(d):
        for model in d["models"]:
            for key in "AB":
                model[key] = [[repr(float(x) / unit) for x in row] for row in model[key]]
            for line in model["lines"]:
                line["dead_time_s"] = repr(float(line["dead_time_s"]) * unit)
        for block in d["structure"]["blocks"]:
            for slot, p in block["parameters"].items():
                factor = {"Ki": 1 / unit, "Tf": unit, "Kd": unit}.get(slot, 1.0)
                p["value"] = repr(float(p["value"]) * factor)
        for p in d["promises"]:
            p["limit"] /= unit if p["kind"] == "decay rate" else 1.0

    assert passes(signed(document, slower))


def test_the_published_schema_is_the_models_and_accepts_every_table(document):
    from importlib.resources import files

    published = json.loads(
        files("workbench.handover.table").joinpath("plant_table.schema.json").read_text(encoding="utf-8")
    )
    assert published == schema()
    import jsonschema  # a second to import

    jsonschema.Draft202012Validator(published).validate(document)


@pytest.mark.parametrize(
    ("at", "value", "sentence"),
    [
        (("version",), 3, "version 1 or 2"),
        (("models", 0, "A", 0, 0), "nan", "models.0.A.0.0"),
        (("structure", "blocks", 0, "kind"), "magic", "kind of block"),
        (("structure", "blocks", 0, "parameters", "Kp", "value"), "1e999", "finite double"),
        (("models", 0, "sample_time_s"), "0", "sample"),
    ],
)
def test_an_unusable_table_is_refused_in_one_sentence(tmp_path, at, value, sentence):
    document = signed(plant_table(design_of("pd")).to_dict(), put(at, value))
    (tmp_path / "t.json").write_text(json.dumps(document))
    with pytest.raises(InputError, match=sentence) as refusal:
        read_table(tmp_path / "t.json")
    assert "\n" not in str(refusal.value)


def test_an_expression_cannot_stand_in_a_table():
    import casadi as ca

    from workbench.control.structure.block import Parameter
    from workbench.control.structure.space import expression
    from workbench.design.problem import Problem
    from workbench.design.record import given
    from workbench.lti.make import tf

    k = ca.SX.sym("k")
    block = expression("r - y", "u", [(Parameter("k", 0.5), k)], D=k)
    problem = Problem(models=tf([1.0], [1.0, 1.0], input="u", output="y"), structure=block, goals=[], name="x")
    with pytest.raises(InputError, match="of a kind that data can state"):
        plant_table(given(problem, {}))


HOSTILE = (None, True, -1, 0, 1e300, 10**30, "", "x" * 5000, "1" * 59, "1e39", "1e-39", [], {}, [[]], {"a": {}}, "NaN")


@pytest.mark.parametrize("name", ["motor", "sampled"])
def test_hostile_values_anywhere_are_refused_in_a_sentence_or_not_proved(name):
    document = plant_table(design_of(name)).to_dict()
    rng = np.random.default_rng(2)
    places = [at for at, _ in leaves(document) if at[0] not in ("measured", "versions")]
    places += [at[:-1] for at in places if len(at) > 1]
    for k in rng.choice(len(places), 60, replace=False):
        value = HOSTILE[int(rng.integers(len(HOSTILE)))]
        changed = signed(document, put(places[k], value))
        sentence = ""
        try:
            report = verify_document(changed, budget_seconds=5.0)
            if report.proved and places[k][0] in ("models", "structure", "promises"):
                assert false_promises(changed) == [], (places[k], value)
        except TableError as refusal:
            sentence = str(refusal)
        assert "\n" not in sentence, (places[k], value)
        assert len(sentence) < 500


@pytest.mark.parametrize("key", ["inputs", "outputs", "points", "openings", "band"])
def test_what_a_proof_does_not_look_at_must_not_stand_in_a_promise(key):
    document = plant_table(design_of("motor")).to_dict()
    value = [0.0, 1.0] if key == "band" else ["voltage"]
    for k, promise in enumerate(document["promises"]):
        if not promise["subject"].get(key):
            changed = signed(document, put(("promises", k, "subject"), {**promise["subject"], key: value}))
            report = verify_document(changed)
            looked_at = key == "band" and promise["kind"] not in ("stability", "variance", "delay margin")
            assert looked_at or key == "openings" or not report.findings[k].holds, promise


def test_a_point_that_is_open_has_no_margin():
    document = plant_table(design_of("sampled")).to_dict()
    for kind, sense in (("disk margin", ">="), ("peak sensitivity", "<="), ("delay margin", ">=")):
        subject = {"points": ["u"], "openings": ["u"]}
        promise = {"kind": kind, "sense": sense, "limit": 1.0, "subject": subject}
        finding = verify_document(signed(document, lambda d, p=promise: d["promises"].append(p))).findings[-1]
        assert finding.verdict == "not proved"
        assert "is open" in finding.reason


def test_a_requirement_held_by_another_promise_is_listed_with_that_promise():
    document = plant_table(design_of("motor")).to_dict()

    def by_stability(d):
        for entry in d["requirements"]:
            entry["promises"] = [0]

    report = verify_document(signed(document, by_stability))
    assert sum("stated to follow from 'stability' >= 0" in words for words in report.not_promised) == len(
        document["requirements"]
    )


def test_a_point_named_as_what_is_before_another_is_refused():
    document = plant_table(design_of("motor")).to_dict()

    def named(d):
        for model in d["models"]:
            model["outputs"] = ["before voltage" if y == "speed" else y for y in model["outputs"]]
        d["structure"]["blocks"][0]["inputs"] = ["before voltage"]

    with pytest.raises(TableError, match="also reads as a sum"):
        verify_document(signed(document, named))


@pytest.mark.parametrize(
    ("kind", "options", "sentence"),
    [
        ("state_space", {"order": 1, "sample_time_s": 0.1, "tustin_s": 0.1}, "sampled once"),
        ("state_space", {"order": 1, "sample_time_s": -0.1}, "sample_time_s must be positive"),
        ("gain", {"tustin_s": 0}, "tustin_s must be positive"),
        ("gain", {"mask": [["a"]]}, "0 or 1"),
    ],
)
def test_options_that_the_workbench_cannot_read_are_refused_by_the_checker(kind, options, sentence):
    names = {"gain": ("K",), "state_space": ("A_1_1", "B_1_1", "C_1_1")}[kind]
    block = {"kind": kind, "inputs": ["p"], "outputs": ["u"], "options": options,
             "parameters": {n: {"name": n, "value": "0.5"} for n in names}}  # fmt: skip
    document = plant_table(design_of("blocks")).to_dict()
    with pytest.raises(TableError, match=sentence):
        verify_document(signed(document, put(("structure", "blocks", 0), block)))
    with pytest.raises(ValueError, match=r"once|positive|0 or 1"):
        PlantTable.model_validate(signed(document, put(("structure", "blocks", 0), block)))


def test_a_parameter_with_bounds_of_its_own_stands_in_a_table_and_an_action_left_out_does_not():
    from workbench.control.structure.block import Parameter
    from workbench.control.structure.blocks import notch
    from workbench.design.problem import Problem
    from workbench.design.record import given
    from workbench.lti.make import tf

    broad = notch("r - y", "u", omega=5.0, zeta_zero=0.1, zeta_pole=Parameter("zeta_pole", 20.0, 0.0, 50.0))
    problem = Problem(models=tf([1.0], [1.0, 1.0], input="u", output="y"), structure=broad, goals=[], name="x")
    assert plant_table(given(problem, {})).values()["zeta_pole"] == 20.0
    document = plant_table(design_of("pd")).to_dict()
    changed = put(("structure", "blocks", 0, "parameters", "Ki", "value"), "0.5")
    with pytest.raises(ValueError, match="Ki is not among the parts"):
        PlantTable.model_validate(signed(document, changed))


def test_a_promise_that_fails_on_one_model_says_nothing_of_the_worst_of_those_after_it():
    document = plant_table(design_of("motor")).to_dict()
    promise = {"kind": "peak sensitivity", "sense": "<=", "limit": 1.0001, "subject": {"points": ["voltage"]}}
    finding = verify_document(signed(document, lambda d: d["promises"].append(promise))).findings[-1]
    assert finding.verdict == "fails"
    assert finding.proved[0] > 1.0001
    assert finding.proved[1] == np.inf


def test_a_promise_of_a_changed_plant_is_proved_of_that_plant():
    document = plant_table(design_of("motor")).to_dict()
    point = "voltage"

    def finding(kind, limit, **subject):
        sense = "<=" if kind == "peak sensitivity" else ">="
        promise = {"kind": kind, "sense": sense, "limit": limit, "subject": subject}
        return verify_document(signed(document, lambda d: d["promises"].append(promise))).findings[-1]

    changed = copy.deepcopy(document)
    for model in changed["models"]:
        column = model["inputs"].index(point)
        for row in (*model["B"], *model["D"]):
            row[column] = repr(0.8 * float(row[column]))
    plain = PlainPlant(changed)
    decay = min(-plain.poles(model).real.max() for model in plain.models.values())
    low, high = finding("decay rate", 1e-3, scaled={point: 0.8}).proved
    assert low * (1 - 1e-9) <= decay <= high * (1 + 1e-9)  # eigenvalues of the matrices changed by hand
    assert finding("decay rate", 0.99 * low, scaled={point: 0.8}).holds
    assert not finding("decay rate", 1.01 * high, scaled={point: 0.8}).holds
    assert not finding("stability", 0.0, scaled={point: -50.0}).holds
    assert not finding("stability", 0.0, scaled={"nothing": 0.8}).holds


def test_the_stability_of_a_changed_plant_is_not_that_of_the_plant():
    document = plant_table(design_of("motor")).to_dict()

    def only_changed(d):
        for p in d["promises"]:
            if p["kind"] == "stability":
                p["subject"]["scaled"] = {"voltage": 0.9}

    report = verify_document(signed(document, only_changed))
    assert any("must promise the stability of every model's loop" in fault for fault in report.faults)
