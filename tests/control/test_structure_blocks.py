import math

import casadi as ca
import numpy as np
import pytest

from workbench.control.structure.block import Controller, Parameter
from workbench.control.structure.blocks import (
    gain,
    lead_lag,
    low_pass,
    low_pass_second,
    notch,
    pid,
    pid_matrix,
    pid_two_degrees,
    washout,
)
from workbench.control.structure.space import expression, state_space, transfer_function
from workbench.control.structure.structure import Structure
from workbench.errors import InputError

OMEGA = np.array([0.0, 0.03, 0.7, 1.9, 40.0])
S = 1j * OMEGA
ROUNDING = 1e-12  # a handful of operations on numbers of order one


def central_differences(function, theta):
    steps = 1e-6 * np.maximum(np.abs(theta), 1.0)
    shifted = [(theta + h * e, theta - h * e, h) for h, e in zip(steps, np.eye(len(theta)), strict=True)]
    return np.array([(function(up) - function(down)) / (2 * h) for up, down, h in shifted])


def random_gradient(block, rng):
    nk, nu, ny = block.order, len(block.outputs), len(block.inputs)
    return Controller(*(rng.normal(size=shape) for shape in ((nk, nk), (nk, ny), (nu, nk), (nu, ny))))


def a_block_of_each_kind():
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    rng = np.random.default_rng(3)
    A = np.array([[0.0, 1, 0], [-2, -0.3, 0.4], [0.1, 0.2, -1]])
    start = Controller(A, rng.normal(size=(3, 2)), rng.normal(size=(2, 3)), np.zeros((2, 2)))
    return {
        "gain": gain(["y1", "y2"], ["u1", "u2", "u3"], rng.normal(size=(3, 2))),
        "pid": pid("e", "u", Kp=2, Ki=3, Kd=0.4, Tf=0.05),
        "pid matrix": pid_matrix(["y1", "y2"], ["u1", "u2"], Kp=[[1, 2], [3, 4]], Ki=0.5, Kd=rng.normal(size=(2, 2))),
        "pid of two degrees": pid_two_degrees("r", "y", "u", Kp=2, Ki=3, Kd=0.4, Tf=0.05, b=0.7, c=0.2),
        "lead": lead_lag("e", "u", K=2, T_zero=0.3, T_pole=0.1),
        "low pass": low_pass("e", "u", tau=0.3),
        "low pass of second order": low_pass_second("e", "u", omega=3, zeta=0.4),
        "washout": washout("e", "u", tau=0.3),
        "notch": notch("e", "u", omega=3, zeta_zero=0.1, zeta_pole=0.8),
        "state space": state_space(["y1", "y2"], ["u1", "u2"], 3, start=start),
        "state space with feedthrough": state_space("y", "u", 2, direct=True),
        "transfer function with feedthrough": transfer_function("e", "u", [2, 1, 5], [1, 3, 4]),
        "transfer function": transfer_function("e", "u", [1, 2], [2, 3, 4]),
        "expression": expression("e", "u", [(Parameter("a", 2), a), (Parameter("b", 3), b)],
                                 A=-a * b, B=1, C=ca.sin(a), D=b),
        "sampled pid": pid("e", "u", Kp=2, Ki=3, Kd=0.4, Tf=0.05).sampled(0.02),
    }  # fmt: skip


@pytest.mark.parametrize("kind", a_block_of_each_kind())
def test_the_pullback_of_a_block_is_its_derivative(kind):
    block, rng = a_block_of_each_kind()[kind], np.random.default_rng(1)
    G = random_gradient(block, rng)
    theta = block.start + 0.01 * rng.normal(size=len(block.start)) * np.maximum(np.abs(block.start), 0.1)
    differences = central_differences(lambda at: G.inner(block.matrices(at)), theta)
    # central differences err by h² and by rounding / h, both near 1e-9 of the function's size
    np.testing.assert_allclose(block.pullback(theta, G), differences, rtol=1e-6, atol=1e-6 * np.abs(differences).max())


@pytest.mark.parametrize(
    ("kind", "formula"),
    [
        ("lead", 2 * (0.3 * S + 1) / (0.1 * S + 1)),
        ("low pass", 1 / (0.3 * S + 1)),
        ("low pass of second order", 9 / (S**2 + 2 * 0.4 * 3 * S + 9)),
        ("washout", 0.3 * S / (0.3 * S + 1)),
        ("notch", (S**2 + 0.6 * S + 9) / (S**2 + 4.8 * S + 9)),
        ("transfer function with feedthrough", (2 * S**2 + S + 5) / (S**2 + 3 * S + 4)),
        ("transfer function", (S + 2) / (2 * S**2 + 3 * S + 4)),
    ],
)
def test_a_block_of_one_input_has_the_response_of_its_formula(kind, formula):
    block = a_block_of_each_kind()[kind]
    np.testing.assert_allclose(
        block.matrices(block.start).response(OMEGA)[:, 0, 0], formula, rtol=ROUNDING, atol=ROUNDING
    )


def test_a_pid_is_the_sum_of_its_three_actions():
    omega, s = OMEGA[1:], S[1:]  # the integrator has a pole at 0
    block = a_block_of_each_kind()["pid"]
    np.testing.assert_allclose(
        block.matrices(block.start).response(omega)[:, 0, 0], 2 + 3 / s + 0.4 * s / (0.05 * s + 1), rtol=ROUNDING
    )


def test_a_pid_of_two_degrees_weights_the_reference_alone():
    omega, s = OMEGA[1:], S[1:]
    block = a_block_of_each_kind()["pid of two degrees"]
    from_r, from_y = block.matrices(block.start).response(omega)[:, 0, :].T
    slope = s / (0.05 * s + 1)
    np.testing.assert_allclose(from_r, 2 * 0.7 + 3 / s + 0.4 * slope * 0.2, rtol=ROUNDING)
    np.testing.assert_allclose(from_y, -(2 + 3 / s + 0.4 * slope), rtol=ROUNDING)


def test_a_sampled_block_is_the_continuous_one_at_tustins_frequency():
    h = 0.02
    continuous, sampled = a_block_of_each_kind()["pid"], a_block_of_each_kind()["sampled pid"]
    omega = np.array([0.3, 5.0, 100.0])
    warped = 2 / h * np.tan(omega * h / 2)
    np.testing.assert_allclose(
        sampled.matrices(sampled.start).response(omega, h),
        continuous.matrices(continuous.start).response(warped),
        rtol=1e-11,
    )  # the sampled integrator's pole at 1 is known to 1e-16 / (ω h)


def test_a_masked_gain_keeps_its_zeros():
    block = gain(["y1", "y2"], ["u1", "u2"], mask=[[1, 0], [1, 1]])
    assert [p.name for p in block.parameters] == ["K_1_1", "K_2_1", "K_2_2"]
    np.testing.assert_array_equal(block.matrices([1, 2, 3]).D, [[1, 0], [2, 3]])


def test_a_state_space_starts_as_the_controller_given():
    rng = np.random.default_rng(3)
    A = rng.normal(size=(4, 4))
    given = Controller(A, rng.normal(size=(4, 2)), rng.normal(size=(3, 4)), rng.normal(size=(3, 2)))
    block = state_space(["y1", "y2"], ["u1", "u2", "u3"], 4, start=given, direct=True)
    K = block.matrices(block.start)
    assert K.A[0, 2] == K.A[0, 3] == K.A[1, 3] == K.A[2, 0] == 0
    np.testing.assert_allclose(K.response(OMEGA), given.response(OMEGA), rtol=1e-10)  # cond of the modes is near 10


def test_a_strictly_proper_state_space_has_no_feedthrough_parameter():
    assert not any(p.name.startswith("D") for p in state_space("y", "u", 2).parameters)


def test_a_parameter_given_for_a_number_brings_its_name_and_bounds():
    block = pid("e", "u", Kp=Parameter("shared", 2, low=0, high=5), name="roll")
    assert block.parameters[0] == Parameter("shared", 2, 0, 5)
    assert block.parameters[1].name == "roll.Ki"


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: Parameter("K", 2, low=3), r"parameter 'K' must start within its bounds \[3, inf\]; got 2"),
        (lambda: Parameter("K", 2, low=3, high=1), "bounds of 'K' must rise"),
        (lambda: Parameter("K", math.nan), "value of parameter 'K' must be a number"),
        (lambda: low_pass("e", "u", tau=0.0), "tau must be positive"),
        (lambda: low_pass("e", "u", tau=Parameter("tau", 1, low=-1)), "its lower bound too"),
        (lambda: pid("e", "u", parts="PX"), "parts of a PID must be letters of 'PID'; got 'PX'"),
        (lambda: gain(["y1", "y2"], "u", [1, 2, 3]), r"value, mask and fixed of shape \(1, 2\); got \(3,\)"),
        (lambda: gain(["y1", "y2"], "u", [[1, 2]], mask=[[1, 0]]), "must start at zero where its mask forbids"),
        (lambda: transfer_function("e", "u", [1, 2, 3], [1, 2]), "no more numerator coefficients"),
        (lambda: state_space("y", "u", 0), "For order 0 take a gain"),
        (lambda: expression("e", "u", [], D=ca.SX.sym("q")), "depend on its parameters' symbols alone; got q"),
        (lambda: expression(["e", "f"], "u", [], D=1), r"matrix D of a block .* shape \(1, 2\); got \(1, 1\)"),
        (lambda: pid("e", "u").sampled(0.1).sampled(0.1), "can be sampled once"),
        (lambda: pid("e", "u").renamed({"Kq": "K"}), "unknown parameter 'Kq'; did you mean 'K"),
        (lambda: pid("e", "u").matrices([1, 2]), "theta must hold the 4 parameters of the block; got 2"),
        (lambda: Controller(np.eye(2), np.eye(2), np.eye(2), np.eye(3)), "matrices must fit together"),
    ],
)  # fmt: skip
def test_a_block_that_cannot_be_is_refused_in_a_sentence(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()


def test_the_response_of_a_controller_is_its_limit_at_infinity_and_refused_at_a_pole_on_the_limit():
    pi = Controller([[0.0]], [[1.0]], [[2.0]], [[3.0]])
    assert pi.response(math.inf).item() == 3
    with pytest.raises(InputError, match=r"got 0\.0 rad"):
        pi.response(0.0)
    alternating = Controller([[-1.0]], [[1.0]], [[2.0]], [[3.0]])
    with pytest.raises(InputError, match=r"got 31\.4159"):
        alternating.response(math.pi / 0.1, 0.1)  # z = −1, although π is rounded
    half = Controller([[0.5]], [[1.0]], [[1.0]], [[0.0]])
    assert half.response(math.pi / 0.1, 0.1).item() == -2 / 3  # no imaginary dust


def test_a_pid_matrix_is_the_matrix_of_pids_with_an_integrator_and_a_filter_for_each_error():
    rng = np.random.default_rng(5)
    P, I, D = rng.normal(size=(3, 2, 3))
    block = pid_matrix(["e1", "e2", "e3"], ["u1", "u2"], Kp=P, Ki=I, Kd=D, Tf=0.3)
    assert block.order == 6
    s = 1j * np.array([0.01, 0.7, 20.0])[:, None, None]
    found = block.matrices(block.start).response([0.01, 0.7, 20.0])
    np.testing.assert_allclose(found, P + I / s + D * s / (0.3 * s + 1), rtol=1e-12)
    assert not block.parameters[-1].free  # Tf, so that what is tuned enters linearly
    unused = ["Ki_1_2", "Ki_2_2", *(f"Kd_{i}_{j}" for i in (1, 2) for j in (1, 2, 3))]
    held = Structure(block).held(dict.fromkeys(unused, 0.0))
    assert held.order == 2  # integrators of the first and the third error
    with pytest.raises(InputError, match=r"gains and mask of shape \(2, 3\); got \(2,\)"):
        pid_matrix(["e1", "e2", "e3"], ["u1", "u2"], Kp=[1, 2])
