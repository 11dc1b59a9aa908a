"""Figures of a batch against the exact analysis, and its parts against the exact algorithms."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.analysis.batch.closing import unfiltered
from workbench.analysis.batch.modal import Excited
from workbench.analysis.batch.plants import FACTORS, fit
from workbench.control import Gains
from workbench.control.gains import GAIN_NAMES
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.lti.modal import Fractions, modes, peaks
from workbench.lti.norm import peak_gain
from workbench.lti.variance import stationary
from workbench.physics.guideway.roughness import Roughness
from workbench.physics.vehicle import varied
from workbench.study.batch import Batch, quantity_names, suits
from workbench.study.quantity import document_of, value_at

# Relative: mean squares of lightly damped loops lose digits to partial fractions (up to ten of sixteen are kept, rms
# keeps more), peaks are pursued to 1e-7 of their frequency.
AGREEMENT = 1e-8
PEAK = 1e-6  # and where the largest gain lies at infinity it is 1 but for 1e-7


def spread_gains(gains, count, width, seed=0):
    base = np.array([getattr(gains, name) for name in GAIN_NAMES])
    return base * (1 + np.random.default_rng(seed).uniform(-width, width, (count, len(base))))


def assert_same(found, k, problem, gains):
    setting = problem.setting
    document = document_of(problem, gains, quantity_names(setting))
    for name in quantity_names(setting):
        exact, ours = value_at(document, name), found.columns[name][k]
        if exact is None:
            assert np.isnan(ours), name
        else:
            tolerance = PEAK if name.startswith("peak_sens") else AGREEMENT
            assert ours == pytest.approx(float(exact), rel=tolerance, abs=1e-14), name


@pytest.mark.parametrize("name", ["comfort_limit", "heave", "report_1975", "hybrid_motor"])
def test_a_batch_agrees_with_the_exact_analysis(name):
    problem = load_problem(name)
    assert suits(problem.setting)
    gains = spread_gains(problem.approved, 60, 0.2)
    found = Batch(problem.setting, quantity_names(problem.setting)).evaluate(gains)
    assert found.columns["stable"].any()
    for k in np.flatnonzero(found.sound)[::15]:
        assert_same(found, k, problem, Gains(**dict(zip(GAIN_NAMES, gains[k].tolist(), strict=True))))
    assert found.sound.mean() > 0.9


def test_filters_without_gain_are_dropped_row_by_row():
    problem = load_problem("comfort_limit")
    gains = np.tile(list(problem.approved.as_dict().values()), (4, 1))
    gains[1, GAIN_NAMES.index("K_hpdot")] = 0.0
    gains[2, GAIN_NAMES.index("K_zdot")] = 0.0
    found = Batch(problem.setting, quantity_names(problem.setting)).evaluate(gains)
    for k in range(4):
        assert_same(found, k, problem, Gains(**dict(zip(GAIN_NAMES, gains[k].tolist(), strict=True))))


def test_a_rate_without_a_filter_is_left_to_the_exact_analysis():
    problem = load_problem("heave")
    gains = np.tile(list(problem.approved.as_dict().values()), (2, 1))
    gains[1, GAIN_NAMES.index("tau_h")] = 0.0
    assert unfiltered(gains).tolist() == [False, True]
    assert Batch(problem.setting, ["damping"]).evaluate(gains).sound.tolist() == [True, False]


def test_railway_spectra_with_two_corners_agree_too():
    problem = load_problem("heave")
    german = replace(Roughness.german("low", track_width=1.93), A2=None, A3=None, A4=None)
    setting = replace(problem.setting, guideway=german)
    assert suits(setting)  # no double corner
    gains = np.array([list(problem.approved.as_dict().values())])
    assert_same(
        Batch(setting, quantity_names(setting)).evaluate(gains), 0, problem.with_setting(setting), problem.approved
    )


def test_correlated_types_do_not_suit_a_batch():
    setting = load_problem("comfort_limit").setting
    tied = replace(setting, guideway=replace(setting.guideway, correlation=tuple(map(tuple, np.eye(4).tolist()))))
    assert not suits(tied)


@pytest.mark.parametrize(
    ("name", "names"),
    [
        ("comfort_limit", ("mass", "current_force")),
        pytest.param("comfort_limit", FACTORS, marks=pytest.mark.slow),
        pytest.param("coil_vehicle", ("mass", "gap_force"), marks=pytest.mark.slow),
    ],
)
def test_one_family_gives_the_plants_of_all_factors(name, names):
    problem = load_problem(name)
    wanted = quantity_names(problem.setting)
    batch = Batch(problem.setting, wanted)

    def vehicle(factors):
        return problem.with_vehicle(varied(problem.vehicle, **factors))

    family = fit(names, lambda factors: batch.read(vehicle(factors).setting))
    factors = np.random.default_rng(2).uniform(0.9, 1.1, (3, len(names)))
    gains = np.tile(list(problem.approved.as_dict().values()), (3, 1))
    found = batch.evaluate(gains, family(factors))
    for k in range(3):
        assert_same(found, k, vehicle(dict(zip(names, factors[k].tolist(), strict=True))), problem.approved)


def test_a_plant_that_is_no_such_function_has_no_family():
    problem = load_problem("heave")
    batch = Batch(problem.setting, ["damping"])
    reading = batch.read(problem.setting)
    bent = lambda factors: tuple(replace(r, A=r.A * np.exp(factors["mass"])) for r in reading)  # noqa: E731
    assert fit(["mass"], bent) is None


def test_an_unknown_quantity_is_refused_with_the_nearest():
    with pytest.raises(InputError, match=r"did you mean 'damping'"):
        Batch(load_problem("heave").setting, ["dampin"])


def random_loops(count, n, seed):
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(count, n, n)) / np.sqrt(n)
    return A - 1.3 * np.eye(n) * np.linalg.eigvals(A).real.max(axis=1)[:, None, None].clip(0.5), rng


@pytest.mark.parametrize("k", [1, 2, 3])
def test_peaks_are_the_hamiltonian_ones(k):
    A, rng = random_loops(12, 8, k)
    B, C, D = rng.normal(size=(12, 8, k)), rng.normal(size=(12, k, 8)), rng.normal(size=(12, k, k))
    found = modes(A)
    found = peaks(found.poles, *found.residues(B, C), D)
    exact = [peak_gain(*one).value for one in zip(A, B, C, D, strict=True)]
    np.testing.assert_allclose(found, exact, rtol=PEAK)


def test_a_peak_of_a_thousandth_damping_is_found():
    z, w = 1e-3, 7.3
    A = np.array([[[0, 1], [-(w**2), -2 * z * w]]])
    found = modes(A)
    found = peaks(found.poles, *found.residues(np.array([[[0], [w**2]]]), np.array([[[1.0, 0]]])), np.zeros((1, 1, 1)))
    assert found[0] == pytest.approx(1 / (2 * z * np.sqrt(1 - z**2)), rel=1e-9)  # the textbook's resonance


def test_partial_fractions_give_the_mean_squares_of_the_lyapunov_equation():
    n, delay = 6, 0.3
    A, rng = random_loops(5, n, 3)
    front, rear, C = rng.normal(size=(5, n, 2)), rng.normal(size=(5, n, 2)), rng.normal(size=(5, 3, n))
    corner, gain = -0.7, 1.9  # noise through gain/(s − corner)
    found = modes(A)
    left, right = found.residues(np.concatenate([front, rear], axis=2), C)
    nothing = np.zeros((5, 3, 2))
    excited = Excited(found.poles, left[:, :, :2], left[:, :, 2:], right, nothing, nothing, delay)
    found = excited.mean_squares(Fractions(np.array([corner + 0j]), np.array([gain + 0j])), None)
    for k in range(5):
        for t in range(2):
            big = np.zeros((n + 2, n + 2))
            big[:n, :n], big[:n, n], big[:n, n + 1] = A[k], front[k, :, t], rear[k, :, t]
            big[n, n] = big[n + 1, n + 1] = corner
            into = np.zeros((n + 2, 2))
            into[n, 0] = into[n + 1, 1] = gain
            exact = stationary(big, into[:, :1], into[:, 1:], delay=delay).mean_squares(np.pad(C[k], ((0, 0), (0, 2))))
            np.testing.assert_allclose(found.value[k, :, t], exact[0], rtol=1e-9)


def test_double_poles_show_in_the_growth_of_the_terms():
    gap = 1e-7
    A = np.array([[[-1.0, 1.0], [0.0, -1.0 - gap]], [[-1.0, 1.0], [0.0, -3.0]]])
    found = modes(A)
    left, right = found.residues(np.tile([[0.0], [1.0]], (2, 1, 1)), np.tile([[1.0, 0.0]], (2, 1, 1)))
    nothing = np.zeros((2, 1, 1))
    excited = Excited(found.poles, left, np.zeros_like(left), right, nothing, nothing, 0.0)
    growth = excited.mean_squares(Fractions(np.array([-0.5 + 0j]), np.array([1.0 + 0j])), None).growth
    assert growth[0] > 1e6
    assert growth[1] < 100


def test_filters_with_a_double_pole_have_no_fractions():
    assert Fractions.of([[-1.0, 1.0], [0.0, -1.0]], [[0.0], [1.0]], [[1.0, 0.0]]) is None
