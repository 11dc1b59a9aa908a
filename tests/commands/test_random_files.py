"""Whatever stands in a data file or a gains file: it loads, or one sentence says what must hold."""

import json
import tempfile
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from workbench.control import GAIN_NAMES, Gains
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.files.gains import read_gains
from workbench.files.problem import load_problem, shipped_problems

DATA = {name: (folder / "data.toml").read_text("utf-8").splitlines() for name, folder in shipped_problems().items()}
MANY = settings(
    max_examples=120, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)

WORDS = st.sampled_from([
    "nan", "inf", "-inf", "1e400", "0", "-0.0", "-1", "true", '"text"', '""', '"nan"', "[]", "[1.0, 2.0]", "[nan, 1.0]",
    "[5, -5]", "{}", "{a = 1}", "[[[[1]]]]", "[" * 200, "9" * 30, "9" * 5000, "2020-01-01", "1e-30", "1e15",
    '["A1"]', '["A1", "A1"]', '["heave"]', '["sway_roll_yaw"]', '["heave", "heave_pitch"]', '"fra"', '"german"',
])  # fmt: skip
NUMBERS = st.floats(-1e15, 1e15).map(repr)
VALUES = st.one_of(WORDS, NUMBERS)
LINES = st.sampled_from(
    ["extra = 1", "[extra]", "K_hh = 3.0", "[[problem]]", "a.b.c = 1", "weight_n = 1.0", "\x00", "é"]
)
KINDS = ("value", "value", "value", "delete", "insert", "key", "letter")
CHANGES = st.lists(
    st.tuples(st.sampled_from(KINDS), st.integers(0, 10**6), VALUES, LINES),
    min_size=1, max_size=3,
)  # fmt: skip


def changed(lines: list[str], changes) -> str:
    """The lines with values replaced, lines deleted or inserted, keys renamed, single letters lost."""
    out = list(lines)
    for kind, number, value, line in changes:
        assigned = [k for k, text in enumerate(out) if "=" in text]
        k = assigned[number % len(assigned)]
        key = out[k].split("=")[0]
        if kind == "value":
            out[k] = f"{key}= {value}"
        elif kind == "delete":
            del out[k]
        elif kind == "insert":
            out.insert(k, line)
        elif kind == "key":
            out[k] = f"{key.strip()}_{out[k][len(key) :]}"
        else:
            at = number % max(len(out[k]), 1)
            out[k] = out[k][:at] + out[k][at + 1 :]
    return "\n".join(out)


def attempt(work):
    """What the work returns, or None where it refuses in one line of bounded length that ends like a sentence."""
    try:
        return work()
    except InputError as error:
        text = " ".join(str(error).split())
    assert 20 < len(text) < 1000
    assert text.endswith((".", ")."))
    return None


FILES = given(name=st.sampled_from(sorted(DATA)), changes=CHANGES)


@MANY
@FILES
def test_a_changed_data_file_loads_or_is_refused_in_one_sentence(name, changes):
    loads_or_is_refused(name, changes)


@pytest.mark.slow
@settings(MANY, max_examples=2000)
@FILES
def test_thousands_of_changed_data_files_load_or_are_refused(name, changes):
    loads_or_is_refused(name, changes)


def loads_or_is_refused(name, changes):
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "data.toml").write_text(changed(DATA[name], changes), "utf-8")
        assert isinstance(attempt(lambda: load_problem(folder)), Problem | None)


SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=20),
    st.sampled_from(["1e400", "0x10", "nan", "1_0", " 2 "]),
)  # fmt: skip
ANYTHING = st.recursive(
    SCALARS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3)
)
GOOD = st.fixed_dictionaries({name: st.floats(0.03, 3.0) for name in GAIN_NAMES})
SPOILT = st.dictionaries(st.sampled_from([*GAIN_NAMES, "K_hh", "", "gains", "K_h "]), ANYTHING, max_size=3)


@MANY
@given(good=GOOD, spoilt=SPOILT, dropped=st.sets(st.sampled_from(GAIN_NAMES), max_size=2), wrapped=st.booleans())
def test_a_changed_gains_file_is_read_or_refused_in_one_sentence(good, spoilt, dropped, wrapped):
    mapping = {name: value for name, value in (good | spoilt).items() if name not in dropped}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "gains.json"
        path.write_text(json.dumps({"gains": mapping} if wrapped else mapping), "utf-8")
        gains = attempt(lambda: read_gains(path))
    if gains is not None:
        assert isinstance(gains, Gains)
        assert gains.as_dict() == {name: float(mapping[name]) for name in GAIN_NAMES}


@MANY
@given(content=st.binary(max_size=60), ending=st.sampled_from([".toml", ".json", ""]))
def test_any_bytes_are_refused_in_one_sentence_as_gains(content, ending):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"gains{ending}"
        path.write_bytes(content)
        assert attempt(lambda: read_gains(path)) is None  # sixty bytes never hold seventeen names
