"""Study files: what is read, and the sentence that refuses what cannot be."""

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.study.file import read_study
from workbench.study.run import run_study
from workbench.study.source import Source

EXAMPLES = sorted((Path(__file__).parents[2] / "notebooks" / "studies").glob("*.toml"))
GOOD = '[study]\nproblem = "heave"\ncount = 4\n[[parameter]]\nname = "mass"\nrange = [0.9, 1.1]\n'


def read(tmp_path, text):
    path = tmp_path / "s.toml"
    path.write_text(text, encoding="utf-8")
    return read_study(path)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_every_example_can_be_read(path):
    assert read_study(path).rows_planned > 1


def test_there_are_examples():
    assert len(EXAMPLES) >= 2


def test_the_robustness_example_varies_the_approved_gains_within_its_limits(tmp_path):
    text = next(p for p in EXAMPLES if p.stem == "how_robust_are_the_gains").read_text().replace("10_000", "64")
    result = run_study(read(tmp_path, text), tmp_path / "out")
    assert result.failing.share < 0.5
    assert {i.parameter for i in result.indices} >= {"mass", "inertia.pitch"}


def test_limits_of_a_sweep_come_in_the_unit_of_their_key(tmp_path):
    sweep = '[[pareto]]\nrequirement = "rms_gap_front_at_most_mm"\nlimits = [18.0]\n'
    sweep = read(tmp_path, '[study]\nproblem = "heave"\ntask = "pareto"\n' + sweep).sweeps[0]
    assert sweep.requirement == "rms gap, front"
    assert sweep.limits == pytest.approx((0.018,))


def test_gains_and_problems_are_found_beside_the_study(tmp_path):
    names = load_problem("heave").approved.as_dict()
    (tmp_path / "g.toml").write_text("\n".join(f"{n} = {v!r}" for n, v in names.items()))
    assert read(tmp_path, GOOD.replace("count = 4", 'count = 4\ngains = "g.toml"')).gains == names


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("count = 4", "count = 4\ncuont = 4", r"key 'study.cuont' is not known"),
        ('problem = "heave"\n', "", r"key 'study.problem' is missing; add it"),
        ("count = 4", "count = 0", r"must have a count of at least 1; got 0"),
        ("count = 4", "count = 4.5", r"study.count is not usable"),
        ("[0.9, 1.1]", "[1.1, 0.9]", r"'mass' must have a rising range"),
        ("range = [0.9, 1.1]", "", r"a parameter must have a range or values"),
        ("range = [0.9, 1.1]", "range = [0.9, 1.1]\nvalues = [1.0]", r"values stand alone"),
        ("range = [0.9, 1.1]", 'range = [0.9, 1.1]\ndistribution = "normal"', r"must have mean and deviation"),
        ("range = [0.9, 1.1]", "range = [0.9, inf]", r"is not usable"),
        ("count = 4", 'count = 4\nsampling = "grid"', r"of a grid must give values, or a range with levels"),
        ("count = 4", "count = 4\nseed = -1", r"study.seed is not usable"),
        ("[[parameter]]", '[[pareto]]\nrequirement = "stroke"\nlimits = [1.0]\n[[parameter]]', r"unknown requirement"),
        ("count = 4", 'count = 9_000_000\nsampling = "sobol"', r"at most 10000000 rows; this one asks for 27000000"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_in_one_sentence(tmp_path, old, new, sentence):
    assert old in GOOD
    with pytest.raises(InputError, match=sentence) as refusal:
        read(tmp_path, GOOD.replace(old, new, 1))
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 1000


def test_an_unknown_problem_is_refused_with_the_nearest(tmp_path):
    with pytest.raises(InputError, match=r"unknown problem 'heaev'; did you mean 'heave'"):
        run_study(read(tmp_path, GOOD.replace("heave", "heaev")), tmp_path / "out")


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=5,
)
KEYS = st.sampled_from(
    [
        "problem",
        "task",
        "sampling",
        "count",
        "seed",
        "quantities",
        "starts",
        "output",
        "name",
        "range",
        "values",
        "mean",
    ]
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.dictionaries(KEYS, VALUES, max_size=4), st.lists(st.dictionaries(KEYS, VALUES, max_size=4), max_size=2))
def test_whatever_a_file_holds_is_read_or_refused(tmp_path, study, parameters):
    import json

    path = tmp_path / "s.json"  # the same reader takes JSON, which hypothesis can write
    path.write_text(json.dumps({"study": {"problem": "heave", **study}, "parameter": parameters}), encoding="utf-8")
    with suppress(InputError):  # and nothing else
        read_study(path)


def test_numbers_of_the_data_go_by_dotted_path_into_lists_too():
    source = Source.of("heave")
    numbers = source.numbers()
    path = "force_law.lift.1"
    changed = source.problem({path: 1.1 * numbers[path]})
    same = source.problem({path: numbers[path]})
    plain = load_problem("heave")
    assert (same.setting.plant.A == plain.setting.plant.A).all()
    assert not (changed.setting.plant.A == plain.setting.plant.A).all()


def test_a_source_travels_as_text_to_where_its_folder_is_not():
    import pickle
    from dataclasses import replace

    source = pickle.loads(pickle.dumps(replace(Source.of("heave"), folder="/nowhere")))
    assert (source.problem().setting.plant.A == load_problem("heave").setting.plant.A).all()
