"""Lags, integrators and patterns in front of a plant; loops closed by wiring: against formulas and algebra by hand."""

import numpy as np
import pytest

from workbench.lti.algebraic import IllPosedError
from workbench.lti.front import integrated, lagged, matrices, mixed
from workbench.lti.join import beside, difference, series, wired
from workbench.lti.plant import Plant
from workbench.lti.realisation import Realisation, frequency_response

RNG = np.random.default_rng(5)
OMEGA = np.array([0.1, 1.0, 7.0])


def plant():
    return Plant(
        A=RNG.normal(size=(3, 3)), B=RNG.normal(size=(3, 3)), C=RNG.normal(size=(2, 3)), D=RNG.normal(size=(2, 3)),
        states=("a", "b", "c"), inputs=("f", "i", "j"), outputs=("y", "z"),
    )  # fmt: skip


@pytest.mark.parametrize("lag", [0.0, 0.3])
def test_a_lagged_input_is_the_command_through_the_lag_and_an_output(lag):
    P = plant()
    late = lagged(P, ["j", "i"], ["want j", "want i"], lag)
    assert late.inputs == ("f", "want i", "want j")
    assert late.outputs == ("y", "z", "j", "i")
    assert late.states == P.states + (("j", "i") if lag else ())
    G, slow = P.response(OMEGA), 1 / (1 + 1j * OMEGA * lag)[:, None]
    expected = np.zeros((3, 4, 3), complex)
    expected[:, :2, 0], expected[:, :2, 1], expected[:, :2, 2] = G[:, :, 0], G[:, :, 1] * slow, G[:, :, 2] * slow
    expected[:, 2, 2] = expected[:, 3, 1] = slow[:, 0]
    np.testing.assert_allclose(late.response(OMEGA), expected, rtol=1e-12, atol=1e-13)


def test_integrators_and_patterns_multiply_their_columns():
    P = plant()
    G = P.response(OMEGA)
    moved = integrated(P, ["i"], ["amount of i"]).response(OMEGA)
    np.testing.assert_allclose(moved[:, :, 1], G[:, :, 1] / (1j * OMEGA)[:, None], rtol=1e-12)
    np.testing.assert_allclose(moved[:, :, [0, 2]], G[:, :, [0, 2]], rtol=1e-12)
    V = np.array([[1.0], [-2.0]])
    together = mixed(P, ["i", "j"], ["both"], V)
    assert together.inputs == ("both", "f")
    np.testing.assert_allclose(together.response(OMEGA)[:, :, 0], G[:, :, 1] - 2 * G[:, :, 2], rtol=1e-12)


def test_wiring_is_the_feedback_formula_with_direct_gains_and_refuses_what_has_no_solution():
    G = matrices(plant())
    back, into, out, past = (RNG.normal(size=s) for s in ((3, 2), (3, 4), (5, 2), (5, 4)))
    got = frequency_response(*wired(G, back, into, out, past), OMEGA)
    g = frequency_response(*G, OMEGA)
    expected = out @ g @ np.linalg.inv(np.eye(3) - back @ g) @ into + past
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-10)  # condition of the loop drawn
    alone = Realisation(np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.array([[4.0]]))
    one = np.ones((1, 1))
    with pytest.raises(IllPosedError, match="must have a solution"):
        wired(alone, one / 4, one, one, one)


def test_joined_systems_answer_by_their_sum_and_product():
    G, H = matrices(plant()), matrices(plant())
    square = Realisation(H.A, H.B[:, :2], H.C, H.D[:, :2])
    g, h, s = (frequency_response(*x, OMEGA) for x in (G, H, square))
    np.testing.assert_allclose(frequency_response(*series(square, G), OMEGA), s @ g, rtol=1e-10)
    np.testing.assert_allclose(frequency_response(*difference(G, H), OMEGA), g - h, rtol=1e-10, atol=1e-12)
    both = frequency_response(*beside(G, H), OMEGA)
    np.testing.assert_allclose(both[:, :2, :3], g, rtol=1e-10)
    np.testing.assert_allclose(both[:, 2:, 3:], h, rtol=1e-10)
    assert not both[:, :2, 3:].any()


def test_what_no_path_leads_to_is_exactly_zero_and_a_chain_is_a_plain_sum():
    # y2 = 3 y1, y3 = 1e9 y2 + 1e-9 y1; nothing reaches y1 but its own input; a loop between two others beside it
    D = np.diag([1.0, 3.0, 1.0, 0.7, 0.9])
    back = np.zeros((5, 5))
    back[1, 0], back[2, 1], back[2, 0], back[3, 4], back[4, 3] = 1.0, 1e9, 1e-9, 0.3, -0.5
    gains = Realisation(np.zeros((0, 0)), np.zeros((0, 5)), np.zeros((5, 0)), D)
    eye = np.eye(5)
    *_, whole = wired(gains, back, eye, eye, 0 * eye)
    assert not whole[:3, 3:].any()
    assert not whole[3:, :3].any()
    assert (whole[:3, 0] == [1.0, 3.0, 3e9 + 1e-9]).all()
    np.testing.assert_allclose(whole, np.linalg.inv(np.linalg.inv(D) - back), rtol=1e-12, atol=1e-12)
