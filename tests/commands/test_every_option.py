"""Every option of every command does what it says: two calls that differ in it alone, and what must differ.

The options come from the commands themselves; one without a statement in `option_statements` fails here.
"""

import json
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest
import typer
from option_statements import STATEMENTS, Words

from workbench.cli import app
from workbench.files.problem import shipped_problems

STUDY = '[study]\nproblem = "heave"\ncount = 12\noutput = "csv"\n[[parameter]]\nname = "K_h"\nrange = [1.0, 4.0]\n'


def every_option() -> set[tuple[str, str]]:
    commands = typer.main.get_command(app).commands
    return {
        (name, parameter.opts[0].lstrip("-"))
        for name, command in commands.items()
        for parameter in command.params
        if parameter.param_type_name == "option"
    }


def test_every_option_has_a_statement_and_every_statement_an_option():
    assert every_option() == set(STATEMENTS)


def at(document: Any, path: str) -> Any:
    for step in path.split("."):
        document = document.get(step) if isinstance(document, dict) else None
    return document


@pytest.fixture
def places(tmp_path):
    """What capital words stand for: a study; one of a problem with a program of its own; another folder."""
    (tmp_path / "one.toml").write_text(STUDY)
    (tmp_path / "own").mkdir()
    for name in ("data.toml", "approved.json", "problem.py"):
        shutil.copy(shipped_problems()["heave"] / name, tmp_path / "own" / name)
    (tmp_path / "own.toml").write_text(STUDY.replace('"heave"', '"own"'))
    (tmp_path / "kp.toml").write_text("Kp = 15.0\n")
    return {
        "KP": tmp_path / "kp.toml",
        "STUDY": tmp_path / "one.toml",
        "OWN": tmp_path / "own.toml",
        "ELSEWHERE": tmp_path / "elsewhere",
    }


def placed(part: str, places: dict[str, Path]) -> str:
    name, slash, rest = part.partition("/")
    return f"{places[name]}{slash}{rest}" if name in places else part


@pytest.mark.parametrize(
    ("key", "words"),
    [pytest.param(k, w, marks=pytest.mark.slow if w.slow else (), id=" --".join(k)) for k, w in STATEMENTS.items()],
)
def test_an_option_moves_what_it_is_for(command, places, tmp_path, key: tuple[str, str], words: Words):
    folders = [tmp_path / "first", tmp_path / "second"]
    if key == ("study", "fresh"):  # throws away what is there
        folders = folders[:1] * 2
    calls = zip(folders, (words.one, words.other), (0, words.code), strict=True)
    seen = []
    for folder, more, code in calls:
        folder.mkdir(exist_ok=True)
        seen.append(command(*(placed(w, {**places, "OUT": folder}) for w in shlex.split(f"{words.base} {more}"))))
        assert seen[-1].code == code, seen[-1].err
    for name in words.moves:
        if name == "text":
            assert seen[0].out != seen[1].out
        elif name.startswith("file "):
            first, second = (f / name.removeprefix("file ") for f in folders)
            assert second.is_file()
            assert not first.is_file() or first.read_bytes() != second.read_bytes()
        else:
            assert at(json.loads(seen[0].out), name) != at(json.loads(seen[1].out), name), name
    assert words.moves or words.code


@pytest.mark.parametrize("option", [("--sample-time-ms", "2"), ("--computing-delay-ms", "2"), ("--accept",)])
def test_an_option_of_the_sampled_check_is_refused_where_there_is_none(refused, option):
    sentence = refused("export", shipped_problems()["heave"] / "approved.json", "--format", "csv", *option)
    assert option[0] in sentence
