"""A Plant keeps names and matrices together, and meets python-control in both directions."""

import control
import numpy as np
import pytest

from workbench.errors import InputError
from workbench.lti import Plant

OSCILLATOR = {
    "A": [[0.0, 1.0], [-4.0, -0.4]],
    "B": [[0.0], [1.0]],
    "C": [[1.0, 0.0], [-4.0, -0.4]],
    "D": [[0.0], [1.0]],
}


def test_a_plant_survives_the_way_to_python_control_and_back():
    plant = Plant(**OSCILLATOR, states=("x", "v"), inputs=("force",), outputs=("place", "acceleration"))
    back = Plant.from_control(plant.to_control())
    assert (back.states, back.inputs, back.outputs) == (plant.states, plant.inputs, plant.outputs)
    for name in "ABCD":
        np.testing.assert_array_equal(getattr(back, name), getattr(plant, name))


def test_its_frequency_response_is_that_of_python_control():
    plant = Plant.from_matrices(**OSCILLATOR)
    omega = np.geomspace(0.1, 100, 50)
    theirs = np.moveaxis(plant.to_control()(1j * omega), -1, 0)
    np.testing.assert_allclose(plant.response(omega), theirs, rtol=1e-12)


def test_a_transfer_function_becomes_a_plant_with_its_poles():
    plant = Plant.from_control(control.tf([1.0], [1.0, 0.4, 4.0]))
    np.testing.assert_allclose(np.sort_complex(plant.poles()), np.sort_complex(np.roots([1.0, 0.4, 4.0])), rtol=1e-12)


def test_a_selection_sees_the_same_states_through_fewer_signals():
    plant = Plant.from_matrices(**OSCILLATOR)
    seen = plant.select(outputs=["y2"])
    np.testing.assert_array_equal(seen.C, [[-4.0, -0.4]])
    assert seen.states == plant.states


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"A": [[0.0, 1.0]]}, r"matrix A must have shape \(2, 2\)"),
        ({"B": [[0.0], [np.nan]]}, "matrix B must be two-dimensional and finite"),
        ({"C": [[1.0, 0.0], [1.0]]}, "matrix C must hold real numbers in rows of equal length"),
        ({"outputs": ("y", "y")}, "outputs must have distinct names"),
    ],
)
def test_what_does_not_fit_together_is_refused(changed, sentence):
    fields = {**OSCILLATOR, "states": ("x", "v"), "inputs": ("force",), "outputs": ("place", "acceleration"), **changed}
    with pytest.raises(InputError, match=sentence):
        Plant(**fields)


def test_a_signal_that_is_not_there_is_refused_with_the_nearest_one():
    plant = Plant(**OSCILLATOR, states=("x", "v"), inputs=("force",), outputs=("place", "acceleration"))
    with pytest.raises(InputError, match="unknown output 'acelleration'; did you mean 'acceleration'"):
        plant.select(outputs=["acelleration"])


def test_a_sampled_system_is_refused():
    with pytest.raises(InputError, match="must be in continuous time"):
        Plant.from_control(control.ss([[0.5]], [[1.0]], [[1.0]], [[0.0]], 0.01))


def test_a_response_at_infinity_is_the_direct_gain_and_a_pole_on_the_axis_is_refused_with_its_frequency():
    swing = Plant.from_matrices([[0.0, 1.0], [-4.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[5.0]])
    assert swing.response([np.inf, 0.0])[:, 0, 0].tolist() == [5.0, 5.25]
    with pytest.raises(InputError, match=r"poles on the imaginary axis; got 2\.0 rad"):
        swing.response([1.0, 2.0])
