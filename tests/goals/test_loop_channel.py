import pickle

import control
import numpy as np
import pytest
from goal_cases import slope_error

from workbench.control.structure.block import Controller
from workbench.control.structure.blocks import gain, low_pass, pid, pid_two_degrees
from workbench.control.structure.loop import Loop
from workbench.control.structure.space import state_space
from workbench.control.structure.structure import Structure
from workbench.design.tuner.pieces import GoalPieces, Labelled
from workbench.goals import Sensitivity
from workbench.lti import Plant
from workbench.lti.make import tf
from workbench.lti.model import Model

OMEGA = np.array([0.0, 0.2, 1.0, 7.0, 300.0])
# python-control and we solve systems of condition near 1e3 in double precision
AGREE = {"rtol": 1e-10, "atol": 1e-11}


def random_plant(rng, n=5, m=3, p=3, direct=True):
    D = 0.3 * rng.normal(size=(p, m)) if direct else None
    return Plant.from_matrices(rng.normal(size=(n, n)) - np.eye(n), rng.normal(size=(n, m)), rng.normal(size=(p, n)), D)


def random_loop(seed, *, direct=True, sample_time=None):
    rng = np.random.default_rng(seed)
    plant = random_plant(rng, direct=direct)
    if sample_time:
        plant = Plant.from_matrices(0.3 * plant.A, plant.B, plant.C, plant.D)
    structure = Structure(
        (gain(["r - y1", "y2"], ["u1", "u2"], 0.1), state_space("y2", "u1", 2, direct=True, sample_time=sample_time)),
        "r",
    )
    loop = Loop(Model("random", plant, sample_time=sample_time), structure)
    return loop, structure.controller(structure.start + 0.3 * rng.normal(size=len(structure.start))), rng


def by_python_control(plant, K, dt=0):
    """Plant and K side by side, outputs (y1, y2, y3, v1, v2) led back to inputs (p1, p2, u3, e, m2) by feedback().

    From pushes (r, u3, at u1, at y2) to (u1, u2, y1 unmeasured, y2 measured, y3, r − y1, u2 of the controller alone).
    """
    beside = control.append(control.ss(plant.A, plant.B, plant.C, plant.D, dt), control.ss(K.A, K.B, K.C, K.D, dt))
    back = np.zeros((5, 5))
    back[0, 3] = back[1, 4] = back[4, 1] = 1.0  # p1 = v1, p2 = v2, m2 = y2
    back[3, 0] = -1.0  # e = r − y1
    closed = control.feedback(beside, control.ss([], [], [], back, dt), sign=1)
    into = np.zeros((5, 4))
    into[3, 0] = into[2, 1] = into[0, 2] = into[4, 3] = 1.0
    out, direct = np.zeros((7, 5)), np.zeros((7, 4))
    out[[0, 1, 2, 3, 4, 6], [3, 4, 0, 1, 2, 4]] = 1.0
    out[5, 0] = -1.0
    direct[0, 2] = direct[3, 3] = direct[5, 0] = 1.0
    return control.ss(closed.A, closed.B @ into, out @ closed.C, out @ closed.D @ into + direct, dt)


OURS = ["r", "u3", "u1", "y2"], ["u1", "u2", "before y1", "y2", "y3", "r - y1", "before u2"]


@pytest.mark.parametrize("direct", [False, True])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_channels_are_the_closed_loop_of_python_control(seed, direct):
    loop, K, _ = random_loop(seed, direct=direct)
    channel = loop.channel(*OURS)
    theirs = by_python_control(loop.model.plant, K)
    expected = np.array([theirs(1j * w) for w in OMEGA])
    np.testing.assert_allclose(channel.response(K, OMEGA), expected, **AGREE)
    ours = channel.system(K)
    np.testing.assert_allclose(
        [ours.C @ np.linalg.solve(1j * w * np.eye(len(ours.A)) - ours.A, ours.B) + ours.D for w in OMEGA],
        expected,
        **AGREE,
    )
    np.testing.assert_allclose(
        np.sort_complex(loop.poles(K)), np.sort_complex(theirs.poles()), rtol=1e-8
    )  # eigenvalues of condition up to 1e4


def test_a_sampled_loop_is_that_of_python_control():
    h = 0.1
    loop, K, _ = random_loop(4, sample_time=h)
    theirs = by_python_control(loop.model.plant, K, dt=h)
    omega = np.array([0.1, 1.0, 20.0])
    expected = np.array([theirs(np.exp(1j * w * h)) for w in omega])
    np.testing.assert_allclose(loop.channel(*OURS).response(K, omega), expected, **AGREE)


def test_the_feedback_of_a_whole_controller_is_control_feedback():
    rng = np.random.default_rng(7)
    plant = random_plant(rng, m=2, p=2)
    structure = Structure(state_space(["r1 - y1", "r2 - y2"], ["u1", "u2"], 3, direct=True), ("r1", "r2"))
    K = structure.controller(structure.start + 0.2 * rng.normal(size=len(structure.start)))
    C = control.ss(K.A, K.B, K.C, K.D)
    theirs = control.feedback(plant.to_control() * C, control.ss([], [], [], np.eye(2)))
    ours = Loop(Model("plant", plant), structure).channel(["r1", "r2"], ["y1", "y2"]).response(K, OMEGA)
    np.testing.assert_allclose(ours, np.array([theirs(1j * w) for w in OMEGA]), **AGREE)


def test_opening_one_loop_leaves_the_other_closed():
    s = 1j * OMEGA
    g11, g12, g21, g22 = 1 / (s + 1), 0.5 / (s + 2), -0.7 / (s + 3), 2 / (s + 4)
    A = np.diag([-1.0, -2, -3, -4])
    B = np.array([[1, 0], [0, 1], [1, 0], [0, 1.0]])
    plant = Plant.from_matrices(A, B, [[1, 0.5, 0, 0], [0, 0, -0.7, 2]])
    k1, k2 = 3.0, 5.0
    structure = Structure((gain("r1 - y1", "u1", k1, name="k1"), gain("r2 - y2", "u2", k2, name="k2")), ("r1", "r2"))
    loop, K = Loop(Model("two by two", plant), structure), structure.controller()

    def seen(channel):
        return channel.response(K, OMEGA)[:, 0, 0]

    # With loop 2 closed, u1 sees the plant g11 − g12 k2 g21 / (1 + k2 g22)
    effective = g11 - g12 * k2 * g21 / (1 + k2 * g22)
    np.testing.assert_allclose(seen(loop.sensitivity("u1", openings="u2")), 1 / (1 + k1 * g11), **AGREE)
    np.testing.assert_allclose(seen(loop.sensitivity("u1")), 1 / (1 + k1 * effective), **AGREE)
    np.testing.assert_allclose(seen(loop.loop_gain("u1", openings="y2")), k1 * g11, **AGREE)
    np.testing.assert_allclose(seen(loop.loop_gain("y1")), k1 * effective, **AGREE)
    np.testing.assert_allclose(seen(loop.complementary("y1")), k1 * effective / (1 + k1 * effective), **AGREE)
    np.testing.assert_allclose(seen(loop.channel("r1", "y1", openings="y2")), k1 * g11 / (1 + k1 * g11), **AGREE)


def test_sensitivity_and_complementary_sensitivity_add_up_to_one_and_follow_from_the_loop_gain():
    loop, K, _ = random_loop(5)
    for points in (["u1", "u2"], ["y1", "y2"], "u2"):
        S, T, L = (f(points).response(K, OMEGA) for f in (loop.sensitivity, loop.complementary, loop.loop_gain))
        one = np.eye(S.shape[1])
        np.testing.assert_allclose(S + T, one + 0 * S, **AGREE)
        np.testing.assert_allclose(S @ (one + L), one + 0 * S, **AGREE)


def test_an_open_point_passes_the_push_alone():
    loop, K, _ = random_loop(6)
    answer = loop.channel(["y1", "r"], ["y1"], openings=["y1"]).response(K, OMEGA)
    np.testing.assert_array_equal(answer[:, 0], np.array([[1, 0]] * len(OMEGA)))


def test_blocks_in_series_reach_the_plant_through_a_signal_between_them():
    s = 1j * OMEGA
    plant = Plant.from_matrices([[-1.0]], [[1.0]], [[1.0]])
    structure = Structure((pid("r - y1", "wanted", Kp=2, parts="P"), low_pass("wanted", "u1", tau=0.5)), "r")
    loop = Loop(Model("lag", plant), structure)
    L = 2 / (0.5 * s + 1) / (s + 1)
    channel = loop.channel("r", ["y1", "wanted"])
    answer = channel.response(structure.controller(), OMEGA)
    np.testing.assert_allclose(answer[:, 0, 0], L / (1 + L), **AGREE)
    np.testing.assert_allclose(answer[:, 1, 0], 2 / (1 + L), **AGREE)
    np.testing.assert_allclose(loop.loop_gain("wanted").response(structure.controller(), OMEGA)[:, 0, 0], L, **AGREE)


def test_feedforward_reads_a_free_input_of_the_plant():
    plant = Plant.from_matrices([[-1.0]], [[1.0, 1.0]], [[1.0]])  # y = (u1 + u2)/(s + 1)
    structure = Structure((pid("-y1", "u1", Kp=2, parts="P"), gain("u2", "u1", -1.0, name="forward")))
    loop = Loop(Model("lag", plant), structure)
    np.testing.assert_array_equal(loop.channel("u2", "y1").response(structure.controller(), OMEGA), 0)


def test_two_degrees_of_freedom_track_and_reject_by_their_formulas():
    omega, s = OMEGA[1:], 1j * OMEGA[1:]
    plant = Plant.from_matrices([[-1.0]], [[1.0]], [[1.0]])
    structure = Structure(pid_two_degrees("r", "y1", "u1", Kp=2, Ki=3, b=0.4, parts="PI"), "r")
    loop, K = Loop(Model("lag", plant), structure), structure.controller()
    G, feedback, forward = 1 / (s + 1), 2 + 3 / s, 0.8 + 3 / s
    np.testing.assert_allclose(
        loop.channel("r", "y1").response(K, omega)[:, 0, 0], G * forward / (1 + G * feedback), **AGREE
    )
    np.testing.assert_allclose(loop.channel("u1", "y1").response(K, omega)[:, 0, 0], G / (1 + G * feedback), **AGREE)


def differences_of(function, K):
    """Gradient of a function of K by central differences of fourth order, stacked."""
    stacked, out = K.stacked(), np.zeros(K.stacked().shape)
    for place in np.ndindex(*stacked.shape):
        h = 1e-5 * max(1.0, abs(stacked[place]))
        ends = []
        for steps in (1, -1, 2, -2):
            moved = stacked.copy()
            moved[place] += steps * h
            ends.append(function(Controller.from_stacked(moved, K.order)))
        out[place] = (8 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12 * h)
    return out


@pytest.mark.parametrize("direct", [False, True])
def test_the_pullback_of_a_channels_matrices_is_their_derivative(direct):
    loop, K, rng = random_loop(2, direct=direct)
    channel = loop.channel(["r", "u3", "y2"], ["u1", "y1", "r - y1"], openings=["u2"])
    G = [rng.normal(size=M.shape) for M in channel.system(K)]
    expected = differences_of(lambda at: sum(np.vdot(g, m) for g, m in zip(G, channel.system(at), strict=True)), K)
    # differences err by h⁴ and by rounding / h, each below 1e-9 of the largest entry
    np.testing.assert_allclose(
        channel.system_pullback(K, *G).stacked(), expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max()
    )


@pytest.mark.parametrize(("direct", "sample_time"), [(False, None), (True, None), (True, 0.1)])
def test_the_pullback_of_a_response_is_its_derivative(direct, sample_time):
    loop, K, rng = random_loop(3, direct=direct, sample_time=sample_time)
    channel = loop.channel(["r", "u3", "y2"], ["u1", "before y1", "r - y1"])
    omega = OMEGA[:4]
    W = rng.normal(size=(4, 3, 3)) + 1j * rng.normal(size=(4, 3, 3))
    expected = differences_of(lambda at: np.vdot(W, channel.response(at, omega)).real, K)
    # as above; the responses are larger and so is their rounding, hence the wider floor
    np.testing.assert_allclose(
        channel.response_pullback(K, omega, W).stacked(), expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max()
    )


def test_the_response_at_infinity_is_the_feedthrough_and_so_is_its_gradient():
    loop, K, rng = random_loop(3)
    channel = loop.channel(["r", "u3"], ["u1", "y1"])
    np.testing.assert_array_equal(channel.response(K, [np.inf])[0], channel.system(K).D)
    W = rng.normal(size=(1, 2, 2))
    zero = [np.zeros_like(M) for M in channel.system(K)]
    np.testing.assert_allclose(
        channel.response_pullback(K, [np.inf], W).stacked(),
        channel.system_pullback(K, *zero[:3], W[0]).stacked(),
        atol=1e-15,  # the same products of numbers of order one
    )


def test_a_plant_without_states_closes_too():
    static = tf([[2.0]], [[1.0]])
    integral = Structure(pid("r - y1", "u1", Kp=0.1, Ki=1, parts="PI"), "r")
    loop, s = Loop(static, integral), 1j * OMEGA[1:]
    L = 2 * (0.1 + 1 / s)
    np.testing.assert_allclose(loop.poles(integral.controller()), [-2 / 1.2], rtol=1e-14)
    np.testing.assert_allclose(
        loop.channel("r", "y1").response(integral.controller(), OMEGA[1:])[:, 0, 0], L / (1 + L), **AGREE
    )


def test_many_frequencies_take_another_way_to_the_same_response():
    loop, K, _ = random_loop(1)
    channel = loop.channel(["r", "u3"], ["u1", "y1"])
    omega = np.geomspace(1e-2, 1e2, 40)
    one_by_one = np.concatenate([channel.response(K, [w]) for w in omega])
    np.testing.assert_allclose(channel.response(K, omega), one_by_one, **AGREE)


def test_a_loop_survives_the_way_to_another_process():
    loop, K, _ = random_loop(1)
    again = pickle.loads(pickle.dumps((loop, loop.sensitivity("u1"))))
    for channel in (again[0].sensitivity("u1"), again[1]):
        np.testing.assert_array_equal(channel.response(K, OMEGA), loop.sensitivity("u1").response(K, OMEGA))


def cascade(unit=1.0):
    """1/(s + 1) under 2 + 1/s, followed by 1/(s + 2) under 0.05/s; time in other units."""
    plant = Plant(
        A=np.array([[-1.0, 0], [1, -2]]) / unit, B=np.array([[1.0], [0]]) / unit, C=np.eye(2), D=np.zeros((2, 1)),
        states=("x1", "x2"), inputs=("u",), outputs=("inner", "outer"),
    )  # fmt: skip
    fast = pid("wanted - inner", "u", Kp=2.0, Ki=1.0 / unit, parts="PI", name="fast")
    slow = pid("r - outer", "wanted", Kp=0.0, Ki=0.05 / unit, parts="I", name="slow")
    return Loop(Model("cascade", plant), Structure((fast, slow), "r"))


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_an_integrator_behind_an_opening_does_not_make_the_channel_before_it_unstable(unit):
    # 1/(1 + (2s + 1)/(s (s + 1))) = s (s + 1)/(s² + 3 s + 1) rises to its peak of 1 at infinity
    loop = cascade(unit)
    K = loop.structure.controller()
    goal = Sensitivity(points=("u",), limit=1.0, openings=("wanted",)).bind(loop)
    for value in (goal.evaluate(K), goal.exact(K)):
        assert value.value == pytest.approx(1.0, rel=1e-8)
    channel = loop.sensitivity("u", "wanted")
    s = np.array([0.3j, 5j])
    np.testing.assert_allclose(channel.response(K, s.imag / unit)[:, 0, 0], s * (s + 1) / (s**2 + 3 * s + 1))
    assert channel.response(K, 0.0) == pytest.approx(0.0, abs=1e-12)  # where the integrator behind the opening stands
    assert len(loop.poles(K, "wanted")) == 4  # the loop itself keeps every state
    assert loop.poles(K).real.max() < 0 == loop.unstable_poles(K)


def test_gradients_through_an_opening_are_those_of_differences():
    loop = cascade()
    goal = Sensitivity(points=("u",), limit={0.1: 0.1, 10.0: 2.0}, openings=("wanted",)).bind(loop)
    assert slope_error(goal, loop.structure.controller()) < 1e-6


def test_an_unstable_mode_that_a_goal_does_not_see_still_makes_the_tuning_unstable():
    loop = cascade()
    theta = loop.structure.start * np.where([n.startswith("slow") for n in loop.structure.names], -1.0, 1.0)
    K = loop.structure.controller(theta)  # 0.05/s with the wrong sign
    goal = Sensitivity(points=("u",), limit=1.5, openings=("wanted",))
    assert goal.bind(loop).exact(K).value < 1
    assert loop.unstable_poles(K) == 1
    programme = GoalPieces([Labelled("cascade", loop.model)], loop.structure, [goal])
    assert programme.at(theta) is None
    assert programme.exact_values(theta)[0].value == np.inf


def test_many_frequencies_far_out_keep_the_digits_of_one():
    # 1/((s + 1)(s + 10)…(s + 1e5)) falls by 1e-30 up to 1e5 rad/s, far below the rounding of its largest value
    poles = 10.0 ** np.arange(6)
    model = tf([[[1.0]]], [[np.poly(-poles)]])
    omega = np.geomspace(1e-2, 1e6, 50)
    expected = np.prod(1 / (1j * omega[:, None] + poles), axis=1)
    # the coefficients' own rounding over six decades
    np.testing.assert_allclose(model.response(omega)[:, 0, 0], expected, rtol=1e-8)
