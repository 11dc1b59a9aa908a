"""The body compiled once for a structure gives what the equations of each vehicle give."""

import casadi as ca
import numpy as np
import pytest

from workbench.ledger.baseline import report_vehicle
from workbench.physics.forces.law import report_extended
from workbench.physics.vehicle import Conditions, Extras, linearise, trim, varied
from workbench.physics.vehicle import operating as operating_module
from workbench.physics.vehicle.body import Structure, _compiled, deviations, held_by_moment, tangent_at
from workbench.physics.vehicle.conditions import Curve, SideWind
from workbench.physics.vehicle.equations import equations, gaps
from workbench.physics.vehicle.operating import operating_point

EVERYTHING = Extras(
    current_lag=0.01, gravity_term=True, coil_length=3.0, thrust=1e4, lift_damping=900.0, lateral_damping=-300.0,
    bank_reading="section",
)  # fmt: skip
POSE = np.array([0.02, 0.003, -0.01, 0.004, -0.002])
CURRENTS = np.array([0.02, -0.01, 0.015, 0.005])
LOADS = np.array([1e3, 2e4, -3e3, 4e3, -5e3])


def by_equations(vehicle, pose, currents, external):
    """Rate and Jacobians of the vehicle's own equations, built and differentiated anew."""
    m = equations(vehicle)
    state = ca.vertcat(m.pose, m.velocity)
    signals = ca.vertcat(m.alpha, m.zeta, m.eta, m.bank, m.external, m.surface_rate)
    rate = ca.vertcat(m.pose_rate, m.acceleration)
    output = ca.vertcat(m.pose, m.velocity, m.acceleration, m.gap, m.gap_lateral, m.sensed_z, m.sensed_y)
    f = ca.Function(
        "f", [state, signals], [rate, *(ca.jacobian(y, x) for y in (rate, output) for x in (state, signals))]
    )
    n = vehicle.count
    inputs = np.concatenate([currents, np.zeros(3 * n), external, np.zeros(2 * n)])
    return [o.full() for o in f(np.concatenate([pose, np.zeros(5)]), inputs)]


@pytest.mark.parametrize("extras", [Extras(), EVERYTHING])
@pytest.mark.parametrize("changed", [{}, {"mass": 0.85, "yaw_inertia": 1.1, "current_force": 0.9, "gap_force": 1.08}])
def test_the_compiled_body_is_the_tangent_of_the_equations(extras, changed):
    vehicle = varied(report_vehicle().with_values(extras=extras), **changed)
    here = tangent_at(vehicle, POSE, CURRENTS, external=LOADS)
    rate, *wanted = by_equations(vehicle, POSE, CURRENTS, LOADS)
    # the same expressions in another order of operations: rounding of some hundred terms
    assert here.rate == pytest.approx(rate.ravel(), rel=1e-12, abs=1e-13)
    for ours, theirs in zip(here.state_space, wanted, strict=True):
        assert np.abs(ours - theirs).max() <= 1e-12 * np.abs(theirs).max()


def test_sets_in_other_places_of_a_law_with_products_have_their_own_slopes():
    vehicle = report_vehicle().with_values(force_law=report_extended(), depth=0.9, positions=(
        (5.0, 1.1), (5.0, -0.9), (0.5, 1.1), (-4.0, -0.9), (-6.0, 1.0), (-6.5, -1.0)))  # fmt: skip
    currents = np.linspace(-0.03, 0.02, 6)
    here = tangent_at(vehicle, POSE, currents)
    _, *wanted = by_equations(vehicle, POSE, currents, np.zeros(5))
    for ours, theirs in zip(here.state_space, wanted, strict=True):
        assert np.abs(ours - theirs).max() <= 1e-12 * np.abs(theirs).max()  # rounding of some hundred terms


def test_a_set_of_half_strength_keeps_half_of_its_forces():
    vehicle = report_vehicle()
    nothing = np.zeros(5), np.zeros(4)
    whole, half, none = (
        tangent_at(vehicle, *nothing, strength=np.array([s, 1.0, 1.0, 1.0])).slopes[5:10] for s in (1.0, 0.5, 0.0)
    )
    assert half == pytest.approx((whole + none) / 2, rel=1e-12, abs=1e-12)  # affine in the strength
    assert np.abs(none[:, 10]).max() == 0.0  # its current does nothing


def test_deviations_are_those_of_the_kinematics():
    vehicle = report_vehicle()
    gap, lateral = gaps(vehicle, ca.SX(POSE), ca.SX.zeros(4), ca.SX.zeros(4))
    ours = deviations(vehicle, POSE)
    assert ours[:2] == pytest.approx(np.array(ca.DM(ca.horzcat(gap, lateral))).T, rel=1e-12, abs=1e-15)  # rounding
    assert ours[2] == pytest.approx([-s * POSE[3] for s in vehicle.sides], rel=1e-15)


def test_vehicles_that_differ_by_numbers_share_one_function():
    vehicle = report_vehicle()
    linearise(vehicle)
    built = _compiled.cache_info().misses
    for mass in (0.8, 0.9, 1.1):
        moved = varied(vehicle, mass=mass, gap_force=1 / mass).with_values(depth=mass)
        linearise(moved.with_values(positions=tuple((x - mass, y) for x, y in moved.positions)))
    assert _compiled.cache_info().misses == built
    assert Structure.of(vehicle) != Structure.of(vehicle.with_extras(gravity_term=True))


def test_the_help_at_the_nominal_pose_is_that_of_a_trim_by_moment():
    quick, slow = held_by_moment(report_vehicle()), trim(report_vehicle())
    # the vertical residual is a difference of forces of 4e5 N
    assert quick.external == pytest.approx(slow.external, rel=1e-12, abs=1e-9)
    assert quick.residual == pytest.approx(slow.residual, rel=1e-12, abs=1e-9)


@pytest.mark.parametrize(
    "conditions",
    [
        Conditions(mass=50e3, cg_forward=0.4),
        Conditions(wind=SideWind(force=2e4, above=1.0), curve=Curve(lateral=0.5), carried_by="currents"),
    ],
)
def test_full_steps_and_shares_of_the_load_end_in_the_same_equilibrium(conditions, monkeypatch):
    quick = operating_point(report_vehicle(), conditions).trim
    monkeypatch.setattr(operating_module, "STEPS", 0)
    slow = operating_point(report_vehicle(), conditions).trim
    assert quick.pose == pytest.approx(slow.pose, rel=1e-10, abs=1e-12)  # a picometre
    assert quick.currents == pytest.approx(slow.currents, rel=1e-10, abs=1e-12)
