"""A problem.py that raises, leaves, prints or has another signature: one sentence, whatever it does."""

import json

import pytest

from workbench.cli import run
from workbench.files.problem import load_problem, shipped_problems

FAULTS = {
    "raises": ("def problem(data):\n    return 1 / 0\n", "line 2: ZeroDivisionError: division by zero"),
    "raises at once": ("x = {}['a']\n", "line 1: KeyError: 'a'"),
    "imports what is not there": ("import no_such_thing\n", "line 1: ModuleNotFoundError: No module named"),
    "raises in a library": (
        "import json\ndef problem(data):\n    return json.loads('{')\n",
        "line 3: JSONDecodeError: Expecting property name",
    ),
    "leaves": ("import sys\nsys.exit(0)\n", "line 2: SystemExit: 0"),
    "leaves when called": ("def problem(data):\n    raise SystemExit\n", "line 2: SystemExit"),
    "takes nothing": (
        "def problem():\n    pass\n",
        "TypeError: problem() takes 0 positional arguments but",
    ),
    "takes two": (
        "def problem(data, more):\n    pass\n",
        "TypeError: problem() missing 1 required positional",
    ),
    "never ends its calls": ("def problem(data):\n    return problem(data)\n", "line 2: RecursionError"),
    "asks for what data have not": ("def problem(data):\n    return data.nothing\n", "line 2: AttributeError"),
    "is no Python": ("def problem(data)\n", "must be valid Python; line 1"),
    "is not text": ("\0", "must"),
    "has no problem": ("x = 1\n", "must define problem(data) that returns a design.Problem"),
    "returns a number": ("def problem(data):\n    return 3\n", "must return a design.Problem; got a int"),
}


@pytest.fixture(params=["heave", "wood_berry"])
def folder(request, tmp_path):
    """A copy of a shipped problem's data, of a vehicle and of a plant of its own."""
    text = shipped_problems()[request.param] / "data.toml"
    (tmp_path / "data.toml").write_text(text.read_text("utf-8"), "utf-8")
    return tmp_path


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_of_a_problems_code_is_one_sentence_with_its_line(folder, capsys, fault):
    text, sentence = FAULTS[fault]
    (folder / "problem.py").write_text(text)
    assert run(["design", str(folder), "--out", str(folder / "out")]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert sentence in err
    assert str(folder / "problem.py") in err


def test_what_a_problems_code_prints_does_not_reach_a_json_document(tmp_path, capsys):
    (tmp_path / "data.toml").write_text((shipped_problems()["heave"] / "data.toml").read_text("utf-8"), "utf-8")
    (tmp_path / "problem.py").write_text(
        "print('hello')\ndef problem(data):\n    print('there')\n    return data.build()\n"
    )
    assert run(["model", str(tmp_path), "--json"]) == 0
    out, err = capsys.readouterr()
    json.loads(out)
    assert err == "hello\nthere\n"


def test_a_fault_of_ours_that_a_problems_code_met_stays_ours(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("workbench.files.problem.GRAVITY", 0.0)  # the mass is weight / gravity
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert run(["model", "heave"]) == 3
    assert "internal error, a defect of the workbench and not of your input (ZeroDiv" in capsys.readouterr().err


def test_a_fault_of_a_problems_own_functions_is_told_when_they_are_called(tmp_path, capsys):
    (tmp_path / "data.toml").write_text((shipped_problems()["heave"] / "data.toml").read_text("utf-8"), "utf-8")
    (tmp_path / "problem.py").write_text(
        "from dataclasses import replace\n"
        "def elsewhere(values):\n    raise OverflowError('too far')\n"
        "def problem(data):\n    return data.build().with_models(replace(data.build().models, elsewhere=elsewhere))\n"
    )
    problem = load_problem(str(tmp_path))
    with pytest.raises(OverflowError):
        problem.at({"mass": 1.1})
    assert run(["design", str(tmp_path), "--robust", "--starts", "1", "--out", str(tmp_path / "out")]) == 2
    assert "problem.py must define problem(data), run and return; line 3: OverflowError" in capsys.readouterr().err
