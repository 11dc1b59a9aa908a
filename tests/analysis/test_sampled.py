"""The sampled closed loop: against simulation in small steps, limits, closed formulas; single precision; refusals."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

from workbench.analysis.precision import single_precision
from workbench.analysis.sampled import sampled_loop
from workbench.control.discrete import DiscreteLaw, discretise
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.lti import Plant
from workbench.lti.bilinear import in_w_plane
from workbench.lti.measure import sampled_peak
from workbench.lti.norm import peak_gain
from workbench.lti.realisation import Realisation

T = 0.1
INTEGRATOR = Plant(A=[[0.0]], B=[[1.0]], C=[[1.0]], D=[[0.0]], states=("x",), inputs=("u",), outputs=("y",))


def proportional(k: float, sample_time: float = T) -> DiscreteLaw:
    """u = −k y, without filters."""
    zero = np.zeros(10)
    return DiscreteLaw(
        sample_time=sample_time, channels=("",) * 10, measurement=np.eye(10)[:, :1],
        resolution=-np.eye(5)[:1], advance=zero, direct=np.full(10, k), memory=zero, step_bound=zero,
    )  # fmt: skip


@pytest.fixture(scope="module")
def vehicle():
    problem = load_problem("comfort_limit")
    law, plant = problem.law, problem.setting.plant
    return plant, law, problem.gains


def test_an_integrator_under_held_proportional_feedback_has_the_pole_one_minus_k_t():
    found = sampled_loop(INTEGRATOR, proportional(3.0), ["u"], ["y"])
    np.testing.assert_allclose(found.poles, [1 - 3.0 * T], atol=1e-12)  # x⁺ = x − T k x, to rounding


@pytest.mark.parametrize("k", [3.0, 7.0])
def test_an_integrator_bears_the_computing_delay_of_the_jury_criterion(k):
    # delay τ ≤ T: x⁺ = x − k(T−τ) x − kτ x₋ is stable exactly for kτ < 1 and k(T − 2τ) < 2
    found = sampled_loop(INTEGRATOR, proportional(k), ["u"], ["y"])
    borne = found.delay_reserve
    if 1 / k <= T:
        assert borne == pytest.approx(1 / k, abs=1e-8)  # the bisection ends at 1e-9 of half a sample
    else:
        assert borne > T


def test_a_delay_of_whole_and_of_part_samples_is_that_of_a_simulation_in_steps_of_the_remainder():
    plant = Plant(
        A=[[0.0, 1.0], [-2.0, -0.4]], B=[[0.0], [1.0]], C=[[1.0, 0.3]], D=[[0.2]],
        states=("x", "v"), inputs=("u",), outputs=("y",),
    )  # fmt: skip
    delay, parts = 0.26, 100  # of a sample each: the delay is two samples and sixty steps
    law = proportional(0.5)
    found = sampled_loop(plant, law, ["u"], ["y"], computing_delay=delay, reserve=False)
    step = expm(np.block([[plant.A, plant.B], [np.zeros((1, 3))]]) * T / parts)
    state, commands, outputs = np.array([1.0, 0.0]), [], []
    for i in range(60 * parts):
        acting = (i - 260) // parts  # sample whose command is in force over the step
        if i % parts == 0:
            before = (i - 261) // parts  # sensors are read before the commands of the same moment act
            held = commands[before] if before >= 0 else 0.0
            y = (plant.C @ state).item() + 0.2 * held
            outputs.append(y)
            commands.append(-0.5 * y)
        u = commands[acting] if acting >= 0 else 0.0
        state = (step @ np.append(state, u))[:2]
    # the outputs satisfy the recurrence of the characteristic polynomial of the poles found
    polynomial = np.poly(found.poles)
    n = len(polynomial)
    residual = [np.dot(polynomial, outputs[k : k - n : -1]) for k in range(2 * n, len(outputs))]
    np.testing.assert_allclose(residual, 0.0, atol=1e-12)  # rounding of signals of size one


def test_fast_sampling_gives_the_poles_of_the_continuous_loop(vehicle):
    from workbench.control.loop.closed import close

    plant, law, gains = vehicle
    fast = discretise(law, gains, 1e-5)
    found = sampled_loop(plant, fast, law.commands, law.sensors, reserve=False)
    poles = np.linalg.eigvals(close(plant, law, gains).system.A)
    damping = np.min(-poles.real / np.abs(poles))
    # holding is half a sample of delay, 5 µs, on a crossover below 100 rad/s: 5e-4 of phase
    assert found.damping == pytest.approx(damping, abs=2e-3)
    assert found.decay == pytest.approx(np.min(-poles.real), rel=1e-3)


def test_the_approved_gains_run_at_one_kilohertz_and_the_reserve_is_where_they_stop(vehicle):
    plant, law, gains = vehicle
    sampled = discretise(law, gains, 1e-3)
    found = sampled_loop(plant, sampled, law.commands, law.sensors)
    assert found.stable
    for factor, stable in ((0.999, True), (1.001, False)):
        late = sampled_loop(
            plant, sampled, law.commands, law.sensors, computing_delay=factor * found.delay_reserve, reserve=False
        )
        assert late.stable is stable


def test_the_bilinear_map_keeps_the_gain_at_corresponding_frequencies():
    rng = np.random.default_rng(4)
    A = rng.normal(size=(4, 4))
    A *= 0.9 / np.abs(np.linalg.eigvals(A)).max()
    system = (A, rng.normal(size=(4, 2)), rng.normal(size=(3, 4)), rng.normal(size=(3, 2)))
    mapped = in_w_plane(Realisation(*system), 2.0)
    for omega in (0.1, 1.0, 10.0):
        z = (1 + 1j * omega) / (1 - 1j * omega)
        G = [c @ np.linalg.solve(p * np.eye(4) - a, b) + d for p, (a, b, c, d) in ((z, system), (1j * omega, mapped))]
        np.testing.assert_allclose(G[0], G[1], rtol=1e-10)  # rounding through one inverse


def test_the_peak_of_a_sampled_low_pass_is_at_zero_and_of_its_mirror_at_half_the_sampling_rate():
    low = sampled_peak([[0.8]], [[1.0]], [[1.0]], [[0.0]], T)
    assert low.value == pytest.approx(1 / (1 - 0.8), rel=1e-9)  # geometric series; tolerance of the bracket
    assert low.frequency == 0.0
    high = sampled_peak([[-0.8]], [[1.0]], [[1.0]], [[0.0]], T)
    assert high.value == pytest.approx(5.0, rel=1e-9)
    assert high.frequency == pytest.approx(np.pi / T, rel=1e-9)


def test_the_sampled_peak_tends_to_the_continuous_one(vehicle):
    plant, law, gains = vehicle
    problem = load_problem("comfort_limit")
    exact = max(peak_gain(*subject.sensitivity(subject.close(gains))).upper for subject in problem.subjects)
    fast = sampled_loop(plant, discretise(law, gains, 1e-5), law.commands, law.sensors, reserve=False)
    assert fast.peak_sensitivity.value == pytest.approx(exact, rel=5e-3)  # 5 µs of delay at 100 rad/s and the filters


def test_the_quantisation_margin_is_where_multiplied_rounding_may_destabilise(vehicle):
    plant, law, gains = vehicle
    sampled = discretise(law, gains, 1e-3)
    found = single_precision(plant, sampled, law.commands, law.sensors)
    assert found.coefficient_error <= 2.0**-24 * (1 + 1e-6)  # half a unit in the last place, by definition
    # small gain: every error of the law up to `margin` times the rounding is borne, that one included
    rounded = sampled.direct.astype(np.float32).astype(float)
    bent = replace(sampled, direct=sampled.direct + 0.9 * found.margin * (rounded - sampled.direct))
    assert sampled_loop(plant, bent, law.commands, law.sensors, reserve=False).stable


def test_a_filter_in_single_precision_stops_within_the_dead_band(vehicle):
    _, law, gains = vehicle
    slowest = discretise(law, gains, 1e-3).advance.min()
    s, u, a = np.float32(0.0), np.float32(1.0), np.float32(slowest)
    for _ in range(60_000):  # 60 s, fifteen of the longest time constants
        s = s + a * (u - s)
    plant, *_ = vehicle
    found = single_precision(plant, discretise(law, gains, 1e-3), law.commands, law.sensors)
    assert 0 < 1 - float(s) <= found.dead_band


def test_negative_and_endless_delays_and_unstable_loops_are_refused(vehicle):
    plant, law, gains = vehicle
    sampled = discretise(law, gains, 1e-3)
    for delay in (-1e-3, 1.0):
        with pytest.raises(InputError, match="computing delay must lie between 0 and 50 samples"):
            sampled_loop(plant, sampled, law.commands, law.sensors, computing_delay=delay)
    with pytest.raises(InputError, match="must be stable before its rounding"):
        single_precision(plant, sampled, law.commands, law.sensors, computing_delay=0.02)


def test_the_sampled_law_as_a_python_control_object_is_the_sampled_law(vehicle):
    _, law, gains = vehicle
    sampled = discretise(law, gains, 1e-3)
    system = sampled.to_control()
    assert system.dt == 1e-3
    for ours, theirs in zip(sampled.state_space(), (system.A, system.B, system.C, system.D), strict=True):
        np.testing.assert_array_equal(ours, theirs)
