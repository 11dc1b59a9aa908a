"""The tuner on loops whose best parameters are known, and what it says where there are none."""

import math
import pickle

import numpy as np
import pytest

from workbench.control.structure.block import Parameter
from workbench.control.structure.blocks import gain, pid
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.design.tuner.constrained import Descent
from workbench.design.tuner.robust import tune_robust
from workbench.design.tuner.stabilise import Abscissa, stabilise
from workbench.design.tuner.tune import _Judged, tune
from workbench.errors import InfeasibleError, InputError
from workbench.goals.gain import Gain
from workbench.goals.loop_shape import Sensitivity
from workbench.goals.poles import Poles
from workbench.lti import Plant
from workbench.lti.model import Model


def mass(m=1.0, c=0.0, k=0.0, name="mass"):
    """m x'' + c x' + k x = u + f, with position and speed measured."""
    A, B = [[0, 1], [-k / m, -c / m]], [[0, 0], [1 / m, 1 / m]]
    plant = Plant(
        A=A, B=B, C=[[1, 0], [0, 1]], D=np.zeros((2, 2)), states=("x", "v"), inputs=("u", "f"), outputs=("pos", "speed")
    )
    return Model(name, plant)


def state_feedback(kp=-1.0, kd=-1.0, low=-20.0):
    return Structure(gain(("pos", "speed"), "u", [[kp, kd]], low=low, high=20.0))


def lag(pole=1.0, name="lag"):
    """1/(s − pole), unstable for a positive pole, disturbed at its input."""
    plant = Plant(A=[[pole]], B=[[1.0, 1.0]], C=[[1.0]], D=[[0, 0]], states=("x",), inputs=("u", "w"), outputs=("y",))
    return Model(name, plant)


def proportional(start=0.0, low=-100.0):
    return Structure(gain("y", "u", Parameter("k", start, low, 100.0)))


def test_a_soft_goal_goes_to_the_bound_where_no_hard_goal_binds():
    # y = w/(s − 1 − k): from w to y 1/(−1 − k), from w to u |k|/(−1 − k)
    goals = [
        Gain(name="effect", inputs=("w",), outputs=("y",)),
        Gain(name="effort", inputs=("w",), outputs=("u",), limit=2.0, hard=True),
    ]
    found = tune(lag(), proportional(), goals, starts=2, budget_seconds=10)
    # |k|/(−1 − k) <= 2 holds for every k <= −2, so the effort does not bind and k goes to its bound
    assert found.values["k"] == pytest.approx(-100, rel=1e-3)
    assert found.goal("effect").value == pytest.approx(1 / 99, rel=1e-3)
    assert found.met


def test_a_binding_hard_goal_is_met_exactly_and_the_soft_one_is_at_its_constrained_minimum():
    # the pole 1 + k must not be faster than 10, so k >= −11, and the gain 1/(−1 − k) is then 1/10 at best
    goals = [
        Gain(name="effect", inputs=("w",), outputs=("y",)),
        Poles(name="speed", frequency=10.0, hard=True),
    ]
    found = tune(lag(), proportional(), goals, starts=2, budget_seconds=10)
    assert found.hard is not None
    assert found.hard < 1
    # the target of the hard goal is 0.999, and alternation ends within 0.2 % of it
    assert found.values["k"] == pytest.approx(-11, rel=5e-3)
    assert found.goal("effect").value == pytest.approx(1 / 10, rel=5e-3)
    assert found.goal("speed").model == "lag"


def test_a_pid_meets_hard_goals_that_its_start_violates():
    plant = Plant(
        A=[[0, 1], [-1, -0.2]], B=[[0], [1]], C=[[1, 0]], D=[[0]], states=("x", "v"), inputs=("u",), outputs=("y",)
    )
    structure = Structure(pid("r - y", "u", Kp=0.1, Ki=0.0, Kd=0.0, Tf=0.02, parts="PD"), references="r")
    goals = [Sensitivity(points=("u",), limit=1.4, hard=True), Poles(decay=1.0, hard=True)]
    found = tune(Model("oscillator", plant), structure, goals, starts=2, budget_seconds=10)
    assert found.met
    assert found.abscissa < -1
    loop = Loop(Model("oscillator", plant), structure)
    assert loop.poles(found.controller).real.max() == pytest.approx(found.abscissa, abs=1e-9)  # same matrices


def test_one_structure_serves_several_models_at_their_worst():
    models = [lag(1.0, "slow"), lag(3.0, "fast")]
    goals = [
        Gain(name="effect", inputs=("w",), outputs=("y",)),
        Poles(name="speed", frequency=10.0, hard=True, models=("slow",)),
    ]
    found = tune(models, proportional(), goals, starts=2, budget_seconds=10)
    # k = −11 as for 'slow' alone; on 'fast' the effect is 1/(−3 + 11)
    assert found.goal("effect").model == "fast"
    assert found.goal("effect").value == pytest.approx(1 / 8, rel=1e-2)
    assert found.goal("speed").model == "slow"


def test_a_hard_goal_out_of_reach_is_refused_by_name_with_value_model_and_frequency():
    goals = [Gain(name="effect", inputs=("w",), outputs=("y",), limit=0.001, hard=True)]
    # at k = −100 the effect is 1/99 = 0.0101 at frequency 0
    with pytest.raises(
        InfeasibleError, match=r"'effect' must be at most 0\.001; the best value reached is 0\.0101.*model lag, 0 rad/s"
    ):
        tune(lag(), proportional(), goals, starts=2, budget_seconds=5)


def test_a_hard_goal_with_a_least_value_is_refused_in_its_own_unit():
    goals = [Poles(name="speed", decay=300.0, hard=True)]
    said = r"'speed' must be at least 300 1/s; the best value reached is 99 1/s"  # k = −100: the pole 1 − 100
    with pytest.raises(InfeasibleError, match=said):
        tune(lag(), proportional(), goals, starts=2, budget_seconds=5)


def test_an_end_that_no_bracket_decides_comes_before_one_that_misses_and_after_one_that_holds():
    # a slow pole by the axis left the bracket of a peak of 1.07 open; the bad start was taken for the best end instead
    descent = Descent(np.zeros(1), 1.0, 0.5, None)
    holds = _Judged(descent, [], missed=0.0, excess=0.0, soft=9.0)
    undecided = _Judged(descent, [], missed=0.0, excess=np.inf, soft=2.0)
    misses = _Judged(descent, [], missed=3.0, excess=3.0, soft=1.0)
    assert holds.rank < undecided.rank < misses.rank


def test_a_loop_that_cannot_be_stabilised_is_refused_with_the_eigenvalue_that_remains():
    with pytest.raises(InfeasibleError, match=r"leaves the eigenvalue 1 of 'lag'"):
        tune(lag(2.0), proportional(-0.5, low=-1.0), [Gain(inputs=("w",), outputs=("y",))], starts=2, budget_seconds=3)


def test_the_abscissa_s_gradient_is_its_difference_continuous_and_sampled():
    discrete = Model(
        "sampled", Plant.from_matrices([[0.9, 0.1], [0.0, 1.02]], [[0.0], [0.1]], np.eye(2)), sample_time=0.1
    )
    sampled = Structure(gain(("y1", "y2"), "u1", [[-0.3, -0.7]]))
    for model, structure in ((mass(), state_feedback(-3.0, -1.0)), (discrete, sampled)):
        measure = Abscissa([Loop(model, structure)], structure)
        theta, h = structure.start, 1e-6
        top = max(measure(theta), key=lambda piece: piece[0])
        assert top[0] == pytest.approx(measure.value(theta), abs=1e-12)  # the same eigenvalues
        for i, unit in enumerate(np.eye(2)):
            slope = (measure.value(theta + h * unit) - measure.value(theta - h * unit)) / (2 * h)
            assert top[1][i] == pytest.approx(slope, rel=1e-5, abs=1e-7)  # h² and 1e-16/h


def test_a_stabilising_start_has_the_margin_asked_for():
    structure = state_feedback(1.0, 1.0)
    loop = Loop(mass(), structure)
    assert loop.poles(structure.controller()).real.max() > 0
    found = stabilise([loop], structure, margin=0.5)
    assert loop.poles(structure.controller(found.theta)).real.max() < -0.5
    with pytest.raises(InfeasibleError, match="the best of 2 starts"):
        stabilise([loop], structure, margin=50.0, starts=2, budget_seconds=2)  # kd >= −20 leaves a decay of 10


@pytest.mark.parametrize(("min_decay", "wanted"), [(None, 1e-7 * 50), (1e-3, 1e-3)])
def test_an_integrator_the_goal_does_not_want_keeps_the_least_decay(min_decay, wanted):
    # 1/(s (s + 1)) tracks without Ki, and the sensitivity's peak falls as Ki goes to its bound 0, where the closed loop
    # has a pole at 0; the fastest pole of the start is that of the derivative's filter, 1/Tf = 50
    plant = Plant(
        A=[[0, 1], [0, -1]], B=[[0], [1]], C=[[1, 0]], D=[[0]], states=("x", "v"), inputs=("u",), outputs=("y",)
    )
    block = pid("r - y", "u", Kp=1.0, Ki=0.1, Kd=0.5, Tf=0.02)
    structure = Structure(block, references="r").freeze("Tf", 0.02)
    structure = structure.with_bounds("Ki", 0.0, 10.0).with_bounds("Kp", 0.1, 100.0).with_bounds("Kd", 0.0, 100.0)
    model, goals = Model("servo", plant), [Sensitivity(points=("u",), limit=1.3)]
    found = tune(model, structure, goals, starts=2, budget_seconds=10, min_decay=min_decay)
    assert found.abscissa < -0.95 * wanted  # the start's fastest pole is 50 up to the loop's own change
    assert found.abscissa > -100 * wanted  # the goal pulls the pole there: without the margin it would be at 0
    free = tune(model, structure, goals, starts=2, budget_seconds=10, min_decay=0.0)
    assert free.abscissa > -1e-9
    # the goal loses nothing that counts: 1e-3 1/s beside a bandwidth of 0.1 rad/s
    assert found.soft == pytest.approx(free.soft, rel=1e-3)


def test_a_least_decay_is_not_negative():
    with pytest.raises(InputError, match="min_decay must be zero or more"):
        tune(lag(), proportional(), [Gain(inputs=("w",), outputs=("y",))], min_decay=-1.0)


def test_the_same_seed_gives_the_same_tuning_and_progress_can_end_it():
    goals = [Gain(name="effect", inputs=("f",), outputs=("pos",)), Poles(frequency=3.0, damping=0.5, hard=True)]
    first, second = (tune(mass(), state_feedback(), goals, starts=2, seed=5, budget_seconds=30) for _ in range(2))
    assert first.theta.tolist() == second.theta.tolist()
    # x = f/(s² + d s + k), |poles| <= 3: k <= 9; gain 1/k if damped well enough: 1/9
    assert first.goal("effect").value == pytest.approx(1 / 9, rel=1e-2)
    told = []
    tune(mass(), state_feedback(), goals, starts=3, budget_seconds=30, on_progress=lambda p: told.append(p) or True)
    assert {p.start for p in told} == {1}


def test_a_tuning_shows_itself_and_survives_a_pickle():
    goals = [Gain(name="effect", inputs=("w",), outputs=("y",), limit=0.5)]
    found = tune(lag(), proportional(-2.0), goals, starts=1, budget_seconds=5)
    shown = found.to_dict()
    assert shown["goals"][0]["met"] is True
    assert shown["values"]["k"] == found.values["k"]
    assert list(found.goal_frame()["name"]) == ["effect"]
    assert pickle.loads(pickle.dumps(found)).values == found.values
    with pytest.raises(InputError, match="did you mean 'effect'"):
        found.goal("efect")


def test_every_goal_gets_an_axes_with_its_name():
    import matplotlib as mpl

    mpl.use("agg")
    from matplotlib import pyplot as plt

    from workbench.design.design import design
    from workbench.design.problem import Problem
    from workbench.plots.goal import plot_goals

    goals = [
        Gain(name="effect", inputs=("w",), outputs=("y",), limit=0.5),
        Poles(name="speed", frequency=10.0, hard=True),
    ]
    found = design(Problem(models=lag(), structure=proportional(-2.0), goals=goals), starts=1, seconds=5)
    axes = plot_goals(found)
    assert [ax.get_title(loc="left") for ax in axes.ravel()] == ["effect (soft)", "speed (hard)"]
    own = plt.subplots(2, 1)[1]
    assert plot_goals(found, axes=own) is own
    with pytest.raises(InputError, match="one axes per goal"):
        plot_goals(found, axes=own[:1])
    plt.close("all")


def test_a_frozen_structure_is_verified_as_it_is():
    found = tune(lag(), proportional(-3.0).freeze("k"), [Gain(name="effect", inputs=("w",), outputs=("y",))], starts=1)
    assert found.values == {"k": -3.0}
    assert found.goal("effect").value == pytest.approx(1 / 2, rel=1e-9)  # 1/(−1 + 3), the certified norm's tolerance


def test_wrong_models_goals_and_starts_are_refused():
    goals = [Gain(inputs=("w",), outputs=("y",))]
    with pytest.raises(InputError, match="distinct names"):
        tune([lag(), lag()], proportional(), goals)
    with pytest.raises(InputError, match="at least one model and one goal"):
        tune(lag(), proportional(), [])
    with pytest.raises(InputError, match="within the structure's bounds"):
        tune(lag(), proportional(), goals, start=[1e6])
    with pytest.raises(InputError, match="must hold for a model"):
        tune(lag(), proportional(), [Gain(inputs=("w",), outputs=("y",), models=("other",))])


def test_the_worst_parameters_of_a_box_are_found_and_tuned_for():
    # effect 1/(−p − k) is worst at the largest p = 2; |p + k| <= 10 binds at the smallest p = 0: k >= −10, effect 1/8
    goals = [Gain(name="effect", inputs=("w",), outputs=("y",)), Poles(name="speed", frequency=10.0, hard=True)]
    found = tune_robust(
        lambda p: lag(p["p"]), {"p": (0.0, 2.0)}, proportional(-3.0), goals, starts=1, budget_seconds=20
    )
    assert found.settled
    assert found.tuning.values["k"] == pytest.approx(-10, rel=1e-2)
    assert found.worst_soft == pytest.approx(1 / 8, rel=2e-2)
    assert {v.parameters["p"] for v in found.visited} == {0.0, 1.0, 2.0}
    with pytest.raises(InputError, match="low <= high"):
        tune_robust(lambda p: lag(p["p"]), {"p": (2.0, 0.0)}, proportional(), goals)


def test_a_box_too_wide_for_a_hard_goal_is_refused_with_its_parameters():
    # |p + k| <= 10 and stable: p may spread over less than 10
    goals = [Poles(name="speed", frequency=10.0, hard=True)]
    with pytest.raises(InfeasibleError, match=r"'speed' must be at most 1|every loop must be stable"):
        tune_robust(lambda p: lag(p["p"]), {"p": (0.0, 12.0)}, proportional(-7.0), goals, starts=1, budget_seconds=5)


@pytest.mark.slow
def test_starts_on_processes_end_where_starts_in_turn_do():
    goals = [Gain(name="effect", inputs=("w",), outputs=("y",)), Poles(name="speed", frequency=10.0, hard=True)]
    alone = tune(lag(), proportional(), goals, starts=3, budget_seconds=60)
    beside = tune(lag(), proportional(), goals, starts=3, budget_seconds=60, workers=2)
    assert beside.theta.tolist() == alone.theta.tolist()
    assert len(beside.starts) == 3
    assert all(math.isfinite(start.soft) for start in beside.starts)
