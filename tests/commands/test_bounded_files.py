"""A small file never costs much: depth, parts of keys, keys and lengths are bounded before anything is parsed."""

import json
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.files.problem import shipped_problems
from workbench.machine.reading import DEEPEST, LARGEST_FILE, MOST_KEYS, MOST_PARTS, read_mapping, shown

N = 100_000  # tomllib takes 21 GB for a key of so many dots, and any decoder recurses as deep as the brackets go
COSTLY = {
    "dots": "a" + ".a" * N + " = 1",
    "dots in a table's name": "[a" + ".a" * N + "]",
    "quoted dots": "a" + '."a"' * N + " = 1",
    "dots with spaces": "a" + " \t.\t a" * N + " = 1",
    "dots in an inline table": "x = {y = {a" + ".a" * N + " = 1}}",
    "dots in an inline table of an array": "x = [1, {a" + ".'a'" * N + " = 1}]",
    "dots after a string": 'x = """\\""" # a"""\n\'"""\' = 1\na' + ".a" * N + " = 1",
    "brackets": "a = " + "[" * N,
    "inline tables": "a = " + "{a=" * N,
    "keys": "".join(f"k{k} = 1\n" for k in range(MOST_KEYS + 1)),
    "tables": "".join(f"[k{k}]\n" for k in range(MOST_KEYS + 2)),
    "digits": "a = " + "9" * N,
    "hexadecimal digits": "a = 0x" + "f" * N,
    "a long name": "a" * N + " = 1",
}
FILES = {
    "data.toml": ("analyse", "{folder}"), "study.toml": ("study", "{file}"),
    "gains.toml": ("analyse", "heave", "--gains", "{file}"), "gains.json": ("export", "{file}", "--format", "csv"),
}  # fmt: skip


@pytest.mark.parametrize("kind", COSTLY)
def test_a_costly_text_is_refused_before_it_is_parsed(tmp_path, monkeypatch, kind):
    path = tmp_path / "x.toml"
    path.write_text(COSTLY[kind])
    monkeypatch.setattr(tomllib, "loads", lambda _: pytest.fail("parsed"))
    with pytest.raises(InputError, match=r"must not be nested deeply|must have at most|thousands of digits"):
        read_mapping(path)


@pytest.mark.parametrize("content", ['{"a":' * N, "[" * N, '{"a": ' + "9" * N + "}", '{"":1,' * (MOST_KEYS + 1)])
def test_a_costly_json_is_refused_before_it_is_parsed(tmp_path, monkeypatch, content):
    path = tmp_path / "x.json"
    path.write_text(content)
    monkeypatch.setattr(json, "loads", lambda *_, **__: pytest.fail("parsed"))
    with pytest.raises(InputError, match=r"must not be nested deeply|must have at most|thousands of digits"):
        read_mapping(path)


@pytest.mark.parametrize("name", FILES)
def test_every_reader_refuses_a_key_of_many_parts_and_deep_brackets(refused, tmp_path, name):
    path = tmp_path / name
    arguments = [a.format(folder=tmp_path, file=path) for a in FILES[name]]
    if name != "data.toml" and name != "gains.toml":
        arguments += ["--out", str(tmp_path / "out")]
    deep = '{"a": ' * 5000 + "1" + "}" * 5000
    nested = (COSTLY["dots"], "problem = [{x = " + "[" * N, "a = [{x" + ".a" * 5000 + " = 1}]")
    for text in (deep,) if name.endswith("json") else nested:
        path.write_text(text)
        assert "must not be nested deeply" in refused(*arguments)


def test_what_is_allowed_is_read(tmp_path):
    path = tmp_path / "x.toml"
    key = ".".join("a" * 1 for _ in range(MOST_PARTS))
    path.write_text(f"{key} = {'[' * DEEPEST}{']' * DEEPEST}\nb = '{'.' * N}{'[' * N}' # {'a.' * N}\n")
    assert len(read_mapping(path)["b"]) == 2 * N
    path = tmp_path / "x.json"
    path.write_text(json.dumps({"a": ".[{" * N, "b\\": '"' * N}))
    assert len(read_mapping(path)["a"]) == 3 * N


def test_every_shipped_file_keeps_far_from_the_bounds():
    for folder in shipped_problems().values():
        for path in folder.glob("*.toml"):
            assert read_mapping(path) == tomllib.loads(path.read_text("utf-8"))
            assert path.stat().st_size < LARGEST_FILE / 100
        for path in folder.glob("*.json"):
            assert read_mapping(path) == json.loads(path.read_text("utf-8"))
            assert path.stat().st_size < LARGEST_FILE / 4


WORDS = st.sampled_from(
    ['"', "'", '"""', "'''", "\\", "#", "\n", ".", "[", "]", "{", "}", "=", ",", " ", "a", "1", "[[", "]]", "\\u0041"]
)


@given(st.lists(WORDS, max_size=40).map("".join))
def test_a_text_is_read_as_the_decoder_reads_it_or_refused(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("texts") / "x.toml"
    path.write_text(text, newline="")
    try:
        expected = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        with pytest.raises(InputError, match="must be valid TOML"):
            read_mapping(path)
    else:
        assert read_mapping(path) == expected


def test_a_refusal_shows_scalars_and_only_tells_of_what_is_larger():
    assert shown(-0.01) == "-0.01"
    assert shown("x" * 1000) == "x" * 60
    assert shown([1.0, 2.0]) == "[1.0, 2.0]"
    assert shown([[1.0]]) == "a list of 1"
    assert shown(list(range(10**6))) == "a list of 1000000"
    assert shown({"a": {"b": 1}}) == "a mapping"
