"""Zero exclusion on families whose truth is known in closed form or by dense sampling."""

import random

import numpy as np
import pytest
from flint import fmpq, fmpq_mat, fmpq_poly

from workbench.verify.family.box import (
    largest_damping,
    largest_decay,
    prove_damping,
    prove_decay,
    prove_hurwitz,
)
from workbench.verify.family.exclusion import inside
from workbench.verify.family.polynomial import ParameterBox, characteristic, interpolate, multiaffine


def oscillator():
    """(s + 1)(m s² + 2 z s + 1): damping z/√m, worst at the smallest z and the largest m."""
    box = ParameterBox.of(z=("0.3", "0.6"), m=("0.9", "1.2"))
    return interpolate(lambda t: (fmpq_poly([1, 1]) * fmpq_poly([1, 2 * t[0], t[1]]),), box, (1, 1))[0]


def test_damping_is_proved_just_below_the_worst_and_refused_just_above():
    worst, family = 0.3 / 1.2**0.5, oscillator()
    below = prove_damping(family, 0.999 * worst)
    assert below.proved
    assert below.undecided == 0
    above = prove_damping(family, 1.001 * worst)
    assert not above.proved
    assert 0 < above.undecided < 1e-2
    assert above.counterexample is not None
    z, m = above.counterexample
    assert float(z) / float(m) ** 0.5 < 1.001 * worst


def test_decay_is_proved_just_below_the_worst_and_refused_just_above():
    family = oscillator()
    worst = 0.3 / 1.2  # the pair's real part is -z/m
    assert prove_decay(family, 0.999 * worst).proved
    assert not prove_decay(family, 1.001 * worst).proved
    bounds = largest_decay(family)
    assert 0.998 * worst <= bounds.low <= worst <= bounds.high <= 1.0001 * worst


def test_a_real_root_that_crosses_zero_is_seen():
    # p = s² + 2 s + a: a = 0 inside the box is static divergence, with no root on the axis but at s = 0
    family = interpolate(lambda t: (fmpq_poly([t[0], 2, 1]),), ParameterBox.of(a=("-0.1", "1.0")), (1,))[0]
    proof = prove_hurwitz(family)
    assert not proof.proved
    assert proof.counterexample is not None
    assert proof.counterexample[0] < 0
    # beyond the crossing no boundary is touched, and yet nothing there counts as proved: 0.1 of 1.1 is unstable
    assert 0.1 / 1.1 <= proof.undecided < 0.1 / 1.1 + 0.1


def test_a_root_that_comes_from_infinity_is_seen():
    # p = e s² + s + 1: e < 0 brings a root in from +infinity
    family = interpolate(lambda t: (fmpq_poly([1, 1, t[0]]),), ParameterBox.of(e=("-0.1", "1.0")), (1,))[0]
    proof = prove_hurwitz(family)
    assert not proof.proved
    assert proof.undecided >= 0.1 / 1.1


def test_an_unstable_centre_is_named_at_once():
    family = interpolate(lambda t: (fmpq_poly([1, t[0], 1]),), ParameterBox.of(d=("-2", "-1")), (1,))[0]
    proof = prove_hurwitz(family)
    assert not proof.proved
    assert proof.pieces == 0
    assert proof.undecided == 1
    assert proof.counterexample == family.box.centre


def random_family(generator: random.Random):
    """Characteristic polynomials of A0 + x A1 + y A2, 3 by 3."""
    matrices = [fmpq_mat(3, 3, [fmpq(generator.randint(-20, 20), 10) for _ in range(9)]) for _ in range(3)]
    shift = fmpq_mat(3, 3, [fmpq(5, 2) if i == j else 0 for i in range(3) for j in range(3)])

    def at(theta):
        return matrices[0] - shift + theta[0] * matrices[1] + theta[1] * matrices[2]

    box = ParameterBox.of(x=("-0.5", "0.5"), y=("-0.5", "0.5"))
    return at, interpolate(characteristic(at), box, (3, 3))[0]


@pytest.mark.slow
def test_random_families_are_proved_exactly_when_dense_sampling_finds_them_damped():
    generator, outcomes = random.Random(5), []
    for _ in range(40):
        at, family = random_family(generator)
        grid = [fmpq(k, 10) for k in range(-5, 6)]
        stack = np.array([[[float(e) for e in r] for r in at((x, y)).tolist()] for x in grid for y in grid])
        poles = np.linalg.eigvals(stack)
        worst = float((-poles.real / np.abs(poles)).min())
        if abs(worst - 0.3) < 0.02:  # the grid's own resolution
            continue
        proved = prove_damping(family, "0.3", most=1500).proved
        outcomes.append(proved)
        assert proved == (worst > 0.3)
    assert outcomes.count(True) >= 5
    assert outcomes.count(False) >= 5


def test_a_worst_member_inside_the_box_is_found():
    # damping 0.3 + x² of a pair at 1 rad/s: the corners say 0.55, the middle of the range 0.3
    box = ParameterBox.of(x=("-0.4", "0.5"))
    family = interpolate(lambda t: (fmpq_poly([1, 2 * (fmpq(3, 10) + t[0] ** 2), 1]),), box, (2,))[0]
    bounds = largest_damping(family)
    # within the tolerance of 1e-3 asked for, doubled for the member it starts from
    assert bounds.low <= 0.3 <= bounds.high
    assert bounds.low > 0.3 * 0.998
    assert bounds.high < 0.3 * 1.003


def test_a_degree_bound_that_is_too_low_is_refused():
    with pytest.raises(ValueError, match="Raise the bounds"):
        interpolate(lambda t: (fmpq_poly([t[0] ** 3, 1, 1]),), ParameterBox.of(a=("1", "2")), (2,))


def test_a_degree_bound_that_is_too_high_costs_nothing_later():
    assert interpolate(lambda t: (fmpq_poly([t[0] ** 2, 1, 1]),), ParameterBox.of(a=("1", "2")), (5,))[0].degrees == (
        2,
    )


def test_a_matrix_that_is_not_affine_is_refused():
    box = ParameterBox.of(a=("1", "2"))
    with pytest.raises(ValueError, match="affine in each of a"):
        multiaffine(lambda t: fmpq_mat([[1 / t[0]]]), box)
    assert multiaffine(lambda t: fmpq_mat([[1 / t[0]]]), box, ("a",))((fmpq(4, 3),)) == fmpq_mat([[fmpq(3, 4)]])


def test_one_member_on_the_boundary_is_neither_inside_nor_outside():
    assert inside(fmpq_poly([1, 0, 1]), fmpq(0), fmpq(0)) is None
    assert inside(fmpq_poly([1, 1, 1]), fmpq(1, 2), fmpq(0)) is None  # damping exactly 0.5
    assert inside(fmpq_poly([1, 1, 1]), fmpq(49, 100), fmpq(0)) is True
    assert inside(fmpq_poly([1, 1, 1]), fmpq(51, 100), fmpq(0)) is False


@pytest.mark.parametrize("bound", range(1, 45))
def test_a_polynomial_of_one_degree_more_than_the_bound_is_refused_whatever_the_bound(bound):
    # the point that checks must lie on no grid: 3/7, say, would lie on that of degree 28
    box = ParameterBox.of(x=("1", "2"))
    with pytest.raises(ValueError, match="off the grid disagrees"):
        interpolate(lambda t: (fmpq_poly([t[0] ** (bound + 1), 1]),), box, (bound,))
    assert interpolate(lambda t: (fmpq_poly([t[0] ** bound, 1]),), box, (bound,))[0].degrees == (bound,)


def test_the_point_that_checks_tells_two_parameters_of_equal_degree_apart():
    box = ParameterBox.of(x=("0", "1"), y=("0", "1"))
    nodes = [fmpq(k, 2) for k in range(3)]

    def value(t):  # vanishes on the grid of both axes, and wherever x = y
        x, y = t
        out = x - y
        for n in nodes:
            out *= (x - n) * (y - n)
        return (fmpq_poly([1 + out, 1]),)

    with pytest.raises(ValueError, match="off the grid disagrees"):
        interpolate(value, box, (2, 2))
