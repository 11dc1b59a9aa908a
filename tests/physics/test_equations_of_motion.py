"""The nonlinear equations against rigid-body mechanics that does not use them."""

import casadi as ca
import numpy as np
import pytest

from workbench.constants import GRAVITY
from workbench.ledger.baseline import report_vehicle
from workbench.physics.forces.law import FirstOrderLaw
from workbench.physics.vehicle.equations import equations, gaps, rotation

NONE = np.zeros(5)
STATES = [np.random.default_rng(seed).uniform(-0.2, 0.2, 10) for seed in range(4)]


def weightless(**fields):
    """The vehicle without magnetic forces."""
    none = (0.0,) * 5
    return report_vehicle().with_values(
        force_law=FirstOrderLaw(lift=none, lateral=none, moment=none, drag_ratio=0.0), **fields
    )


def at(motion, expression, state, loads=NONE):
    """An expression of the motion at pose and velocity `state` (10,), without currents and irregularities."""
    n = motion.alpha.numel()
    inputs = [motion.pose, motion.velocity, motion.alpha, motion.zeta, motion.eta, motion.bank, motion.external]
    values = [state[:5], state[5:], *[np.zeros(n)] * 4, loads]
    return ca.Function("f", inputs, [ca.densify(expression)])(*values).full()


def along_motion(motion, expression):
    """Time derivative of an expression of pose and velocity."""
    state, rate = ca.vertcat(motion.pose, motion.velocity), ca.vertcat(motion.pose_rate, motion.acceleration)
    return ca.jtimes(expression, state, rate)


@pytest.mark.parametrize("angles", [(0.1, -0.2, 0.3), (0.0, 0.5, -1.0), (2.0, 0.1, 0.2)])
def test_the_rotation_is_the_product_of_three_turns_about_moving_axes(angles):
    from scipy.spatial.transform import Rotation

    roll, pitch, yaw = angles
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix()
    assert np.array(ca.DM(rotation(*angles))) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("state", STATES)
def test_the_rotation_turns_at_the_body_rates(state):
    motion = equations(report_vehicle())
    R = rotation(motion.pose[3], motion.pose[1], motion.pose[4])
    _, q, _, p, r = state[5:]
    spin = np.array([[0, -r, q], [r, 0, -p], [-q, p, 0]])
    found = at(motion, along_motion(motion, ca.vec(R)), state).reshape(3, 3, order="F")
    assert found == pytest.approx(at(motion, R, state) @ spin, abs=1e-14)


@pytest.mark.parametrize("state", STATES)
def test_angular_momentum_is_kept_without_moments(state):
    vehicle = weightless()
    motion = equations(vehicle)
    _, q, _, p, r = ca.vertsplit(motion.velocity)
    body = ca.vertcat(vehicle.roll_inertia * p, vehicle.pitch_inertia * q, vehicle.yaw_inertia * r)
    momentum = ca.mtimes(rotation(motion.pose[3], motion.pose[1], motion.pose[4]), body)
    size = np.linalg.norm(at(motion, momentum, state))
    assert at(motion, along_motion(motion, momentum), state) == pytest.approx(np.zeros((3, 1)), abs=1e-13 * size)


@pytest.mark.parametrize("state", STATES)
def test_spin_energy_grows_by_the_power_of_the_moments(state):
    vehicle, moments = weightless(), np.array([0.0, 2e4, 0.0, -1e4, 3e4])
    motion = equations(vehicle)
    _, q, _, p, r = ca.vertsplit(motion.velocity)
    energy = (vehicle.roll_inertia * p**2 + vehicle.pitch_inertia * q**2 + vehicle.yaw_inertia * r**2) / 2
    power = moments[3] * state[8] + moments[1] * state[6] + moments[4] * state[9]
    assert at(motion, along_motion(motion, energy), state, moments).item() == pytest.approx(power, rel=1e-12)


def test_without_forces_it_falls():
    motion = equations(weightless())
    assert at(motion, motion.acceleration, np.zeros(10)).ravel() == pytest.approx([GRAVITY, 0, 0, 0, 0])


@pytest.mark.parametrize("state", STATES)
def test_gap_changes_are_places_of_the_coil_sets(state):
    vehicle = report_vehicle()
    pose = ca.DM(state[:5])
    gap, lateral = (np.array(g).ravel() for g in gaps(vehicle, pose, ca.DM.zeros(4), ca.DM.zeros(4)))
    turn = np.array(ca.DM(rotation(state[3], state[1], state[4])))
    for i, ((x, y), side) in enumerate(zip(vehicle.positions, vehicle.sides, strict=True)):
        place = np.array([0.0, state[2], state[0]]) + turn @ [x, y, vehicle.depth]
        assert gap[i] == pytest.approx(vehicle.depth - place[2], abs=1e-12)  # Z points down, gaps grow upward
        assert lateral[i] == pytest.approx(side * (place[1] - y), abs=1e-12)


@pytest.mark.parametrize("gravity", [False, True])
@pytest.mark.parametrize("state", STATES)
def test_accelerometers_read_the_second_derivative_of_their_place_in_body_axes(state, gravity):
    vehicle = report_vehicle().with_extras(gravity_term=gravity)
    motion = equations(vehicle)
    R = rotation(motion.pose[3], motion.pose[1], motion.pose[4])
    felt = GRAVITY * np.array([0.0, 0.0, 1.0])
    for i, ((x, y), side) in enumerate(zip(vehicle.positions, vehicle.sides, strict=True)):
        place = ca.vertcat(0, motion.pose[2], motion.pose[0]) + ca.mtimes(R, ca.vertcat(x, y, vehicle.depth))
        inertial = at(motion, along_motion(motion, along_motion(motion, place)), state).ravel()
        turn = at(motion, R, state)
        # a strap-down instrument reads acceleration less gravity; zeroed at rest on level ground
        body = turn.T @ inertial - (turn.T @ felt - felt if gravity else 0.0)
        assert at(motion, motion.sensed_y, state)[i, 0] == pytest.approx(side * body[1], abs=1e-9)
        assert at(motion, motion.sensed_z, state)[i, 0] == pytest.approx(-body[2], abs=1e-9)


def test_a_bank_of_the_whole_section_turns_the_forces_with_it():
    vehicle = report_vehicle().with_extras(bank_reading="section")
    motion = equations(vehicle)
    force = vehicle.mass * ca.gradient(motion.acceleration[2], motion.bank)
    everything = at(motion, force, np.zeros(10)).ravel()
    assert everything == pytest.approx(np.full(4, -4.7202e4 + 1.1120e5), rel=1e-12)  # F_Gφ + F_L0, each set
