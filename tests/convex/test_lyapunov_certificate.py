"""Quadratic forms for families of state matrices: what they prove, what they refuse to say."""

import numpy as np
import pytest

from workbench.convex.lyapunov import lyapunov_certificate
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.solve.semidefinite import Answer


def spring(stiffness: float, damping: float = 0.5) -> np.ndarray:
    """x'' + damping x' + stiffness x = 0."""
    return np.array([[0.0, 1.0], [-stiffness, -damping]])


def largest_common_stiffness(damping: float) -> float:
    """b of the widest interval 1 ≤ k(t) ≤ b with √b − 1 < c: the circle criterion for x'' + cx' + k(t)x = 0."""
    return (1 + damping) ** 2


@pytest.mark.parametrize(("share", "holds"), [(0.995, True), (1.005, False)])
def test_a_common_form_of_an_oscillator_exists_exactly_up_to_the_circle_criterion(share, holds):
    # two vertices, n = 2: a common quadratic form exists if and only if √b − √a < c (Kalman-Yakubovich-Popov)
    stiffness = share * largest_common_stiffness(0.5)
    found = lyapunov_certificate([spring(1.0), spring(stiffness)])
    assert found.holds is holds
    assert (found.margin > 0) is holds


def test_a_margin_is_the_decay_that_the_form_has_along_each_matrix():
    found = lyapunov_certificate([spring(1.0), spring(1.8)])
    P = found.matrix()
    for A in (spring(1.0), spring(1.8), spring(1.4)):  # the last lies between the vertices
        growth = np.linalg.eigvals(np.linalg.solve(P, A.T @ P + P @ A)).real.max()
        assert found.margin_at(A) == pytest.approx(-growth, rel=1e-9)  # two routes to one eigenvalue problem of size 2
        assert growth <= -found.margin * (1 - 1e-9)


def test_a_form_affine_in_the_parameter_holds_where_a_common_one_does_not():
    stiffness = np.linspace(1.0, 4.0, 7)  # √4 − √1 = 1 > 0.5: no common form
    family = [spring(k) for k in stiffness]
    assert not lyapunov_certificate(family).holds
    slow = lyapunov_certificate(family, parameters=stiffness, rate=0.05)
    assert slow.holds
    for k in np.linspace(1.0, 4.0, 61):  # P and A affine in k: checked between the points as well
        P, slope = slow.matrix(k), slow.matrix(k + 1) - slow.matrix(k)
        for rate in (-0.05, 0.05):
            assert np.linalg.eigvalsh(spring(k).T @ P + P @ spring(k) + rate * slope).max() < 0
    assert not lyapunov_certificate(family, parameters=stiffness, rate=50.0).holds


def test_a_form_found_on_a_coarse_grid_shows_where_it_fails_between_the_points():
    # stiffness swings between the grid's points to 4, beyond what any form common with stiffness 1 bears
    coarse = lyapunov_certificate([spring(1.0), spring(1.5)])
    assert coarse.holds
    assert coarse.margin_at(spring(4.0)) < 0


def test_a_certificate_does_not_depend_on_the_units_of_the_states():
    family = np.array([spring(1.0), spring(1.8)])
    scale = np.diag([1e-4, 1e5])
    turned = lyapunov_certificate([scale @ A @ np.linalg.inv(scale) for A in family])
    assert turned.holds
    # balancing is by powers of two, so the coordinates differ somewhat, and with them what P ⪯ I means: not the proof
    assert turned.margin == pytest.approx(lyapunov_certificate(family).margin, rel=0.1)


def test_what_the_solver_says_decides_nothing(monkeypatch):
    monkeypatch.setattr(
        "workbench.convex.lyapunov.minimise", lambda c, *_, **__: Answer(np.ones(len(c)), "Solved", 1, 0.0)
    )
    assert not lyapunov_certificate([spring(1.0), spring(1.8)]).holds
    monkeypatch.setattr(
        "workbench.convex.lyapunov.minimise", lambda c, *_, **__: Answer(np.full(len(c), np.nan), "Solved", 1, 0.0)
    )
    assert not lyapunov_certificate([spring(1.0), spring(1.8)]).holds


def test_the_approved_gains_have_a_common_form_over_the_mass():
    problem = load_problem("heave_pitch")
    matrices = []
    for share in (0.85, 1.0, 1.15):
        vehicle = problem.vehicle.with_values(mass=share * problem.vehicle.mass)
        (group,) = problem.with_vehicle(vehicle).subjects
        matrices.append(group.close(problem.gains).A)
    found = lyapunov_certificate(matrices)
    assert found.holds
    assert found.condition < 1e4  # unscaled it is 1e6 and more
    for A in matrices:  # once more in the states' own units, by another route
        P = found.matrix()
        size = 1 / np.sqrt(np.diag(P))
        assert np.linalg.eigvalsh((A.T @ P + P @ A) * np.outer(size, size)).max() < 0


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"matrices": [spring(-1.0)]}, "number 0 has a pole"),
        ({"matrices": [spring(1.0)], "decay": 0.3}, "stable with the decay asked for"),
        ({"matrices": [spring(1.0)], "rate": 1.0}, "a rate needs the parameter"),
        ({"matrices": [spring(1.0), spring(2.0)], "parameters": [1.0]}, "parameters must be 2 finite numbers"),
        ({"matrices": np.ones((2, 3))}, r"shape \(k, n, n\)"),
        ({"matrices": [spring(1.0)], "decay": -1.0}, "not negative"),
    ],
)
def test_families_that_cannot_be_certified_are_refused(arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        lyapunov_certificate(**arguments)
