"""Curves and transitions: what a body feels that moves with the guideway, and how the guideway lies under its sets."""

import numpy as np
import pytest

from workbench.constants import GRAVITY
from workbench.files.problem import load_problem
from workbench.physics.vehicle.conditions import Conditions, Curve
from workbench.physics.vehicle.operating import operating_point
from workbench.simulation import Rig, simulate

VEHICLE = load_problem("comfort_limit").vehicle
CURVES = [
    Curve(lateral=0.5, cant=0.05),
    Curve(lateral=0.5, cant=0.05, roll_rate=0.05),
    Curve(lateral=1.0, cant=0.1, roll_rate=0.05, roll_acceleration=0.05, lateral_jerk=0.3),
    Curve(lateral=-2.0, cant=-0.3, roll_rate=-0.4, roll_acceleration=0.2, lateral_jerk=-1.0),
    Curve(lateral=0.0, cant=0.0, roll_acceleration=0.05),
]


def newton_euler(curve: Curve, vehicle) -> list[float]:
    """The loads by the formulas of a rotating frame: a = a_O + α×ρ + ω×(ω×ρ), M = −Iα − ω×Iω."""
    m, depth, s, c = vehicle.mass, vehicle.depth, np.sin(curve.cant), np.cos(curve.cant)
    turn, turn_rate, p = curve.lateral / vehicle.speed, curve.lateral_jerk / vehicle.speed, curve.roll_rate
    omega = np.array([p, turn * s, turn * c])
    alpha = np.array([curve.roll_acceleration, turn_rate * s + turn * c * p, turn_rate * c - turn * s * p])
    rho, inertia = np.array([0, 0, -depth]), np.diag([vehicle.roll_inertia, vehicle.pitch_inertia, vehicle.yaw_inertia])
    acceleration = curve.lateral * np.array([0, c, -s]) + np.cross(alpha, rho) + np.cross(omega, np.cross(omega, rho))
    force = m * (GRAVITY * np.array([0, s, c]) - acceleration) - np.array([0, 0, m * GRAVITY])
    moment = -(inertia @ alpha) - np.cross(omega, inertia @ omega)
    return [force[2], moment[1], force[1], moment[0], moment[2]]


@pytest.mark.parametrize("curve", CURVES)
def test_the_loads_of_a_curve_are_those_of_newton_and_euler_in_a_rotating_frame(curve):
    expected = newton_euler(curve, VEHICLE)
    assert curve.loads(VEHICLE) == pytest.approx(expected, rel=1e-10, abs=1e-6)


def test_the_centre_of_gravity_swings_above_the_line_the_track_turns_about():
    # 45.36 t, 1.21 m above the line: 2.74 kN at 0.05 rad/s²; −23.3 kN of unbalanced curve become −26.0 kN
    curve = Curve(lateral=0.5137, roll_acceleration=0.0)
    swinging = Curve(lateral=0.5137, roll_acceleration=0.05)
    assert curve.loads(VEHICLE)[2] == pytest.approx(-23.3e3, abs=50)
    assert swinging.loads(VEHICLE)[2] == pytest.approx(-26.0e3, abs=50)
    rolling = Curve(lateral=0.0, roll_rate=0.2)
    assert rolling.loads(VEHICLE)[0] == pytest.approx(-VEHICLE.mass * VEHICLE.depth * 0.2**2, rel=1e-12)


def test_the_sets_see_the_horizontal_arc_from_canted_axes():
    curve, radius = Curve(lateral=1.0, cant=0.2), VEHICLE.speed**2 / 1.0
    zeta, eta, bank = curve.irregularity(VEHICLE)
    for i, ((x, _), side) in enumerate(zip(VEHICLE.positions, VEHICLE.sides, strict=True)):
        across = radius * (1 - np.cos(x / radius))  # to the right, of a point x along the circle
        # 9 m of 18 km: the arc's next term is 2e-8 of the first
        assert zeta[i] == pytest.approx(across * np.sin(0.2), rel=1e-6)
        assert eta[i] == pytest.approx(side * across * np.cos(0.2), rel=1e-6)
    assert not bank.any()


def test_a_growing_roll_rate_twists_the_guideway_under_the_vehicle():
    curve = Curve(lateral=0.0, roll_rate=0.1, roll_acceleration=0.5)
    _, _, bank = curve.irregularity(VEHICLE)
    time = np.array([x for x, _ in VEHICLE.positions]) / VEHICLE.speed
    assert bank == pytest.approx(0.1 * time + 0.25 * time**2, rel=1e-12)


@pytest.mark.slow
def test_commands_of_joined_sets_can_give_the_currents_that_carry_a_lost_set():
    problem = load_problem("two_coil_corner")
    point = operating_point(problem.vehicle, Conditions(lost_set=1, carried_by="currents"))
    for first, second in problem.vehicle.groups:
        assert point.trim.currents[first] == pytest.approx(point.trim.currents[second], rel=1e-12)
    lift = [
        problem.vehicle.force_law.forces(*d, a)[0] for d, a in zip(point.deviation.T, point.trim.currents, strict=True)
    ]
    assert point.strength @ np.array(lift) == pytest.approx(problem.vehicle.mass * GRAVITY, rel=1e-9)
    history = simulate(Rig(point=point, gains=problem.approved, gap=0.3, gap_lateral=0.3), 0.01)
    assert np.abs(history.acceleration).max() < 1e-9  # was 0.43 m/s²: rest is rest
