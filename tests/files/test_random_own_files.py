"""Whatever number, word or list stands in the place of another: a plant's data file loads, or one sentence says why."""

import re
import tempfile
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.files.problem import load_problem, shipped_problems, shipped_vehicles

OWN = sorted(set(shipped_problems()) - set(shipped_vehicles()))
TEXT = {name: (shipped_problems()[name] / "data.toml").read_text("utf-8") for name in OWN}
VALUE = re.compile(r'(?<![\w."])-?\d+(?:\.\d+)?(?:[eE]-?\d+)?\b|\btrue\b|\bfalse\b|"[^"\n]*"')
PLACES = {name: [m.span() for m in VALUE.finditer(re.sub("#[^\n]*", lambda c: "#" * len(c[0]), text))]
          for name, text in TEXT.items()}  # fmt: skip
VALUES = st.one_of(
    st.sampled_from([
        "0", "-0.0", "-1", "1", "2", "7", "50", "1e3", "-1e6", "1e15", "1e60", "1e300", "1e-30", "-1e-9", "true",
        "false", '""', '"r"', '"u"', '"speed"', '"voltage"', '"Kp"', '"pid"', '"gain"', '"notch"', '"poles"',
        "[]", "[0.0]", "[1.0, 2.0]", "[[1.0]]", "{}", "{value = 1}", "inf", "-inf", "nan", "9" * 400,
    ]),
    st.floats(-1e3, 1e3).map(repr),
)  # fmt: skip
CHANGES = given(
    name=st.sampled_from(OWN), changes=st.lists(st.tuples(st.integers(0, 10**6), VALUES), min_size=1, max_size=2)
)


def loads_or_is_refused(name, changes):
    text, places = TEXT[name], PLACES[name]
    chosen = {places[number % len(places)]: value for number, value in changes}
    for (start, end), value in sorted(chosen.items(), reverse=True):
        text = text[:start] + value + text[end:]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "data.toml").write_text(text, "utf-8")
        try:
            assert isinstance(load_problem(folder), Problem)
        except InputError as error:
            sentence = str(error)
            assert 20 < len(sentence) < 1000
            assert sentence.count("\n") == 0
            assert sentence.endswith((".", ")."))


@settings(max_examples=200, deadline=None, derandomize=True)
@CHANGES
def test_a_changed_plant_loads_or_is_refused_in_one_sentence(name, changes):
    loads_or_is_refused(name, changes)


@pytest.mark.slow
@settings(max_examples=3000, deadline=None, derandomize=True)
@CHANGES
def test_thousands_of_changed_plants_load_or_are_refused(name, changes):
    loads_or_is_refused(name, changes)
