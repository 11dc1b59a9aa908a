"""Slopes of eigenvalues: against differences, at double and defective ones, in other units."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.lti.eigen import DEFECTIVE, apart, eigen


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_slopes_are_those_of_differences_and_of_gradients(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 6))
    units = 10.0 ** rng.uniform(-4, 4, n)
    A, dA = (rng.normal(size=(n, n)) * units[:, None] / units for _ in range(2))
    found = eigen(A)
    if np.linalg.cond(found.right / np.linalg.norm(found.right, axis=0)) > 1e7:
        return  # nearly double by chance: differences say nothing
    step = 1e-6
    moved = [np.linalg.eigvals(A + sign * step * dA) for sign in (1, -1)]
    matched = [np.array([m[np.argmin(np.abs(m - v))] for v in found.values]) for m in moved]
    expected = (matched[0] - matched[1]) / (2 * step)
    slopes = found.slopes(dA.ravel(order="F")[:, None])[:, 0]
    np.testing.assert_allclose(slopes, expected, rtol=1e-4, atol=1e-5 * np.abs(expected).max())
    for k in range(n):
        for weight in (1.0, 1j):
            assert np.sum(found.gradient(k, weight) * dA) == pytest.approx(
                (weight * slopes[k]).real, rel=1e-9, abs=1e-9
            )


def test_the_sum_of_slopes_is_the_trace_also_beside_a_double_pole():
    A = np.array([[-1.0, 1.0], [-1e-6, -1.0]])  # −1 ± 1e-3 j, vectors nearly parallel
    dA = np.array([[1.0, 2.0], [3.0, 4.0]])
    slopes = eigen(A).slopes(dA.ravel(order="F")[:, None])[:, 0]
    assert slopes.sum() == pytest.approx(5.0, abs=1e-9)
    # λ² + 2λ + 1 + 1e-6 …: dλ = (adjugate) : ∂p/∂ε over p'
    assert abs(slopes[0].imag) == pytest.approx(3.0 / 2 / 1e-3, rel=1e-3)


@pytest.mark.parametrize("order", [2, 3, 4])
def test_at_a_defective_pole_slopes_stay_finite_and_below_the_guard(order):
    found = eigen(np.eye(order, k=1) - 2 * np.eye(order))
    slopes = found.slopes(np.eye(order, k=1 - order).ravel(order="F")[:, None])[:, 0]
    assert np.isfinite(slopes).all()
    assert np.abs(slopes).max() <= 1.001 / DEFECTIVE
    assert np.isfinite(found.gradient(0)).all()


def test_an_overlap_keeps_its_direction():
    np.testing.assert_allclose(apart(np.array([0.5j, 1e-20j, 0.0])), [0.5j, DEFECTIVE * 1j, DEFECTIVE])
