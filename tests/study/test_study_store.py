"""Rows that are kept: read back to the last digit or refused, whatever happened to their files."""

import json
import math
import random

import pytest

from workbench.errors import BudgetEnded, InputError
from workbench.machine.budget import Deadline
from workbench.study.file import read_study
from workbench.study.run import run_study
from workbench.study.store import Piece, opened

ROWS = [[1.5, True, None, ""], [-2.25e-7, False, math.inf, "no figures"], [3.0, None, -math.inf, ""]]


@pytest.fixture
def kept(tmp_path):
    """A folder with one piece of three rows, and a function that reads it back."""
    folder = tmp_path / "out"
    with opened(folder, {"any": 1}) as store:
        store.add(Piece(0, ROWS, 0.5))

    def read():
        with opened(folder, {"any": 1}) as store:
            return list(store.pieces(4))

    return folder / "rows" / "00000000.json", read


def test_rows_are_read_back_as_they_were_with_what_nothing_limits(kept):
    assert kept[1]() == [Piece(0, ROWS, 0.5)]


def test_one_changed_digit_is_refused_with_the_name_of_the_file(kept):
    path, read = kept
    path.write_text(path.read_text().replace("1.5,", "1.6,"))
    with pytest.raises(InputError, match=r"00000000\.json .* its checksum does not fit its content\. Delete it: only"):
        read()


@pytest.mark.parametrize("content", ["", "[1]", "null", "[" * 100_000, "{"])
def test_a_file_that_is_no_table_of_rows_may_be_deleted(kept, content):
    path, read = kept
    path.write_text(content)
    with pytest.raises(InputError, match=r"00000000\.json .* delete it: only its rows are computed again\.$"):
        read()
    path.unlink()
    assert read() == []


def test_every_single_character_changed_is_refused_or_changes_nothing(kept):
    path, read = kept
    text = path.read_text()
    rng = random.Random(1)
    for _ in range(300):
        k = rng.randrange(len(text))
        path.write_text(text[:k] + rng.choice('0123456789e.-+,[]{}" tx') + text[k + 1 :])
        try:
            assert read() == [Piece(0, ROWS, 0.5)]
        except InputError as refusal:
            assert "\n" not in str(refusal)  # noqa: PT017


@pytest.mark.parametrize(
    "change",
    [
        {"rows": None}, {"rows": {}}, {"rows": []}, {"rows": "abc"}, {"rows": [[1.0]]},
        {"rows": [[1.0, True, "x", ""]]},
        {"rows": [[1.0, True, None, 7]]}, {"rows": [None]}, {"rows": [[1.0, True, [], ""]]}, {"seconds": "long"},
        {"seconds": None}, {"first": 128}, {"sha256": "0"}, {"checksum": None},
    ],
)  # fmt: skip
def test_rows_of_another_shape_are_refused_even_if_signed_anew(kept, change):
    from workbench.study.store import _checksum

    path, read = kept
    document = {**json.loads(path.read_text()), **change}
    if "checksum" not in change:
        document["checksum"] = _checksum(document)
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"must hold finished rows of this study"):
        read()


def test_rows_under_another_number_are_refused(kept):
    path, read = kept
    path.rename(path.with_name("00000003.json"))
    with pytest.raises(InputError, match="its rows begin at 0"):
        read()


def test_a_planted_link_in_place_of_the_lock_keeps_its_target(study_file, tmp_path):
    target = tmp_path / "precious"
    target.write_text("mine")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "study.lock").symlink_to(target)
    with pytest.raises(InputError, match=r"study\.lock must be writable"):
        run_study(read_study(study_file()), tmp_path / "out")
    assert target.read_text() == "mine"


def test_a_deleted_piece_is_computed_again_and_nothing_else(study_file, tmp_path):
    study = read_study(study_file(300))
    whole = run_study(study, tmp_path / "out", size=128)
    (tmp_path / "out" / "rows" / "00000128.json").unlink()
    done = []
    assert run_study(study, tmp_path / "out", on_rows=lambda n, total: done.append(n)).columns == whole.columns
    assert done == [172, 300]


def test_a_budget_that_is_over_keeps_what_is_finished_and_the_rest_comes_later(study_file, tmp_path):
    study = read_study(study_file(300))
    with pytest.raises(BudgetEnded, match="the study, whose finished rows are kept"):
        run_study(study, tmp_path / "out", size=128, deadline=Deadline.after(1e-9))
    assert [p.name for p in sorted((tmp_path / "out" / "rows").iterdir())] == ["00000000.json"]
    done = []
    again = run_study(study, tmp_path / "out", on_rows=lambda n, total: done.append(n))
    assert done[0] == 128
    assert again.columns == run_study(study, tmp_path / "whole").columns


@pytest.mark.parametrize("taken", ["table.csv", "summary.json", "report.html"])
def test_a_folder_where_an_output_goes_is_refused_before_any_row(study_file, tmp_path, taken, capsys):
    from workbench.cli import run

    (tmp_path / "out" / taken).mkdir(parents=True)
    assert run(["study", str(study_file()), "--out", str(tmp_path / "out")]) == 2
    assert f"{taken} must be a file's path; a folder is there" in capsys.readouterr().err
    assert not list((tmp_path / "out").glob("rows/*"))
