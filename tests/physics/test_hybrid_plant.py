"""The motor on the vehicle: inputs, stiffness and thrust as the motor's own forces give them."""

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.lti.signals import COORDINATES
from workbench.physics.motor import HybridMotor
from workbench.physics.vehicle.drive import AXES, DRIVEN, LOADS, MotorDrive, with_motor

RATES = [f"{name}_rate" for name in COORDINATES]
HYBRID, COILS = load_problem("hybrid_motor"), load_problem("comfort_limit")
PLANT, BARE = HYBRID.setting.plant, COILS.setting.plant
DRIVE = MotorDrive(motor=HybridMotor(), thrust=41e3, current_lag=0.010)


def inertia(plant):
    return 1 / np.diag(plant.B[np.ix_(plant.index("states", RATES), plant.index("inputs", LOADS))])


def test_rated_long_term_current_holds_41_kn():
    # Appendix F, 6.2: 0.956 kA, three printed digits
    assert DRIVE.working_current == pytest.approx(956.0, abs=0.5)


def test_the_problem_is_the_default_vehicle_with_a_motor():
    default = load_problem("revenue_vehicle")
    assert HYBRID.setting.guideway == COILS.setting.guideway
    assert HYBRID.vehicle.with_values(drive=None) == COILS.vehicle
    assert HYBRID.vehicle.drive is not None
    shared = {r.name: r.limit for r in HYBRID.requirements if r.name != "motor current at mean + 3σ"}
    assert shared == {r.name: r.limit for r in default.requirements}


def test_force_per_motor_command_is_the_hybrid_motors_input_matrix():
    # at low frequency the lag is 1; rows Z, M, Y, L, N; columns right, left of d then q; 1e-9: the two routes' rounding
    states = PLANT.index("states", [f"current_{name}" for name in DRIVEN])
    force = inertia(PLANT)[:, None] * PLANT.A[np.ix_(PLANT.index("states", RATES), states)]
    i_q = DRIVE.working_current
    own = 1500.0 * HybridMotor().forces((0.0, i_q, 0.0, i_q)).input_matrix
    expected = own[:, [0, 2, 1, 3]]  # i_dR, i_dL, i_qR, i_qL
    assert force == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_stiffness_added_to_the_vehicle_is_the_hybrid_motors_at_its_working_point():
    i_q = DRIVE.working_current
    rows, columns = PLANT.index("states", RATES), PLANT.index("states", COORDINATES)
    bare_rows, bare_columns = BARE.index("states", RATES), BARE.index("states", COORDINATES)
    added = inertia(PLANT)[:, None] * (PLANT.A[np.ix_(rows, columns)] - BARE.A[np.ix_(bare_rows, bare_columns)])
    expected = HybridMotor().forces((0.0, i_q, 0.0, i_q)).stiffness
    # difference of stiffnesses up to 4e8 N m/rad: 16 digits leave 1e-7 N
    assert added == pytest.approx(expected, abs=1e-6)
    assert expected[COORDINATES.index("Y"), COORDINATES.index("Psi")] == pytest.approx(1.555e5, rel=1e-3)


def test_stiffness_at_the_working_point_is_the_slope_of_the_force_between_two_poses():
    i_q, step = DRIVE.working_current, 1e-5
    motor = HybridMotor(drop=0.4)
    drive = MotorDrive(motor=motor, thrust=41e3)
    for k in range(5):
        pose = np.zeros(6)
        pose[1 + k] = step
        difference = motor.forces((0, i_q, 0, i_q), pose).wrench - motor.forces((0, i_q, 0, i_q), -pose).wrench
        # the row's ends move 8 m × step: (8e-5 m)² κ²/6 = 1e-8 of 1.6e5 N/m, and rounding 1e-12 × 4e4 N / step
        assert difference[1:] / (2 * step) == pytest.approx(drive.stiffness[:, k], abs=1e-1)


def test_antisymmetric_currents_leave_the_thrust_alone():
    row = HybridMotor().forces().thrust_row  # i_dR, i_qR, i_dL, i_qL
    for right, left in ((0, 2), (1, 3)):
        assert row[right] - row[left] == pytest.approx(0.0, abs=1e-9)
    assert 956.2712 * (row[1] + row[3]) == pytest.approx(41e3, rel=1e-6)  # the current is typed to seven digits


def test_a_current_follows_its_command_with_its_own_lag():
    s = 2j * np.pi * 3.0
    seen = PLANT.select(inputs=["command_motor_d_right"], outputs=["current_motor_d_right"])
    assert seen.response([s.imag])[0, 0, 0] == pytest.approx(1 / (1 + 0.010 * s), rel=1e-12)


def test_sensors_feel_the_motors_force_as_they_feel_a_load():
    # one unit of i_d right is a side force and nothing else at drop 0: sensors see it as force_y through the same lag
    omega = [2 * np.pi * 2.0]
    unit = DRIVE.input_matrix[COORDINATES.index("Y"), DRIVEN.index("motor_d_right")]
    sensors = HYBRID.law.sensors
    by_motor = PLANT.select(inputs=["command_motor_d_right"], outputs=sensors).response(omega)[0]
    by_load = PLANT.select(inputs=["force_y"], outputs=sensors).response(omega)[0]
    assert by_motor == pytest.approx(unit * by_load / (1 + 0.010j * omega[0]), rel=1e-9, abs=1e-12)


def test_without_lag_currents_are_the_commands():
    bare = load_problem("report_1975").setting.plant  # no current-loop lag
    plant = with_motor(bare, MotorDrive(motor=HybridMotor(), thrust=41e3))
    assert plant.states == bare.states
    seen = plant.select(inputs=["command_motor_q_left"], outputs=["current_motor_q_left"])
    assert seen.response([1.0])[0, 0, 0] == 1.0


def test_a_motor_below_the_centre_of_gravity_rolls_the_body_when_it_pushes_sideways():
    low = MotorDrive(motor=HybridMotor(drop=0.5), thrust=41e3).input_matrix
    Y, Phi = COORDINATES.index("Y"), COORDINATES.index("Phi")
    # motor.md, 7.4: L = −z_L Y
    assert low[Phi, :2] == pytest.approx(-0.5 * low[Y, :2], rel=1e-9)


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        ({"thrust": 70e3}, "the thrust must not exceed what the rated current of 1500 A gives"),
        ({"thrust": float("nan")}, "thrust must be finite"),
        ({"thrust": 41e3, "current_lag": -1.0}, "current_lag must not be negative"),
    ],
)
def test_a_drive_that_cannot_be_is_refused(fields, sentence):
    with pytest.raises(InputError, match=sentence):
        MotorDrive(motor=HybridMotor(), **fields)


def test_one_lag_without_the_other_is_refused():
    with pytest.raises(InputError, match="either both or neither of motor and control coils must have a current lag"):
        with_motor(BARE, MotorDrive(motor=HybridMotor(), thrust=41e3))


def test_names_of_commands_follow_axes_and_sides():
    expected = tuple(f"{axis}_{side}" for axis in AXES for side in ("right", "left"))
    assert expected == DRIVEN
    assert set(HYBRID.law.commands) <= set(PLANT.inputs)
    assert set(HYBRID.law.currents) <= set(PLANT.outputs)


def test_frozen_where_it_flies_the_vehicle_with_a_motor_is_itself():
    # 2e-3: the coils' own slopes against the report's printed digits
    plant, current = HYBRID.setting.offsets.plant(0.0, 0.0)
    assert plant.inputs == PLANT.inputs
    assert plant.states == PLANT.states
    assert current == pytest.approx(0.0, abs=1e-12)
    assert np.linalg.eigvals(plant.A).imag.max() == pytest.approx(np.linalg.eigvals(PLANT.A).imag.max(), rel=2e-3)
    aside, _ = HYBRID.setting.offsets.plant(0.05, 0.05)
    bare, _ = COILS.setting.offsets.plant(0.05, 0.05)
    springs = [
        m.A[np.ix_(m.index("states", RATES), m.index("states", COORDINATES))]
        for one, other in ((aside, bare), (PLANT, BARE)) for m in (one, other)
    ]  # fmt: skip
    # the motor's slopes are the same at every pose: 1e-9 of the coils' stiffness is rounding
    assert springs[0] - springs[1] == pytest.approx(springs[2] - springs[3], abs=1e-9 * np.abs(springs[0]).max())
