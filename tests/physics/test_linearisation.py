"""The linear vehicle: printed and computed entries, decoupling, switches."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from workbench.constants import GRAVITY
from workbench.control.loop import subject
from workbench.control.loop.subject import coupling
from workbench.errors import InputError
from workbench.ledger.baseline import report_law, report_model, report_vehicle
from workbench.lti import Plant
from workbench.physics.vehicle import Extras, Vehicle, linearise, trim
from workbench.physics.vehicle.equations import equations


def test_the_mass_is_the_weight_over_gravity():
    assert report_vehicle().mass == pytest.approx(45357, abs=0.5)  # kg; A.3 prints 444.8 kN


def test_stiffness_entries_are_the_tables():
    # Tables B-1 and B-2 with the coefficients of A.3, evaluated by hand to five digits
    expected = [[-3.5749e6, 2.4130e6, 0, 0, 0], [2.3492e6, -2.4880e8, 0, 0, 0], [0, 0, -1.2972e6, 1.4402e6, -8.7561e5],
                [0, 0, 1.4402e6, -4.7241e6, 9.6027e5], [0, 0, -8.9079e5, 7.4318e5, -9.0651e7]]  # fmt: skip
    assert report_model().stiffness == pytest.approx(np.array(expected), rel=5e-5, abs=1e-6)


def test_passive_frequencies_are_undamped():
    roots = report_model().plant.poles()
    assert np.abs(roots.real).max() < 1e-9
    # our own numbers: sway/roll 0.628 and yaw… in Hz
    assert sorted(np.abs(roots) / (2 * np.pi))[::2] == pytest.approx([0.628, 0.828, 1.324, 1.385, 1.447], abs=5e-4)


@given(
    x=st.tuples(st.floats(3.0, 12.0), st.floats(3.0, 12.0)),
    half_track=st.floats(0.5, 2.0),
    depth=st.floats(0.1, 2.0),
    gravity=st.booleans(),
    coil=st.floats(0.0, 4.0),
)
@settings(max_examples=10, deadline=None)
def test_a_vehicle_that_is_its_own_mirror_image_decouples_exactly(x, half_track, depth, gravity, coil):
    vehicle = report_vehicle().with_values(
        positions=((x[0], half_track), (x[0], -half_track), (-x[1], half_track), (-x[1], -half_track)), depth=depth,
        extras=Extras(gravity_term=gravity, coil_length=coil, current_lag=0.01, thrust=1e4),
    )  # fmt: skip
    assert coupling(linearise(vehicle).plant) < 1e-14


def test_an_asymmetric_vehicle_is_not_split_into_groups():
    lopsided = report_vehicle().with_values(positions=((9.0, 0.965), (9.0, -0.9), (-7.65, 0.965), (-7.65, -0.965)))
    with pytest.raises(InputError, match="Place the coil sets symmetrically"):
        subject(linearise(lopsided).plant, report_law(), "heave_pitch")


@pytest.mark.parametrize("lag", [0.0, 0.01])
@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
def test_a_vehicle_with_one_weak_set_is_not_split_into_groups_though_its_stiffness_is_symmetric(lag, unit):
    plant = linearise(report_vehicle().with_values(extras=Extras(current_lag=lag))).plant

    def with_forces(shares):
        """The plant whose sets pull with a share of their force per current; currents in other units."""
        A, B = plant.A.copy(), plant.B.copy()
        for number, share in enumerate(shares, 1):
            if lag:
                A[:10, plant.index("states", [f"current_{number}"])] *= share * unit
            else:
                B[:10, plant.index("inputs", [f"command_{number}"])] *= share * unit
        return Plant(
            A=A, B=B, C=plant.C, D=plant.D, states=plant.states, inputs=plant.inputs, outputs=plant.outputs
        )  # fmt: skip

    assert subject(with_forces([0.7] * 4), report_law(), "heave_pitch").name == "heave_pitch"
    for group in ("heave_pitch", "heave", "sway_roll_yaw"):
        with pytest.raises(InputError, match="acceleration per current"):
            subject(with_forces([0.7, 1, 1, 1]), report_law(), group)
    assert subject(with_forces([0.7, 1, 1, 1]), report_law(), "all").name == "all"


def test_the_linear_plant_is_the_tangent_of_the_nonlinear_one():
    vehicle = report_vehicle()
    motion = equations(vehicle)
    inputs = [motion.pose, motion.velocity, motion.alpha, motion.zeta, motion.eta, motion.bank, motion.external]
    accelerate = ca.Function("a", inputs, [motion.acceleration])
    plant, external = linearise(vehicle).plant, trim(vehicle).external
    draw = np.random.default_rng(3)
    pose, velocity, alpha, zeta = draw.normal(size=5), draw.normal(size=5), draw.normal(size=4), draw.normal(size=4)
    columns = plant.index("inputs", [f"command_{i}" for i in range(1, 5)] + [f"zeta_{i}" for i in range(1, 5)])
    linear = plant.A[5:] @ np.concatenate([pose, velocity]) + plant.B[5:, columns] @ np.concatenate([alpha, zeta])
    left = []
    for size in (1e-3, 1e-4):
        exact = accelerate(pose * size, velocity * size, alpha * size, zeta * size, np.zeros(4), np.zeros(4), external)
        left.append(exact.full().ravel() - size * linear)
    # what is left falls with the square of the displacement, to the next order
    assert left[0] == pytest.approx(100 * left[1], rel=0.05, abs=1e-8)
    assert np.abs(left[1]).max() > 1e-7  # and is not rounding


def test_the_lag_puts_one_state_before_each_current():
    plant = linearise(report_vehicle().with_extras(current_lag=0.01)).plant
    assert len(plant.states) == 14
    own = plant.response(100.0)[0][plant.index("outputs", ["current_1"])[0], plant.index("inputs", ["command_1"])[0]]
    assert own == pytest.approx(1 / (1 + 1j))


def test_the_coil_centre_moments_stiffen_pitch_by_one_per_cent():
    # L²/12 · 4 F_Lh for the 3 m coil
    long = linearise(report_vehicle().with_extras(coil_length=3.0))
    difference = (long.stiffness - report_model().stiffness)[1, 1]
    assert difference == pytest.approx(9 / 12 * 4 * -8.9372e5, rel=1e-9)
    assert difference / report_model().stiffness[1, 1] == pytest.approx(0.011, abs=5e-4)


def test_the_thrust_pushes_where_the_nose_points():
    pushed = linearise(report_vehicle().with_extras(thrust=1e4))
    difference = pushed.stiffness - report_model().stiffness
    assert difference[2, 4] == pytest.approx(1e4)
    assert difference[0, 1] == pytest.approx(-1e4)  # nose up lifts, Z is down


def test_magnetic_damping_opposes_the_motion():
    damped = linearise(report_vehicle().with_extras(lift_damping=2e3, lateral_damping=1e3))
    assert damped.damping[0, 0] == pytest.approx(-8e3)
    assert damped.damping[2, 2] == pytest.approx(-4e3)
    assert np.linalg.eigvals(damped.plant.A).real.max() < 0


def test_bad_vehicles_are_refused():
    with pytest.raises(InputError, match="mass must be positive; got -1"):
        report_vehicle().with_values(mass=-1.0)
    with pytest.raises(InputError, match="must sit on one side"):
        report_vehicle().with_values(positions=((1.0, 0.0),) * 4)
    with pytest.raises(InputError, match="current_lag must not be negative"):
        Extras(current_lag=-0.01)
    with pytest.raises(InputError, match="bank_reading must be one of"):
        Extras(bank_reading="roll")


def test_the_vehicle_knows_its_arms():
    vehicle = report_vehicle()
    assert (vehicle.front, vehicle.rear, vehicle.count, vehicle.sides) == (9.0, 7.65, 4, (1, -1, 1, -1))
    assert isinstance(vehicle, Vehicle)
    assert vehicle.mass * GRAVITY == pytest.approx(444.8e3)
