"""Polynomial matrices: determinants against exact rationals, roots against eigenvalues, what they refuse."""

from fractions import Fraction

import casadi as ca
import flint
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.lti import PolynomialMatrix
from workbench.lti.polynomial import companion, multiply


def random_matrix(seed: int, size: int, degree: int, density: float = 1.0) -> PolynomialMatrix:
    draw = np.random.default_rng(seed)
    blocks = draw.normal(size=(degree + 1, size, size)) * (draw.random((degree + 1, size, size)) < density)
    return PolynomialMatrix.of([ca.DM(b) for b in blocks])


def flint_determinant_at(matrix: PolynomialMatrix, s: int) -> Fraction:
    """det M(s) in python-flint's exact rationals, by another algorithm than ours."""
    blocks = matrix.blocks()

    def entry(i: int, j: int):
        total = flint.fmpq(0)
        for k, block in enumerate(blocks):
            value = Fraction(float(block[i, j]))
            total += flint.fmpq(value.numerator, value.denominator) * flint.fmpq(s) ** k
        return total

    n = matrix.size
    found = flint.fmpq_mat(n, n, [entry(i, j) for i in range(n) for j in range(n)]).det()
    return Fraction(int(found.p), int(found.q))


@pytest.mark.parametrize(
    ("seed", "size", "degree", "density"), [(1, 2, 4, 1.0), (2, 4, 2, 1.0), (3, 5, 2, 0.5), (4, 7, 2, 0.4)]
)
def test_the_exact_determinant_is_the_one_of_rational_arithmetic(seed, size, degree, density):
    matrix = random_matrix(seed, size, degree, density)
    polynomial = matrix.exact_determinant()
    for s in range(-2, size * degree):  # more points than coefficients: the polynomials are the same, exactly
        assert sum((c * s**k for k, c in enumerate(polynomial)), Fraction(0)) == flint_determinant_at(matrix, s)


def test_the_symbolic_determinant_takes_the_numeric_one_at_numbers():
    x = ca.SX.sym("x", 3)
    matrix = PolynomialMatrix.of(
        [
            ca.vertcat(ca.horzcat(x[0], 2, 0), ca.horzcat(1, x[1], x[2]), ca.horzcat(0, x[0] * x[1], 3)),
            ca.SX.eye(3),
            ca.SX(ca.DM(np.diag([1.0, 0, 2]))),
        ]
    )
    at = np.array([0.3, -1.7, 2.2])
    symbolic = ca.Function("f", [x], [ca.vertcat(*matrix.determinant())])(at).full().ravel()
    numeric = PolynomialMatrix.of([ca.Function("c", [x], [c])(at) for c in matrix.coefficients]).determinant()
    assert symbolic == pytest.approx(numeric, rel=1e-13)  # a few dozen roundings


def test_swapping_two_rows_changes_the_sign_of_the_determinant():
    matrix = random_matrix(7, 4, 2, 0.6)
    swapped = PolynomialMatrix.of([c[[1, 0, 2, 3], :] for c in matrix.coefficients])
    assert swapped.exact_determinant() == [-c for c in matrix.exact_determinant()]


@pytest.mark.parametrize("seed", range(5))
def test_roots_are_where_the_matrix_is_singular(seed):
    matrix = random_matrix(seed, 4, 3)
    blocks = matrix.blocks()
    for s in matrix.roots():
        value = sum(b * s**k for k, b in enumerate(blocks))
        singular = np.linalg.svd(value, compute_uv=False)
        # backward error of an eigenvalue: some 1e-13 of the largest term
        assert singular[-1] < 1e-11 * max(np.linalg.norm(b) * abs(s) ** k for k, b in enumerate(blocks))


def test_a_column_of_lower_degree_gives_no_root_at_infinity():
    # det [[s² + 1, 3], [s, s + 2]] = (s² + 1)(s + 2) − 3 s
    matrix = PolynomialMatrix.of([[[1, 3], [0, 2]], [[0, 0], [1, 1]], [[1, 0], [0, 0]]])
    assert np.sort_complex(matrix.roots()) == pytest.approx(np.sort_complex(np.roots([1, 2, -2, 2])), rel=1e-12)


@pytest.mark.parametrize(
    ("coefficients", "root"),
    [
        ([[[0, 0], [0, 1]], [[1, 1], [1, 1]]], 0.0),  # det [[s, s], [s, s + 1]] = s
        ([[[2, 0], [0, 1]], [[1, 0], [0, 0]], [[0, 1], [0, 0]]], -2.0),  # det [[s + 2, s²], [0, 1]] = s + 2
    ],
)
def test_roots_at_infinity_are_left_out(coefficients, root):
    assert PolynomialMatrix.of(coefficients).roots() == pytest.approx([root], abs=1e-9)


@given(st.lists(st.floats(-3.0, -0.1), min_size=1, max_size=4, unique_by=lambda x: round(x, 1)))
@settings(max_examples=30, deadline=None)
def test_a_product_of_factors_has_their_roots(values):
    polynomial = [1.0]
    for root in values:
        polynomial = multiply(polynomial, [-root, 1.0])
    found = np.sort(PolynomialMatrix.of([[[c]] for c in polynomial]).roots().real)
    # roots at least 0.05 apart, four of them: condition below 1e5
    assert found == pytest.approx(np.sort(values), abs=1e-9)


def test_value_sum_and_product_agree_with_the_coefficients():
    a, b = random_matrix(1, 3, 2), random_matrix(2, 3, 4)
    s = 0.7
    assert np.array((a + b).at(s)) == pytest.approx(np.array(a.at(s)) + np.array(b.at(s)), rel=1e-13)
    assert np.array(a.times([2.0, -1.0]).at(s)) == pytest.approx(np.array(a.at(s)) * (2.0 - s), rel=1e-13)


def test_the_companion_matrix_of_a_constant_is_empty():
    assert companion(np.eye(2)[None]).shape == (0, 0)


@pytest.mark.parametrize(
    ("coefficients", "sentence"),
    [
        ([np.eye(2), np.eye(3)], "must have one shape"),
        ([np.ones((2, 3))], "must be square"),
    ],
)
def test_matrices_that_do_not_fit_are_refused(coefficients, sentence):
    with pytest.raises(InputError, match=sentence):
        PolynomialMatrix.of(coefficients)


def test_roots_of_symbols_are_refused():
    with pytest.raises(InputError, match="substitute values for the gains"):
        PolynomialMatrix.of([ca.SX.sym("x", 2, 2), ca.SX.eye(2)]).roots()
