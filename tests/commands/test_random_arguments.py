"""Whatever is typed after `workbench`, and whatever stands in a gain table: an answer, or one sentence."""

import contextlib
import io
import json
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from workbench.cli import run
from workbench.errors import InfeasibleError, InputError
from workbench.files.problem import shipped_problems
from workbench.handover.code.formats import FORMATS, render
from workbench.handover.table.table import GainTable, digest_of, read_table

TABLE = shipped_problems()["heave"] / "approved.json"
MANY = settings(
    max_examples=120, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
THOUSANDS = settings(MANY, max_examples=3000)

NAMES = ["heave", "no_such_problem", "", ".", "/", "\x00", "é" * 40, str(TABLE), "-", "--"]
NUMBERS = ["0", "-1", "1e400", "nan", "inf", "0.3", "1e-300", "12345678901234567890", "abc", "", "0x10", "١"]
OPTIONS = [
    "--json", "--help", "--gains", "--speed", "--h", "--h-prime", "--roll", "--alpha", "--physics", "--x", "--y", "--z",
    "--pitch", "--yaw", "--coils", "--latex", "--format", "--sample-time-ms", "--computing-delay-ms", "--problem",
    "--no-such-option", "-q",
]  # fmt: skip
WORDS = st.one_of(
    st.sampled_from(NAMES), st.sampled_from(NUMBERS), st.sampled_from(OPTIONS), st.sampled_from(FORMATS),
    st.sampled_from(["report", "scaled", "slab"]), st.text(max_size=12).filter(lambda t: not t.startswith("@")),
)  # fmt: skip
# commands that look and do not search, with what makes their first word valid often enough to get past it
COMMANDS = {
    "problems": [], "analyse": ["heave"], "model": ["heave"], "compare": ["heave"], "forces": [], "motor": [],
    "export": [str(TABLE)], "desing": [], "": [],
}  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def elsewhere(tmp_path_factory):
    """A folder of its own, should an argument name a file to write."""
    with contextlib.chdir(tmp_path_factory.mktemp("arguments")):
        yield


ARGUMENTS = given(command=st.sampled_from(sorted(COMMANDS)), words=st.lists(WORDS, max_size=4), first=st.booleans())


def answered(command, words, first):
    out, err = io.TextIOWrapper(io.BytesIO(), "utf-8"), io.StringIO()
    arguments = [command, *(COMMANDS[command] if first else []), *words]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run(arguments)
    said = err.getvalue().strip()
    assert code in (0, 1, 2)
    if code == 2 and said:
        assert len(said.splitlines()) == 1
        assert "Traceback" not in said
    if code == 0 and "--json" in words and "--help" not in words:
        out.flush()
        json.loads(out.buffer.getvalue())


@MANY
@ARGUMENTS
def test_any_arguments_give_an_answer_or_one_sentence(command, words, first):
    answered(command, words, first)


@pytest.mark.slow
@THOUSANDS
@ARGUMENTS
def test_thousands_of_arguments_give_an_answer_or_one_sentence(command, words, first):
    answered(command, words, first)


DOCUMENT = json.loads(TABLE.read_text("utf-8"))
SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(-10, 10**20), st.floats(allow_nan=False), st.text(max_size=8),
    st.sampled_from(["1e999", "nan", "-0.0", "1" * 500, "0x1p3", " 1", "𝟏"]), st.just([]), st.just({}),
)  # fmt: skip


def places(value, path=()):
    """Every path into the document."""
    yield path
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield from places(inner, (*path, key))


PATHS = sorted({p[:3] for p in places(DOCUMENT) if p}, key=repr)


def replaced(document, path, value, how):
    """The document with one place changed, removed, or given a neighbour."""
    copy = json.loads(json.dumps(document))
    inner = copy
    for key in path[:-1]:
        inner = inner[key]
    if how == "remove":
        del inner[path[-1]]
    elif how == "add" and isinstance(inner, dict):
        inner["surprise"] = value
    else:
        inner[path[-1]] = value
    return copy


CHANGES = given(
    path=st.sampled_from(PATHS), value=SCALARS, how=st.sampled_from(["change", "change", "remove", "add"]),
    signed=st.booleans(),
)  # fmt: skip


@MANY
@CHANGES
def test_a_changed_gain_table_is_read_and_exported_or_refused_in_one_sentence(path, value, how, signed):
    read_or_refused(path, value, how, signed)


@pytest.mark.slow
@THOUSANDS
@CHANGES
def test_thousands_of_changed_gain_tables_are_read_or_refused(path, value, how, signed):
    read_or_refused(path, value, how, signed)


def read_or_refused(path, value, how, signed):
    document = replaced(DOCUMENT, path, value, how)
    if signed:
        try:
            document["digest"] = digest_of(document)
        except ValueError:
            return  # a number that has no JSON
    file = Path("changed.json")
    file.write_text(json.dumps(document), "utf-8")
    try:
        table = read_table(file)
        assert isinstance(table, GainTable)
        for format in FORMATS:
            render(table, format)
    except (InputError, InfeasibleError) as error:
        text = " ".join(str(error).split())
        assert 20 < len(text) < 1500
        assert text.endswith((".", ")."))
