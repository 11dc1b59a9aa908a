"""An exploration as a script makes it: moves, pins, optimisation, files; and its figures against the analysis."""

import json

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.errors import InputError
from workbench.explore import Session, Sweep
from workbench.files.problem import load_problem
from workbench.handover.table.table import read_table


@pytest.fixture(scope="module")
def problem():
    return load_problem("heave")


@pytest.fixture
def session(problem):
    return Session(problem)


def test_the_middle_of_the_root_locus_is_the_poles_of_the_analysis(session):
    shot = session.snapshot
    middle = shot.locus[len(shot.locus) // 2]
    analysed = shot.analysis.poles
    # the heave loop's eigenvalues from two realisations, rounding of order ε ‖A‖ ≈ 1e-13 times the condition of a pole
    np.testing.assert_allclose(np.sort_complex(middle), np.sort_complex(analysed), atol=1e-8)


def test_the_ends_of_the_root_locus_are_the_poles_of_the_gains_moved_by_half(problem):
    sweep = Sweep(problem.setting)
    for name, low in (("K_zdot", 0.5), ("tau_z", 0.5)):
        ends = sweep(problem.gains, name)[0]
        moved = problem.gains.with_values(**{name: low * getattr(problem.gains, name)})
        np.testing.assert_allclose(
            np.sort_complex(ends), np.sort_complex(analyse(problem.setting, moved).poles), atol=1e-8
        )


def test_what_is_shown_is_the_exact_analysis_of_the_gains(session, problem):
    session.set(K_zdot=0.9 * problem.gains.K_zdot)
    shown = {name: value for name, value, _ in session.snapshot.rows()}
    exact = analyse(problem.setting, session.gains)
    assert shown["cost J"] == exact.cost
    assert shown["smallest damping ratio"] == exact.damping
    assert session.moved == "K_zdot"


def test_undo_goes_back_one_change_at_a_time(session, problem):
    session.set(K_h=1.0)
    session.set(K_h=2.0)
    session.undo()
    assert session.gains.K_h == 1.0
    session.undo()
    session.undo()
    assert session.gains == problem.gains


def test_an_unstable_design_is_shown_without_spectra(session):
    session.set(K_zdot=-5.0, K_hdot=-5.0)
    shot = session.snapshot
    assert not shot.analysis.stable
    assert shot.spectra is None
    assert shot.loops == ()
    assert not shot.met


def test_pins_stand_beside_the_present_design(session):
    session.pin("first")
    session.set(K_zdot=0.5 * session.gains.K_zdot)
    heads, rows = session.comparison()
    assert heads == ["", "now", "first", "unit"]
    damping = next(row for row in rows if row[0] == "smallest damping ratio")
    assert damping[1] != damping[2]
    with pytest.raises(InputError, match="unknown pinned design 'fist'; did you mean 'first'"):
        session.unpin("fist")
    session.unpin("first")
    assert session.comparison()[0] == ["", "now", "unit"]


def test_a_heavier_vehicle_is_the_problem_with_a_heavier_vehicle(session, problem):
    from workbench.physics.vehicle import varied

    session.vary(mass=1.1)
    heavy = problem.with_vehicle(varied(problem.vehicle, mass=1.1))
    assert session.snapshot.analysis.damping == analyse(heavy.setting, problem.gains).damping
    with pytest.raises(InputError, match="must be of the nominal operating point"):
        session.write_table("never.json")
    session.vary(mass=1.0)
    assert session.problem is problem


def test_optimising_from_here_meets_the_requirements_again(session):
    session.set(K_zdot=0.8 * session.gains.K_zdot)
    assert not session.snapshot.met
    session.optimise()
    assert session.snapshot.met
    session.undo()
    assert not session.snapshot.met


def test_a_table_from_the_explorer_is_a_gain_table_of_what_is_shown(session, tmp_path):
    path = session.write_table(tmp_path / "mine.json")
    table = read_table(path)
    assert table.to_gains() == session.gains
    assert table.solver == "explorer"
    assert all(r.met for r in table.requirements) == session.snapshot.met


def test_a_saved_exploration_comes_back_whole(session, problem, tmp_path):
    session.set(K_h=3.0)
    session.pin("kept")
    session.set(K_zdot=0.9 * session.gains.K_zdot)
    session.vary(mass=1.05)
    session.save(tmp_path / "state.json")
    again = Session(problem)
    again.load(tmp_path / "state.json")
    assert again.to_dict() == session.to_dict()
    assert again.moved == again.snapshot.moved == "K_zdot"
    assert again.snapshot.analysis.cost == session.snapshot.analysis.cost


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"problem": "other"}, "must be a saved exploration of 'heave'"),
        ({"gains": {"K_h": 1.0}}, "missing K_hdot"),
        ({"moved": "K_hh"}, "unknown gain 'K_hh'; did you mean"),
        ({"gains": 3}, "must hold gains as an object"),
        ({"factors": {"mass": "heavy"}}, "factor mass .* must be a number"),
        ({"pins": [1]}, "pins .* must be objects"),
    ],
)
def test_a_file_that_is_no_exploration_of_this_problem_changes_nothing(session, tmp_path, change, sentence):
    path = tmp_path / "state.json"
    path.write_text(json.dumps({**session.to_dict(), **change}))
    before = session.to_dict()
    with pytest.raises(InputError, match=sentence):
        session.load(path)
    assert session.to_dict() == before


def test_names_that_do_not_exist_are_refused_with_the_nearest(session, problem):
    with pytest.raises(InputError, match="unknown gain 'K_hh'; did you mean 'K_h'"):
        session.set(K_hh=1.0)
    with pytest.raises(InputError, match="unknown factor 'mas'; did you mean 'mass'"):
        session.vary(mas=1.1)
