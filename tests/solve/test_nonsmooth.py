"""The nonsmooth solver on functions whose minima are known."""

import math
from typing import cast

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.solve.direction import shortest, simplex_direction
from workbench.solve.nonsmooth import minimise

FREE = (np.full(2, -np.inf), np.full(2, np.inf))


def rosenbrock(x):
    """8|x1² − x2| + (1 − x1)², minimum 0 at (1, 1): Lewis & Overton's example."""
    rest = x[0] ** 2 - x[1]
    sign = np.sign(rest) or 1.0
    return [(8 * abs(rest) + (1 - x[0]) ** 2, np.array([16 * sign * x[0] - 2 * (1 - x[0]), -8 * sign]))]


def chebyshev(x):
    """Nesterov's Chebyshev–Rosenbrock function, minimum 0 at (1, …, 1)."""
    value, gradient = abs(x[0] - 1) / 4, np.zeros(len(x))
    gradient[0] = np.sign(x[0] - 1) / 4
    for i in range(len(x) - 1):
        rest = x[i + 1] - 2 * x[i] ** 2 + 1
        sign = np.sign(rest) or 1.0
        value += abs(rest)
        gradient[i + 1] += sign
        gradient[i] -= 4 * sign * x[i]
    return [(value, gradient)]


def quadratics(n, k, seed):
    """max of k convex quadratics whose gradients at 0 have 0 in their hull: minimum 0 at 0 (Lewis & Wylie)."""
    rng = np.random.default_rng(seed)
    H = [M @ M.T / n for M in rng.normal(size=(k, n, n))]
    weights = rng.random(k) + 0.1
    g = rng.normal(size=(k, n))
    g[-1] = -(weights[:-1] @ g[:-1]) / weights[-1]

    def function(x):
        return [(v @ x + x @ M @ x / 2, v + M @ x) for v, M in zip(g, H, strict=True)]

    return function


def abscissa(A, B, C):
    """x → eigenvalues of A + Σ x_i B_i C_i."""
    from scipy.linalg import eig

    def function(x):
        solution = eig(A + (B * x) @ C, left=True, right=True)
        values, left, right = cast(tuple[np.ndarray, np.ndarray, np.ndarray], solution)
        pieces = []
        for k in range(len(values)):
            scale = left[:, k].conj() @ right[:, k]
            if values[k].imag >= 0 and abs(scale) > 1e-9:
                pieces.append((values[k].real, ((B.T @ left[:, k].conj()) * (C @ right[:, k]) / scale).real))
        return pieces

    return function


def test_the_nonsmooth_rosenbrock_valley_is_followed_to_its_end():
    found = minimise(rosenbrock, [-1.2, 1.0], tolerance=1e-10)
    # the value is quadratic along the valley: 1e-8 of value is 1e-4 of x
    assert found.value < 1e-8
    assert found.x == pytest.approx([1, 1], abs=1e-4)


def test_chebyshev_rosenbrock_is_solved_even_from_a_start_on_its_kink():
    assert minimise(chebyshev, [-1.0, 1.0], tolerance=1e-9).value < 1e-6  # (−1, 1) has x2 = 2x1² − 1 exactly
    assert minimise(chebyshev, [-0.7, 0.6, -0.4], tolerance=1e-10).value < 1e-6


@pytest.mark.parametrize("seed", range(3))
def test_known_pieces_need_few_evaluations(seed):
    function = quadratics(10, 5, seed)
    found = minimise(function, np.ones(10), tolerance=1e-9)
    assert found.value >= -1e-12
    assert found.value < 1e-7
    alone = minimise(lambda x: [max(function(x), key=lambda p: p[0])], np.ones(10), tolerance=1e-9)
    assert alone.value < 1e-5
    assert found.evaluations < alone.evaluations


def test_the_certificate_is_small_at_a_minimum_and_not_on_the_way():
    function = quadratics(10, 5, 0)
    end = minimise(function, np.ones(10), tolerance=1e-9)
    early = minimise(function, np.ones(10), evaluations=4)
    # gradients at the minimum are of size 3; the smallest combination vanishes up to the radius times the curvature
    assert end.stationarity < 1e-3
    assert early.stationarity > 0.1
    assert "used up" in early.message


def test_a_spectral_abscissa_is_minimised_where_eigenvalues_coalesce():
    # oscillator x'' = −(1 + k) x − d x': abscissa −d/2 until d² = 4(1 + k); with k = 0 fixed by its bounds the best is
    # −1, a double defective eigenvalue, at d = 2
    A, B, C = np.array([[0.0, 1.0], [-1.0, 0.0]]), np.array([[0.0], [1.0]]), np.array([[0.0, -1.0]])
    found = minimise(abscissa(A, B, C), [0.3], tolerance=1e-10)
    # near d = 2 the abscissa rises like a square root: 1e-4 of value is 1e-8 of d
    assert found.value == pytest.approx(-1, abs=1e-4)


def test_the_box_holds_at_every_point_and_its_pull_is_part_of_the_certificate():
    seen = []

    def function(x):
        seen.append(x.copy())
        return [(float(np.sum((x - 2) ** 2)), 2 * (x - 2))]

    found = minimise(function, [0.0, 0.5], bounds=[(-1, 1), (-1, 3)])
    assert np.all(np.array(seen)[:, 0] <= 1)
    assert found.x == pytest.approx([1, 2], abs=1e-4)  # value error tolerance 1e-7, quadratic
    # the gradient there is (−2, 0); the bound absorbs it, up to the radius times the curvature 2
    assert found.stationarity < 1e-3


def test_infinite_values_keep_the_run_inside_the_domain():
    # x − log x on x > 0: minimum 1 at 1; the first trial steps leave the domain
    found = minimise(lambda x: [(x[0] - math.log(x[0]), 1 - 1 / x)] if x[0] > 0 else [], [50.0], tolerance=1e-10)
    assert found.x == pytest.approx([1.0], abs=1e-4)  # quadratic around the minimum


def test_scaling_the_variables_gives_the_same_minimum():
    function = quadratics(4, 3, 1)
    size = np.array([1e-4, 1.0, 1e3, 10.0])

    def scaled(y):
        return [(value, gradient / size) for value, gradient in function(y / size)]

    found = minimise(scaled, size, scale=size, tolerance=1e-9)
    # the same iterates as unscaled, up to rounding of the division
    assert found.value == pytest.approx(minimise(function, np.ones(4), tolerance=1e-9).value, abs=1e-8)


def test_a_metric_of_the_right_shape_makes_a_narrow_valley_round():
    # |Lx|² + |first entry of Lx|, condition 1e10: with the metric (L'L)⁻¹ it is a function of y = Lx alone
    rng = np.random.default_rng(0)
    L = (
        np.linalg.qr(rng.normal(size=(6, 6)))[0]
        @ np.diag(np.geomspace(1, 1e-5, 6))
        @ np.linalg.qr(rng.normal(size=(6, 6)))[0]
    )

    def function(x):
        y = L @ x
        return [(y @ y + sign * y[0], L.T @ (2 * y + sign * np.eye(6)[0])) for sign in (1, -1)]

    start = np.linalg.solve(L, np.ones(6))
    with_it = minimise(function, start, metric=np.linalg.inv(L), tolerance=1e-9, evaluations=60)
    without = minimise(function, start, tolerance=1e-9, evaluations=60)
    assert with_it.value < 1e-6
    assert without.value > 100 * max(with_it.value, 1e-8)
    with pytest.raises(InputError, match="metric must be a finite, nonzero matrix"):
        minimise(function, start, metric=np.eye(2))


def test_same_seed_gives_the_same_point_and_the_caller_can_stop_it():
    first, second = (minimise(chebyshev, [-1.0, 1.0], seed=3) for _ in range(2))
    assert first.x.tolist() == second.x.tolist()
    stopped = minimise(chebyshev, [-0.5, 1.0], on_step=lambda x, value: value < 0.5)
    assert stopped.message == "stopped by the caller"
    assert minimise(rosenbrock, [-1.2, 1.0], stop_below=1.0).value < 1.0


def test_a_budget_of_time_ends_the_run():
    import time

    def slow(x):
        time.sleep(0.01)
        return chebyshev(x)

    found = minimise(slow, [-0.5, 1.0, 0.3], budget_seconds=0.1)
    assert found.message == "the time is used up"
    assert found.evaluations < 20


def test_starts_and_bounds_that_do_not_fit_are_refused():
    with pytest.raises(InputError, match="must lie in the function's domain"):
        minimise(lambda x: [], [0.0])
    with pytest.raises(InputError, match="low <= high"):
        minimise(rosenbrock, [0.0, 0.0], bounds=[(1, 0), (0, 1)])
    with pytest.raises(InputError, match="positive sizes"):
        minimise(rosenbrock, [0.0, 0.0], scale=[1.0, 0.0])


def test_the_shortest_vector_of_a_hull_is_found():
    # hull of (1, 1) and (1, −3): the segment x = 1, nearest point (1, 0)
    norm, vector = shortest(np.array([[1.0, 1.0], [1.0, -3.0]]), *FREE)
    assert norm == pytest.approx(1, rel=1e-9)  # NNLS is exact to rounding
    assert vector == pytest.approx([1, 0], abs=1e-9)


def test_the_model_step_minimises_the_model():
    rng = np.random.default_rng(0)
    gradients, gaps = rng.normal(size=(4, 3)), np.array([0.0, 0.1, 0.3, 0.2])
    L = np.tril(rng.normal(size=(3, 3))) + 2 * np.eye(3)
    low, high = np.array([-0.2, -np.inf, -0.5]), np.array([0.1, 0.3, np.inf])
    found = simplex_direction(gradients, gaps, L, low, high)
    hessian = np.linalg.inv(L @ L.T)

    def model(d):
        return np.max(gradients @ d - gaps) + d @ hessian @ d / 2

    best = model(found.step)
    trials = np.clip(found.step + 0.05 * rng.normal(size=(4000, 3)), low, high)
    # the extra term of the dual changes the model's optimum by at most 1e-4 of the gaps
    assert min(model(d) for d in trials) > best - 1e-4
    assert found.weights.sum() == pytest.approx(1, abs=1e-12)
