"""Examples in docstrings print what stands there."""

import doctest
import importlib
from pathlib import Path

import pytest

import workbench

FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
ROOT = Path(workbench.__file__).parent
# modules that hold an example; those of problems that an installed wheel carries are none of the library
MODULES = sorted(
    ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)
    for path in ROOT.rglob("*.py")
    if ">>> " in path.read_text("utf-8") and "shipped" not in path.parts
)


def examples(module: str) -> list[doctest.DocTest]:
    """The docstrings of a module that hold examples."""
    name = module.removesuffix(".__init__")
    return [test for test in doctest.DocTestFinder().find(importlib.import_module(name), name) if test.examples]


def test_the_library_shows_at_least_25_examples():
    assert sum(len(examples(module)) for module in MODULES) >= 25


@pytest.mark.parametrize("module", MODULES)
def test_examples_print_what_stands_there(module, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write files
    said: list[str] = []
    found = examples(module)
    for test in found:
        doctest.DocTestRunner(verbose=False, optionflags=FLAGS).run(test, out=said.append)
    assert found
    assert not said, "".join(said)


def test_a_wrong_output_would_be_noticed():
    test = doctest.DocTestParser().get_doctest(">>> 1 + 1\n3\n", {}, "wrong", None, 0)
    assert doctest.DocTestRunner(verbose=False).run(test, out=lambda _: None).failed == 1
