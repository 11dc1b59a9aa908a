"""Gains known to half a unit of their last digit: proofs that cover every value they may have had."""

from itertools import product

import numpy as np
import pytest
from flint import fmpq

from workbench.verify.family.box import prove_damping, prove_hurwitz, recheck
from workbench.verify.family.polynomial import Box, characteristic, interpolate, rational
from workbench.verify.family.rounding import rounded_family

GAINS = {"k": rational("2.10312"), "d": rational("1.20743"), "tau": rational("0.150261")}
UNITS = {"k": fmpq(1, 200000), "d": fmpq(1, 200000), "tau": fmpq(1, 2000000)}
BOX = Box.of(m=("0.9", "1.1"))


def rows(theta, gains):
    """m x'' = -k x - d v, v = x' filtered: τ v' = x' - v."""
    m, k, d, tau = theta[0], gains["k"], gains["d"], gains["tau"]
    zero = k - k
    one = zero + 1
    return [[zero, one, zero], [-k / m, zero, -d / m], [zero, one / tau, -one / tau]]


def damping(gains, m) -> float:
    A = np.array(rows([m], {name: float(v) for name, v in gains.items()}), float)
    poles = np.linalg.eigvals(A)
    return float((-poles.real / np.abs(poles)).min())


def worst(steps) -> float:
    """Over mass and corners of the rounding: damping is monotone in each over so small a change."""
    return min(
        damping({n: GAINS[n] + s * UNITS[n] for n, s in zip(GAINS, signs, strict=True)}, m)
        for signs in product(steps, repeat=3)
        for m in np.linspace(0.9, 1.1, 21)
    )


def family():
    return rounded_family(rows, GAINS, UNITS, BOX, (1,), lambda theta: theta[0])


def test_what_rounding_costs_is_proved_and_no_more():
    nominal, rounded = worst((0,)), worst((-1, 1))
    loss = nominal - rounded
    assert loss > 2e-6  # so that the two differ by more than the margins below
    whole = family()
    proof = prove_damping(whole, rounded - 0.05 * loss)
    assert proof.proved
    assert recheck(whole, proof.certificate)
    assert not prove_damping(whole, rounded + 0.05 * loss, most=600).proved
    # as printed, without rounding, more holds
    assert prove_damping(whole.nominal, nominal - 0.05 * loss).proved


def test_the_nominal_family_is_that_of_the_printed_gains():
    from flint import fmpq_mat

    plain = interpolate(
        characteristic(lambda t: fmpq_mat([list(r) for r in rows(t, GAINS)]), lambda t: t[0]), BOX, (1,)
    )[0]
    assert family().nominal == plain


def test_the_remainder_is_small_beside_the_first_order():
    whole = family()
    first = max(
        sum(abs(float(e.coefficients[k])) for e in whole.effects) for k in range(len(whole.nominal.coefficients))
    )
    # of second order: a thousandth for the loop itself, the rest is the width of the balls that bound it
    assert max(float(c) for c in whole.remainder.coefficients) < 0.05 * first
    assert min(whole.remainder.coefficients) >= 0


def test_without_units_the_rounded_proof_is_the_exact_one():
    exact = rounded_family(rows, GAINS, {}, BOX, (1,), lambda theta: theta[0])
    assert prove_hurwitz(exact).proved
    assert not exact.effects
    assert prove_damping(exact, worst((0,)) * 0.9999).proved


def test_a_gain_printed_with_too_few_digits_is_refused():
    with pytest.raises(ValueError, match="more digits"):
        rounded_family(rows, GAINS, {"tau": fmpq(1, 20)}, BOX, (1,), lambda theta: theta[0])
