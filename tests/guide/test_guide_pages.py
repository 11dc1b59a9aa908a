"""Pages of the guide: examples print what stands there, commands and links exist, Sphinx has no complaint."""

import ast
import doctest
import re
import shlex
import subprocess
import sys

import pytest
import typer
from guide_page import GUIDE, PAGES, ROOT, fences

from workbench.cli import app

FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
SLOW = ("tuning.md", "certificates.md", "theory.md", "not_flown.md")  # they design and tune, some seconds each
SHELL = ("cp", "rm", "sed", "source", "pip", "jupyter")  # what a shell has anyway
WITH_EXAMPLES = sorted({fence.page for fence in fences("pycon")})


def commands() -> list[tuple[str, str]]:
    """(place, command) of every line that the guide asks to be typed."""
    return [
        (fence.place, line.removeprefix("$ "))
        for fence in fences("console")
        for line in fence.text.splitlines()
        if line.startswith("$ ")
    ]


@pytest.mark.parametrize("page", [pytest.param(p, marks=pytest.mark.slow) if p in SLOW else p for p in WITH_EXAMPLES])
def test_examples_of_a_page_print_what_stands_there(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write files
    names: dict = {"__name__": "__main__"}
    said: list[str] = []
    for fence in fences("pycon"):
        if fence.page == page:
            test = doctest.DocTest([], names, fence.place, page, fence.line, fence.text)
            test.examples = doctest.DocTestParser().get_examples(fence.text, fence.place)
            test.globs = names
            doctest.DocTestRunner(verbose=False, optionflags=FLAGS).run(test, out=said.append, clear_globs=False)
    assert not said, "".join(said)


@pytest.mark.slow
@pytest.mark.parametrize("page", sorted({fence.page for fence in fences("python run")}))
def test_what_a_page_says_how_to_add_can_be_added_so(page, tmp_path):
    # in a process of its own: what it registers is not the house's; a file, so that pickled classes have a place
    said = "\n".join(fence.text for fence in fences("python run") if fence.page == page)
    (tmp_path / "added.py").write_text(said, "utf-8")
    ran = subprocess.run(
        [sys.executable, "-W", "error", "added.py"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert ran.returncode == 0, ran.stderr


@pytest.mark.parametrize("fence", fences("python"), ids=lambda fence: fence.place)
def test_python_that_is_not_run_is_python(fence):
    assert ast.parse(fence.text).body


def test_commands_are_shown():
    assert len(commands()) > 20


@pytest.mark.parametrize(("place", "line"), commands(), ids=[place for place, _ in commands()])
def test_a_command_shown_exists_with_its_options(place, line):
    words = shlex.split(line.partition(" > ")[0])
    if words[0] == "make":
        targets = re.findall(r"^([a-z]+):", (ROOT / "Makefile").read_text("utf-8"), re.M)
        assert words[1] in targets
    elif words[0] == "workbench":
        group = typer.main.get_command(app)
        if words[1:] != ["--help"]:
            assert words[1] in group.commands, place
            with group.commands[words[1]].make_context(words[1], words[2:]) as context:  # raises for an unknown option
                assert context.params
    else:
        assert words[0] in SHELL, place


def test_a_wrong_option_would_be_noticed():
    group = typer.main.get_command(app)
    with pytest.raises(Exception, match="No such option"):
        group.commands["design"].make_context("design", ["heave", "--start", "4"])


@pytest.mark.parametrize("page", PAGES)
def test_links_between_pages_lead_somewhere(page):
    reference = [f"reference/{name}" for name in REFERENCE]
    text = (GUIDE / page).read_text("utf-8")
    for name in re.findall(r"\{doc\}`(?:[^`<]*<)?([^`>]+)>?`", text):
        assert name in reference or (GUIDE / f"{name}.md").is_file(), name
    for name in re.findall(r"^```\{image\} (\S+)$", text, re.M):
        assert (GUIDE / name).is_file(), name


REFERENCE = (
    "commands",
    "data_file",
    "gain_table",
    "plant_file",
    "study_file",
    "goals",
    "problems",
    "errata",
)


def test_every_page_is_in_the_table_of_contents():
    index = (GUIDE / "index.md").read_text("utf-8")
    listed = set(re.findall(r"^[a-z_/]+$", index, re.M))
    assert {page.removesuffix(".md") for page in PAGES} - {"index"} <= listed
    assert {f"reference/{name}" for name in REFERENCE} <= listed


@pytest.mark.slow
def test_the_guide_builds_without_a_warning(tmp_path):
    built = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d", tmp_path / "doctrees", GUIDE,
         tmp_path / "html"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert built.returncode == 0, built.stderr
    made = {path.relative_to(tmp_path / "html").as_posix() for path in (tmp_path / "html").rglob("*.html")}
    assert {f"{page.removesuffix('.md')}.html" for page in PAGES} <= made
    commands_page = (tmp_path / "html" / "reference" / "commands.html").read_text("utf-8")
    assert all(f'id="workbench-{name}"' in commands_page for name in typer.main.get_command(app).commands)


GOALS = re.findall(r"^\|[^|]*\|[^|]*\| `([A-Z]\w+\(.*\))` \|$", (GUIDE / "tuning.md").read_text("utf-8"), re.M)


@pytest.mark.parametrize("line", GOALS, ids=[line.partition("(")[0] for line in GOALS])
def test_a_goal_shown_can_be_written_so(line):
    import numpy

    from workbench.goals import kinds, ride

    goal = eval(line, {"np": numpy, **vars(ride), **vars(kinds)})
    assert isinstance(goal, kinds.Goal)


def test_the_guide_shows_every_goal_of_the_tuner():
    from workbench.goals import kinds, ride

    goals = {
        kind.__name__
        for kind in (*vars(ride).values(), *vars(kinds).values())
        if isinstance(kind, type) and issubclass(kind, kinds.Goal) and kind.bind is not kinds.Goal.bind
    }
    assert goals == {line.partition("(")[0] for line in GOALS}
