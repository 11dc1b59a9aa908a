"""What makes another study: its problem's own code and files, other gains, another workbench. And who runs the code."""

import json
import pickle
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

import workbench.study.run
from workbench.errors import InputError
from workbench.files.problem import shipped_problems
from workbench.study.file import read_study
from workbench.study.folder import workbench_sha256
from workbench.study.run import run_study
from workbench.study.source import Source

HELPED = """
import sys
from pathlib import Path
sys.path.insert(0, str(Path(__file__).parent))
factor = float((Path(__file__).parent / "tables" / "factor.txt").read_text())


def problem(data):
    from dataclasses import replace

    whole = data.build()
    (Path(__file__).parent / "tables" / "factor.txt").read_text()  # again, while it builds
    return replace(whole, title=f"{whole.title} {factor}")
"""
STUDY = """
[study]
problem = "own"
count = 4
output = "csv"
[[parameter]]
name = "K_h"
range = [1.0, 4.0]
"""


@pytest.fixture
def own(tmp_path):
    """A study beside a problem of one's own, whose problem.py reads a file; (study, folder)."""
    folder = tmp_path / "own"
    (folder / "tables").mkdir(parents=True)
    for name in ("data.toml", "approved.json"):
        shutil.copy(shipped_problems()["heave"] / name, folder / name)
    (folder / "problem.py").write_text(HELPED)
    (folder / "tables" / "factor.txt").write_text("2.0")
    (tmp_path / "s.toml").write_text(STUDY)
    return read_study(tmp_path / "s.toml"), folder


def test_a_problem_py_of_somebody_is_run_only_with_trust(own, tmp_path):
    study, folder = own
    (folder / "problem.py").write_text("raise SystemExit(0)")
    with pytest.raises(InputError, match=r"own/problem\.py is a program .* give --trust"):
        run_study(study, tmp_path / "out")


def test_a_shipped_problem_and_a_folder_of_data_alone_need_no_trust(own, tmp_path):
    study, folder = own
    Source.of("heave")
    Source.of(str(shipped_problems()["heave"]))
    (folder / "problem.py").unlink()
    assert len(run_study(study, tmp_path / "out").columns["row"]) == 4


def test_the_command_asks_for_trust_and_takes_it(own, tmp_path):
    from workbench.cli import run

    words = ["study", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out"), "--workers", "1", "--json"]
    assert run(words) == 2
    assert run([*words, "--trust"]) == 0


@pytest.mark.parametrize("changed", ["tables/factor.txt", "problem.py", "tables/new.csv"])
def test_a_changed_or_new_file_beside_problem_py_makes_another_study(own, tmp_path, changed):
    study, folder = own
    run_study(study, tmp_path / "out", trust=True)
    path = folder / changed
    path.write_text((path.read_text() if path.exists() else "") + "\n")
    with pytest.raises(InputError, match=rf"another study \(problem_files\.{changed} differs\)"):
        run_study(study, tmp_path / "out", trust=True)


def test_outputs_in_the_folder_and_hidden_files_do_not(own):
    study, folder = own
    one = run_study(study, folder / "mine", trust=True)  # a study's own folder is none of the problem's
    (folder / "results").mkdir()
    (folder / "results" / "gains.json").write_text("{}")
    (folder / ".notes").write_text("x")
    done = []
    again = run_study(study, folder / "mine", trust=True, on_rows=lambda n, total: done.append(n))
    assert done == [4]
    assert again.columns == one.columns


def test_other_approved_gains_make_another_study(own, tmp_path):
    study, folder = own
    run_study(study, tmp_path / "out", trust=True)
    shutil.copy(shipped_problems()["heave_pitch"] / "approved.json", folder / "approved.json")
    with pytest.raises(InputError, match=r"another study \(gains\.\w+ differs\)"):
        run_study(study, tmp_path / "out", trust=True)


def test_another_workbench_makes_another_study(study_file, tmp_path, monkeypatch):
    study = read_study(study_file(4))
    run_study(study, tmp_path / "out")
    monkeypatch.setattr(workbench.study.run, "workbench_sha256", lambda: "0" * 64)
    with pytest.raises(InputError, match=r"another study \(workbench_sha256 differs\)"):
        run_study(study, tmp_path / "out")


def test_the_identity_holds_the_code_that_computed_the_rows(study_file, tmp_path):
    run_study(read_study(study_file(4)), tmp_path / "out")
    identity = json.loads((tmp_path / "out" / "study.json").read_text())["study"]
    assert identity["workbench_sha256"] == workbench_sha256()
    assert identity["versions"].keys() >= {"maglev-workbench", "numpy", "scipy", "casadi"}


def test_a_source_travels_with_every_file_that_its_problem_reads(own):
    _, folder = own
    source = Source.of(str(folder), trust=True)
    away = pickle.loads(pickle.dumps(replace(source, folder="/nowhere")))
    assert away.problem().title.endswith(" 2.0")


def test_a_worker_builds_from_what_was_read_when_the_folder_has_changed_meanwhile(own):
    _, folder = own
    source = Source.of(str(folder), trust=True)
    (folder / "tables" / "factor.txt").write_text("3.0")
    assert pickle.loads(pickle.dumps(source)).problem().title.endswith(" 2.0")


def test_a_folder_too_large_to_travel_is_refused(own, monkeypatch):
    monkeypatch.setattr("workbench.study.folder.MOST_FILES", 1)
    with pytest.raises(InputError, match=r"at most 1 files of 64 MB in all; .*own holds more"):
        Source.of(str(Path(own[1])), trust=True)
