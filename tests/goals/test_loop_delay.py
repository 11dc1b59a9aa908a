import control
import numpy as np
import pytest
from scipy.special import lambertw

from workbench.control.structure.block import Controller
from workbench.control.structure.blocks import gain, pid
from workbench.control.structure.loop import Loop
from workbench.control.structure.space import state_space
from workbench.control.structure.structure import Structure
from workbench.errors import InputError
from workbench.lti import Plant
from workbench.lti.delay import pade
from workbench.lti.make import tf
from workbench.lti.model import DelayLine, Model

OMEGA = np.array([0.0, 0.01, 0.3, 2.0, 15.0])
S = 1j * OMEGA
AGREE = {"rtol": 1e-11, "atol": 1e-12}  # a few solves of small systems
WOOD_BERRY = (
    [[12.8, -18.9], [6.6, -19.4]],
    [[[16.7, 1], [21, 1]], [[10.9, 1], [14.4, 1]]],
    [[1, 3], [7, 3]],
)  # minutes; Chemical Engineering Science 28 (1973) 1707


def lag():
    return Plant.from_matrices([[-1.0]], [[1.0]], [[1.0]])


def wood_berry(omega):
    num, den, times = WOOD_BERRY
    s = 1j * np.asarray(omega)
    rows = [[num[i][j] * np.exp(-s * times[i][j]) / (den[i][j][0] * s + 1) for j in range(2)] for i in range(2)]
    return np.array(rows).transpose(2, 0, 1)


@pytest.mark.parametrize("delays", [{"input_delay": {"u1": 0.7}}, {"output_delay": {"y1": 0.7}}])
def test_a_dead_time_turns_the_phase_and_nothing_else(delays):
    loop = Loop(Model("late", lag(), **delays), Structure(gain("-y1", "u1", 0.8)))
    L = 0.8 * np.exp(-0.7 * S) / (S + 1)
    K = loop.structure.controller()
    assert loop.sensitivity("u1").delayed
    np.testing.assert_allclose(loop.loop_gain("u1").response(K, OMEGA)[:, 0, 0], L, **AGREE)
    np.testing.assert_allclose(loop.sensitivity("y1").response(K, OMEGA)[:, 0, 0], 1 / (1 + L), **AGREE)


@pytest.mark.parametrize("delays", [{"input_delay": {"u1": 0.7}}, {"output_delay": {"y1": 0.7}}])
def test_a_dead_time_holds_back_the_feedthrough_too(delays):
    model = Model(
        "late", Plant.from_matrices([[-1.0]], [[1.0, 2.0]], [[1.0], [3.0]], [[0.5, 0.1], [0.0, 0.2]]), **delays
    )
    s = S[:, None, None]
    expected = np.array([[1.0, 2], [3, 6]]) / (s + 1) + np.array([[0.5, 0.1], [0, 0.2]])
    late = np.exp(-0.7 * S)
    if "input_delay" in delays:
        expected[:, :, 0] *= late[:, None]
    else:
        expected[:, 0] *= late[:, None]
    np.testing.assert_allclose(model.response(OMEGA), expected, **AGREE)


def test_signals_keep_their_names_before_the_actuator_and_behind_the_sensor():
    model = Model("late", lag(), input_delay={"u1": 0.7}, output_delay={"y1": 0.2})
    loop = Loop(model, Structure(gain("-y1", "u1", 0.8)))
    assert (model.inputs, model.outputs) == (("u1",), ("y1",))
    answer = loop.channel("u1", ["u1", "y1"], openings="y1").response(loop.structure.controller(), OMEGA)
    np.testing.assert_allclose(answer[:, :, 0], np.array([np.ones(5), np.zeros(5)]).T, **AGREE)
    np.testing.assert_allclose(model.response(OMEGA)[:, 0, 0], np.exp(-0.9 * S) / (S + 1), **AGREE)


def test_an_integrator_behind_a_dead_time_has_a_finite_loop_at_rest():
    loop = Loop(
        Model("late", Plant.from_matrices([[0.0]], [[1.0]], [[1.0]]), {"u1": 0.7}), Structure(gain("-y1", "u1", 0.8))
    )
    K = loop.structure.controller()
    np.testing.assert_allclose(loop.sensitivity("u1").response(K, [0.0]), 0, atol=1e-15)  # 1 − 1
    np.testing.assert_allclose(loop.channel("u1", "y1").response(K, [0.0]), 1 / 0.8, rtol=1e-15)


def test_dead_times_inside_a_plant_are_their_linear_fractional_form():
    rng = np.random.default_rng(2)
    n, m, p, q = 4, 2, 2, 3
    D = 0.2 * rng.normal(size=(p + q, m + q))
    plant = Plant.from_matrices(
        rng.normal(size=(n, n)) - 2 * np.eye(n), rng.normal(size=(n, m + q)), rng.normal(size=(p + q, n)), D
    )
    times = np.array([0.3, 0.05, 1.1])
    lines = tuple(DelayLine(f"y{p + k + 1}", f"u{m + k + 1}", t) for k, t in enumerate(times))
    model = Model("inside", plant, lines=lines)
    whole = plant.response(OMEGA)
    turned = np.exp(-S[:, None] * times)[:, :, None] * np.eye(q)
    P11, P12, P21, P22 = whole[:, :p, :m], whole[:, :p, m:], whole[:, p:, :m], whole[:, p:, m:]
    expected = P11 + P12 @ turned @ np.linalg.solve(np.eye(q) - P22 @ turned, P21)
    np.testing.assert_allclose(model.response(OMEGA), expected, **AGREE)
    # and with each line a fraction: exact to the fraction's own error, (ωT)^9 2e-8 for order 4 at ωT = 1.1 × 0.3
    np.testing.assert_allclose(model.rational().response(OMEGA[:3]), expected[:3], rtol=1e-9, atol=1e-9)


def test_wood_and_berrys_column_is_its_matrix_of_fractions_and_dead_times():
    model = tf(*WOOD_BERRY[:2], dead_time=WOOD_BERRY[2], input=("reflux", "steam"), output=("top", "bottom"))
    np.testing.assert_allclose(model.response(OMEGA), wood_berry(OMEGA), **AGREE)
    assert sorted(line.dead_time for line in model.lines) == [1, 3, 6]  # two common to columns, one inside
    assert len(model.plant.states) == 4


def test_wood_and_berrys_column_under_two_controllers_is_the_matrix_formula():
    structure = Structure(
        (
            pid("r1 - y1", "u1", Kp=0.2, Ki=0.02, parts="PI", name="top"),
            pid("r2 - y2", "u2", Kp=-0.1, Ki=-0.01, parts="PI", name="bottom"),
        ),
        ("r1", "r2"),
    )
    loop, omega = Loop(tf(*WOOD_BERRY[:2], dead_time=WOOD_BERRY[2]), structure), OMEGA[1:]
    s = 1j * omega
    zero = 0 * s
    C = np.array([[0.2 + 0.02 / s, zero], [zero, -0.1 - 0.01 / s]]).transpose(2, 0, 1)
    L = wood_berry(omega) @ C
    expected = np.linalg.solve(np.eye(2) + L, L)
    answer = loop.channel(["r1", "r2"], ["y1", "y2"]).response(structure.controller(), omega)
    np.testing.assert_allclose(answer, expected, **AGREE)


def test_the_poles_of_a_late_integrator_are_lamberts():
    k, T = 0.5, 1.0
    loop = Loop(
        Model("late", Plant.from_matrices([[0.0]], [[1.0]], [[1.0]]), {"u1": T}, pade_order=6),
        Structure(gain("-y1", "u1", k)),
    )
    exact = lambertw(-k * T) / T  # s + k exp(−s T) = 0
    poles = loop.poles(loop.structure.controller())
    # order 6 is exact to (sT)^13/1e13 at the slow pair, |sT| = 0.8
    assert np.abs(poles - exact).min() < 1e-12


@pytest.mark.parametrize("order", [1, 2, 4, 8, 12])
def test_the_fraction_of_a_dead_time_is_pades_and_an_all_pass(order):
    T = 1e-3
    A, B, C, D = pade(T, order)
    s = 1j * np.array([0.0, 0.3, 2.0]) / T
    ours = np.array([(C @ np.linalg.solve(at * np.eye(order) - A, B) + D).item() for at in s])
    num, den = control.pade(T, order)
    np.testing.assert_allclose(ours, np.polyval(num, s) / np.polyval(den, s), rtol=1e-10)
    np.testing.assert_allclose(np.abs(ours), 1, rtol=1e-12)  # the same magnitude above and below
    # both Gramians are the identity; the turn to these coordinates costs the condition of the first, 1e5 at order 12
    np.testing.assert_allclose((A + A.T) * T, -B @ B.T * T, atol=1e-9)
    np.testing.assert_allclose((A + A.T) * T, -C.T @ C * T, atol=1e-9)


def test_a_sampled_dead_time_is_a_chain_of_states_and_exact():
    h = 0.1
    plant = Plant.from_matrices([[0.9]], [[0.1]], [[1.0]])
    model = Model("late", plant, {"u1": 0.3}, {"y1": 0.1}, sample_time=h)
    loop = Loop(model, Structure(gain("-y1", "u1", 0.8)))
    K = loop.structure.controller()
    omega = np.array([0.0, 1.0, 30.0])
    z = np.exp(1j * omega * h)
    L = 0.8 * 0.1 / (z - 0.9) * z**-4
    channel = loop.sensitivity("u1")
    assert not channel.delayed
    np.testing.assert_allclose(channel.response(K, omega)[:, 0, 0], 1 / (1 + L), **AGREE)
    A, B, C, D = channel.system(K)
    assert len(A) == 5
    by_states = [(C @ np.linalg.solve(at * np.eye(5) - A, B) + D).item() for at in z]
    np.testing.assert_allclose(by_states, 1 / (1 + L), **AGREE)


def late_loop(sample_time=None):
    rng = np.random.default_rng(5)
    scale = 1.0 if sample_time is None else 0.2
    plant = Plant.from_matrices(
        scale * (rng.normal(size=(3, 3)) - 2 * np.eye(3)),
        rng.normal(size=(3, 2)),
        rng.normal(size=(2, 3)),
        0.1 * rng.normal(size=(2, 2)),
    )
    structure = Structure(state_space(["r - y1", "y2"], "u1", 2, direct=True, sample_time=sample_time), "r")
    loop = Loop(Model("late", plant, {"u1": 0.2}, {"y2": 0.3}, sample_time=sample_time), structure)
    return loop, structure.controller(structure.start + 0.2 * rng.normal(size=len(structure.start))), rng


@pytest.mark.parametrize("sample_time", [None, 0.1])
def test_gradients_go_through_dead_times(sample_time):
    loop, K, rng = late_loop(sample_time)
    channel = loop.channel(["r", "u2"], ["u1", "before y2", "r - y1"])
    omega = np.array([0.1, 1.0, 6.0])
    W = rng.normal(size=(3, 3, 2)) + 1j * rng.normal(size=(3, 3, 2))
    G = [rng.normal(size=M.shape) for M in channel.system(K)]

    def of_response(at):
        return np.vdot(W, channel.response(at, omega)).real

    def of_system(at):
        return sum(np.vdot(g, m) for g, m in zip(G, channel.system(at), strict=True))

    for function, gradient in (
        (of_response, channel.response_pullback(K, omega, W)),
        (of_system, channel.system_pullback(K, *G)),
    ):
        stacked, ours = K.stacked(), gradient.stacked()
        for place in np.ndindex(*stacked.shape):
            step = np.zeros_like(stacked)
            step[place] = 1e-5
            ends = [function(Controller.from_stacked(stacked + k * step, K.order)) for k in (1, -1, 2, -2)]
            difference = (8 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / 12e-5
            # differences of fourth order: h⁴ and rounding / h = 1e-11, each times the condition of the loop
            assert difference == pytest.approx(ours[place], rel=1e-6, abs=1e-6 * np.abs(ours).max())


def test_a_model_from_python_control_keeps_its_sample_time_and_names():
    system = control.ss([[0.5]], [[1.0]], [[2.0]], [[0.0]], 0.2, inputs=["force"], outputs=["place"])
    model = Model.from_control(system, name="cart")
    assert (model.name, model.sample_time, model.inputs, model.outputs) == ("cart", 0.2, ("force",), ("place",))
    omega = np.array([0.3, 2.0])
    np.testing.assert_allclose(model.response(omega)[:, 0, 0], [system(np.exp(0.2j * w)) for w in omega], **AGREE)
    assert Model.from_control(control.tf([1], [1, 1])).sample_time is None
    with pytest.raises(InputError, match="sample time in seconds; got dt = True"):
        Model.from_control(control.ss([[0.5]], [[1.0]], [[2.0]], [[0.0]], True))


@pytest.mark.parametrize(
    ("numerators", "denominators", "order"),
    [
        ([[1], [2]], [[[1, 0]], [[1, 0]]], 1),  # two measurements of one integrator
        ([[1, 2]], [[[1, 0], [1, 0]]], 1),  # two inputs of one
        ([[1, 1], [1, 2]], [[[1, 0], [1, 0]], [[1, 0], [1, 0]]], 2),
        ([[1, 1], [1, 1]], [[[1, 0], [1, 0]], [[1, 0], [1, 0]]], 1),
        ([[[1, 1]]], [[[1, 3, 2]]], 1),  # (s + 1)/((s + 1)(s + 2))
        ([[[2, 3]]], [[[1, 2]]], 1),
        ([[5.0]], [[2.0]], 0),
    ],
)
def test_a_matrix_of_fractions_gets_the_least_number_of_states_where_that_is_asked(numerators, denominators, order):
    model = tf(numerators, denominators, minimal=True)
    assert len(model.plant.states) == order
    s = 1j * OMEGA[1:]
    expected = [
        [np.polyval(np.atleast_1d(n), s) / np.polyval(np.atleast_1d(d), s) for n, d in zip(*rows, strict=True)]
        for rows in zip(numerators, denominators, strict=True)
    ]
    np.testing.assert_allclose(model.response(OMEGA[1:]), np.array(expected).transpose(2, 0, 1), **AGREE)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (([[[1, 2, 3]]], [[[1, 2]]]), r"entry \(1, 1\) must be proper with a nonzero denominator; got degree 2 over 1"),
        (([[1]], [[0]]), "got degree 0 over zero"),
        (([[1, 2]], [[[1, 2]]]), r"matrices of one shape; got \(1, 2\) and \(1, 1\)"),
        (([[1]], [[[1, 2]]], [[-1]]), "numbers from 0"),
        (([[1, 2], [3]], [[[1, 2]]]), "rows of equal length"),
    ],
)
def test_a_matrix_of_fractions_that_cannot_be_is_refused_in_a_sentence(arguments, sentence):
    with pytest.raises(InputError, match=sentence):
        tf(*arguments[:2], dead_time=arguments[2] if len(arguments) > 2 else 0.0)
