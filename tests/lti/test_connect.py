"""Models joined by names: against python-control, against formulas with dead times, against loops opened by hand."""

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.errors import InputError
from workbench.lti import connect as algebra
from workbench.lti.algebraic import IllPosedError
from workbench.lti.connect import append, connect, feedback, lft, open_at, parallel, select, series
from workbench.lti.make import second_order, ss, tf, zpk

AGREE = {"rtol": 1e-9, "atol": 1e-10}  # responses of the same matrices in another order


def drawn(rng, n, m, p, name, inputs, outputs, h=None, direct=True):
    A = rng.normal(size=(n, n)) - 2 * np.eye(n)
    A = A if h is None else 0.3 * A
    D = 0.3 * rng.normal(size=(p, m)) * direct
    return ss(
        A, rng.normal(size=(n, m)), rng.normal(size=(p, n)), D, inputs=inputs, outputs=outputs, sample_time=h, name=name
    )


@pytest.mark.parametrize("h", [None, 0.1])
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_connect_joins_as_python_control_does(h, seed):
    rng = np.random.default_rng(seed)
    P = drawn(rng, 3, 3, 2, "P", ["u1", "u2", "d"], ["y1", "y2"], h, direct=False)
    K = drawn(rng, 2, 2, 2, "K", ["e1", "e2"], ["u1", "u2"], h)
    F = drawn(rng, 1, 1, 1, "F", ["y2"], ["f"], h)
    ours = connect([P, K, F], inputs=["r", "d"], outputs=["y1", "f", "u1"], links={"e1": "r - y1", "e2": "f"})
    theirs = control.interconnect(
        [m.to_control() for m in (P, K, F)] + [control.summing_junction(["r", "-y1"], "e1", name="sum")],
        connections=[["P.u1", "K.u1"], ["P.u2", "K.u2"], ["F.y2", "P.y2"], ["K.e2", "F.f"], ["K.e1", "sum.e1"],
                     ["sum.y1", "P.y1"]],
        inplist=["sum.r", "P.d"], outlist=["P.y1", "F.f", "K.u1"],
    )  # fmt: skip
    omega = rng.uniform(0.01, 20, size=6)
    at = 1j * omega if h is None else np.exp(1j * omega * h)
    np.testing.assert_allclose(ours.response(omega), np.moveaxis(theirs(at), -1, 0), **AGREE)
    assert sorted(ours.plant.states) == sorted(f"{m.name}: {x}" for m in (P, K, F) for x in m.plant.states)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_dead_times_go_through_every_join_exactly(seed):
    rng = np.random.default_rng(seed)
    t = rng.uniform(0.01, 2.0, size=3)
    P = tf([2.0], [1.0, 0.5], input="u", output="y", dead_time=t[0], name="plant")
    K = tf([1.0, 0.3], [0.1, 1.0], input="r - m", output="u", dead_time=t[1], name="controller")
    H = tf([1.0], [0.2, 1.0], input="y", output="m", dead_time=t[2], name="sensor")
    s = 1j * rng.uniform(0.01, 30, size=8)
    p, k, h = (
        2 / (s + 0.5) * np.exp(-s * t[0]), (s + 0.3) / (0.1 * s + 1) * np.exp(-s * t[1]),
        np.exp(-s * t[2]) / (0.2 * s + 1),
    )  # fmt: skip
    omega, S = s.imag, 1 / (1 + p * k * h)
    closed = connect([P, K, H], inputs=["r", "u"], outputs={"angle": "y", "error": "r - m", "in front": "before u"})
    expected = np.array([[p * k * S, p * S], [S, -h * p * S], [k * S, -p * k * h * S]]).transpose(2, 0, 1)
    np.testing.assert_allclose(closed.response(omega), expected, **AGREE)
    assert sorted(line.dead_time for line in closed.lines) == sorted(t)
    for point in ("u", "y", "m"):  # one loop: the same gain wherever it is cut
        L = open_at([P, K, H], point, references="r")
        np.testing.assert_allclose(L.response(omega)[:, 0, 0], p * k * h, **AGREE)
        assert L.outputs == (f"back to {point}",)
    np.testing.assert_allclose(feedback(P, H).response(omega)[:, 0, 0], p / (1 + p * h), **AGREE)
    np.testing.assert_allclose(feedback(P, H, sign=1).response(omega)[:, 0, 0], p / (1 - p * h), **AGREE)
    np.testing.assert_allclose(series(P, H).response(omega)[:, 0, 0], p * h, **AGREE)
    np.testing.assert_allclose(parallel(P, H).response(omega)[:, 0, 0], p + h, **AGREE)
    np.testing.assert_allclose(
        append([P, H.renamed({"y": "speed"})]).response(omega),
        np.array([[p, 0 * s], [0 * s, h]]).transpose(2, 0, 1), **AGREE,
    )  # fmt: skip


def test_a_loop_of_two_points_is_opened_at_both_or_at_one_with_the_other_closed():
    # G = [[a, b], [c, d]] constant gains, K = k I: L = kG at both; with the second closed a − b k c/(1 + k d), times k
    (a, b), (c, d), k = (0.3, -0.2), (0.5, 0.4), 1.7
    G = ss(
        np.zeros((0, 0)), np.zeros((0, 2)), np.zeros((2, 0)), [[a, b], [c, d]], inputs=["u", "v"], outputs=["y", "z"]
    )
    K = [tf([k], [1.0], input=f"-{y}", output=u, name=u) for y, u in (("y", "u"), ("z", "v"))]
    np.testing.assert_allclose(open_at([G, *K], ["u", "v"]).plant.D, k * np.array([[a, b], [c, d]]), rtol=1e-14)
    np.testing.assert_allclose(open_at([G, *K], "u").plant.D, [[k * (a - b * k * c / (1 + k * d))]], rtol=1e-14)
    np.testing.assert_allclose(open_at([G, *K], "u", openings="v").plant.D, [[k * a]], rtol=1e-14)


def test_lft_leaves_what_the_lower_system_neither_makes_nor_reads():
    P = ss([[0.0, 1], [-1, 0]], np.eye(2), np.eye(2), inputs=["force", "kick"], outputs=["place", "speed"])
    K = tf([3.0], [1.0], input="-speed", output="force")
    closed = lft(P, K)
    assert (closed.inputs, closed.outputs) == (("kick",), ("place",))
    np.testing.assert_allclose(closed.plant.A, [[0, 1 - 3], [-1, 0]], rtol=1e-15)


def test_sampled_dead_times_are_counted_in_samples_and_static_gains_have_any_sample_time():
    P = tf([1.0], [1.0, -0.5], input="u", output="y", sample_time=0.1, dead_time=0.3)
    K = tf([0.2], [1.0], input="r - y", output="u")
    closed = connect([P, K], inputs="r", outputs="y")
    assert closed.sample_time == 0.1
    z = np.exp(1j * np.array([0.3, 3.0]) * 0.1)
    L = 0.2 * z**-3 / (z - 0.5)
    np.testing.assert_allclose(closed.response([0.3, 3.0])[:, 0, 0], L / (1 + L), **AGREE)
    # z³(z − 0.5) + 0.2 = 0
    np.testing.assert_allclose(
        np.sort_complex(closed.poles()), np.sort_complex(np.roots([1, -0.5, 0, 0, 0.2])), rtol=1e-9
    )


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        ({"outputs": "z"}, "unknown signal 'z'"),
        ({"inputs": ["r", "q"]}, "unknown signal from outside 'q'"),
        ({"inputs": ()}, "the input 'r - y' must be made by a system, linked, one of `inputs` or of `references`"),
        ({"links": {"y": "r"}}, "unknown input of a system to link 'y'"),
        ({"openings": "w"}, "unknown point to open 'w'"),
        ({"inputs": "r", "outputs": "r"}, "different names; 'r' is both"),
    ],
)
def test_wiring_that_cannot_be_is_refused_by_name(arguments, sentence):
    P, K = tf([1.0], [1.0, 0.0], input="u", output="y"), tf([1.0], [1.0], input="r - y", output="u")
    with pytest.raises(InputError, match=sentence):
        connect([P, K], **{"inputs": "r", "outputs": "y", **arguments})


def test_two_makers_of_a_signal_two_sample_times_and_no_system_are_refused():
    P, Q = (tf([1.0], [1.0, a], input=u, output="y", sample_time=h) for a, u, h in ((0.1, "u", None), (0.2, "v", 0.1)))
    with pytest.raises(InputError, match="'y' appears twice"):
        connect([P, Q], inputs=["u", "v"], outputs="y")
    with pytest.raises(InputError, match=r"must be sampled alike; got model continuous, model 0\.1 s"):
        append([P, Q.renamed({"y": "z"})])
    with pytest.raises(InputError, match="at least one system"):
        connect([], inputs="u", outputs="y")


@pytest.mark.parametrize("unit", [1.0, 1e9, 1e-9])
def test_an_algebraic_loop_without_solution_is_refused_in_any_unit_and_large_gains_are_not(unit):
    def around(gain):
        return [tf([gain * unit], [1.0], input="r - y", output="u"), tf([1 / unit], [1.0], input="u", output="y")]

    with pytest.raises(IllPosedError, match="algebraic loop"):
        connect(around(-1.0), inputs="r", outputs="y")
    np.testing.assert_allclose(connect(around(1e8), inputs="r", outputs="y").plant.D, [[1 - 1e-8]], rtol=1e-12)
    with pytest.raises(IllPosedError, match="links must not lead round"):
        connect([tf([1.0], [1.0], input="a", output="b")], inputs="r", outputs="b", links={"a": "r + a"})


def test_select_keeps_dead_times_and_refuses_what_is_not_there():
    model = tf([[1.0, 2.0]], [[[1.0, 1.0], [1.0, 2.0]]], input=["a", "b"], output="y", dead_time=[[0.1, 0.5]])
    part = select(model, inputs=["b"])
    np.testing.assert_allclose(part.response([3.0])[0, 0, 0], 2 * np.exp(-1.5j) / (3j + 2), rtol=1e-12)
    with pytest.raises(InputError, match="unknown input 'c'"):
        model.select(inputs=["c"])
    with pytest.raises(InputError, match="unknown output 'y into its dead time'"):
        tf([1.0], [1.0, 1], input="u", output="y", dead_time=1.0).select(outputs=["y into its dead time"])


def test_zeros_and_poles_decades_apart_stay_where_they_are_given():
    poles = [0, 0, -1e-4, -1e-4, *second_order(1.0, 1e-3), -1e5, *second_order(3e3, 0.7)]
    zeros = [-1e-4, *second_order(2.0, 1e-4), -1e3]
    model = zpk(zeros, poles, 7.0, input="u", output="y", dead_time=1e-3)
    s = 1j * np.geomspace(1e-6, 1e6, 61) * 1.0123
    expected = 7.0 * np.prod([s - z for z in zeros], 0) / np.prod([s - p for p in poles], 0) * np.exp(-1e-3 * s)
    np.testing.assert_allclose(model.response(s.imag)[:, 0, 0], expected, rtol=1e-9)
    got = np.sort_complex(model.plant.poles())
    np.testing.assert_allclose(got, np.sort_complex(np.array(poles, complex)), rtol=1e-7, atol=1e-13)
    with pytest.raises(InputError, match="must come with their conjugates"):
        zpk([], [-1 + 2j, -1], 1.0)
    with pytest.raises(InputError, match="zeros must not be more than poles"):
        zpk([1.0], [], 1.0)


def test_poles_right_of_the_axis_are_located_as_they_are_counted():
    # y' = u(t − 1), u = −k y: the pair crosses the axis at k = π/2, the next one at 5π/2
    for k, count in ((1.5, 0), (1.6, 2), (7.8, 2), (7.9, 4)):
        loop = feedback(tf([k], [1.0, 0.0], dead_time=1.0), tf([1.0], [1.0]))
        poles = loop.poles()
        assert loop.unstable_poles() == count == np.sum(poles.real > 0)
        np.testing.assert_allclose(poles + k * np.exp(-poles), 0, atol=1e-9)
        assert loop.abscissa() == pytest.approx(poles.real.max(), rel=1e-6, abs=1e-9)


def test_python_control_goes_in_and_out_again():
    theirs = control.tf([1.0, 2.0], [1.0, 3.0, 5.0], inputs=["force"], outputs=["place"])
    model = tf(theirs, output="z", dead_time=0.5)
    s = 2j
    assert model.response(2.0)[0, 0, 0] == pytest.approx(theirs(s) * np.exp(-0.5 * s), rel=1e-12)
    assert (model.inputs, model.outputs) == (("force",), ("z",))
    with pytest.raises(InputError, match="a state space has no dead times"):
        model.to_control()
    back = ss(theirs).to_control()
    assert back(s) == pytest.approx(theirs(s), rel=1e-12)
    assert ss(tf([1.0], [1.0, -0.5], sample_time=0.2).to_control()).sample_time == 0.2


def test_the_algebra_gives_every_function_a_sentence():
    for name in ("connect", "append", "select", "open_at", "series", "parallel", "feedback", "lft"):
        assert getattr(algebra, name).__doc__


def test_twins_keep_states_and_dead_times_apart():
    P = tf([2.0], [1.0, 3.0], input="u", output="y", dead_time=0.1)
    omega = np.array([0.3, 1.0, 5.0])
    g = P.response(omega)[:, 0, 0]
    twice = series(P, P)
    np.testing.assert_allclose(twice.response(omega)[:, 0, 0], g**2, **AGREE)
    assert len(set(twice.plant.states)) == len(twice.lines) == 2
    four = feedback(parallel(twice, twice), P)
    np.testing.assert_allclose(four.response(omega)[:, 0, 0], 2 * g**2 / (1 + 2 * g**3), **AGREE)
    assert len(four.lines) == 5
