"""A new folder is a whole problem or nothing, and takes the place of nothing."""

import json

import numpy as np
import pytest

import workbench.files.new as module
from workbench.cli import run
from workbench.errors import InputError
from workbench.files.new import new
from workbench.files.problem import load_problem, shipped_problems


@pytest.mark.parametrize("like", ["dc_motor", "heave"])
def test_a_new_folder_holds_the_same_problem_with_its_comments(tmp_path, like):
    made = new(tmp_path / "deep" / "mine", like)
    text = (tmp_path / "deep" / "mine" / "data.toml").read_text("utf-8")
    assert text == (shipped_problems()[like] / "data.toml").read_text("utf-8")
    assert "# " in text
    assert set(made.files) == {path.name for path in (tmp_path / "deep" / "mine").iterdir()}
    mine, theirs = load_problem(made.folder), load_problem(like)
    assert (mine.name, mine.title, mine.data_sha256) == ("mine", theirs.title, theirs.data_sha256)
    assert mine.goals == theirs.goals


def test_a_folder_begins_like_a_problem_made_in_a_program(tmp_path):
    motor = load_problem("dc_motor")
    again = load_problem(new(tmp_path / "mine", motor).folder)
    assert np.array_equal(again.systems[0].plant.A, motor.systems[0].plant.A)
    assert again.structure.parameters == motor.structure.parameters


@pytest.mark.parametrize("there", ["file", "folder", "link"])
def test_what_is_there_stays(tmp_path, there):
    place = tmp_path / "mine"
    if there == "file":
        place.write_text("precious")
    elif there == "folder":
        place.mkdir()
    else:
        place.symlink_to(tmp_path / "nowhere")
    with pytest.raises(InputError, match="must not be there yet"):
        new(place, "dc_motor")
    assert [path.name for path in tmp_path.iterdir()] == ["mine"]
    assert there != "file" or place.read_text() == "precious"


def test_nothing_is_left_of_a_folder_that_could_not_be_made_whole(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "_files", lambda source: {"data.toml": b"x", "no/such\0name": b""})
    with pytest.raises(InputError):
        new(tmp_path / "mine", "dc_motor")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("folder", "like", "sentence"),
    [("m", "dc_moter", "did you mean 'dc_motor'"), ("m", ".", "must hold data.toml"), ("m\0", "dc_motor", "a name")],
)
def test_what_cannot_be_taken_after_is_refused(tmp_path, monkeypatch, folder, like, sentence):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=sentence):
        new(folder, like)
    assert list(tmp_path.iterdir()) == []


def test_the_command_makes_the_folder_and_says_what_comes_next(tmp_path, capsys):
    assert run(["new", str(tmp_path / "mine")]) == 0
    assert f"workbench design {tmp_path / 'mine'}" in capsys.readouterr().out
    assert run(["new", str(tmp_path / "other"), "--like", "heave", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == load_problem("heave").title
    assert run(["new", str(tmp_path / "mine")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
