"""Each proof on small systems whose answer is known in closed form, and its refusals."""

import math

import numpy as np
import pytest
from flint import arb, arb_mat, fmpq, fmpq_mat, fmpq_poly
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.lti.norm import peak_gain
from workbench.verify.exact import pole
from workbench.verify.exact.delay import delay_margins, smallest_delay_margin
from workbench.verify.exact.failure import NotProved
from workbench.verify.exact.sensitivity import Peak, numerators, roots_from_zero, squared_minors
from workbench.verify.exact.system import System, identity, matrix, zeros
from workbench.verify.exact.variance import Stationary, intensity
from workbench.verify.vehicle.response import shaping
from workbench.verify.vehicle.table import Spectrum

SHARP = 1e-12  # relative; the balls are 1e-20 wide and wider, the expected numbers doubles


def q(rows):
    """A rational matrix from exact doubles."""
    return fmpq_mat(len(rows), len(rows[0]), [fmpq(*float(x).as_integer_ratio()) for row in rows for x in row])


def system(A, B, C, D):
    m, p = len(B[0]), len(C)
    names = [tuple(f"{k}{i}" for i in range(n)) for k, n in (("x", len(A)), ("u", m), ("y", p))]
    return System(q(A), q(B), q(C), q(D), *names)


def middle(ball):
    low, high = pole.ends(ball)
    assert low <= high
    assert float(high - low) <= 1e-9 * abs(float(high)) + 1e-30
    return float(low + high) / 2


# ---- poles


def test_damping_and_decay_of_a_known_pair_and_a_real_pole():
    # (s² + 2·0.3·2 s + 4)(s + 5)
    discs = pole.poles(q([[0, 1, 0], [-4, -1.2, 0], [0, 0, -5]]))
    assert pole.stable(discs)
    assert middle(pole.damping(discs)) == pytest.approx(0.3, rel=SHARP)
    assert middle(pole.decay(discs)) == pytest.approx(0.6, rel=SHARP)


def test_a_threefold_pole_is_no_special_case():
    discs = pole.poles(
        matrix([[fmpq(-1), fmpq(1), fmpq(0)], [fmpq(0), fmpq(-1), fmpq(1)], [fmpq(0), fmpq(0), fmpq(-1)]])
    )
    assert middle(pole.damping(discs)) == 1
    assert middle(pole.decay(discs)) == 1


@pytest.mark.parametrize("A", [[[0.0]], [[0, 1], [-1, 0]], [[1e-300]], [[0, 1], [-1, 1e-30]]])
def test_a_pole_on_or_hardly_beyond_the_axis_is_never_called_stable(A):
    discs = pole.poles(q(A))
    assert not pole.stable(discs)
    with pytest.raises(NotProved, match="the loop is not stable"):
        pole.require_stable(discs)


def test_a_hardly_stable_pair_is_proved_stable_where_doubles_cannot_tell():
    discs = pole.poles(matrix([[fmpq(0), fmpq(1)], [fmpq(-1), fmpq(-1, 10**40)]]))
    assert pole.stable(discs)
    assert 0 < float(pole.decay(discs)) < 1e-39


# ---- Sturm


@settings(deadline=None)
@given(st.lists(st.fractions(-4, 4, max_denominator=7), min_size=1, max_size=7), st.integers(0, 2))
@pytest.mark.slow
def test_sturm_counts_the_distinct_roots_from_zero_on(roots, pairs):
    p = fmpq_poly([1])
    for r in roots:
        p *= fmpq_poly([-fmpq(r.numerator, r.denominator), 1])
    for k in range(pairs):
        p *= fmpq_poly([1 + k, 1, 1])  # complex pairs
    expected = len({r for r in roots if r > 0})
    if 0 in roots:
        assert roots_from_zero(p) >= 1  # a root at zero ends the question: some root is there
    else:
        assert roots_from_zero(p) == roots_from_zero(-p) == expected


def test_sturm_sees_a_double_root_that_only_touches_and_a_constant_without_roots():
    assert roots_from_zero(fmpq_poly([4, -4, 1])) == 1
    assert roots_from_zero(fmpq_poly([5])) == 0
    assert roots_from_zero(fmpq_poly([0])) == 1


# ---- peak sensitivity


def sensitivity_of(A, B, C):
    """S = I − C (sI − A + BC)⁻¹ B of a loop L = C (sI − A)⁻¹ B."""
    A, B, C = (np.array(m, float) for m in (A, B, C))
    return A - B @ C, B, -C, np.eye(len(C))


def test_the_peak_of_a_textbook_loop_is_its_closed_form():
    # L = 1/(s (s + 1)): |S|² = (x² + x)/(x² − x + 1) in x = ω², largest at x = (1 + √3)/2
    x = (1 + math.sqrt(3)) / 2
    true = math.sqrt((x**2 + x) / (x**2 - x + 1))
    peak = Peak(system(*sensitivity_of([[0, 1], [0, -1]], [[0], [1]], [[1, 0]])), [fmpq(1)])
    low, high = peak.enclosure(fmpq(3))
    assert float(low) <= true * (1 + 1e-15)
    assert true * (1 - 1e-15) <= float(high)
    assert high <= low * (1 + fmpq(1, 10**9))
    assert peak.below(fmpq(math.ceil(true * 1.00001 * 10**9), 10**9))
    assert not peak.below(fmpq(int(true * 0.99999 * 10**9), 10**9))


@pytest.mark.parametrize("guess", ["1", "1.5", "40"])
def test_the_bracket_does_not_depend_on_where_the_search_starts(guess):
    peak = Peak(system(*sensitivity_of([[0, 1], [0, -1]], [[0], [1]], [[1, 0]])), [fmpq(1)])
    low, high = peak.enclosure(fmpq(*map(int, float(guess).as_integer_ratio())))
    true = math.sqrt((1.5 + math.sqrt(3)) / 1.5)  # the closed form above: x² = x + 1/2 there
    assert float(low) * (1 - 1e-15) <= true <= float(high)
    assert high <= low * (1 + fmpq(1, 10**9))


def test_a_peak_that_is_only_approached_at_infinity_is_one():
    peak = Peak(system([[-1.0]], [[1.0]], [[-0.5]], [[1.0]]), [fmpq(1)])  # S = (s + 0.5)/(s + 1) < 1
    assert not peak.below(fmpq(1))
    assert peak.below(fmpq(1000001, 1000000))


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 4))
def test_peaks_of_random_loops_with_several_commands_are_the_hamiltonians(seed, commands):
    rng = np.random.default_rng(seed)
    n = 5
    A = np.round(rng.normal(size=(n, n)) * 8) / 8
    A -= np.eye(n) * (math.ceil(8 * max(np.linalg.eigvals(A).real.max() + 0.3, 0)) / 8)
    B, C = (np.round(rng.normal(size=s) * 8) / 8 for s in ((n, commands), (commands, n)))
    D = np.eye(commands)
    root = 2.0 ** rng.integers(0, 2, commands)  # patterns of unequal length: S between unit ones is diag(root) S diag⁻¹
    ours = Peak(system(A.tolist(), B.tolist(), C.tolist(), D.tolist()), [fmpq(int(r * r)) for r in root])
    theirs = peak_gain(A, B / root, root[:, None] * C, D)
    low, high = ours.enclosure(fmpq(2))
    # 1e-8: the Hamiltonian's own bracket is 1e-9 wide
    assert float(low) * (1 - 1e-8) <= theirs.value <= float(high) * (1 + 1e-8)


def test_minors_are_the_determinants_of_the_sensitivity():
    A, B, C, D = sensitivity_of([[0, 1, 0], [-2, -1, 1], [0, 0, -3]], [[0, 1], [1, 0], [0, 1]], [[1, 0, 0], [0, 0, 2]])
    seen = system(A.tolist(), B.tolist(), C.tolist(), D.tolist())
    p = seen.A.charpoly()
    N = numerators(seen, p)
    S = D + C @ np.linalg.solve(2j * np.eye(3) - A, B)

    def at(poly, s):
        return sum(float(c) * s**k for k, c in enumerate(poly.coeffs()))

    for i in range(2):
        for j in range(2):
            assert at(N[i][j], 2j) / at(p, 2j) == pytest.approx(S[i, j], rel=SHARP)
    last = squared_minors(p, N, [fmpq(1)] * 2)[2]
    assert float(last(fmpq(4))) == pytest.approx(abs(np.linalg.det(S) * at(p, 2j)) ** 2, rel=SHARP)


# ---- delay margin


def test_the_delay_margin_of_an_integrator_is_a_quarter_turn_over_its_gain():
    # L = k/s crosses 1 at ω = k with phase −π/2: the margin is (π/2)/k
    for k in (1.0, 4.0):
        (margin,) = delay_margins(system(*sensitivity_of([[0.0]], [[k]], [[1.0]])))
        assert middle(margin) == pytest.approx(math.pi / 2 / k, rel=SHARP)


def test_a_loop_that_never_reaches_one_has_no_delay_margin_and_a_direct_one_none_to_give():
    assert delay_margins(system(*sensitivity_of([[-1.0]], [[0.5]], [[1.0]]))) == [None]
    assert smallest_delay_margin([None, arb(2), arb(1)]) == 1
    assert smallest_delay_margin([None]) is None
    # L = 1.5 + 1/(s + 1), S(∞) = 1/2.5: any dead time around |L(∞)| > 1 destabilises
    direct = system([[-1.4]], [[0.4]], [[-0.4]], [[0.4]])
    assert middle(delay_margins(direct)[0]) == 0


def test_a_delay_a_little_below_the_margin_keeps_a_pade_loop_stable_and_one_above_does_not():
    A, B, C = np.array([[0, 1], [0, -1.0]]), np.array([[0], [2.0]]), np.array([[1.0, 0]])
    (margin,) = delay_margins(system(*sensitivity_of(A, B, C)))
    for factor, stable in ((0.999, True), (1.001, False)):
        s_num, s_den = pade(middle(margin) * factor, 8)
        loop_den = np.polymul([1, 1, 0], s_den)
        closed = np.polyadd(loop_den, 2 * np.array(s_num))
        assert (np.roots(closed).real.max() < 0) is np.bool_(stable)


def pade(T, n):
    c = [1.0]
    for k in range(1, n + 1):
        c.append(c[-1] * (n - k + 1) / (k * (2 * n - k + 1)))
    bottom = [c[k] * T**k for k in range(n, -1, -1)]
    return [b * (-1) ** (n - i) for i, b in enumerate(bottom)], bottom


# ---- variance


def test_the_mean_square_of_a_first_order_lag_is_its_closed_form():
    state = Stationary(q([[-3.0]]), arb_mat([[2]]))
    assert middle(state.mean_square([arb(5)])) == pytest.approx(25 * 2 / 6, rel=SHARP)


def test_noise_that_comes_again_after_a_delay_adds_its_correlation():
    # dx = −a x + w(t) + w(t − T): E[x²] = (1 + e^{−aT})/a
    a, T = 2.0, fmpq(3, 8)
    one = arb_mat([[1]])
    Q = intensity(q([[-a]]), [(fmpq(0), one), (T, one)], one)
    true = (1 + math.exp(-a * 3 / 8)) / a
    assert middle(Stationary(q([[-a]]), Q).mean_square([arb(1)])) == pytest.approx(true, rel=SHARP)


def test_the_covariance_of_a_stiff_system_far_from_balance_is_enclosed_tightly():
    # ẍ + 2ζω ẋ + ω² x = w has E[x²] = 1/(4ζω³), E[ẋ²] = 1/(4ζω); beside it a lag a thousand times faster in other units
    omega, zeta = 0.25, 0.03125
    A = q([[0, 1, 0], [-(omega**2), -2 * zeta * omega, 0], [1e6, 0, -500]])
    Q = zeros(3, 3)
    Q[1, 1] = fmpq(1)
    state = Stationary(A, arb_mat(Q))
    assert middle(state.mean_square([arb(1), arb(0), arb(0)])) == pytest.approx(1 / (4 * zeta * omega**3), rel=SHARP)
    assert middle(state.mean_square([arb(0), arb(1), arb(0)])) == pytest.approx(1 / (4 * zeta * omega), rel=SHARP)


def test_an_interval_of_intensities_widens_the_mean_square_as_much():
    wide = arb(2, 0.02)
    low, high = pole.ends(Stationary(q([[-1.0]]), arb_mat([[wide]])).mean_square([arb(1)]))
    assert low <= fmpq(99, 100)
    assert high >= fmpq(101, 100)
    assert high - low < fmpq(41, 1000)  # twice what it must be: the error bound works both ways


def test_a_marginal_matrix_gives_no_covariance():
    with pytest.raises(NotProved):
        Stationary(q([[0.0]]), arb_mat([[1]]))
    with pytest.raises(NotProved):
        Stationary(q([[0, 1], [-1, 0]]), arb_mat([[1, 0], [0, 1]]))


@pytest.mark.parametrize(("corners", "zeros_"), [((0.3,), 0), ((0.3, 2.0), 0), ((0.3, 2.0), 1), ((0.3, 2.0, 5.0), 2)])
def test_a_shaping_filter_is_the_workbenchs_own(corners, zeros_):
    from workbench.physics.guideway.spectrum import Rational

    theirs = Rational(strength=2e-6, corners=corners, zeros=zeros_, provenance="a test", extrapolate=True)
    A, B, C = theirs.shaping_filter(100.0)
    ours_A, signal = shaping(Spectrum(fmpq(1), tuple(fmpq(*c.as_integer_ratio()) for c in corners), zeros_), fmpq(100))
    ours = [[float(x) for x in row] for row in ours_A.tolist()]
    for omega in (1.0, 50.0, 700.0):
        expected = C @ np.linalg.solve(1j * omega * np.eye(len(A)) - A, B)
        left = np.linalg.solve(1j * omega * np.eye(len(ours)) - np.array(ours), np.eye(len(ours))[:, 0])
        gain = np.sqrt(np.pi * 2e-6 * 100.0 ** (2 * len(corners) - 2 * zeros_ - 1))
        assert gain * (np.array([float(c) for c in signal]) @ left) == pytest.approx(expected[0, 0], rel=1e-12)


def test_the_root_of_a_ball_around_zero_is_a_number():
    low, high = pole.ends(pole.root(arb(0, 1e-20)))
    assert low <= 0
    assert 1e-10 <= float(high) < 1.1e-10


def test_identity_is_what_it_says():
    assert identity(2) * q([[1, 2], [3, 4]]) == q([[1, 2], [3, 4]])
