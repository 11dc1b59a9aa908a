from functools import cache

import numpy as np
import pytest

from workbench.control.discrete import discretise
from workbench.control.loop.closed import close
from workbench.control.structure.loop import Loop
from workbench.control.structure.space import modal_law
from workbench.control.structure.structure import Structure
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.lti.model import Model

OMEGA = np.array([0.05, 1.0, 9.0, 80.0])


@cache
def vehicle():
    problem = load_problem("comfort_limit")
    assert problem.approved is not None
    return problem, problem.setting.plant, problem.law, problem.approved


def tuned_loop():
    problem, plant, law, gains = vehicle()
    return Loop(Model("revenue vehicle", plant), Structure(modal_law(law, gains, problem.bounds)))


def test_the_modal_law_closes_the_loop_of_the_comfort_limit():
    _, plant, law, gains = vehicle()
    loop, closed = tuned_loop(), close(plant, law, gains).system
    K = loop.structure.controller()
    inputs = ["zeta_1", "eta_3", "force_y", "command_2", "gap_1", "acceleration_y_4"]
    outputs = ["Y_acceleration", "before gap_1", "command_1", "command_4", "Phi"]
    theirs = closed.select(
        inputs=["zeta_1", "eta_3", "force_y", "error_command_2", "error_gap_1", "error_acceleration_y_4"],
        outputs=["Y_acceleration", "gap_1", "command_1", "command_4", "Phi"],
    ).response(OMEGA)
    size = np.abs(theirs).max(axis=(0, 1))[None, None]
    ours = loop.channel(inputs, outputs).response(K, OMEGA)
    # the same loop assembled twice from numbers up to 1e3 against results of order one
    assert np.max(np.abs(ours - theirs) / size) < 1e-11
    np.testing.assert_allclose(
        np.sort_complex(loop.poles(K)), np.sort_complex(closed.poles()), atol=1e-7
    )  # double poles


@pytest.mark.parametrize("name", ["hybrid_motor", "coil_vehicle"])
def test_the_modal_law_closes_the_loops_of_other_vehicles(name):
    problem = load_problem(name)
    plant, law, gains = problem.setting.plant, problem.law, problem.approved
    assert gains is not None
    loop = Loop(Model(name, plant), Structure(modal_law(law, gains, problem.bounds)))
    poles, theirs = loop.poles(loop.structure.controller()), close(plant, law, gains).system.poles()
    np.testing.assert_allclose(
        np.sort_complex(poles), np.sort_complex(theirs), atol=1e-7
    )  # double poles: root of 1e-16


def test_the_free_gains_are_the_problems():
    problem, *_ = vehicle()
    structure = tuned_loop().structure
    assert structure.names == problem.free
    assert structure.values()["K_heave"] == 1.0


def test_the_pullback_of_the_modal_law_is_its_derivative():
    loop = tuned_loop()
    structure, channel = loop.structure, loop.sensitivity(loop.structure.outputs)
    theta = structure.start
    T = channel.response(structure.controller(theta), [7.0])
    left, sizes, right = np.linalg.svd(T[0])
    W = np.outer(left[:, 0], right[0])[None]
    ours = structure.pullback(theta, channel.response_pullback(structure.controller(theta), [7.0], W))

    def largest(at):
        return np.linalg.svd(channel.response(structure.controller(at), [7.0])[0], compute_uv=False)[0]

    assert sizes[0] > 1.001 * sizes[1]  # simple, hence smooth
    steps = 1e-6 * np.maximum(np.abs(theta), 1e-2)
    differences = [
        (largest(theta + h * e) - largest(theta - h * e)) / (2 * h)
        for h, e in zip(steps, np.eye(len(theta)), strict=True)
    ]
    # rounding of σ, 1e-15 × condition 1e3, over a step of 1e-8 or more
    np.testing.assert_allclose(ours, differences, rtol=1e-5, atol=1e-5 * np.abs(ours).max())


def test_a_filter_whose_gain_is_frozen_at_zero_is_dropped_as_the_law_drops_it():
    _, _, law, gains = vehicle()
    without = gains.with_values(K_hpdot=0.0)
    structure = Structure(modal_law(law, gains)).freeze("K_hpdot", 0.0)
    assert structure.order == len(law.kept_filters(without)) == 8
    ours, theirs = (
        structure.controller().stacked(),
        np.block([list(law.numeric(without)[:2]), list(law.numeric(without)[2:])]),
    )
    np.testing.assert_allclose(ours, theirs, rtol=1e-12, atol=1e-14)  # the same formulas


def test_the_sampled_law_is_the_discrete_law_of_the_export():
    _, _, law, gains = vehicle()
    h = 1e-3
    structure = Structure(modal_law(law, gains)).sampled(h)
    omega = np.array([0.5, 20.0, 900.0])
    A, B, C, D = discretise(law, gains, h).state_space()
    theirs = [C @ np.linalg.solve(np.exp(1j * w * h) * np.eye(len(A)) - A, B) + D for w in omega]
    # poles within 1e-3 of 1 lose three of sixteen digits
    np.testing.assert_allclose(structure.controller().response(omega, h), theirs, rtol=1e-10, atol=1e-10)


def test_a_law_without_a_filter_time_or_with_an_unknown_gain_is_refused():
    _, _, law, gains = vehicle()
    with pytest.raises(InputError, match="tau_h must be positive in a tuned law; got 0"):
        modal_law(law, gains.with_values(tau_h=0.0))
    with pytest.raises(InputError, match="unknown gain 'K_hh'; did you mean 'K_h'"):
        modal_law(law, gains, {"K_hh": (0, 1)})
