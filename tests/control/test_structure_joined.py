import pickle

import numpy as np
import pytest

from workbench.control.structure.block import Controller, Parameter
from workbench.control.structure.blocks import gain, low_pass, pid
from workbench.control.structure.space import state_space
from workbench.control.structure.structure import Structure
from workbench.errors import InputError

OMEGA = np.array([0.3, 2.0, 11.0])


def structure():
    return Structure(
        (
            pid("r - y1", "u1", Kp=2, Ki=3, Kd=0.4, Tf=0.05, name="front"),
            pid("r - y2", "u2", Kp=2, Ki=3, Kd=0.4, Tf=0.05, name="rear").renamed({"rear.Kp": "front.Kp"}),
            state_space(["y1", "r - y1"], "u2", 2, name="cross"),
        ),
        references="r",
    )


def test_joined_blocks_act_each_on_its_own_signals_and_add_up():
    joined = structure()
    assert joined.inputs == ("r - y1", "r - y2", "y1")
    assert joined.outputs == ("u1", "u2")
    theta = joined.start + 0.1 * np.arange(len(joined.names))
    values = joined.values(theta)
    front, rear, cross = (
        block.matrices([values[p.name] for p in block.parameters]).response(OMEGA) for block in joined.blocks
    )
    whole = joined.controller(theta).response(OMEGA)
    expected = np.zeros_like(whole)
    expected[:, 0, 0] = front[:, 0, 0]
    expected[:, 1, 1] = rear[:, 0, 0]
    expected[:, 1, [2, 0]] = cross[:, 0, :]
    np.testing.assert_allclose(whole, expected, rtol=1e-12, atol=1e-12)  # the same few operations in another order


def test_blocks_between_the_same_signals_add_up():
    both = Structure((gain("y", "u", 2.0, name="one"), gain("y", "u", 3.0, name="other")))
    assert both.controller().D == 5
    np.testing.assert_array_equal(both.pullback(both.start, Controller.static([[7.0]])), [7, 7])


def test_the_pullback_of_a_structure_sums_over_what_shares_a_parameter():
    joined, rng = structure(), np.random.default_rng(0)
    theta = joined.start + 0.1 * rng.normal(size=len(joined.names)) * np.maximum(np.abs(joined.start), 0.1)
    G = Controller.from_stacked(rng.normal(size=joined.controller().stacked().shape), joined.order)
    steps = 1e-6 * np.eye(len(theta)) * np.maximum(np.abs(theta), 0.01)
    differences = [
        (G.inner(joined.controller(theta + h)) - G.inner(joined.controller(theta - h))) / (2 * h.sum()) for h in steps
    ]
    # central differences: h² ‖K'''‖ and rounding / h, both below 1e-8 of the largest
    np.testing.assert_allclose(joined.pullback(theta, G), differences, rtol=1e-6, atol=1e-7 * np.abs(differences).max())
    by_block = dict.fromkeys(joined.names, 0.0)
    values = joined.values(theta)
    for block, rows, columns, states in zip(
        joined.blocks, ([0], [1], [1]), ([0], [1], [2, 0]), ([0, 1], [2, 3], [4, 5]), strict=True
    ):
        part = Controller(
            G.A[np.ix_(states, states)],
            G.B[np.ix_(states, columns)],
            G.C[np.ix_(rows, states)],
            G.D[np.ix_(rows, columns)],
        )
        gradient = block.pullback([values[p.name] for p in block.parameters], part)
        for parameter, slope in zip(block.parameters, gradient, strict=True):
            by_block[parameter.name] += slope
    np.testing.assert_allclose(joined.pullback(theta, G), list(by_block.values()), rtol=1e-12)  # the same formulas


def test_a_shared_parameter_is_one_parameter():
    joined = structure()
    assert joined.names.count("front.Kp") == 1
    assert "rear.Kp" not in joined.names
    theta = joined.start
    theta[joined.names.index("front.Kp")] = 7.0
    moved = joined.controller(theta).D - joined.controller().D
    np.testing.assert_allclose(moved, [[5, 0, 0], [0, 5, 0]], atol=1e-12)  # Kp alone reaches D by 7 − 2


def test_freezing_takes_a_parameter_from_theta_and_freeing_gives_it_back():
    joined = structure()
    frozen = joined.freeze("rear.Ki", 9.0)
    assert set(joined.names) - set(frozen.names) == {"rear.Ki"}
    assert frozen.values()["rear.Ki"] == 9.0
    assert frozen.order == joined.order
    assert frozen.free("rear.Ki", 3.0).names == joined.names
    np.testing.assert_array_equal(frozen.free("rear.Ki", 3.0).controller().C, joined.controller().C)


def test_a_state_that_nothing_sees_is_left_out_with_the_parameters_that_lost_their_meaning():
    frozen = structure().freeze("rear.Ki", 0.0).freeze("front.Kd", 0.0)
    assert frozen.order == structure().order - 2
    assert "front.Tf" not in frozen.names  # the derivative's filter
    whole = structure().with_values({"rear.Ki": 0.0, "front.Kd": 0.0})
    np.testing.assert_allclose(frozen.controller().response(OMEGA), whole.controller().response(OMEGA), rtol=1e-12)


def test_bounds_and_starts_are_set_by_name():
    joined = structure().with_bounds("front.Kp", 0.0, 1.5).with_values({"front.Kd": 0.1})
    at = joined.names.index("front.Kp")
    assert tuple(joined.bounds[at]) == (0.0, 1.5)
    assert joined.start[at] == 1.5  # moved to the nearer bound
    assert joined.values()["front.Kd"] == 0.1


def test_parts_of_a_pid_left_out_are_frozen_at_zero():
    assert Structure(pid("y", "u", parts="P")).names == ("Kp",)
    assert Structure(pid("y", "u", parts="PI")).order == 1


def test_a_structure_without_free_parameters_is_a_constant():
    fixed = Structure(gain("y", "u", Parameter("K", 3, free=False)))
    assert fixed.start.shape == (0,)
    assert fixed.bounds.shape == (0, 2)
    assert fixed.controller().D == 3
    assert fixed.pullback(fixed.start, Controller.static([[1.0]])).shape == (0,)


def test_a_structure_survives_the_way_to_another_process():
    joined = structure().freeze("rear.Ki", 0.0)
    again = pickle.loads(pickle.dumps(joined))
    np.testing.assert_array_equal(again.controller().stacked(), joined.controller().stacked())


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (
            lambda: Structure((gain("y", "u", low=0, name="K"), gain("z", "u", low=-1, name="K"))),
            r"parameter 'K' must be declared alike .*; got low \[0.0\] and \[-1.0\]",
        ),
        (
            lambda: Structure((low_pass("y", "u", name="a"), low_pass("y", "v", name="b").sampled(0.1))),
            "must be sampled alike",
        ),
        (lambda: Structure(()), "at least one block"),
        (lambda: structure().freeze("rear.Kii"), "unknown parameter 'rear.Kii'; did you mean 'rear.Ki'"),
        (lambda: structure().with_values({"front.Tf": -1}), "parameter 'front.Tf' must start within its bounds"),
        (lambda: structure().controller([1.0]), "theta must hold the 17 free parameters of the structure; got 1"),
        (lambda: Structure(gain("r - r", "u")), "must name each signal once; got 'r - r'"),
    ],
)
def test_a_structure_that_cannot_be_is_refused_in_a_sentence(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()


def test_controllers_asked_for_by_several_threads_at_once_are_each_ones_own():
    import sys
    import threading

    joined = Structure((pid("r - y1", "u1", Kp=1, Ki=1, Kd=0.1),), "r")
    wrong = []

    def ask(seed):
        rng = np.random.default_rng(seed)
        for _ in range(1500):
            theta = np.r_[rng.normal(size=3), 0.05]
            if joined.controller(theta).C[0, 0] != theta[1]:
                wrong.append(theta)

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)  # a switch between any two steps: with one buffer for all, dozens are wrong
    try:
        threads = [threading.Thread(target=ask, args=(seed,)) for seed in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert not wrong
