"""Bounded-real and H2 inequalities against the Hamiltonian and Lyapunov routes to the same norms."""

import cvxpy as cp
import numpy as np
import pytest

from workbench.convex.gain_bound import bounded_real, h2_bound
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.lti.norm import h2_norm, peak_gain
from workbench.solve.semidefinite import Answer


def system(seed: int, order: int = 5):
    random = np.random.default_rng(seed)
    A = random.standard_normal((order, order))
    A -= (np.linalg.eigvals(A).real.max() + 0.3) * np.eye(order)
    return A, random.standard_normal((order, 2)), random.standard_normal((3, order)), random.standard_normal((3, 2))


@pytest.mark.parametrize("seed", range(5))
def test_the_bounded_real_inequality_gives_the_peak_gain(seed):
    found, peak = bounded_real([system(seed)]), peak_gain(*system(seed))
    assert found.holds
    assert found.bound >= peak.lower
    # from above, to the solver's accuracy 1e-9 in γ² and the lift of P that makes it strict
    assert found.bound == pytest.approx(peak.value, rel=1e-4)


@pytest.mark.parametrize("seed", range(5))
def test_the_h2_inequality_gives_the_h2_norm(seed):
    A, B, C, _ = system(seed)
    found = h2_bound([(A, B, C)])
    assert found.bound >= h2_norm(A, B, C) * (1 - 1e-12)
    assert found.bound == pytest.approx(h2_norm(A, B, C), rel=1e-4)  # as above


def test_a_light_resonance_between_any_grid_points_is_bounded():
    damping = 1e-4
    A = np.array([[0.0, 1.0], [-1.0, -2 * damping]])
    found = bounded_real([(A, np.array([[0.0], [1.0]]), np.array([[1.0, 0.0]]))])
    assert found.bound == pytest.approx(1 / (2 * damping), rel=1e-2)  # solver: relative 1e-9 of γ², condition 1e4
    assert found.bound >= 1 / (2 * damping)


def test_one_form_for_a_family_bounds_every_member_and_what_lies_between():
    A, B, C, D = system(1)
    family = [(A - shift * np.eye(len(A)), B, C, D) for shift in (0.0, 0.2)]
    found = bounded_real(family)
    for shift in (0.0, 0.05, 0.1, 0.2):
        assert peak_gain(A - shift * np.eye(len(A)), B, C, D).value <= found.bound


def test_the_bound_of_a_family_is_that_of_the_same_inequality_written_in_cvxpy():
    A, B, C, _ = system(3, order=4)
    family = [(A - shift * np.eye(4), B, C) for shift in (0.0, 0.5)]
    P, level = cp.Variable((4, 4), symmetric=True), cp.Variable()
    rules = [P >> 0]
    for a, b, c in family:
        rules.append(
            cp.bmat([[a.T @ P + P @ a + c.T @ c, P @ b], [b.T @ P, -level * np.eye(b.shape[1])]]) << 0
        )  # fmt: skip
    cp.Problem(cp.Minimize(level), rules).solve(solver=cp.CLARABEL)
    assert bounded_real(family).bound == pytest.approx(np.sqrt(level.value), rel=1e-4)  # two solutions to 1e-8 each


def test_the_approved_gains_peak_sensitivity_is_bounded_within_a_thousandth():
    problem = load_problem("sway_roll_yaw")
    (group,) = problem.subjects
    loop = group.sensitivity(group.close(problem.gains))
    found, peak = bounded_real([loop]), peak_gain(*loop)
    assert peak.lower <= found.bound <= 1.001 * peak.value  # the solver's accuracy in coordinates of condition 1e4


def test_a_form_that_proves_nothing_gives_no_bound(monkeypatch):
    monkeypatch.setattr(
        "workbench.convex.gain_bound.minimise", lambda c, *_, **__: Answer(-np.ones(len(c)), "Solved", 1, 0.0)
    )
    found = bounded_real([system(0)])
    assert not found.holds
    assert found.bound == np.inf


def test_systems_that_have_no_norm_are_refused():
    A, B, C, D = system(0)
    with pytest.raises(InputError, match="must be stable"):
        bounded_real([(A + 5 * np.eye(len(A)), B, C, D)])
    with pytest.raises(InputError, match="feedthrough is infinite"):
        h2_bound([(A, B, C, D)])
    with pytest.raises(InputError, match="same sizes"):
        bounded_real([system(0), system(0, order=4)])
    with pytest.raises(InputError, match="at least one system"):
        bounded_real([])


@pytest.mark.parametrize("inputs", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(("outputs", "time"), [(1.0, 1.0), (1e6, 1e-6), (1e-6, 1e6)])
def test_the_bounds_are_as_tight_in_any_units(inputs, outputs, time):
    T = np.diag([1e5, 1e-4, 1.0, 1e3, 1e-6])
    A, B, C, D = system(2)
    A, B, C = time * T @ A @ np.linalg.inv(T), time * inputs * T @ B, outputs * C @ np.linalg.inv(T)
    D = inputs * outputs * D
    found, peak = bounded_real([(A, B, C, D)]), peak_gain(A, B, C, D)
    assert peak.lower <= found.bound
    assert found.bound == pytest.approx(peak.value, rel=1e-6)
    # P is in the units of what was given: the dissipation it proves, in units where its diagonal is 1
    size = 1 / np.sqrt(np.diag(found.P))
    fall = found.P @ A + A.T @ found.P + C.T @ C
    side = found.P @ B + C.T @ D
    fall = fall + side @ np.linalg.solve((1 + 1e-9) * found.bound**2 * np.eye(2) - D.T @ D, side.T)
    assert np.linalg.eigvalsh(fall * np.outer(size, size))[-1] < 1e-6 * time
    assert h2_bound([(A, B, C)]).bound == pytest.approx(h2_norm(A, B, C), rel=1e-6)


def test_one_input_in_other_units_does_not_hide_the_others():
    A, B, C, D = system(3)
    B, D = B * [1e6, 1.0], D * [1e6, 1.0]
    assert bounded_real([(A, B, C, D)]).bound == pytest.approx(peak_gain(A, B, C, D).value, rel=1e-6)
