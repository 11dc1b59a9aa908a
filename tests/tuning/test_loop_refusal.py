import numpy as np
import pytest

from workbench.errors import InputError
from workbench.lti import Plant
from workbench.tuning import Controller, DelayLine, Loop, Model, Structure
from workbench.tuning.blocks import gain, low_pass, pid


def plant(A=((-1.0, 0.0), (1.0, 0.0)), B=((1.0,), (0.0,)), C=((0.0, 1.0),), D=None):
    return Plant.from_matrices(A, B, C, D)


def loop(model=None, structure=None):
    return Loop(model or Model("lag", plant()), structure or Structure(gain("r - y1", "u1", 1.0), "r"))


def test_a_mode_that_no_input_moves_is_named_by_its_eigenvalue():
    A = [[-1.0, 0, 0], [1, 0, 0], [0, 0, 0.25]]
    with pytest.raises(InputError, match=r"must be moved .* eigenvalue 0.25 that its signals do not reach"):
        loop(Model("lag", plant(A, [[1], [0], [0]], [[0, 1, 1]])))


def test_a_mode_that_no_measurement_shows_is_named_by_its_eigenvalue():
    A = [[-1.0, 0, 0, 0], [1, 0, 0, 0], [0, 0, 0.1, 2], [0, 0, -2, 0.1]]
    with pytest.raises(InputError, match=r"must be seen .* eigenvalue 0.1 ± 2j that its signals do not see"):
        loop(Model("lag", plant(A, [[1], [0], [0], [1]], [[0, 1, 0, 0]])))


def test_a_stable_mode_may_stay_unmoved_and_unseen():
    assert (
        len(loop(Model("lag", plant([[-1.0, 0, 0], [1, 0, 0], [0, 0, -0.25]], [[1], [0], [0]], [[0, 1, 0]]))).points)
        == 3
    )


def test_an_integrator_counts_as_unstable():
    with pytest.raises(InputError, match="eigenvalue 0 that its signals do not reach"):
        loop(Model("lag", plant([[-1.0, 0], [0, 0]], [[1], [0]], [[1, 1]])))


def test_inputs_and_measurements_of_unlike_units_move_and_see_alike():
    structure = Structure((gain("-y1", "u1", 1.0, name="k1"), gain("-y2", "u2", 1.0, name="k2")))
    model = Model("unlike", plant([[0.5, 0], [0, 0.5]], np.diag([1e-12, 1e3]), np.diag([1e3, 1e-12])))
    assert Loop(model, structure).name == "unlike"


def test_a_mode_that_is_hardly_moved_by_any_feedback_is_not_taken_for_a_fixed_one():
    structure = Structure((gain("-y1", "u1", 1.0, name="k1"), gain("-y2", "u2", 1.0, name="k2")))
    weak = np.array([[1e-5, 1e-5], [1, 0], [0, 1]])
    assert Loop(Model("weak", plant(np.diag([0.2, -1, -2]), weak, weak.T)), structure).name == "weak"


def test_a_sampled_mode_on_the_unit_circle_counts_as_unstable():
    with pytest.raises(InputError, match="eigenvalue -1 that its signals do not reach"):
        loop(Model("lag", plant([[0.5, 0], [0, -1.0]], [[1], [0]], [[1, 1]]), sample_time=0.1))


def decentralised(coupling):
    """u1 → unstable mode → y2, and y1 sees it through a coupling; u2 drives what nobody sees."""
    return Model("crossed", plant([[0.2, 0], [0, -1]], np.eye(2), [[coupling, 0], [1, 0]]))


def test_a_mode_that_the_structures_zeros_leave_fixed_is_named():
    own = Structure((gain("-y1", "u1", 0.0, name="k1"), gain("-y2", "u2", 0.0, name="k2")))
    with pytest.raises(InputError, match=r"eigenvalue 0\.2 that no controller with this structure's zeros moves"):
        Loop(decentralised(0.0), own)
    crossed = Structure((gain("-y1", "u2", 0.0, name="k1"), gain("-y2", "u1", 0.0, name="k2")))
    assert Loop(decentralised(0.0), crossed).name == "crossed"
    assert Loop(decentralised(1e-5), own).name == "crossed"  # weakly, but moved


def test_the_test_of_modes_does_not_depend_on_units():
    units = np.diag([1e-6, 1.0, 1e5])
    A = units @ np.array([[0.0, 1, 0], [2, 0, 1], [0, 3, 0]]) @ np.linalg.inv(units)
    assert (
        loop(Model("scaled", plant(A, units @ [[0], [0], [1e-4]], [[1e-3, 0, 0]] @ np.linalg.inv(units)))).name
        == "scaled"
    )


def test_an_algebraic_loop_without_solution_is_refused_at_the_start_and_later():
    model = Model("direct", plant(D=[[2.0]]))
    structure = Structure(gain("-y1", "u1", 1.0))  # u = −(2 u + …): fine; at −0.5, u = u + …
    channel = Loop(model, structure).sensitivity("u1")
    with pytest.raises(InputError, match="closes an algebraic loop without solution"):
        channel.system(structure.controller([-0.5]))
    with pytest.raises(InputError, match="closes an algebraic loop without solution"):
        Loop(model, structure.with_values({"K": -0.5}))


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: loop(structure=Structure(gain("r - y11", "u1"), "r")), "unknown signal 'y11'; did you mean 'y1'"),
        (lambda: loop(structure=Structure(gain("y1 - ref", "u1"))), "reference must be named in Structure"),
        (lambda: loop(structure=Structure(gain("r-y1", "u1"), "r")), "signs of a sum stand between spaces"),
        (lambda: loop(structure=Structure(gain("before y1", "u1"))), "unknown signal 'before y1'; Known: u1, y1"),
        (lambda: loop(structure=Structure(gain("y1", "u2"))), "unknown model input .* 'u2'; did you mean 'u1'"),
        (
            lambda: loop(structure=Structure(gain("y1", "u1"), "r")),
            "every reference must be read by a block; 'r' is not",
        ),
        (lambda: loop(structure=Structure(gain("y1", "u1"), "u1")), "must have one origin; 'u1' has two"),
        (lambda: loop().channel("q", "y1"), "unknown point 'q'"),
        (lambda: loop().channel("u1", "before yy1"), "unknown signal 'yy1'; did you mean 'y1'"),
        (lambda: loop().channel(["u1", "u1"], "y1"), "must be distinct points"),
        (lambda: loop().sensitivity("r"), "unknown analysis point 'r'"),
        (lambda: loop().sensitivity("u1", openings="u1"), "must be closed; 'u1' is among the openings"),
        (lambda: loop().loop_gain(()), "name at least one analysis point; there are u1, y1"),
        (
            lambda: loop().channel("u1", "y1").system(Controller.static(np.eye(2))),
            "must have 1 inputs and 1 outputs; got 2 and 2",
        ),
        (
            lambda: loop(structure=Structure(low_pass("y1", "u1").sampled(0.1))),
            "sampled alike; got continuous and 0.1 s",
        ),
        (
            lambda: loop(Model("lag", plant(), sample_time=0.1), Structure(pid("y1", "u1", Ki=1))),
            "sampled alike; got 0.1 s and continuous",
        ),
        (lambda: Model("lag", plant(), {"u2": 1.0}), "unknown input 'u2'; did you mean 'u1'"),
        (lambda: Model("lag", plant(), {"u1": -1.0}), "dead time of 'u1' must not be negative"),
        (lambda: Model("lag", plant(), {"u1": 0.25}, sample_time=0.1), "whole sample times of 0.1 s; got 0.25 s"),
        (lambda: Model("lag", plant(), lines=(DelayLine("y2", "u1", 1.0),)), "unknown output 'y2'"),
        (lambda: Model("lag", plant(), pade_order=0), "pade_order must be a whole number from 1 to 12"),
        (lambda: Model("lag", plant(), sample_time=0.0), "sample time must be positive"),
        (
            lambda: Model(
                "twice", Plant(A=[[0]], B=[[1]], C=[[1]], D=[[0]], states=("x",), inputs=("a",), outputs=("a",))
            ),
            "inputs and outputs of a model must have different names; 'a' is both",
        ),
    ],
)
def test_a_loop_that_cannot_be_is_refused_in_a_sentence(make, sentence):
    with pytest.raises(InputError, match=sentence):
        make()
