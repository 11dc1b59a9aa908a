"""The integration step: chosen from the loop's poles, refused where a pole would grow, checked by other integrators.

The second integrator is the exponential of the linear closed loop, exact for loads so small that no product of
deviations counts; a third, with error control, takes large ones.
"""

from functools import cache

import numpy as np
import pytest
from scipy.linalg import expm

from workbench.control.loop import close
from workbench.errors import InputError
from workbench.files.problem import load_problem, shipped_vehicles
from workbench.lti.signals import COORDINATES
from workbench.physics.guideway.shape import VersineBump
from workbench.physics.vehicle.operating import operating_point
from workbench.simulation import LoadStep, Rig, ShapedGuideway, simulate
from workbench.simulation.ensemble import seeds
from workbench.simulation.rig import LONGEST_STEP, largest_step

LOADS = ("force_z", "moment_pitch", "force_y", "moment_roll", "moment_yaw")
FLOWN = sorted(set(shipped_vehicles()) - {"report_1975"})  # without current loops a direct acceleration gain is refused
EXACT = ("coil_vehicle", "scheduled_vehicle", "two_coil_corner")  # on the exact law of coils
LOAD = np.array([300.0, 2000.0, 300.0, 50.0, 2000.0])


@cache
def problem(name):
    return load_problem(name)


def rig(name, **changed) -> Rig:
    p = problem(name)
    gap, gap_lateral = getattr(p.vehicle.force_law, "gap", 0.3), getattr(p.vehicle.force_law, "gap_lateral", 0.3)
    point = operating_point(p.vehicle)
    return Rig(**{"point": point, "gains": p.approved, "gap": gap, "gap_lateral": gap_lateral, **changed})


def linear(rig: Rig, load, instants: int) -> dict[str, np.ndarray]:
    """The step response of the linear loop at 0, h, 2h, …, by its matrix exponential."""
    loop = close(rig.point.plant(), rig.law, rig.gains).system
    n = len(loop.A)
    block = np.zeros((n + 1, n + 1))
    block[:n, :n], block[:n, n] = loop.A, loop.B[:, loop.index("inputs", LOADS)] @ load
    advance, state, path = expm(block * rig.step_used), np.eye(n + 1)[n], []
    for _ in range(instants):
        path.append(state)
        state = advance @ state
    names = {
        "pose": COORDINATES,
        "current": rig.law.currents[: rig.law.count],
        "motor": rig.law.currents[rig.law.count :],
    }
    return {kind: loop.C[loop.index("outputs", each)] @ np.array(path).T[:n] for kind, each in names.items()}


@pytest.mark.parametrize(
    ("name", "finer"),
    [
        pytest.param(name, finer, marks=[pytest.mark.slow] if name in EXACT else [])
        for finer in (1, 8)
        for name in FLOWN
    ],
)
def test_a_load_step_is_the_exponential_of_the_linear_loop_on_every_shipped_problem(name, finer):
    loaded = rig(name)
    if finer > 1:
        loaded = rig(name, step=loaded.step_used / finer)
    load = 1e-4 * LOAD  # so small that products of deviations are 1e-7 of the motion
    history = simulate(loaded, 0.08, loads=[LoadStep(load=tuple(load))])
    expected = linear(loaded, load, len(history.time))
    ours = {
        "pose": history.pose - loaded.point.trim.pose[:, None],
        "current": history.current - loaded.resting[: loaded.law.count, None],
        "motor": history.motor,
    }
    assert history.contact is None
    # |λ|h = 0.5 costs 0.5⁵/120 a step where the fastest pole carries all, as in the currents just after the step
    coarse, fine = {"pose": 3e-6, "current": 5e-3, "motor": 1e-3}, dict.fromkeys(("pose", "current", "motor"), 1e-6)
    sizes = fine if finer > 1 else coarse
    for kind, reference in expected.items():
        if reference.size:
            wrong = np.abs(ours[kind] - reference).max(axis=1)
            assert np.all(wrong <= sizes[kind] * np.abs(reference).max(axis=1).max()), kind


@pytest.mark.parametrize("name", ["comfort_limit", "hybrid_motor"])
def test_a_large_load_step_is_that_of_an_integrator_with_error_control(name):
    loads = [LoadStep(load=tuple(10 * LOAD))]
    fixed = rig(name)
    ours, adaptive = (
        simulate(r, 0.1, loads=loads) for r in (fixed, rig(name, integrator="cvodes", step=fixed.step_used))
    )
    for kind in ("gap", "gap_lateral"):
        one, other = getattr(ours, kind), getattr(adaptive, kind)
        # |λ|h = 0.5 of the fastest pole, as in the test above
        assert one == pytest.approx(other, abs=3e-6 * np.abs(other - other[:, :1]).max())


def test_the_load_step_that_seemed_to_touch_the_guideway_moves_the_gaps_by_a_fraction_of_a_millimetre():
    history = simulate(rig("comfort_limit"), 1.0, loads=[LoadStep(load=(0, 0, 300, 0, 0), start=0.5)])
    assert history.contact is None
    assert 1e-4 < np.abs(history.gap_lateral).max() < 1e-3


@pytest.mark.parametrize("name", FLOWN)
def test_the_step_resolves_the_fastest_pole(name):
    chosen = rig(name)
    assert chosen.step_used <= LONGEST_STEP
    assert np.abs(chosen.poles).max() * chosen.step_used <= 0.5 * (1 + 1e-12)


def test_a_step_at_which_a_decaying_pole_grows_is_refused_with_the_largest_that_does_not():
    with pytest.raises(InputError, match=r"at most 0.00323 s.*\(\|λ\| = 863.* 1/s\).*got 0.004 s"):
        rig("comfort_limit", step=0.004)
    largest, _ = largest_step(rig("comfort_limit").poles)
    rig("comfort_limit", step=0.999 * largest)
    with pytest.raises(InputError, match="integration step must be at most"):
        rig("comfort_limit", step=1.001 * largest)
    rig("comfort_limit", step=0.004, sample_time=0.001)  # a whole fraction of the sample time, and commands are held


def test_a_step_between_fine_and_unstable_is_warned_of_in_the_record():
    assert rig("comfort_limit").warning is None
    coarse = rig("comfort_limit", step=0.002)
    assert "(|λ| = 863.1 1/s) is not resolved by the step of 2 ms" in coarse.warning
    assert "0.579 ms resolves it" in coarse.warning


def test_the_region_of_runge_kutta_ends_where_its_growth_passes_one():
    def growth(z):
        return abs(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24)

    # on the negative real axis at 2.785293563 (Hairer & Wanner), just left of the imaginary axis at √8
    assert largest_step(np.array([-1.0 + 0j]))[0] == pytest.approx(2.785293563, rel=1e-9)
    assert largest_step(np.array([1j - 1e-9]))[0] == pytest.approx(np.sqrt(8), rel=1e-6)
    for pole in np.random.default_rng(1).standard_normal((20, 2)) @ [1, 1j] * 10.0 ** np.arange(-10, 10):
        decaying = complex(-abs(pole.real), pole.imag)
        end, binding = largest_step(np.array([decaying, 5.0 + 0j]))  # a growing pole does not count
        assert binding == decaying
        assert growth(decaying * end * (1 - 1e-6)) < 1 < growth(decaying * end * (1 + 1e-6))


def test_the_motors_fly_with_their_own_gains():
    loaded = rig("hybrid_motor")
    history = simulate(loaded, 0.3, loads=[LoadStep(load=(0.0, 0.0, 300.0, 0.0, 2000.0))])
    assert history.motor.shape == (4, len(history.time))
    # d against the side force, q against the yaw moment, the right against the left
    assert history.motor[0] == pytest.approx(-history.motor[1], abs=1e-12)
    assert np.abs(history.motor[[0, 2]]).max() > 1e-4
    limited = simulate(rig("hybrid_motor", motor_limit=1e-4), 0.3, loads=[LoadStep(load=(0, 0, 300, 0, 2000))])
    assert np.abs(limited.motor_command).max() == 1e-4


def test_a_bump_between_two_samples_is_touched():
    # 1.2 m of bump take 9 ms of the 20 ms between samples, from 4 ms after the first; the control coil, 0.1 m below
    # the main coil, is given 10 mm of clearance
    sampled = rig("robust_vehicle", sample_time=0.02, gap=0.11)
    touched, clear = (
        simulate(sampled, 0.02, course=ShapedGuideway(A1=VersineBump(start=134 * 0.004, length=1.2, peak=peak)))
        for peak in (0.015, 0.008)
    )
    assert touched.contact is not None
    assert 0.004 < touched.contact.time < 0.0085  # on the way up
    assert len(touched.time) == 1  # the sample before
    assert clear.contact is None
    # looked at every 2 ms: less than a millisecond from the top, the bump is within a tenth of its height
    assert 0.002 < clear.floor.min() < 0.003


def test_a_load_that_comes_on_at_a_step_is_not_felt_before_it():
    step = 0.002
    history = simulate(
        rig("robust_vehicle", step=step), 0.1, loads=[LoadStep(load=(300.0, 0, 0, 0, 0), start=10 * step)]
    )
    assert np.abs(history.pose[0, :11]).max() < 1e-12
    from_start = simulate(rig("robust_vehicle", step=step), 0.05, loads=[LoadStep(load=(300.0, 0, 0, 0, 0))])
    assert history.pose[0, 10:30] == pytest.approx(from_start.pose[0, :20], rel=1e-6, abs=1e-13)


def test_guideway_and_sensor_noise_of_a_run_have_seeds_of_their_own():
    pairs = seeds(3, 50)
    assert len({number for pair in pairs for number in pair}) == 100
    assert seeds(3, 50) == pairs
