"""A problem written as a data file and read again is the same problem, number for number."""

import casadi as ca
import numpy as np
import pytest
from own_cases import LOOP, folder_with

from workbench.control.structure.block import Parameter
from workbench.control.structure.blocks import gain, low_pass_second, notch, pid_two_degrees
from workbench.control.structure.space import expression, state_space
from workbench.control.structure.structure import Structure
from workbench.design.problem import Problem
from workbench.errors import InputError
from workbench.files.problem import load_problem, shipped_problems, shipped_vehicles
from workbench.files.writing import problem_toml
from workbench.goals.kinds import DelayMargin, Gain, MaxLoopGain, Poles, Sensitivity, StepTracking, Variance
from workbench.lti.make import ss, tf

OWN = sorted(set(shipped_problems()) - set(shipped_vehicles()))


def same(one: Problem, other: Problem) -> None:
    """Whether two problems agree in everything but their names and where they came from."""
    for a, b in zip(one.systems, other.systems, strict=True):
        assert (a.name, a.inputs, a.outputs, a.sample_time, a.pade_order) == (
            b.name, b.inputs, b.outputs, b.sample_time, b.pade_order,
        )  # fmt: skip
        assert a.lines == b.lines
        assert a.plant.states == b.plant.states
        u, v = (m.plant.index("inputs", [*m.inputs, *(x.sink for x in m.lines)]) for m in (a, b))
        y, z = (m.plant.index("outputs", [*m.outputs, *(x.source for x in m.lines)]) for m in (a, b))
        assert np.array_equal(a.plant.A, b.plant.A)
        assert np.array_equal(a.plant.B[:, u], b.plant.B[:, v])
        assert np.array_equal(a.plant.C[y], b.plant.C[z])
        assert np.array_equal(a.plant.D[y][:, u], b.plant.D[z][:, v])
    assert one.structure.references == other.structure.references
    for a, b in zip(one.structure.blocks, other.structure.blocks, strict=True):
        for field in ("kind", "inputs", "outputs", "options", "parameters", "slots", "sample_time", "idle"):
            assert getattr(a, field) == getattr(b, field)
    assert [type(goal) for goal in one.goals] == [type(goal) for goal in other.goals]
    theta = one.structure.start * 1.1
    for first, second in zip(one.goals, other.goals, strict=True):
        assert first.stated().keys() == second.stated().keys()
        for a, b in zip(one.loops, other.loops, strict=True):
            if first.holds_for(a.name):
                values = [g.bind(loop).evaluate(p.structure.controller(theta)).value
                          for g, loop, p in ((first, a, one), (second, b, other))]  # fmt: skip
                assert values[0] == values[1]
    assert one.sample_time == other.sample_time


@pytest.mark.parametrize("name", OWN)
def test_a_shipped_plant_survives(name, tmp_path):
    problem = load_problem(name)
    again = load_problem(folder_with(tmp_path, problem_toml(problem)))
    same(problem, again)
    assert problem_toml(again) == problem_toml(problem)


def drawn(seed: int) -> Problem:
    """A problem with dead times at every place, shared, held and masked parameters, names that need quotes."""
    rng = np.random.default_rng(seed)
    sampled = seed % 2 == 1
    step = 0.1 if sampled else None
    A = rng.normal(size=(3, 3)) / 4 - (0 if sampled else 3) * np.eye(3)
    plant = ss(A, rng.normal(size=(3, 2)), rng.normal(size=(2, 3)), inputs=["valve \"1\"", "w"],
               outputs=["level é", "y\\2"], input_delay={"w": 0.3}, sample_time=step, name="first")  # fmt: skip
    other = tf([[[1.0], [2.0]], [[0.5], [rng.normal()]]], [[[1.0, 0.5], [1.0, 0.2]], [[1.0, 0.3], [1.0, 0.4]]],
               dead_time=[[0.2, 0.5], [0.1, 0.7]], input=plant.inputs, output=plant.outputs, name="second",
               sample_time=step, pade_order=3)  # fmt: skip
    blocks = [
        gain(["level é", "y\\2"], "e", [[0.1, 0.3]], mask=[[1, 1]], fixed=[[0, 1]], name="mix"),
        pid_two_degrees("r", "e", "v", Kp=0.01, Ki=Parameter("reset", 0.01, 0, 1), parts="PI", name="c"),
        notch("v", "f", omega=2.0, name="n"),
        state_space("f", "g", 2, name="k"),
        low_pass_second("v", "h", omega=Parameter("n.omega", 2.0, 2e-3, 2e3, unit="rad/s")),
        gain(["g", "h"], 'valve "1"', [[0.1, 0.02]], low=-1, high=rng.uniform(1, 2)),
    ]
    structure = Structure(tuple(b.sampled(0.1) if sampled else b for b in blocks), ("r",))
    goals = (
        Sensitivity(points="level é", limit={0.1: 0.5, 2.0: 1.9}, hard=True, name='the "first"'),
        Poles(decay=0.01, damping=0.1, frequency=400.0, focus=(0.0, 50.0)),
        MaxLoopGain(points="level é", profile=([1.0], [1.0, 0.3]), models="first"),
        Gain(inputs="w", outputs=("y\\2", "level é"), limit=3.0, openings="y\\2"),
        Variance(inputs="w", outputs="y\\2", limit=2.0),
        DelayMargin(points="level é", delay=0.05),
        StepTracking(inputs="r", outputs="level é", time_constant=1.3, overshoot_percent=5.0),
    )
    return Problem(models=(plant, other), structure=structure, goals=goals, title='A "title" with \\ and é',
                   sample_time=step)  # fmt: skip


@pytest.mark.parametrize("seed", range(4))
def test_a_problem_made_in_a_program_survives(seed, tmp_path):
    problem = drawn(seed)
    same(problem, load_problem(folder_with(tmp_path, problem_toml(problem))))


def test_what_no_file_can_state_is_refused(tmp_path):
    problem = load_problem(folder_with(tmp_path, LOOP))
    a = ca.SX.sym("a")
    block = expression("r - y", "u", [(Parameter("a", 0.1), a)], D=a)
    with pytest.raises(InputError, match="lives in the program"):
        problem_toml(Problem(models=problem.systems, structure=block, goals=problem.goals))
    with pytest.raises(InputError, match="copy its folder"):
        problem_toml(load_problem("heave"))
    drawn_goal = Gain(inputs="r", outputs="y", limit=ss([[-1.0]], [[1.0]], [[1.0]]).plant)
    with pytest.raises(InputError, match="limit of goal"):
        problem_toml(Problem(models=problem.systems, structure=problem.structure, goals=[drawn_goal]))
