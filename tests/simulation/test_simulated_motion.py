"""Nonlinear time histories against linear theory where it holds, and the hardware's limits where it does not."""

from functools import cache

import numpy as np
import pytest
from scipy.linalg import expm

from workbench.control import Gains
from workbench.control.loop import close
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.physics.forces.operating import law_at
from workbench.physics.forces.taylor import TaylorLaw
from workbench.physics.guideway.shape import VersineBump
from workbench.physics.vehicle.conditions import Conditions, SideWind
from workbench.physics.vehicle.operating import operating_point
from workbench.simulation import Failure, Gust, LoadStep, Rig, Scaled, ShapedGuideway, monte_carlo, simulate

# stable with 10 ms of lag and accelerometers that feel gravity: damping 0.33
GAINS = Gains(
    K_h=-2.155, K_hdot=0.15, tau_h=0.637, K_hp=0.0, K_hpdot=0.152, tau_hp=0.2, K_zddot=0.0, K_zdot=0.15, tau_z=0.637,
    K_yddot=-0.01, K_ydot=0.152, tau_y=0.2, K_heave=1.0, K_pitch=1.0, K_sway=1.0, K_roll=1.73, K_yaw=6.76,
)  # fmt: skip
BUMP = VersineBump(start=20.0, length=60.0, peak=0.02)


@cache
def problem():
    return load_problem("comfort_limit")


@cache
def curved():
    return problem().vehicle.with_values(force_law=TaylorLaw.from_corner(law_at(), 2))


def rig(vehicle=None, conditions=None, **changed) -> Rig:
    point = operating_point(vehicle or problem().vehicle, conditions)
    return Rig(**{"point": point, "gains": GAINS, "gap": 0.3, "gap_lateral": 0.3, **changed})


@cache
def closed():
    return close(problem().setting.plant, problem().law, GAINS).system


def test_at_rest_nothing_moves():
    history = simulate(rig(curved(), Conditions(wind=SideWind(force=1e4))), 2.0)
    # 500 periods of rounding in forces of 1e5 N on 45 t
    assert np.abs(history.gap - history.rest[0][:, None]).max() < 1e-10
    assert np.abs(history.acceleration).max() < 1e-9


def test_a_small_load_step_gives_the_step_response_of_the_linear_loop():
    load = np.array([5.0, 20.0, 3.0, 2.0, 10.0])
    history = simulate(rig(), 3.0, loads=[LoadStep(load=tuple(load))])
    system = closed()
    column = (
        system.B[:, system.index("inputs", ["force_z", "moment_pitch", "force_y", "moment_roll", "moment_yaw"])] @ load
    )
    rows = system.C[system.index("outputs", ["gap_1", "gap_3", "gap_lateral_2", "current_4"])]
    n = len(column)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n] = system.A, column
    for k in (250, 500, 750):
        expected = rows @ expm(block * history.time[k])[:n, n]
        ours = [history.gap[0, k], history.gap[2, k], history.gap_lateral[1, k], history.current[3, k]]
        # gaps move 20 µm: products with angles of 1e-6 rad times arms of 10 m are 1e-3 of the 0.3 µm of sway
        assert ours == pytest.approx(expected, rel=1e-3)


def test_a_bias_moves_the_gaps_by_the_static_gain_of_the_linear_loop():
    bias = np.zeros(16)
    bias[[8, 9, 10, 11]] = 1e-4  # the four vertical accelerometers [m/s²]
    history = simulate(rig(bias=tuple(bias)), 40.0, keep_every=100)
    system = closed()
    seen = system.select(inputs=[f"error_acceleration_z_{i}" for i in range(1, 5)], outputs=["gap_1", "gap_3"])
    static = (seen.D - seen.C @ np.linalg.solve(seen.A, seen.B)) @ np.full(4, 1e-4)
    assert history.gap[[0, 2], -1] == pytest.approx(
        static, rel=1e-4
    )  # 40 s are twenty time constants of the slowest mode


@pytest.mark.slow
def test_runge_kutta_and_an_adaptive_integrator_agree():
    course = ShapedGuideway(A1=BUMP)
    fixed = simulate(rig(curved()), 1.0, course=course)
    adaptive = simulate(rig(curved(), integrator="cvodes"), 1.0, course=course)
    # both run along the same parabolas; fourth order with a step of 0.4 current-loop lags
    assert fixed.gap[:, -1] == pytest.approx(adaptive.gap[:, -1], rel=1e-4, abs=1e-7)


def test_machine_code_and_the_interpreter_give_the_same_numbers(monkeypatch):
    compiled = simulate(rig(curved()), 0.5, course=ShapedGuideway(A1=BUMP))
    monkeypatch.setenv("WORKBENCH_COMPILER", "none")
    interpreted = simulate(rig(curved()), 0.5, course=ShapedGuideway(A1=BUMP))
    assert compiled.gap == pytest.approx(interpreted.gap, abs=1e-12)  # another order of additions


@pytest.mark.slow
def test_fast_sampling_approaches_the_continuous_law():
    course = ShapedGuideway(A1=BUMP)
    smooth = simulate(rig(step=0.001), 1.0, course=course)
    errors = [
        np.abs(simulate(rig(sample_time=T), 1.0, course=course).gap[0, -1] - smooth.gap[0, -1]) for T in (0.004, 0.001)
    ]
    assert errors[1] < 5e-5
    assert errors[1] < 0.5 * errors[0]  # the hold delays by half a sample: first order


def test_the_rear_sets_meet_the_guideway_a_wheel_base_later():
    positions = problem().vehicle.positions
    time = np.linspace(0, 1, 200)
    met = ShapedGuideway(A1=BUMP, A3=BUMP).inputs(positions, 134.0, time)
    assert met[2] == pytest.approx(BUMP.height(134.0 * time - 16.65), abs=1e-15)
    assert np.array_equal(met[4], -met[5])  # alignment: right wall outward, left wall inward


def test_commands_stay_within_their_limit_and_nothing_winds_up():
    gust = Gust(peak=(0.0, 0.0, 3e4, 2e4, 0.0), start=0.2, duration=1.0)
    limited = simulate(rig(curved(), current_limit=0.05), 20.0, loads=[gust], keep_every=5)
    free = simulate(rig(curved()), 20.0, loads=[gust], keep_every=5)
    assert np.abs(free.command).max() > 0.1
    assert np.abs(limited.command).max() <= 0.05
    assert np.abs(limited.current).max() <= 0.05
    assert 0 < limited.limited < 0.5
    # the slowest mode decays with 0.8/s: e^-15 of 60 mm, as if the limit had never been met
    assert np.abs(limited.gap[:, -1]).max() < 1e-6


def test_a_rate_limit_bounds_the_slope_of_the_currents():
    gust = Gust(peak=(3e4, 0.0, 0.0, 0.0, 0.0), start=0.1, duration=0.4)
    history = simulate(rig(rate_limit=0.2, step=0.002), 1.0, loads=[gust])
    assert np.abs(np.diff(history.current)).max() <= 0.2 * 0.002 * (1 + 1e-9)


def test_contact_ends_the_run_and_names_the_set():
    course = ShapedGuideway(A1=VersineBump(start=20.0, length=60.0, peak=0.35))
    history = simulate(rig(curved()), 3.0, course=course)
    assert history.contact is not None
    assert history.contact.surface == "floor"
    assert history.contact.coil_set in (1, 2)  # the bump meets the front first
    assert history.time[-1] < history.contact.time < 20.0 / 134 + 0.5
    # every kept reading is still clear: the control coil hangs 0.1 m below the main coil at 0.3 m
    assert history.gap.min() > -0.2


def test_a_failed_coil_set_brings_the_vehicle_down():
    history = simulate(rig(curved()), 5.0, failure=Failure(lost_set=1, start=0.5))
    assert history.contact is not None
    assert history.contact.time > 0.5
    assert history.contact.coil_set == 1
    before = history.time < 0.5
    assert np.abs(history.gap[:, before]).max() < 1e-9


def test_noise_repeats_with_its_seed_and_needs_one():
    noisy = rig(gap_noise=1e-5, acceleration_noise=1e-3, sample_time=0.001)
    first, second, other = (simulate(noisy, 0.5, seed=s) for s in (1, 1, 2))
    assert np.array_equal(first.gap, second.gap)
    assert not np.array_equal(first.gap, other.gap)
    with pytest.raises(InputError, match="sensor noise needs a seed"):
        simulate(noisy, 0.5)


def test_sensor_noise_moves_the_currents_as_much_as_the_linear_analysis_says():
    from workbench.analysis.sensor import noise_rms

    setting = problem().setting
    expected = noise_rms(setting, [(s, s.close(GAINS)) for s in setting.subjects])["current"]
    gap, acceleration = setting.sensor_noise
    history = simulate(rig(gap_noise=gap, acceleration_noise=acceleration, step=0.001), 60.0, seed=3)
    measured = np.sqrt(np.mean(history.current[:, history.time > 5] ** 2, axis=1)).max()
    # 55 s of a loop with a correlation time of about 0.3 s: 1/√(2·180) = 5 %, and the largest of four is taken
    assert measured == pytest.approx(expected, rel=0.2)


@pytest.mark.parametrize("law", ["straight", pytest.param("curved", marks=pytest.mark.slow)])
def test_on_a_smooth_guideway_the_random_runs_have_the_spectral_rms(law):
    from workbench.analysis.analysis import analyse

    setting = problem().setting
    spectral = analyse(setting, GAINS).rms
    chosen = rig(step=0.005) if law == "straight" else rig(curved(), step=0.005)
    runs = monte_carlo(chosen, setting.guideway, runs=6, duration=200.0, seed=2, factor=0.05)
    assert runs.finished == 6
    for quantity, places in runs.ratio(spectral).items():
        for place, (ratio, error) in places.items():
            # four standard errors; 1 % for the waves beyond 200 s and below 0.4 m, which the drawn guideways lack; the
            # curved law's own slopes differ from the printed ones by up to 0.7 % (roll)
            assert abs(ratio - 1) < 4 * error + 0.01, (quantity, place, ratio, error)


@pytest.mark.slow
def test_on_a_rough_guideway_the_curved_law_shakes_more_than_the_linear_one():
    from workbench.analysis.analysis import analyse

    setting = problem().setting
    spectral = analyse(setting, GAINS).rms
    third = problem().vehicle.with_values(force_law=TaylorLaw.from_corner(law_at(), 3))
    rough = monte_carlo(rig(third, step=0.005), setting.guideway, runs=4, duration=100.0, seed=2, factor=0.5)
    ratio, error = rough.ratio(spectral)["acceleration_z"]["front"]
    assert ratio - 1 > 10 * error


@pytest.mark.slow
def test_runs_that_touch_the_guideway_are_counted_and_left_out():
    runs = monte_carlo(rig(curved(), step=0.005), problem().setting.guideway, runs=2, duration=60.0, seed=2, factor=4.0)
    assert runs.finished == 0
    assert len(runs.contacts) == 2
    assert runs.ratio({"gap": {"front": 0.03}}) == {}


def test_a_scaled_course_doubles_every_height():
    course = ShapedGuideway(A1=BUMP)
    positions, time = problem().vehicle.positions, np.linspace(0, 1, 50)
    assert np.array_equal(
        Scaled(course=course, factor=2.0).inputs(positions, 134.0, time), 2 * course.inputs(positions, 134.0, time)
    )


@pytest.mark.slow
def test_the_two_coil_vehicle_rides_on_eight_coils_and_four_commands():
    two = load_problem("two_coil_corner")
    point = operating_point(two.vehicle.with_values(force_law=TaylorLaw.from_corner(two.vehicle.force_law, 2)))
    history = simulate(
        Rig(point=point, gains=GAINS, gap=0.3, gap_lateral=0.3, step=0.005), 2.0, course=ShapedGuideway(A1=BUMP)
    )
    assert history.gap.shape[0] == 8
    assert history.command.shape[0] == 4
    assert history.contact is None


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"step": 0.0}, "Rig.step must be positive"),
        ({"integrator": "euler"}, "unknown integrator"),
        ({"bias": (0.0,)}, "bias must hold one value for each of the 16 sensors"),
        ({"gap_noise": -1.0}, "gap_noise must be finite and not negative"),
    ],
)
def test_impossible_rigs_are_refused(changed, sentence):
    with pytest.raises(InputError, match=sentence):
        rig(**changed)


def test_a_continuous_law_with_direct_acceleration_gain_needs_the_lag_and_a_sampled_one_does_not():
    vehicle = problem().vehicle.with_extras(current_lag=0.0, gravity_term=False)
    with pytest.raises(InputError, match="the command is its own cause"):
        rig(vehicle)
    history = simulate(rig(vehicle, sample_time=0.001), 1.0, course=ShapedGuideway(A1=BUMP))
    assert history.contact is None


def test_impossible_runs_are_refused():
    with pytest.raises(InputError, match="duration must be positive"):
        simulate(rig(), -1.0)
    with pytest.raises(InputError, match=r"Failure.lost_set must be 1 … 4"):
        simulate(rig(), 1.0, failure=Failure(lost_set=9))
    with pytest.raises(InputError, match=r"Gust.duration must be positive"):
        Gust(peak=(0.0,) * 5, start=0.0, duration=0.0)
    with pytest.raises(InputError, match="five finite loads"):
        LoadStep(load=(1.0, 2.0))
    with pytest.raises(InputError, match="at least 2 runs"):
        monte_carlo(rig(), problem().setting.guideway, runs=1, duration=10.0)
