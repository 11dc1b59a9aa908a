"""Notebooks parse, ask a question, answer it and check the answer; the slow tests run them as Jupyter does."""

import ast
import re
from pathlib import Path

import jupytext
import pytest

FOLDER = Path(__file__).parents[2] / "notebooks"
PATHS = sorted(FOLDER.glob("[0-9]*.py"))
SECONDS = 60  # each runs within a minute on two idle cores
SLACK = 5  # tests share theirs

each = pytest.mark.parametrize("path", PATHS, ids=lambda path: path.stem)


def cells(path: Path, kind: str) -> list[str]:
    return [cell.source for cell in jupytext.read(path).cells if cell.cell_type == kind]


def test_there_are_notebooks():
    assert [path.stem[:2] for path in PATHS[:3]] == ["01", "02", "03"]


@each
def test_a_notebook_opens_with_a_question_and_its_answer(path):
    lines = [line for line in cells(path, "markdown")[0].splitlines() if line.strip()]
    assert re.fullmatch(r"# [A-Z].*\?", lines[0])
    assert len(lines) > 1
    assert not lines[1].startswith("#")
    assert len(lines[1]) > 40  # an answer, not a heading


@each
def test_a_notebook_ends_by_asserting_its_answer(path):
    tree = ast.parse(cells(path, "code")[-1])
    assert any(isinstance(node, ast.Assert) for node in ast.walk(tree))


@each
def test_no_function_of_a_notebook_is_longer_than_a_line(path):
    tree = ast.parse("\n".join(cells(path, "code")))
    long = [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef | ast.Lambda) and n.end_lineno != n.lineno]
    assert [ast.unparse(node)[:60] for node in long] == []


def test_the_index_names_every_notebook_with_its_question():
    index = (FOLDER / "README.md").read_text(encoding="utf-8")
    for path in PATHS:
        question = cells(path, "markdown")[0].splitlines()[0].removeprefix("# ")
        assert f"[{path.stem[:2]}]({path.name}) | {question} |" in index


@pytest.mark.slow
@each
def test_a_notebook_runs_to_its_end(path, tmp_path, monkeypatch):
    from nbclient import NotebookClient

    monkeypatch.setenv("MPLBACKEND", "module://matplotlib_inline.backend_inline")
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path))
    notebook = jupytext.read(path)
    NotebookClient(
        notebook, timeout=SECONDS * SLACK, kernel_name="python3", resources={"metadata": {"path": tmp_path}}
    ).execute()
    words = [
        output.get("text", "")
        for cell in notebook.cells
        if cell.cell_type == "code"
        for output in cell.outputs
        if output.get("name") == "stderr"
    ]
    assert "".join(words) == ""  # nothing warns
