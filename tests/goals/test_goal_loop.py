"""Loop goals and margins against textbook formulas and python-control; delay margins against a delayed loop."""

import math

import control
import numpy as np
import pytest
from goal_cases import loop_of, plant, random_controller, random_plant

from workbench.control.structure.block import Controller
from workbench.control.structure.blocks import gain
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.design.tuner.result import TunedGoal
from workbench.errors import InputError
from workbench.goals.gain import Gain
from workbench.goals.loop_shape import LoopShape, MaxLoopGain, MinLoopGain, Rejection, Sensitivity
from workbench.goals.margin import DelayMargin, Margins
from workbench.lti import Plant
from workbench.lti.model import Model
from workbench.lti.mu import lower, turned
from workbench.lti.structured import scaling_below


def _third_order(k, **delays):
    """L = k/(s + 1)³ at "u" under u = −k y: stable for k < 8."""
    A = [[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0], [0.0, 0.0, -1.0]]
    system = plant(A, [[0.0], [0.0], [1.0]], [[1.0, 0.0, 0.0]], inputs=["u"], outputs=["y"])
    return loop_of(system, controls=["u"], measured=["y"], **delays), Controller.static([[-k]])


def _loop_gain(k, omega):
    return k / (1j * omega + 1) ** 3


OMEGA = np.geomspace(1e-4, 1e3, 700001)  # 1e-5 relative between neighbours: 1e-9 of a smooth peak's height


def test_peak_sensitivity_is_that_of_python_control():
    loop, K = _third_order(2.0)
    S = control.feedback(1, control.tf([2.0], [1.0, 3.0, 3.0, 1.0]))
    expected = control.system_norm(S, p="inf", tol=1e-10)
    bound = Sensitivity(points="u", limit=2.0).bind(loop)
    assert bound.evaluate(K).value == pytest.approx(expected / 2, rel=1e-6)  # tolerance of its bisection
    assert bound.exact(K).value == pytest.approx(np.abs(1 / (1 + _loop_gain(2.0, OMEGA))).max() / 2, rel=1e-8)


def test_rejection_weighs_the_sensitivity_over_frequency():
    loop, K = _third_order(2.0)
    profile = {0.01: 10.0, 1.0: 0.1}
    found = Rejection(points="u", attenuation=profile).bind(loop).evaluate(K)
    size = np.exp(np.interp(np.log(OMEGA), np.log([0.01, 1.0]), np.log([10.0, 0.1])))
    assert found.value == pytest.approx((size / np.abs(1 + _loop_gain(2.0, OMEGA))).max(), rel=1e-6)


def test_loop_gain_goals_ask_where_their_profile_is_above_or_below_one():
    loop, K = _third_order(2.0)
    gain, target = np.abs(_loop_gain(2.0, OMEGA)), 0.5 / OMEGA
    least = MinLoopGain(points="u", profile=([0.5], [1.0, 0.0]), focus=(0.05, math.inf)).bind(loop).evaluate(K)
    # target/|L| = 0.5 (1 + ω²)^1.5/(2 ω) falls until ω = 1/√2, beyond the end of the asked-for band at 0.5
    assert least.value == pytest.approx(0.5 * 1.0025**1.5 / (2 * 0.05), rel=1e-10)
    most = MaxLoopGain(points="u", profile=([0.5], [1.0, 0.0])).bind(loop).evaluate(K)
    assert most.value == pytest.approx((gain / target)[target < 1].max(), rel=1e-8)  # smooth inside


def test_a_loop_shape_is_met_exactly_by_a_loop_within_its_tolerance():
    # L = ω_c/(s (1 + s/100)): its crossover is ω_c but for 0.5 %
    for crossover, met in ((1.0, True), (1.9, True), (2.1, False), (0.45, False)):
        system = plant([[0.0, 1.0], [0.0, -100.0]], [[0.0], [100.0]], [[1.0, 0.0]], inputs=["u"], outputs=["y"])
        loop = loop_of(system, controls=["u"], measured=["y"])
        goal = LoopShape(points="u", crossover=1.0, tolerance_db=20 * math.log10(2), focus=(0.01, 20.0)).bind(loop)
        K = Controller.static([[-crossover]])
        assert (goal.evaluate(K).value < 1) == met
        assert (goal.exact(K).value < 1) == met


def test_the_disk_margin_of_one_loop_is_that_of_python_control():
    loop, K = _third_order(3.0)
    expected = control.disk_margins(control.tf([3.0], [1.0, 3.0, 3.0, 1.0]), np.geomspace(1e-2, 1e2, 20001))[0]
    goal = Margins(points="u", gain_db=6.0, phase_deg=30.0)
    found = goal.bind(loop).evaluate(K)
    assert goal.alpha / found.value == pytest.approx(float(np.squeeze(expected)), rel=1e-6)  # its grid: 5e-4 apart


def test_margins_ask_for_the_stricter_of_gain_and_phase():
    # 6 dB is a factor of 1.9953: α = 2·0.9953/2.9953; 60° is α = 2 tan 30°
    assert Margins(points="u", gain_db=6.0).alpha == pytest.approx(2 * 0.99526 / 2.99526, rel=1e-4)
    assert Margins(points="u", gain_db=6.0, phase_deg=60.0).alpha == pytest.approx(2 / math.sqrt(3), rel=1e-12)


def test_the_multiloop_margin_lies_in_the_proved_bracket():
    system = random_plant(1, 8, 3, 3)
    loop = loop_of(system, controls=["u1", "u2"], measured=["y1", "y2"], order=3)
    K = random_controller(2, 3, 2, 2, size=0.5)
    for points in (("u1", "u2"), ("u1", "u2", "y1")):
        goal = Margins(points=points, gain_db=4.0).bind(loop)
        value, exact = goal.evaluate(K), goal.exact(K)
        assert exact.value * (1 - 1e-3) <= value.value <= exact.upper  # a lower bound of the same supremum
        assert exact.upper <= exact.value * 1.002  # the bracket's own tolerance


def test_the_margin_found_destabilises_when_it_is_used_up():
    system = random_plant(1, 8, 3, 3)
    loop = loop_of(system, controls=["u1", "u2"], measured=["y1", "y2"], order=3)
    K = random_controller(2, 3, 2, 2, size=0.5)
    goal = Margins(points=("u1", "u2"), gain_db=4.0)
    found = goal.bind(loop).evaluate(K)
    M = loop.sensitivity(("u1", "u2")).response(K, [found.frequency])[0] - np.eye(2) / 2
    size, turn = turned(M[None], 2000)
    delta = turn[0] / size[0]
    # |δ| is the margin, and I − M diag(δ) is singular: a pole on the axis
    assert np.abs(delta) == pytest.approx(goal.alpha / found.value, rel=1e-6)
    assert np.linalg.svd(np.eye(2) - M * delta, compute_uv=False)[-1] < 1e-6


def test_mu_of_two_channels_is_the_formula_and_the_fixed_point():
    random = np.random.default_rng(0)
    M = random.standard_normal((200, 2, 2)) + 1j * random.standard_normal((200, 2, 2))
    exact, climbed = lower(M), turned(M, 3000)[0]
    # from below; a few of 200 stop at a local maximum
    assert np.all(climbed <= exact * (1 + 1e-9))
    assert np.median(climbed / exact) == pytest.approx(1.0, abs=1e-9)
    assert np.mean(climbed < exact * (1 - 1e-6)) < 0.05


def test_an_unstable_loop_has_no_margins():
    loop, K = _third_order(9.0)
    for goal in (Margins(points="u", gain_db=6.0), DelayMargin(points="u", delay=0.1), Sensitivity(points="u")):
        for value in (goal.bind(loop).evaluate(K), goal.bind(loop).exact(K)):
            assert value.value == math.inf
            assert "unstable: pole" in value.reason


def test_the_delay_margin_is_phase_over_crossover():
    loop, K = _third_order(3.0)
    crossover = math.sqrt(3 ** (2 / 3) - 1)  # |1 + jω|³ = 3
    margin = (math.pi - 3 * math.atan(crossover)) / crossover
    goal = DelayMargin(points="u", delay=0.2).bind(loop)
    assert goal.evaluate(K).value == pytest.approx(0.2 / margin, rel=1e-10)
    assert goal.exact(K).value == pytest.approx(0.2 / margin, rel=1e-10)


def test_a_loop_is_stable_just_below_its_delay_margin_and_unstable_above():
    loop, K = _third_order(3.0)
    margin = 0.2 / DelayMargin(points="u", delay=0.2).bind(loop).evaluate(K).value
    for factor, stable in ((0.999, True), (1.001, False)):
        delayed, _ = _third_order(3.0, input_delay={"u": margin * factor})
        value = Gain(inputs="u", outputs="y").bind(delayed).evaluate(K).value
        assert math.isfinite(value) == stable  # Padé of order 4 is good to 1e-7 at this crossover


def test_a_loop_gain_that_stays_above_one_bears_no_delay():
    system = plant([[-1.0]], [[1.0]], [[1.0]], [[2.0]], inputs=["u"], outputs=["y"])
    loop = loop_of(system, controls=["u"], measured=["y"])
    value = DelayMargin(points="u", delay=0.1).bind(loop).evaluate(Controller.static([[-1.0]]))
    assert value.value == math.inf
    assert "high frequencies" in value.reason


def test_openings_leave_the_other_loops_open():
    system = random_plant(1, 6, 2, 2)
    loop = loop_of(system, controls=["u1", "u2"], measured=["y1", "y2"])
    K = Controller.static([[-0.1, 0.05], [0.03, -0.2]])
    opened = Sensitivity(points="u1", limit=1.0, openings="u2").bind(loop).evaluate(K)
    omega = np.geomspace(1e-3, 1e3, 100001)
    L = -(K.D[0] @ system.response(omega))[:, 0]
    assert opened.value == pytest.approx(np.abs(1 / (1 + L)).max(), rel=1e-7)


def test_misused_loop_goals_are_refused():
    with pytest.raises(InputError, match="a target or a crossover, not both"):
        LoopShape(points="u")
    with pytest.raises(InputError, match="not both zero"):
        Margins(points="u")
    with pytest.raises(InputError, match="must name at least one signal"):
        Sensitivity(points=())
    with pytest.raises(InputError, match="looks at all frequencies"):
        DelayMargin(points="u", delay=1.0, focus=(1.0, 2.0))


@pytest.mark.parametrize(
    ("late", "focus"), [(None, (1.0, 5.0)), ({"u1": 0.01, "u2": 0.02}, (0.0, math.inf))], ids=["band", "late"]
)
def test_what_a_multiloop_margin_leaves_open_counts_as_not_met(late, focus):
    rng = np.random.default_rng(3)
    A = rng.normal(size=(4, 4))
    system = Plant.from_matrices(A - (np.linalg.eigvals(A).real.max() + 1) * np.eye(4), rng.normal(size=(4, 3)),
                                 rng.normal(size=(3, 4)))  # fmt: skip
    loop = Loop(Model("three", system, late), Structure(gain(["y1", "y2", "y3"], ["u1", "u2", "u3"], 0.0)))
    K = Controller.static(-0.2 * rng.normal(size=(3, 3)))
    found = Margins(points=("u1", "u2", "u3"), gain_db=6.0, focus=focus).bind(loop).exact(K)
    assert 0 < found.upper / found.value - 1 < 2.1e-3
    # at the best constant scaling of the worst frequency, three channels: σ_max(D M D⁻¹) is μ
    alpha = 2 * (10**0.3 - 1) / (10**0.3 + 1)
    S = loop.sensitivity(("u1", "u2", "u3")).response(K, found.frequency)
    _, size, _ = scaling_below(S - np.eye(3) / 2, 0.0, np.zeros(3))
    assert found.value * (1 - 1e-4) <= alpha * size <= found.upper * (1 + 1e-4)

    def judged(value, upper):
        return TunedGoal(
            name="m", hard=True, model="three", value=value, upper=upper, smooth=value, frequency=None, time=None,
            channel="", method="", reason="",
        )  # fmt: skip

    assert judged(0.999, 1.0).met
    assert not judged(0.999, 1.0001).met
