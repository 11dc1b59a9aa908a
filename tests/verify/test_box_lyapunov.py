"""Common Lyapunov matrices where the largest box is known in closed form."""

import pytest
from flint import fmpq, fmpq_mat

from workbench.verify.family.lyapunov import positive_definite, prove_common_lyapunov
from workbench.verify.family.polynomial import Box


def spring(theta):
    """x'' + x' + k(t) x = 0: a common quadratic function exists for k in [k1, k2] just when √k2 - √k1 < 1 (circle)."""
    return fmpq_mat([[0, 1], [-theta[0], -1]])


def test_a_common_matrix_is_proved_just_inside_the_circle_criterion():
    # P = [[m + 1/2, 1/2], [1/2, 1]] with k2 - √k2 < m < k1 + √k1: 1.925 … 2 for k in [1, 3.9]
    P = [["2.46", "0.5"], ["0.5", "1"]]
    proof = prove_common_lyapunov(P, spring, Box.of(k=("1", "3.9")))
    assert proof.proved
    assert proof.pieces == 2
    assert proof.certificate["P"][0][0] == "123/50"


def test_the_same_matrix_is_refused_beyond_it():
    P = [["2.46", "0.5"], ["0.5", "1"]]
    proof = prove_common_lyapunov(P, spring, Box.of(k=("1", "4.1")))
    assert not proof.proved
    assert proof.left[0][0] == (fmpq(41, 10),)
    assert proof.certificate == {}


def test_decay_is_part_of_the_claim():
    # at k = 1, P = [[3/2, 1/2], [1/2, 1]]: -(A'P + PA) = I, so σ may reach 1/(2 λmax(P)) = 0.2764
    P, box = [["1.5", "0.5"], ["0.5", "1"]], Box.of(k=("0.9999999", "1.0000001"))
    assert prove_common_lyapunov(P, spring, box, decay="0.276").proved
    assert not prove_common_lyapunov(P, spring, box, decay="0.277").proved


def test_an_indefinite_matrix_proves_nothing():
    proof = prove_common_lyapunov([["1", "2"], ["2", "1"]], spring, Box.of(k=("1", "2")))
    assert not proof.proved
    assert "positive definite" in proof.detail


def test_definiteness_is_decided_where_floats_cannot():
    tiny = fmpq(1, 10**60)
    assert positive_definite(fmpq_mat([[1, 1 - tiny], [1 - tiny, 1]]))
    assert not positive_definite(fmpq_mat([[1, 1 + tiny], [1 + tiny, 1]]))
    assert not positive_definite(fmpq_mat([[1, 1], [1, 1]]))


def test_a_matrix_of_the_wrong_size_is_refused():
    with pytest.raises(ValueError, match="size of the state matrix, 2"):
        prove_common_lyapunov([["1"]], spring, Box.of(k=("1", "2")))
