"""[design] of a data file says how hard a design looks; a caller's word goes before it."""

import pytest

import workbench as wb
from workbench.design.effort import Effort
from workbench.errors import InputError
from workbench.files.problem import load_problem, shipped_problems
from workbench.files.writing import problem_toml

TABLE = "\n[design]\nstarts = 2\nseed = 7\nbudget_min = 0.5\n"


@pytest.fixture
def folder(tmp_path):
    def made(name, text=TABLE):
        (tmp_path / "data.toml").write_text((shipped_problems()[name] / "data.toml").read_text() + text)
        return str(tmp_path)

    return made


@pytest.mark.parametrize("name", ["attraction_magnet", "heave"])
def test_the_table_is_read_alike_for_a_vehicle_and_for_any_other_plant(folder, name):
    assert load_problem(folder(name)).effort == Effort(starts=2, seed=7, budget=30.0)


def test_a_design_keeps_to_it_and_a_callers_word_goes_before_it(folder):
    problem = load_problem(folder("dc_motor", TABLE.replace("0.5", "0.05")))
    found = wb.design(problem)
    assert (len(found.starts), found.seed) == (2, 7)
    other = wb.design(problem, starts=1, seed=3)
    assert (len(other.starts), other.seed) == (1, 3)


def test_it_is_written_into_a_data_file_and_read_again(folder, tmp_path):
    problem = load_problem(folder("dc_motor"))
    (tmp_path / "again").mkdir()
    (tmp_path / "again" / "data.toml").write_text(problem_toml(problem))
    assert load_problem(str(tmp_path / "again")).effort == problem.effort


@pytest.mark.parametrize("name", ["dc_motor", "heave"])
@pytest.mark.parametrize(
    ("line", "said"),
    [("starts = 0", "starts"), ("seed = -1", "seed"), ("budget_s = 0.0", "budget"), ('budget_s = "60"', "budget"),
     ("budget = 60.0", "did you mean 'budget_s'"), ("start = 3", "did you mean 'starts'")],
)  # fmt: skip
def test_what_it_cannot_be_is_one_sentence(folder, name, line, said):
    with pytest.raises(InputError, match=said):
        load_problem(folder(name, f"\n[design]\n{line}\n"))
