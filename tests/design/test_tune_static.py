"""Static output feedback against Riccati equations, matrix inequalities and its own identities."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from workbench.design.static.feedback import static_feedback
from workbench.design.static.loop import Peaks, StaticLoop
from workbench.errors import InfeasibleError, InputError
from workbench.lti.norm import h2_norm, peak_gain


def random_plant(n, w, u, z, y, seed, shift=0.3):
    """A plant with some unstable modes and regular D12."""
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n)) / np.sqrt(n) + shift * np.eye(n)
    C1, D12 = np.vstack([rng.normal(size=(z, n)), np.zeros((u, n))]), np.vstack([np.zeros((z, u)), np.eye(u)])
    return A, rng.normal(size=(n, w)), rng.normal(size=(n, u)), C1, rng.normal(size=(y, n)), D12


def steepest(pieces):
    return max(pieces, key=lambda piece: piece[0])


@pytest.mark.parametrize(("n", "seed"), [(3, 0), (5, 1), (7, 2)])
def test_state_feedback_for_h2_is_the_riccati_solution(n, seed):
    A, _, B2, C1, _, D12 = random_plant(n, n, 2, 2, n, seed)
    found = static_feedback(A, np.eye(n), B2, C1, np.eye(n), D12=D12, norm="h2", starts=1)
    X = solve_continuous_are(A, B2, C1.T @ C1, D12.T @ D12)
    # LQR: the optimum is √trace X; log norm converged to 1e-6
    assert found.value == pytest.approx(np.sqrt(np.trace(X)), rel=1e-5)
    # the norm is quadratic around the optimum: 1e-5 of value is 3e-3 of K
    assert np.abs(found.K + B2.T @ X).max() < 1e-2 * np.abs(X).max()


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_state_feedback_for_hinf_is_the_bounded_real_inequality_s_optimum(seed):
    import cvxpy as cp

    n, w, u = 4, 2, 1
    A, B1, B2, C1, _, D12 = random_plant(n, w, u, 2, n, seed)
    Q, Y, gamma = cp.Variable((n, n), symmetric=True), cp.Variable((u, n)), cp.Variable()
    z = len(C1)
    F, G = A @ Q + B2 @ Y, C1 @ Q + D12 @ Y
    block = cp.bmat([
        [F + F.T, B1, G.T], [B1.T, -gamma * np.eye(w), np.zeros((w, z))], [G, np.zeros((z, w)), -gamma * np.eye(z)],
    ])  # fmt: skip
    problem = cp.Problem(cp.Minimize(gamma), [(block + block.T) / 2 << 0, Q >> 1e-7 * np.eye(n)])
    problem.solve(solver=cp.CLARABEL)
    found = static_feedback(A, B1, B2, C1, np.eye(n), D12=D12, starts=3)
    # the convex optimum is a lower bound for every K, reached up to the interior-point solver's 1e-4 and ours
    assert gamma.value is not None
    assert found.value >= float(gamma.value) * (1 - 1e-3)
    assert found.value == pytest.approx(float(gamma.value), rel=5e-3)


@pytest.mark.parametrize("seed", range(3))
def test_gradients_of_all_measures_are_the_differences(seed):
    A, B1, B2, C1, C, D12 = random_plant(5, 2, 2, 2, 2, seed, shift=-2.0)
    rng = np.random.default_rng(seed)
    loops = {"hinf": StaticLoop.of(A, B1, B2, C1, C, rng.normal(size=(4, 2)), D12, rng.normal(size=(2, 2)))}
    loops["h2"] = StaticLoop.of(A, B1, B2, C1, C, None, D12, None)
    K, direction, h = 0.1 * rng.normal(size=(2, 2)), rng.normal(size=(2, 2)), 1e-6
    for loop, measure in (
        (loops["hinf"], Peaks(loops["hinf"])), (loops["h2"], loops["h2"].variance), (loops["h2"], loops["h2"].abscissa),
    ):  # fmt: skip
        above, below = (steepest(measure(K + s * h * direction))[0] for s in (1, -1))
        slope = np.sum(steepest(measure(K))[1] * direction)
        # central differences: truncation h² and rounding 1e-16/h, both below 1e-8 of the slope's scale
        assert slope == pytest.approx((above - below) / (2 * h), rel=1e-4, abs=1e-6), loop
    loop = loops["hinf"]
    assert np.exp(steepest(Peaks(loop)(K))[0]) == pytest.approx(peak_gain(*loop.closed(K)).value, rel=1e-9)  # same peak
    assert np.exp(steepest(loops["h2"].variance(K))[0]) == pytest.approx(h2_norm(*loops["h2"].closed(K)[:3]), rel=1e-9)


def test_mixtures_of_equal_singular_values_stay_below_the_largest():
    # two equal decoupled channels: σ1 = σ2 at K = 0 and every piece is a minorant of σ_max along any change of K
    A, eye = -np.eye(2), np.eye(2)
    loop = StaticLoop.of(A, eye, eye, eye, eye)
    pieces = Peaks(loop)(np.zeros((2, 2)))
    assert len(pieces) > 2
    rng = np.random.default_rng(0)
    for _ in range(20):
        change = 1e-4 * rng.normal(size=(2, 2))
        value = np.log(np.linalg.norm(np.linalg.inv(eye - change), 2))
        predicted = max(v + np.sum(g * change) for v, g in pieces)
        assert predicted <= value + 1e-7  # second order in the change
        # four phases leave at most the share 1 − cos 45° of the difference of the singular values
        assert predicted >= value - 0.5 * np.linalg.norm(change)


def test_an_unstable_plant_is_stabilised_and_its_norm_bracketed():
    A, B1, B2, C1, C, D12 = random_plant(4, 2, 2, 2, 3, 6)
    found = static_feedback(A, B1, B2, C1, C, D12=D12, starts=2, seed=1, largest=20.0)
    assert np.linalg.eigvals(A).real.max() > 0
    assert found.abscissa < 0
    assert found.lower <= found.value <= found.upper
    assert found.upper == pytest.approx(np.exp(found.minimum.value), rel=1e-4)  # steering saw what the bracket proves
    again = static_feedback(A, B1, B2, C1, C, D12=D12, starts=2, seed=1, largest=20.0)
    assert again.K.tolist() == found.K.tolist()


def test_the_metric_of_gains_on_nearly_parallel_signals_is_that_on_independent_ones():
    # measurements mixed by a matrix of condition 1e3: K T, the same closed loops, so the same length of every change
    A, B1, B2, C1, C, D12 = random_plant(4, 2, 2, 2, 3, 6, shift=-2.0)
    rng = np.random.default_rng(0)
    U, V = (np.linalg.qr(rng.normal(size=(3, 3)))[0] for _ in range(2))
    back = np.linalg.inv(U @ np.diag([1.0, 3e-2, 1e-3]) @ V)
    K = 0.1 * rng.normal(size=(2, 3))
    plain = StaticLoop.of(A, B1, B2, C1, C, D12=D12).metric(K)
    mixed = StaticLoop.of(A, B1, B2, C1, np.linalg.inv(back) @ C, D12=D12).metric(K @ back)
    turn = np.kron(np.eye(2), back.T)  # entries row by row
    wanted = turn @ plain @ plain.T @ turn.T
    np.testing.assert_allclose(mixed @ mixed.T, wanted, rtol=0, atol=1e-6 * np.abs(wanted).max())  # 1e3² · 1e-13


def test_h2_with_noise_on_both_sides_stays_where_the_feedthrough_vanishes():
    # z = (x, u1), y = (x1 + noise, x2): D12 K D21 = 0 forbids K[0, 0] alone
    A, B2 = np.array([[0.0, 1.0], [-1.0, 0.5]]), np.array([[0.0, 0.3], [1.0, 0.0]])
    B1, D21 = np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[0.0, 0.5], [0.0, 0.0]])
    C1, D12 = np.vstack([np.eye(2), np.zeros((1, 2))]), np.array([[0.0, 0], [0, 0], [1.0, 0.0]])
    found = static_feedback(A, B1, B2, C1, np.eye(2), D12=D12, D21=D21, norm="h2", largest=5.0, starts=3)
    assert abs(found.K[0, 0]) < 1e-12  # the restriction, to rounding
    assert np.abs(found.K).max() <= 5.0
    loop = StaticLoop.of(A, B1, B2, C1, np.eye(2), None, D12, D21)
    closed = loop.closed(found.K)
    assert np.abs(closed[3]).max() < 1e-12
    assert found.value == pytest.approx(h2_norm(*closed[:3]), rel=1e-9)  # two routes
    rng = np.random.default_rng(0)
    for _ in range(200):  # no allowed gain nearby is better: local optimum, up to the tolerance of the descent
        K = found.K + 1e-2 * rng.normal(size=(2, 2)) * [[0, 1], [1, 1]]
        if np.abs(K).max() <= 5 and np.linalg.eigvals(loop.closed(K)[0]).real.max() < 0:
            assert h2_norm(*loop.closed(K)[:3]) >= found.value * (1 - 1e-4)


def test_a_feedthrough_that_the_gain_can_cancel_fixes_it():
    # z = 2 w + u with y = w + x: only K = −2 leaves no feedthrough, and dx = x − 2 (x + w) + w is stable
    one = [[1.0]]
    found = static_feedback(one, one, one, [[0.0]], one, D11=[[2.0]], D12=one, D21=one, norm="h2", starts=1)
    assert found.K[0, 0] == pytest.approx(-2, rel=1e-12)
    # z = −2 x, dx = −x − w: variance 1/2, norm √(4/2)
    assert found.value == pytest.approx(np.sqrt(2), rel=1e-9)


def test_a_mode_that_no_feedback_moves_is_named():
    A, B2 = np.diag([0.5, -1.0]), np.array([[0.0], [1.0]])
    with pytest.raises(InfeasibleError, match=r"the mode 0\.5 ± 0j is out of reach of the inputs"):
        static_feedback(A, B2, B2, np.eye(2), np.eye(2), starts=1)
    with pytest.raises(InfeasibleError, match="out of reach of the measurements"):
        static_feedback(A, B2, np.eye(2), np.eye(2), [[0.0, 1.0]], starts=1)


def test_bounds_on_the_gain_are_kept():
    # dx = x + u + w, z = x, y = x: the norm 1/(−1 − K) falls for ever, so the bound binds
    found = static_feedback([[1.0]], [[1.0]], [[1.0]], [[1.0]], [[1.0]], largest=5.0, starts=2)
    assert found.K[0, 0] == pytest.approx(-5, rel=1e-6)  # a vertex: reached exactly up to the tolerance
    assert found.value == pytest.approx(1 / 4, rel=1e-6)


def test_what_no_static_gain_stabilises_is_refused_with_the_eigenvalue():
    # 1/s²: position feedback alone never damps; trace zero keeps the abscissa at zero or above
    with pytest.raises(InfeasibleError, match=r"the best of 2 starts leaves"):
        static_feedback([[0, 1], [0, 0.1]], [[0], [1]], [[0], [1]], [[1, 0]], [[1, 0]], starts=2, budget_seconds=3)


def test_matrices_that_do_not_fit_are_refused():
    one = [[1.0]]
    with pytest.raises(InputError, match="B2 must have shape"):
        static_feedback(one, one, [[1.0], [2.0]], one, one)
    with pytest.raises(InputError, match="no feedthrough"):
        static_feedback(one, one, one, one, one, D11=one, norm="h2")
    with pytest.raises(InputError, match="one of hinf, h2"):
        static_feedback(one, one, one, one, one, norm="l1")


def test_a_given_gain_is_never_worsened_and_more_starts_are_never_worse():
    for seed, norm in ((0, "hinf"), (1, "h2"), (2, "h2")):
        A, B1, B2, C1, C, D12 = random_plant(3, 2, 1, 2, 2, seed, shift=-0.8)
        one, three = (static_feedback(A, B1, B2, C1, C, D12=D12, norm=norm, starts=k, seed=2) for k in (1, 3))
        assert three.value <= one.value
        again = static_feedback(A, B1, B2, C1, C, D12=D12, norm=norm, starts=1, K0=three.K)
        assert again.value <= three.value


def test_a_given_gain_that_a_search_cannot_improve_comes_back():
    # z = (x, u), y = x: K is the optimum's, and a search that is ended at once has nothing else
    A, B2, eye = np.array([[0.5]]), np.array([[1.0]]), np.eye(1)
    C1, D12 = np.array([[1.0], [0.0]]), np.array([[0.0], [1.0]])
    K = -B2.T @ solve_continuous_are(A, B2, C1.T @ C1, D12.T @ D12)
    found = static_feedback(A, eye, B2, C1, eye, D12=D12, norm="h2", K0=K, on_progress=lambda words, value: True)
    assert found.value <= h2_norm(A + B2 @ K, eye, C1 + D12 @ K) * (1 + 1e-12)


def test_a_given_gain_outside_the_bounds_is_refused_and_a_default_bound_gives_way():
    A, eye = -np.eye(1), np.eye(1)
    with pytest.raises(InputError, match="K0 must lie within the bounds"):
        static_feedback(A, eye, eye, eye, eye, K0=[[-3.0]], largest=2.0)
    far = -1e7 * eye
    assert static_feedback(A, eye, eye, eye, eye, K0=far).value <= 1e-7  # 1/(s + 1 + 1e7)


@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_static_feedback_is_the_same_in_other_units(unit):
    A, B1, B2, C1, C, D12 = random_plant(4, 2, 1, 2, 2, 5, shift=-0.3)
    plain = static_feedback(A, B1, B2, C1, C, D12=D12, starts=1)
    other = static_feedback(A * unit, B1 * unit, B2 * unit, C1, C, D12=D12, starts=1)
    assert other.value == pytest.approx(plain.value, rel=1e-4)
    louder = static_feedback(A, B1 * unit, B2, C1, C, D12=D12, starts=1)
    assert louder.value == pytest.approx(plain.value * unit, rel=1e-4)
