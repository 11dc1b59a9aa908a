"""The polynomial form of the loop against the state space, against exact rationals, and at its edges."""

from fractions import Fraction

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from workbench.control.filters import combined_fraction
from workbench.control.gains import GAIN_NAMES, TIME_CONSTANTS
from workbench.control.loop import close, subject
from workbench.control.loop.mechanics import EXTERNAL, mechanics
from workbench.control.loop.polynomial import characteristic_polynomial, loop_polynomial, roots_of
from workbench.errors import InputError
from workbench.ledger.baseline import report_gains, report_law, report_model, report_vehicle
from workbench.lti import PolynomialMatrix
from workbench.lti.polynomial import multiply
from workbench.physics.vehicle import linear as vehicle_linear
from workbench.physics.vehicle import linearise

GROUPS = ("heave_pitch", "sway_roll_yaw")
EXTRAS = (
    {},
    {"gravity_term": True},
    {"current_lag": 0.01},
    {
        "current_lag": 0.01,
        "gravity_term": True,
        "coil_length": 3.0,
        "thrust": 1e4,
        "lift_damping": 2e3,
        "lateral_damping": -1e3,
    },
)


def distinct_gains(seed: int = 0):
    """Gains without coincident roots: all present, all time constants different."""
    draw = np.random.default_rng(seed)
    names = {name: float(draw.uniform(0.1, 0.9)) for name in TIME_CONSTANTS}
    names |= {name: float(draw.uniform(0.05, 0.4)) for name in GAIN_NAMES if name not in TIME_CONSTANTS}
    return report_gains().with_values(
        **names | {"K_h": -1.1, "K_heave": 1.0, "K_pitch": 1.1, "K_sway": 0.6, "K_roll": 1.3, "K_yaw": 3.0}
    )


def farthest(found, expected) -> float:
    """Largest relative distance between two sets of roots, paired as well as possible."""
    distance = np.abs(np.asarray(found)[:, None] - np.asarray(expected)[None, :])
    i, j = linear_sum_assignment(distance)
    return float((distance[i, j] / np.abs(np.asarray(expected))[j]).max())


@pytest.mark.parametrize("extras", EXTRAS)
@pytest.mark.parametrize("part", [*GROUPS, "all"])
@pytest.mark.parametrize("seed", [0, 1])
def test_roots_are_the_eigenvalues_of_the_closed_state_space(extras, part, seed):
    plant, law, gains = linearise(report_vehicle().with_extras(**extras)).plant, report_law(), distinct_gains(seed)
    expected = subject(plant, law, part).close(gains).poles()
    found = roots_of(plant, law, part, gains)
    assert len(found) == len(expected)
    assert farthest(found, expected) < 1e-9  # simple roots of condition below 1e5, each route good to 1e-14


def test_both_groups_together_are_the_whole_vehicle():
    plant, law, gains = report_model().plant, report_law(), distinct_gains()
    both = np.concatenate([roots_of(plant, law, part, gains) for part in GROUPS])
    assert farthest(both, close(plant, law, gains).system.poles()) < 1e-9


@pytest.mark.parametrize(("part", "order"), [("heave_pitch", 8), ("sway_roll_yaw", 12)])
def test_the_order_is_4n_with_filters_two_n_without_and_two_more_with_lag(part, order):
    # Appendix C.2: the maximum possible order is 4N, the lowest 2N
    plant, law, gains = report_model().plant, report_law(), distinct_gains()
    lagged = linearise(report_vehicle().with_extras(current_lag=0.01)).plant
    bare = gains.with_values(**dict.fromkeys(TIME_CONSTANTS, 0.0))
    assert len(characteristic_polynomial(plant, law, part, gains)) - 1 == order
    assert len(characteristic_polynomial(plant, law, part, bare)) - 1 == order // 2
    assert len(characteristic_polynomial(lagged, law, part, gains)) - 1 == order + 2


@pytest.mark.parametrize("extras", EXTRAS)
@pytest.mark.parametrize("part", GROUPS)
def test_symbolic_coefficients_take_the_exact_values_at_numbers(extras, part):
    plant, law, gains = linearise(report_vehicle().with_extras(**extras)).plant, report_law(), distinct_gains()
    theta = ca.SX.sym("theta", 17)
    symbolic = ca.Function("a", [theta], [ca.vertcat(*characteristic_polynomial(plant, law, part, theta))])
    exact = characteristic_polynomial(plant, law, part, gains)
    # the numeric coefficients are exact; a sum of some thousand terms of one sign keeps 1e-13
    assert symbolic(list(gains.as_dict().values())).full().ravel() == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("part", GROUPS)
def test_the_determinant_is_the_one_of_exact_rational_elimination(part):
    import flint

    matrix = loop_polynomial(report_model().plant, report_law(), part, report_gains()).matrix
    polynomial, blocks, n = matrix.exact_determinant(), matrix.blocks(), matrix.size

    def rational(value: float):
        fraction = Fraction(float(value))
        return flint.fmpq(fraction.numerator, fraction.denominator)

    for s in range(-6, 7):  # thirteen points fix a polynomial of order 12
        entries = [
            sum((rational(b[i, j]) * s**k for k, b in enumerate(blocks)), flint.fmpq(0))
            for i in range(n)
            for j in range(n)
        ]
        found = flint.fmpq_mat(n, n, entries).det()
        assert sum((c * s**k for k, c in enumerate(polynomial)), Fraction(0)) == Fraction(int(found.p), int(found.q))


@pytest.mark.parametrize("part", GROUPS)
def test_the_determinant_is_the_reports_with_its_denominators_cleared(part):
    # [s²I − A + B Q K K_0(s)] of C.2 in (Z, Θ) or (Y − cΦ, Φ, Ψ), where every column has one denominator
    linear, law, g = report_model(), report_law(), distinct_gains()
    q = [0, 1] if part == "heave_pitch" else [2, 3, 4]
    vertical = combined_fraction(g.K_h, g.K_hdot, g.tau_h, g.K_zddot, g.K_zdot, g.tau_z)
    lateral = combined_fraction(g.K_hp, g.K_hpdot, g.tau_hp, g.K_yddot, g.K_ydot, g.tau_y)
    c = law.depth
    if part == "heave_pitch":
        W, fractions, factors, channels = np.eye(2), [vertical] * 2, [g.K_heave, g.K_pitch], [0, 1]
    else:
        W = np.array([[1.0, c, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])  # Y = (Y − cΦ) + cΦ
        fractions, factors, channels = [lateral, vertical, lateral], [g.K_sway, g.K_sway - g.K_roll, g.K_yaw], [3, 2, 4]
    inertia, stiffness = np.diag(linear.inertia[q]) @ W, linear.stiffness[np.ix_(q, q)] @ W
    control = -linear.current[q] @ law.command_columns()[:, channels] @ np.diag(factors)
    size = len(q)
    columns = np.zeros((5, size, size))
    for j, (top, bottom) in enumerate(fractions):
        for k, d in enumerate(bottom):
            columns[k, :, j] -= stiffness[:, j] * d
            columns[k + 2, :, j] += inertia[:, j] * d
        for k, t in enumerate(top):
            columns[k, :, j] += control[:, j] * t
    expected = PolynomialMatrix.of(list(columns)).determinant()
    # entries of both matrices are rounded once or twice; coefficients are sums of one sign
    assert characteristic_polynomial(linear.plant, law, part, g) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("extras", EXTRAS)
@pytest.mark.parametrize(
    ("part", "output", "given"),
    [
        ("heave_pitch", "Z", "zeta_1"),
        ("heave_pitch", "Theta", "force_z"),
        ("sway_roll_yaw", "Phi", "zeta_3"),
        ("sway_roll_yaw", "Y", "eta_2"),
        ("sway_roll_yaw", "Psi", "bank_4"),
    ],
)
def test_transfer_functions_are_the_frequency_response_of_the_plant(extras, part, output, given):
    plant, law, gains = linearise(report_vehicle().with_extras(**extras)).plant, report_law(), distinct_gains()
    loop, whole = loop_polynomial(plant, law, part, gains), close(plant, law, gains).system
    omega = np.array([0.05, 1.0, 6.0, 50.0])
    expected = whole.response(omega)[:, whole.index("outputs", [output])[0], whole.index("inputs", [given])[0]]
    # a polynomial of order 14 evaluated near its roots keeps eight digits or more
    assert loop.transfer(output, given)(1j * omega) == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("part", GROUPS)
def test_equal_time_constants_and_rate_gains_make_the_filters_disappear(part):
    # C.2: K_0 reduces to a simple polynomial if t_4 = t_6; p(s) = p_unfiltered(s) (1 + τs)^2N
    plant, law, tau = report_model().plant, report_law(), 0.637
    gains = report_gains()
    bare = characteristic_polynomial(plant, law, part, gains.with_values(**dict.fromkeys(TIME_CONSTANTS, 0.0)))
    expected = bare
    for _ in range(len(bare) - 1):
        expected = multiply(expected, [1.0, tau])
    found = characteristic_polynomial(plant, law, part, gains)
    assert found == pytest.approx(expected, rel=1e-12)  # rounding of the entries


@pytest.mark.parametrize("part", GROUPS)
def test_small_time_constants_approach_none(part):
    plant, law, gains = report_model().plant, report_law(), distinct_gains()
    bare = roots_of(plant, law, part, gains.with_values(**dict.fromkeys(TIME_CONSTANTS, 0.0)))
    fast = roots_of(plant, law, part, gains.with_values(**dict.fromkeys(TIME_CONSTANTS, 1e-6)))
    assert farthest(fast[: len(bare)], bare) < 1e-4  # the first-order effect of τ = 1e-6 s on roots of some 10 rad/s


def test_unfiltered_rates_have_roots_but_no_state_space():
    plant, law = report_model().plant, report_law()
    bare = report_gains().with_values(tau_h=0.0)
    assert len(roots_of(plant, law, "heave_pitch", bare)) == 6
    with pytest.raises(InputError, match="ask for roots only"):
        close(plant, law, bare)


def test_a_filter_without_rate_gain_adds_no_root():
    plant, law = report_model().plant, report_law()
    assert len(roots_of(plant, law, "heave_pitch", report_gains().with_values(K_zdot=0.0))) == 6


def test_the_mechanics_read_back_from_the_plant_are_the_linearisation():
    for extras in EXTRAS:
        linear = linearise(report_vehicle().with_extras(**extras))
        m = mechanics(linear.plant, report_law())
        assert m.inertia == pytest.approx(linear.inertia, rel=1e-14)
        assert m.stiffness == pytest.approx(linear.stiffness, rel=1e-13, abs=1e-6)  # N/m beside 1e8
        assert m.current == pytest.approx(linear.current, rel=1e-13, abs=1e-6)
        assert m.by_set("eta") == pytest.approx(linear.eta, rel=1e-13, abs=1e-6)
        assert m.lag == pytest.approx(extras.get("current_lag", 0.0), rel=1e-14)
        # the lateral accelerometers feel −gΦ, the others nothing
        assert m.tilt[3, 3] == pytest.approx(-9.80665 if extras.get("gravity_term") else 0.0, rel=1e-12)
        assert np.count_nonzero(m.tilt) == bool(extras.get("gravity_term"))


def test_vehicle_and_loop_name_the_unit_loads_alike():
    assert tuple(EXTERNAL) == tuple(vehicle_linear.EXTERNAL)


def test_a_plant_without_unit_loads_is_refused_by_name():
    plant = report_model().plant
    few = plant.select(inputs=[name for name in plant.inputs if name != "force_y"])
    with pytest.raises(InputError, match="unknown input 'force_y'"):
        roots_of(few, report_law(), "all", report_gains())


@pytest.mark.parametrize(
    ("call", "sentence"),
    [
        (lambda p, w, g: loop_polynomial(p, w, "roll", g), "unknown part of the vehicle 'roll'"),
        (lambda p, w, g: loop_polynomial(p, w, "heave", ca.SX.sym("x", 3)), "must have 17 entries; got 3"),
        (lambda p, w, g: loop_polynomial(p, w, "heave", {"K_h": 1.0}), "missing K_hdot"),
        (lambda p, w, g: loop_polynomial(p, w, "heave", {"K_hh": 1.0}), "unknown gain 'K_hh'"),
        (lambda p, w, g: loop_polynomial(p, w, "heave", g).numerator("Q", "zeta_1"), "unknown output 'Q'"),
        (lambda p, w, g: loop_polynomial(p, w, "heave", g).numerator("Z", "zeta_9"), "unknown input 'zeta_9'"),
        (lambda p, w, g: loop_polynomial(p, w, "heave", ca.SX.sym("x", 17)).transfer("Z", "zeta_1"), "in numbers"),
    ],
)  # fmt: skip
def test_bad_requests_are_refused_with_a_sentence(call, sentence):
    with pytest.raises(InputError, match=sentence):
        call(report_model().plant, report_law(), report_gains())
