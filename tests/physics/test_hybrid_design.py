"""The shipped problem hybrid_motor: its figures by second routes, its approved gains, beside comfort_limit."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.analysis.analysis import analyse
from workbench.analysis.full import full_analysis
from workbench.analysis.motor import CURRENTS, current_at_3_sigma, slope_at_3_sigma
from workbench.analysis.response import driven
from workbench.analysis.setting import MotorPoint
from workbench.control.loop import subject
from workbench.control.loop.closed import interconnect
from workbench.design.comparison import compare
from workbench.design.design import design
from workbench.design.robustness import robustness
from workbench.design.steering import Programme
from workbench.errors import InputError
from workbench.files.problem import load_problem
from workbench.goals.ride.motor_current import MotorCurrent
from workbench.goals.ride.requirement import requirement
from workbench.lti.crossing import sign_changes
from workbench.lti.norm import peak_gain
from workbench.lti.signals import COORDINATES, numbered
from workbench.physics.guideway.irregularity import TYPES, phasors

PROBLEM = load_problem("hybrid_motor")
SETTING, GAINS = PROBLEM.setting, PROBLEM.approved
POINT = SETTING.motor


@pytest.fixture(scope="module")
def analysis():
    return analyse(SETTING, GAINS, PROBLEM.name)


def test_cruise_thrust_is_held_while_the_currents_steer(analysis):
    assert analysis.motor.thrust == 41e3
    assert analysis.motor.propulsion_power == pytest.approx(41e3 * 134.0)  # thrust times speed
    # two sides, 3/2 × 16 coils: the mean force of the working point by the motor's own forces is tested with the plant
    assert analysis.motor.working_current == pytest.approx(956.27, abs=0.01)


def test_rms_motor_currents_are_the_areas_under_their_spectra(analysis):
    s = SETTING.subjects[1]
    closed = s.close(GAINS)
    f = np.geomspace(1e-4, 300, 8000)
    omega = 2 * np.pi * f
    wave = phasors(SETTING.law.positions, SETTING.speed, omega)
    w = numbered("zeta", 4) + numbered("eta", 4)
    response = closed.select(inputs=w, outputs=CURRENTS).response(omega) @ wave
    density = np.stack(
        [SETTING.guideway.spectra[k].psd_frequency(f, SETTING.speed) for k in range(len(TYPES))], axis=-1
    )
    squares = np.trapezoid((np.abs(response) ** 2 * density[:, None, :]).sum(axis=2), f, axis=0)
    d_right, d_left, q_right, q_left = 1500.0 * np.sqrt(squares)
    # 1e-3: guide, Definitions: Roughness: a grid must agree with the Lyapunov equation to that
    assert (d_right, q_right) == pytest.approx((analysis.motor.rms_d, analysis.motor.rms_q), rel=1e-3)
    assert (d_left, q_left) == pytest.approx((d_right, q_right), rel=1e-9)  # the two sides mirror each other


def test_current_at_3_sigma_joins_mean_and_fluctuation_of_both_axes(analysis):
    m = analysis.motor
    assert m.current_at_3_sigma == pytest.approx(np.hypot(3 * m.rms_d, m.working_current + 3 * m.rms_q), rel=1e-12)
    assert m.share_of_rated == pytest.approx(m.current_at_3_sigma / 1500.0, rel=1e-12)


def test_on_the_bearable_roughness_the_rated_current_suffices(analysis):
    scale = analysis.motor.bearable_roughness
    spectra = {
        t: replace(s, roughness=s.roughness * scale) for t, s in zip(TYPES, SETTING.guideway.spectra, strict=True)
    }
    smoother = replace(SETTING, guideway=replace(SETTING.guideway, **spectra))
    assert analyse(smoother, GAINS).motor.current_at_3_sigma == pytest.approx(1500.0, rel=1e-9)


def test_slope_of_the_current_by_the_mean_squares_is_its_derivative():
    for square_d, square_q in ((0.02, 0.3), (1e-4, 0.02)):
        step = 1e-7
        by_d = (
            current_at_3_sigma(POINT, square_d + step, square_q) - current_at_3_sigma(POINT, square_d - step, square_q)
        ) / (2 * step)
        by_q = (
            current_at_3_sigma(POINT, square_d, square_q + step) - current_at_3_sigma(POINT, square_d, square_q - step)
        ) / (2 * step)
        assert slope_at_3_sigma(POINT, square_d, square_q) == pytest.approx(
            (by_d, by_q), rel=1e-5
        )  # step²/square², rounding


def test_a_motor_at_rest_draws_its_mean_current_and_its_slope_is_finite():
    assert current_at_3_sigma(POINT, 0.0, 0.0) == pytest.approx(POINT.working_current)
    assert np.all(np.isfinite(slope_at_3_sigma(POINT, 0.0, 0.0)))
    backward = MotorPoint(rated_current=1500.0, working_current=-900.0, thrust=-38e3, forces=POINT.forces)
    assert current_at_3_sigma(backward, 0.0, 0.01) == pytest.approx(900.0 + 450.0)  # braking counts like driving


def test_motor_power_is_that_of_its_currents_forces_in_the_plant(analysis):
    plant = SETTING.plant
    rates = [f"{c}_rate" for c in COORDINATES]
    loads = ("force_z", "moment_pitch", "force_y", "moment_roll", "moment_yaw")
    inertia = 1 / np.diag(plant.B[np.ix_(plant.index("states", rates), plant.index("inputs", loads))])
    per_current = inertia[:, None] * plant.A[np.ix_(plant.index("states", rates), plant.index("states", CURRENTS))]
    total = 0.0
    for s in SETTING.subjects:
        system = driven(SETTING, s, s.close(GAINS))
        state = system.stationary()
        currents = system.rows(CURRENTS)
        total += float(state.power(currents, per_current.T @ system.rows(rates)).sum())
    # 1e-6: powers of sway and yaw, of types A2 and A3, partly cancel
    assert analysis.motor.power_to_body == pytest.approx(total, rel=1e-6)


def test_smooth_measure_of_the_motor_current_agrees_with_the_exact_one(analysis):
    programme = Programme(PROBLEM, back_off=0.0)
    point = programme.at(programme.x(GAINS))
    slack = point.constraints[point.names.index(MotorCurrent.kind)]
    limit = programme.asked[MotorCurrent.kind].limit
    # 1e-3: quadrature over the grid against the Lyapunov equation
    assert limit * (1 - slack) == pytest.approx(analysis.motor.current_at_3_sigma, rel=1e-3)


@pytest.mark.slow
def test_gradient_of_the_motor_constraint_is_its_slope():
    programme = Programme(PROBLEM, back_off=0.0)
    x = programme.x(GAINS)
    row = programme.at(x).names.index(MotorCurrent.kind)
    gradient = programme.at(x).jacobian[row].copy()
    for k, name in enumerate(PROBLEM.free):
        step = np.zeros(len(x))
        step[k] = 1e-6
        slope = (programme.at(x + step).constraints[row] - programme.at(x - step).constraints[row]) / 2e-6
        assert slope == pytest.approx(gradient[k], rel=1e-4, abs=1e-7), name  # rounding 1e-16/step; third derivatives


def test_a_gain_margin_of_a_motor_current_puts_a_pole_on_the_axis():
    margins = {m.channel: m for m in full_analysis(SETTING, GAINS).current_margins}
    assert list(margins) == [name.replace("_", " ") for name in SETTING.law.currents]
    whole = subject(SETTING.plant, SETTING.law, "all")
    for name in CURRENTS:
        margin = margins[name.replace("_", " ")]
        row = SETTING.law.currents.index(name)
        A, B, C, D = (m.copy() for m in whole.controller(GAINS))
        C[row] *= margin.gain_up
        D[row] *= margin.gain_up
        closed = interconnect(
            whole.plant, (A, B, C, D), whole.commands, SETTING.law.sensors, [f"f{k}" for k in range(len(A))]
        )
        assert closed.poles().real.max() == pytest.approx(0.0, abs=1e-6)


def test_a_sign_change_at_two_coinciding_points_is_found_there():
    # asked with others the function is 1e-17 at 2 rad/s, asked alone it is 0: rounding, as from matrix products
    def function(omega):
        return np.where(np.abs(omega - 2) < 1e-12, 1e-17 if len(omega) > 1 else 0.0, omega - 2)

    found = sign_changes(function, np.array([0.5, 2.0, np.nextafter(2.0, 3.0)]))
    assert found == pytest.approx([2.0], rel=1e-14)


def test_sensitivity_is_judged_at_the_currents_the_law_commands(analysis):
    whole = subject(SETTING.plant, SETTING.law, "all")
    A, B, C, D = whole.sensitivity(whole.close(GAINS))
    U = SETTING.subjects[1].patterns
    # another system (all 26 states), the same number; 1e-6: the bracket of the peak
    assert peak_gain(A, B @ U, U.T @ C, U.T @ D @ U).upper == pytest.approx(
        analysis.peak_sensitivity["sway_roll_yaw"].upper, rel=1e-5
    )


def test_robustness_counts_the_loss_of_each_of_eight_commands():
    lost = [case for case in robustness(PROBLEM, GAINS) if case.name.endswith("lost")]
    assert [case.name for case in lost] == [f"{name.replace('_', ' ')} lost" for name in SETTING.law.commands]
    assert all(case.stable for case in lost)
    # mirror images lose alike
    assert lost[4].damping == pytest.approx(lost[5].damping, rel=1e-6)


def test_steering_by_motor_rides_better_than_by_coils_but_not_on_the_rated_current(analysis):
    figures = {f.quantity: f.values for f in compare([(PROBLEM, None)]).figures}
    assert figures["cost J"][0] == pytest.approx(analysis.cost)
    assert figures["motor current at mean + 3σ"][0] > 2 * 1500.0


def test_a_comparison_leaves_empty_what_a_problem_does_not_have():
    other = load_problem("report_1975")
    compared = compare([(PROBLEM, None), (other, None)])
    values = {f.quantity: f.values for f in compared.figures}
    assert compared.problems == ("hybrid_motor", "report_1975")
    assert values["motor i_d, rms"][1] is None
    assert all(len(row) == 4 for row in compared.table())
    assert "motor" not in analyse(other.setting, other.approved).to_dict()


def test_an_unstable_loop_has_no_motor_currents():
    wild = analyse(SETTING, GAINS.with_values(K_sway=-40.0))
    assert not wild.stable
    assert wild.motor.rms_d is None
    assert wild.motor.current_at_3_sigma is None
    assert wild.to_dict()["motor"]["working_current"] == pytest.approx(956.27, abs=0.01)


def test_a_motor_current_is_not_required_of_a_vehicle_without_motor():
    coils = load_problem("comfort_limit")
    with pytest.raises(InputError, match=r"can be required only of a vehicle whose motor .*'comfort_limit' has none"):
        coils.with_requirements([requirement(MotorCurrent.kind, 1500.0)])


def test_a_comparison_of_nothing_or_without_gains_is_refused():
    with pytest.raises(InputError, match="needs at least one problem"):
        compare([])
    with pytest.raises(InputError, match="has no approved gains to compare"):
        compare([(replace(PROBLEM, approved=None), None)])


@pytest.mark.slow
def test_solving_again_from_the_approved_gains_ends_where_they_are(analysis):
    again = design(PROBLEM, starts=1, start=GAINS)
    # 1 %: the cost is flat along the limits, and the way back through the relaxed problem ends 0.3 % above
    assert again.analysis.cost == pytest.approx(analysis.cost, rel=0.01)
    assert all(v.met for v in again.requirements)


@pytest.mark.slow
def test_random_starts_find_the_approved_design(analysis):
    # 1 %: four starts end within 1e-5 of sixteen
    assert design(PROBLEM, starts=4).analysis.cost == pytest.approx(analysis.cost, rel=0.01)
