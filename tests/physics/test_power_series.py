"""Power series through CasADi functions: against derivatives of expressions and known series."""

import casadi as ca
import numpy as np
import pytest

from workbench.physics.forces.operating import law_at
from workbench.physics.forces.series import RULES, series
from workbench.physics.forces.taylor import TaylorLaw


def every_rule(x):
    a, b = x[0] + 2, x[1]
    root = ca.sqrt(a * (a + 1) + b**2)
    return ca.vertcat(
        ca.atanh(b / (2 * root)) - ca.asinh(-a / b),
        ca.sin(a * b) * ca.cos(b - a) + 3 * ca.fabs(-a),
        2 * root / (1 + b**2) - b,
    )


def test_every_rule_gives_the_derivatives_of_the_expression():
    x, d, s = ca.SX.sym("x", 2), ca.SX.sym("d", 2), ca.SX.sym("s")
    function = ca.Function("f", [x], [every_rule(x)])
    used = {function.instruction_id(k) for k in range(function.n_instructions())}
    assert set(RULES) <= used, "a rule that no expression here uses"
    point, directions = np.array([0.3, -0.7]), np.array([[1.0, 0.0], [0.0, 1.0], [0.4, -1.3]])
    found = series(function, point, directions, 4)
    derivative, factorial = every_rule(x + s * d), 1.0
    for n in range(5):
        value = ca.Function("d", [x, d, s], [derivative])
        for k, direction in enumerate(directions):
            # rounding of a few dozen operations on numbers of size one
            assert found[n, k] * factorial == pytest.approx(value(point, direction, 0).full().ravel(), rel=1e-12)
        derivative, factorial = ca.jacobian(derivative, s), factorial * (n + 1)


def test_a_root_has_its_binomial_series():
    x = ca.SX.sym("x", 1)
    found = series(ca.Function("f", [x], [ca.sqrt(x)]), np.array([1.0]), np.array([[1.0]]), 6)[:, 0, 0]
    assert found == pytest.approx([1, 1 / 2, -1 / 8, 1 / 16, -5 / 128, 7 / 256, -21 / 1024], rel=1e-14)


def test_an_operation_without_a_rule_is_named():
    x = ca.SX.sym("x", 1)
    with pytest.raises(NotImplementedError, match="no rule for power series"):
        series(ca.Function("f", [x], [ca.erf(x)]), np.array([1.0]), np.array([[1.0]]), 2)


def test_the_fifth_order_of_the_coils_law_is_the_derivative_of_its_fourth():
    # along one line, where the exact law's own slopes at nearby poses say what the fifth coefficient must be
    exact, law = law_at(), TaylorLaw.from_corner(law_at(), 5)
    gaps = 0.02 * np.cos(np.pi * (np.arange(12) + 0.5) / 12)
    lift = np.array([exact.forces(float(h), 0.0, 0.0, 0.0)[0] for h in gaps])
    fitted = np.polynomial.Chebyshev.fit(gaps, lift, 11).convert(kind=np.polynomial.Polynomial).coef
    for power in range(6):
        # a fit of 12 points over ±2 cm keeps 1e-13/0.02⁵ of the fifth coefficient
        assert law.coefficient(0, (power, 0, 0, 0)) == pytest.approx(fitted[power], rel=1e-4)
