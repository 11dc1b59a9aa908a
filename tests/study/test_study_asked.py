"""A study does what its problem asks for: every requirement counts, schedules are flown, variations are borne."""

import shutil

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.design.verdict import margin_verdicts, verdicts
from workbench.errors import InputError
from workbench.files.gains import read_schedule
from workbench.files.problem import load_problem, shipped_problems, shipped_vehicles
from workbench.goals.ride.requirement import limit_keys
from workbench.study.file import read_study
from workbench.study.quantity import limits_of, required
from workbench.study.run import run_study
from workbench.study.source import Source


@pytest.fixture
def study_of(tmp_path):
    """Runs a study over a copy of a shipped problem, its data changed; head lines, tables, replacements in the data."""

    def run(name, head, tables, *changes, gains=None):
        folder = tmp_path / "copy"
        folder.mkdir(exist_ok=True)
        text = (shipped_problems()[name] / "data.toml").read_text()
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        (folder / "data.toml").write_text(text)
        shutil.copy(shipped_problems()[name] / "approved.json", folder / "approved.json")
        (tmp_path / "s.toml").write_text(f'[study]\nproblem = "copy"\noutput = "csv"\n{head}\n{tables}')
        return run_study(read_study(tmp_path / "s.toml"), tmp_path / "out", fresh=True), folder

    return run


APPROVED = [name for name, folder in shipped_vehicles().items() if (folder / "approved.json").is_file()]
COILS = ("coil_vehicle", "two_coil_corner", "scheduled_vehicle")  # a second each, for their forces
ONE = '[[parameter]]\nname = "K_h"\nvalues = [{}]\n'


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("heave", "delay_margin_at_least_ms = 50.0"),
        ("heave_pitch", "vertical_ride_mask_ratio_at_most = 1e-6"),
        ("sway_roll_yaw", "lateral_ride_mask_ratio_at_most = 1e-6"),
        ("hybrid_motor", "motor_current_at_most_a = 100.0"),
        ("heave", "peak_gap_change_at_most_mm = 0.1"),
    ],
)
def test_a_requirement_that_is_missed_is_counted_whatever_it_limits(study_of, name, line):
    key = line.split(" ", 1)[0]
    base = (shipped_problems()[name] / "data.toml").read_text()
    old = next((one for one in base.splitlines() if one.startswith(f"{key} =")), None)
    change = (old, line) if old else ("[requirements]", f"[requirements]\n{line}")
    k_h = load_problem(name).approved.K_h
    result, folder = study_of(name, 'sampling = "list"', ONE.format(k_h), change)
    problem = load_problem(str(folder))
    missed = [v for v in verdicts(problem, analyse(problem.setting, problem.approved)) if not v.met]
    assert [v.name for v in missed] == [limit_keys()[key]]
    told = {reason: n for reason, n in result.failing.by.items() if n}
    assert list(told.values()) == [1]
    quantity = next(iter(told)).split(" ")[0]
    assert result.columns[quantity][0] == pytest.approx(missed[0].value, rel=1e-7)


@pytest.mark.parametrize("name", [pytest.param(n, marks=pytest.mark.slow if n in COILS else ()) for n in APPROVED])
def test_approved_gains_fail_nothing_that_their_problem_requires(study_of, name):
    # the verdicts of the design and the limits of a study are the same sentences
    result, folder = study_of(name, 'sampling = "list"', ONE.format(load_problem(name).approved.K_h))
    problem = load_problem(str(folder))
    verdict = verdicts(problem, analyse(problem.setting, problem.approved))
    assert result.failing.count == int(not all(v.met for v in verdict))
    assert {x.quantity for x in result.limits} == set(required(problem))
    assert len(limits_of(problem)) == len(verdict) - sum(
        r.beside for r in problem.requirements
    )  # no scalars of an analysis


def test_a_study_that_records_few_quantities_still_counts_every_requirement(study_of):
    change = ("delay_margin_at_least_ms = 2.0", "delay_margin_at_least_ms = 50.0")
    result, _ = study_of("heave", 'quantities = ["damping"]\nsampling = "list"', ONE.format(2.0), change)
    assert result.failing.by["delay_margin >= 0.05 missed"] == 1


def test_a_margin_that_nothing_limits_is_no_missing_one(study_of):
    # sway, roll and yaw of a vehicle that floats by itself: without gains no delay harms it
    gains = "".join(f'[[parameter]]\nname = "{n}"\nvalues = [0.0]\n' for n in ("K_sway", "K_yaw", "K_roll"))
    result, _ = study_of(
        "sway_roll_yaw", 'sampling = "list"\nquantities = ["stable", "margins.current.0.delay"]', gains
    )
    if result.columns["stable"] == [True]:
        assert result.columns["delay_margin"] == [np.inf]
        assert result.failing.by["delay_margin >= 0.002 missed"] == 0
        assert result.columns["margins.current.0.delay"] == [np.inf]


@pytest.mark.slow
def test_a_study_over_speed_flies_the_schedule(study_of):
    speeds = '[[parameter]]\nname = "speed"\nvalues = [40.0, 134.0]\n'
    result, folder = study_of("scheduled_vehicle", 'sampling = "list"', speeds)
    schedule = read_schedule(folder / "approved.json")
    for row, speed in enumerate(result.columns["speed"]):
        there = load_problem(str(folder), speed=speed)
        analysis = analyse(there.setting, schedule.gains_at(speed))
        assert result.columns["damping"][row] == pytest.approx(analysis.damping, rel=1e-9)
    cruise = analyse(load_problem(str(folder), speed=40.0).setting, schedule.gains_at(134.0))
    assert result.columns["damping"][0] > 0.4 > cruise.damping  # what cruise gains would have said


@pytest.mark.slow
def test_a_speed_that_the_schedule_does_not_reach_is_a_row_without_figures(study_of):
    result, _ = study_of(
        "scheduled_vehicle", 'sampling = "list"', '[[parameter]]\nname = "speed"\nvalues = [20.0, 99.0]\n'
    )
    assert "20" in result.columns["error"][0]
    assert result.columns["error"][1] == ""


VARIED = (
    "[discretisation]",
    '[variation]\nmass = [0.8, 1.2]\ncurrent_force = [0.8, 1.2]\nsource = "test"\n\n[discretisation]',
)
DESIGNED = 'task = "design"\nsampling = "list"\nstarts = 1\n'


def row_gains(result, row):
    return Gains(**{name: result.columns[f"gains.{name}"][row] for name in GAIN_NAMES})


@pytest.mark.slow
def test_a_design_of_a_study_bears_the_variation_about_the_mass_of_its_row(study_of):
    masses = '[[parameter]]\nname = "mass"\nvalues = [1.1]\n'
    corner = {"mass": 1.1 * 0.8, "current_force": 1.2}
    result, folder = study_of("heave", DESIGNED, masses, VARIED)
    problem = load_problem(str(folder))
    assert all(v.met for v in margin_verdicts(_stability(problem.at(corner)), row_gains(result, 0)))
    plain, _ = study_of("heave", DESIGNED, masses)
    assert not all(v.met for v in margin_verdicts(_stability(problem.at(corner)), row_gains(plain, 0)))


def _stability(problem):
    return problem.with_requirements([r for r in problem.requirements if r.margin_alone])


def test_a_variation_that_cannot_be_borne_is_a_row_without_figures(study_of):
    more = "limits = { damping_ratio_at_least = 1.5 }"  # no root can
    wide = (VARIED[0], VARIED[1].replace("source", f"{more}\nsource"))
    result, _ = study_of("heave", DESIGNED, '[[parameter]]\nname = "mass"\nvalues = [1.0]\n', wide)
    assert result.columns["error"][0]
    assert result.failing.count == 1


def test_a_design_records_margins_of_the_full_analysis_where_they_are_asked_for(study_of):
    asked = DESIGNED + 'quantities = ["margins.disk.lower", "cost"]'
    result, _ = study_of("heave", asked, '[[parameter]]\nname = "mass"\nvalues = [1.0]\n')
    assert result.columns["error"] == [""]
    assert 0 < result.columns["margins.disk.lower"][0] < 2


def test_rows_of_the_same_values_are_equal_to_the_last_bit(study_of):
    tables = '[[parameter]]\nname = "mass"\nvalues = [1.0, 1.0]\n'
    columns = study_of("heave", DESIGNED, tables)[0].columns
    assert all(values[0] == values[1] for name, values in columns.items() if name != "row")


@pytest.mark.parametrize(
    ("head", "tables", "sentence"),
    [
        ('starts = 3\nsampling = "list"', ONE.format(1.0), "starts belong to designs"),
        (
            'count = 5\nsampling = "list"',
            ONE.format(1.0),
            "rows of a list must follow from its parameters; got count = 5",
        ),
        ("count = 5", '[[parameter]]\nname = "K_h"\nrange = [1.0, 2.0]\nlevels = 4\n', "levels must stand in a grid"),
        ('gains = "copy/approved.json"\n' + DESIGNED, ONE.format(1.0), "does not begin at given gains; set starts = 0"),
        ('task = "pareto"\ncount = 9', '[[pareto]]\nrequirement = "x"\nlimits = [1.0]\n', "sampling and count are not"),
    ],
)
def test_a_key_that_nothing_would_be_done_with_is_refused(study_of, head, tables, sentence):
    with pytest.raises(InputError, match=sentence):
        study_of("heave", head, tables)


def test_more_rows_than_fit_into_memory_are_refused_before_any_is_computed(study_of):
    with pytest.raises(InputError, match=r"must have at most \d+ rows, 4 GB of memory; this one asks for 9000000"):
        study_of("heave", "count = 9_000_000", '[[parameter]]\nname = "K_h"\nrange = [1.0, 2.0]\n')


def test_a_source_knows_the_schedule_of_its_problem():
    assert Source.of("scheduled_vehicle").schedule is not None
    assert Source.of("heave").schedule is None


@pytest.mark.slow
def test_equal_designs_are_equal_to_the_last_bit_with_one_two_and_three_workers(study_of, tmp_path):
    tables = '[[parameter]]\nname = "mass"\nvalues = [1.0, 1.0, 1.0, 1.0]\n'
    alone, _ = study_of("heave", DESIGNED, tables)
    for workers in (2, 3):
        shared = run_study(read_study(tmp_path / "s.toml"), tmp_path / f"by{workers}", workers=workers)
        assert shared.columns == alone.columns
    assert all(len(set(values)) == 1 for name, values in alone.columns.items() if name != "row")


def test_a_quantity_that_no_design_has_is_refused_before_the_first_one_even_without_approved_gains(tmp_path):
    (tmp_path / "copy").mkdir()
    shutil.copy(shipped_problems()["heave"] / "data.toml", tmp_path / "copy" / "data.toml")
    tables = '[[parameter]]\nname = "mass"\nvalues = [1.0]\n'
    for name, fits in (("dampin", False), ("damping", True)):
        text = f'[study]\nproblem = "copy"\noutput = "csv"\nquantities = ["{name}"]\n{DESIGNED}{tables}'
        (tmp_path / "s.toml").write_text(text)
        if fits:
            assert run_study(read_study(tmp_path / "s.toml"), tmp_path / "out").columns["error"] == [""]
        else:
            with pytest.raises(InputError, match="did you mean 'damping'"):
                run_study(read_study(tmp_path / "s.toml"), tmp_path / "out")
