from fractions import Fraction

import control
import numpy as np
import pytest

from workbench.errors import InputError
from workbench.lti import Plant
from workbench.lti.make import tf
from workbench.lti.model import Model


def exact(num, den, omega):
    """num(jω)/den(jω) in rational arithmetic, rounded once."""

    def at(coefficients):
        re, im, w = Fraction(0), Fraction(0), Fraction(float(omega))
        for c in coefficients:
            re, im = -im * w + Fraction(float(c)), re * w
        return re, im

    (a, b), (c, d) = at(num), at(den)
    size = c * c + d * d
    return complex(float((a * c + b * d) / size), float((b * c - a * d) / size))


def test_random_coprime_fractions_over_twelve_decades_keep_their_order_and_their_response():
    rng = np.random.default_rng(0)
    for _ in range(200):
        n = int(rng.integers(1, 7))
        den = np.poly(-(10 ** rng.uniform(-6, 6, size=n)))
        num = np.atleast_1d(np.poly(-(10 ** rng.uniform(-6, 6, size=rng.integers(0, n)))))
        for minimal in (False, True):
            model = tf([[num]], [[den]], minimal=minimal)
            assert minimal or len(model.plant.states) == n
            for omega in 10 ** rng.uniform(-6, 6, size=3):
                # 1e-6: companion matrices of twelve decades, rounding grows with their condition
                assert model.response([omega])[0, 0, 0] == pytest.approx(exact(num, den, omega), rel=1e-6)


def test_a_cancelling_root_stays_unless_it_is_asked_out_and_is_then_named():
    kept = tf([[[1, 1]]], [[[1, 3, 2]]])
    assert len(kept.plant.states) == 2
    assert kept.cancelled == ()
    model = tf([[[1, 1]]], [[[1, 3, 2]]], minimal=True)
    assert len(model.plant.states) == 1
    assert "1 cancelled" in repr(model)
    np.testing.assert_allclose(model.cancelled, [-1], rtol=1e-12)


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_an_integrator_that_all_entries_share_is_one_state_in_any_unit_of_time(unit):
    row = tf([[[1 / unit], [2 / unit], [3 / unit]]], [[[1, 0]] * 3])
    assert len(row.plant.states) == 1
    np.testing.assert_allclose(row.response([1 / unit])[0], [[-1j, -2j, -3j]], rtol=1e-12)


def test_matrices_of_transfer_functions_come_from_python_control_without_its_optional_library():
    names = {"inputs": ["a", "b"], "outputs": ["c", "d"]}
    system = control.tf([[[1], [2]], [[1], [3, 1]]], [[[1, 1], [1, 2]], [[1, 3], [1, 4, 0]]], **names)
    for plant in (Model.from_control(system).plant, Plant.from_control(system)):
        assert (plant.inputs, plant.outputs) == (("a", "b"), ("c", "d"))
    sampled = Model.from_control(control.tf([1], [1, -0.5], 0.1))
    assert sampled.sample_time == 0.1
    for omega in (0.1, 1.0, 30.0):
        np.testing.assert_allclose(Model.from_control(system).response([omega])[0], system(1j * omega), rtol=1e-12)


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (control.frd([1, 2], [1, 2]), "measured frequency response has no states"),
        (control.tf([1, 0, 0], [1, 1]), "must be proper"),
        (control.nlsys(lambda t, x, u, p: -x, None, states=1, inputs=1, outputs=1), "nonlinear system has none"),
        (control.tf2ss([1], [1, 1]).A, "ndarray is neither"),
    ],
)
def test_what_has_no_state_space_is_refused_in_a_sentence(system, words):
    for make in (Model.from_control, Plant.from_control):
        with pytest.raises(InputError, match=words):
            make(system)
