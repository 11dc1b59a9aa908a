"""What a law keeps in reserve, held against the law itself: perturbed, delayed, resampled, moved."""

import numpy as np
import pytest

from workbench.analysis.break_parts import delayed
from workbench.analysis.break_points import KINDS, break_points
from workbench.analysis.frozen import frozen
from workbench.analysis.loop_rows import ReserveAt, damping_rows
from workbench.analysis.reserve_loops import ReserveLoops
from workbench.analysis.sampled_cases import sampled_cases
from workbench.analysis.variations import variations
from workbench.control.gains import GAIN_NAMES
from workbench.control.loop import subject
from workbench.control.loop.affine import LawFunction, Stacked
from workbench.control.loop.closed import interconnect
from workbench.files.problem import load_problem

# Printed by an independent program for the approved gains of 2026-11 (four digits): point -> (gain up or down, disk).
INDEPENDENT = {
    "modal:sway": (1.052, 0.045), "modal:roll": (0.947, 0.049), "kind:acceleration_z": (0.877, 0.117),
    "kind:acceleration_y": (1.118, 0.097), "kind:gap_lateral": (2.00, 0.667), "sensor:acceleration_y_3": (1.443, 0.317),
}  # fmt: skip
GAINS_THEN = {
    "K_h": 9.18611, "K_hdot": -30.1695, "tau_h": 4.0, "K_hp": 0.720098, "K_hpdot": -0.369599, "tau_hp": 0.234536,
    "K_zddot": 0.195777, "K_zdot": 1.08893, "tau_z": 3.14525, "K_yddot": -0.129188, "K_ydot": -0.372397,
    "tau_y": 0.0722977, "K_heave": 1.0, "K_pitch": 1.38296, "K_sway": 1.0, "K_roll": 1.74789, "K_yaw": -3.53215,
}  # fmt: skip


@pytest.fixture(scope="module")
def problem():
    return load_problem("revenue_vehicle")


@pytest.fixture(scope="module")
def gains(problem):
    return problem.approved.with_values(**GAINS_THEN)


@pytest.fixture(scope="module")
def points(problem, gains):
    return {b.point: b for b in break_points(problem.setting, gains)}


@pytest.fixture(scope="module")
def whole(problem):
    return subject(problem.setting.plant, problem.setting.law, "all")


def growth(whole, gains, factor, sensors=(), commands=()):
    """Largest real part with sensors and commands times a factor."""
    law = whole.law
    A, B, C, D = whole.controller(gains)
    right = np.array([factor if name in sensors else 1.0 for name in law.sensors])
    left = np.array([factor if name in commands else 1.0 for name in law.commands])
    controller = A, B * right, left[:, None] * C, left[:, None] * D * right
    names = [f"filter {k}" for k in range(len(A))]
    return interconnect(whole.plant, controller, whole.commands, law.sensors, names).poles().real.max()


def members(law, point):
    kind, _, name = point.partition(":")
    if kind == "kind":
        return [f"{k}_{i + 1}" for k in KINDS[name] for i in range(law.count)], []
    if kind == "sensor":
        return [name], []
    return [], list(law.commands) if name == "uniform" else [f"command_{name}"]


SCALED = [
    *(f"kind:{k}" for k in KINDS),
    "sensor:acceleration_z_1",
    "sensor:acceleration_y_3",
    "current:1",
    "currents:uniform",
]


@pytest.mark.parametrize("point", SCALED)
def test_a_gain_margin_is_where_the_scaled_loop_loses_stability(points, whole, gains, point):
    sensors, commands = members(whole.law, point)
    b = points[point]
    # 1e-4 beside a margin the growth has its sign; a margin that is not there is looked for up to 50 and down to zero
    if np.isfinite(b.gain_up):
        assert growth(whole, gains, b.gain_up * (1 - 1e-4), sensors, commands) < 0
        assert growth(whole, gains, b.gain_up * (1 + 1e-4), sensors, commands) > 0
    if b.gain_down > 0:
        assert growth(whole, gains, b.gain_down * (1 + 1e-4), sensors, commands) < 0
        assert growth(whole, gains, b.gain_down * (1 - 1e-4), sensors, commands) > 0
    inside = np.r_[
        np.linspace(max(b.gain_down, 0.0) + 1e-3, 1.0, 30), np.geomspace(1.0, min(b.gain_up * 0.999, 50.0), 30)
    ]
    assert all(growth(whole, gains, k, sensors, commands) < 0 for k in inside)


@pytest.mark.parametrize("point", list(INDEPENDENT))
def test_margins_are_those_of_an_independent_program(points, point):
    factor, disk = INDEPENDENT[point]
    b = points[point]
    nearest = b.gain_up if factor > 1 else b.gain_down
    assert nearest == pytest.approx(factor, rel=1e-3)  # four digits printed
    assert b.disk == pytest.approx(disk, abs=6e-4)  # three


def test_a_delay_margin_is_where_a_dead_time_in_its_place_loses_stability(problem, gains, points):
    theta = np.array([getattr(gains, name) for name in GAIN_NAMES])
    reserve = ReserveLoops(problem.setting)
    for name in (
        "kind:acceleration_z",
        "kind:vertical",
        "kind:acceleration_y",
        "pattern:pitch",
        "modal:roll",
        "modal:sway",
    ):
        margin = points[name].delay

        def decay(factor, name=name, margin=margin):
            found = []
            for part, loops in zip(
                reserve.points[name].parts, delayed(reserve.points[name], reserve.groups, factor * margin), strict=True
            ):
                loop, modal = loops
                group = reserve.groups[part.group]
                found.append(loop.roots((group.modal_law if modal else group.law)(theta))[0].real.max())
            return max(found)

        # the fraction of third order is exact to 1e-3 of the crossing's phase here
        assert decay(0.99) < 0 < decay(1.01), name


def test_rows_that_steer_see_what_judges(problem, gains, points):
    theta = np.array([getattr(gains, name) for name in GAIN_NAMES])
    at = ReserveAt(ReserveLoops(problem.setting), theta)
    for name, b in points.items():
        values, _ = at.rows(name, 1.0)
        # 180 frequencies over five decades miss a crest by at most a percent
        assert 1 / (1 - values.min()) == pytest.approx(b.disk, rel=0.01), name


def test_derivatives_of_rows_are_those_of_differences(problem, gains):
    theta = np.array([getattr(gains, name) for name in GAIN_NAMES])
    reserve, step = ReserveLoops(problem.setting), 1e-6
    group = reserve.groups[1]
    for k in (1, 5, 6, 9, 15):
        moved = [theta.copy(), theta.copy()]
        size = step * max(1.0, abs(theta[k]))
        moved[0][k] += size
        moved[1][k] -= size
        for name in ("kind:vertical", "sensor:acceleration_y_1", "current:3", "modal:roll"):
            both = [ReserveAt(reserve, t).rows(name, 0.5)[0] for t in moved]
            slope = ReserveAt(reserve, theta).rows(name, 0.5)[1]
            # central differences of a crest: 1e-6 of the largest slope
            assert np.abs((both[0] - both[1]) / (2 * size) - slope[:, k]).max() < 1e-5 * (1 + np.abs(slope).max())
        both = [damping_rows(group.loop, group.law(t), 0.3)[0] for t in moved]
        slope = damping_rows(group.loop, group.law(theta), 0.3)[1]
        assert np.abs((both[0] - both[1]) / (2 * size) - slope[:, k]).max() < 1e-5 * (1 + np.abs(slope).max())


def test_variations_are_those_of_an_independent_program(problem, gains):
    found = {v.name: v for v in variations(problem.setting, gains)}
    printed = {
        "scale:acceleration_y:1.1": 0.081, "scale:lateral:1.1": 0.084, "scale:acceleration_z:0.9": 0.099,
        "scale:vertical:0.9": 0.103, "mass:0.85": 0.312, "force:0.9": 0.359, "lost:1": 0.234, "lost:3": 0.207,
    }  # fmt: skip
    for name, damping in printed.items():
        assert found[name].damping == pytest.approx(damping, abs=6e-4), name  # three digits printed
    dead = found["dead:acceleration_z_1"]
    assert dead.damping == -1
    assert not dead.stable
    assert dead.peak_sensitivity is None
    assert dead.decay == pytest.approx(-89, abs=0.5)  # printed +89/s
    assert {f"dead:{s}" for s in problem.setting.law.sensors} <= set(found)


def test_a_sampled_loop_is_that_of_an_independent_program(problem, gains):
    first, second, third = sampled_cases(problem.setting, gains)
    assert (first.damping, max(first.peak_sensitivity.values())) == pytest.approx((0.392, 2.04), abs=5e-3)
    assert (second.damping, max(second.peak_sensitivity.values())) == pytest.approx((0.15220, 4.108), abs=5e-4)
    assert np.exp(-third.decay * 0.002) == pytest.approx(1.18, abs=5e-3)  # printed |z| of the growing root
    assert third.peak_sensitivity["heave_pitch"] is None


def test_sampled_rows_have_the_roots_of_the_sampled_loop(problem, gains):
    from workbench.analysis.sampled import between_samples

    theta, T = np.array([getattr(gains, name) for name in GAIN_NAMES]), 0.001
    roots = []
    for s in problem.setting.subjects:
        seen = s.plant.select(inputs=s.commands, outputs=problem.setting.law.sensors)
        loop = Stacked.from_plant(s.name, *between_samples(seen, T, T), len(s.modal_rows), T)
        roots.append(loop.roots(LawFunction(s, T)(theta))[0])
    roots = np.concatenate(roots)
    case = sampled_cases(problem.setting, gains, [(T, 1.0)])[0]
    assert (-roots.real / np.abs(roots)).min() == pytest.approx(case.damping, rel=1e-9)  # the same matrices


def test_the_exact_law_behind_printed_coefficients_has_the_printed_ratio(problem):
    assert problem.setting.offsets.law.lift_ratio == pytest.approx(0.8380, abs=5e-5)  # report, A.3


def test_the_loop_frozen_at_rest_is_the_loop_and_sides_are_alike(problem, gains):
    at = {(f.heave, f.sway): f for f in frozen(problem.setting, gains)}
    nominal = np.concatenate([s.close(gains).poles() for s in problem.setting.subjects])
    damping = (-nominal.real / np.abs(nominal)).min()
    assert len(at) == 21
    assert at[0.0, 0.0].damping == pytest.approx(damping, rel=1e-3)  # coefficients are printed to five digits
    assert abs(at[0.0, 0.0].current) < 1e-6
    for heave in (-0.12, 0.0, 0.08):
        assert at[heave, -0.1].damping == pytest.approx(at[heave, 0.1].damping, rel=1e-9)  # a mirror image


def test_riding_high_and_aside_the_old_gains_flutter(problem, gains):
    high = frozen(problem.setting, gains, heave=(0.09, 0.10, 0.12), sway=(0.0,))
    growth = [-f.decay for f in high]
    # an independent program with the slopes alone prints 0.63, 2.5, 6.4; the pose turns forces too, a few per cent
    assert growth == pytest.approx([0.63, 2.5, 6.4], rel=0.05)
    aside = frozen(problem.setting, gains, heave=(0.04,), sway=(0.1,))[0]
    assert -aside.decay == pytest.approx(5.3, rel=0.05)
