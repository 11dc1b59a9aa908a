"""Proofs over boxes of the revenue vehicle's masses, inertias and forces, against the floating-point workbench."""

from itertools import product

import numpy as np
import pytest
from box_vehicle import VehicleLoop

from workbench.control.loop.subject import subject
from workbench.files.problem import load_problem
from workbench.lti.norm import peak_gain
from workbench.physics.vehicle.variation import varied
from workbench.verify.family.box import (
    largest_damping,
    prove_damping,
    prove_decay,
    prove_hurwitz,
    prove_peak_sensitivity,
    smallest_peak,
)
from workbench.verify.family.polynomial import characteristic, interpolate
from workbench.verify.family.sensitivity import peak_at, sensitivity_family

FOUR = ("mass", "inertia", "current_force", "gap_force")


def family_of(loop: VehicleLoop):
    return interpolate(characteristic(loop.state_matrix, loop.multiplier), loop.box, loop.degrees)[0]


def closed_at(group: str, **factors):
    """The group's floating closed loop at factors, through the vehicle's nonlinear equations."""
    problem = load_problem("comfort_limit")
    names = {"inertia": ("roll_inertia", "pitch_inertia", "yaw_inertia")}
    named = {n: v for name, v in factors.items() for n in names.get(name, (name,))}
    assert problem.models.rebuild is not None
    setting = problem.models.rebuild(varied(problem.vehicle, **named))
    alone = subject(setting.plant, setting.law, group)
    return alone, alone.close(problem.approved)


def damping_at(group: str, **factors) -> float:
    poles = closed_at(group, **factors)[1].poles()
    return float((-poles.real / np.abs(poles)).min())


@pytest.mark.parametrize("group", ["heave_pitch", "sway_roll_yaw"])
def test_damping_over_mass_and_current_force_is_that_of_the_worst_vertex(group):
    loop = VehicleLoop(group, ("mass", "current_force"))
    worst = min(damping_at(group, mass=m, current_force=c) for m, c in product((0.85, 1.15), (0.9, 1.1)))
    family = family_of(loop)
    below = prove_damping(family, 0.999 * worst)
    assert below.proved
    above = prove_damping(family, 1.001 * worst, most=1000)
    assert not above.proved
    assert above.undecided > 0


def test_the_attained_damping_is_that_of_the_floating_model_at_the_member_named():
    names = ("mass", "inertia", "current_force")
    bounds = largest_damping(family_of(VehicleLoop("sway_roll_yaw", names)))
    at = {name: float(v) for name, v in zip(names, bounds.at, strict=True)}
    # the table's decimals are doubles: what is left is the condition of the eigenvalues, some 1e-12
    assert damping_at("sway_roll_yaw", **at) == pytest.approx(bounds.high, abs=1e-9)


@pytest.mark.slow
def test_four_parameters_leave_nothing_undecided():
    loop = VehicleLoop("sway_roll_yaw", FOUR, "0.5")
    family = family_of(loop)
    bounds = largest_damping(family)
    # the tolerance asked for, plus rounding of the floats
    assert bounds.low >= 0.9989 * bounds.high
    assert bounds.proof is not None
    assert bounds.proof.undecided == 0
    for proof in (prove_hurwitz(family), prove_decay(family, "0.1")):
        assert proof.proved


def test_the_nominal_peak_is_the_analysis_own_and_the_box_bound_lies_within_half_a_percent_of_its_worst_vertex():
    loop = VehicleLoop("sway_roll_yaw", ("mass", "current_force"), "0.5")
    family = sensitivity_family(loop.loop, loop.box, loop.degrees, loop.multiplier, loop.lengths)
    alone, closed = closed_at("sway_roll_yaw")
    nominal = peak_gain(*alone.sensitivity(closed))
    # an attained value and the upper end of a bracket that is 1e-9 wide
    assert float(peak_at(family, (1, 1))[0].mid()) == pytest.approx(nominal.upper, rel=1e-8)
    worst = max(float(peak_at(family, v)[0].mid()) for v in loop.box.vertices())
    proof = prove_peak_sensitivity(family, 1.005 * worst)
    assert proof.proved
    refused = prove_peak_sensitivity(family, 0.995 * worst)
    assert not refused.proved
    assert refused.counterexample is not None
    assert float(peak_at(family, refused.counterexample)[0].mid()) > 0.995 * worst


@pytest.mark.slow
def test_sensitivity_in_four_parameters_is_bounded_within_half_a_percent():
    loop = VehicleLoop("sway_roll_yaw", FOUR)
    family = sensitivity_family(loop.loop, loop.box, loop.degrees, loop.multiplier, loop.lengths)
    bounds = smallest_peak(family)
    assert bounds.low > 1
    assert bounds.high <= 1.0051 * bounds.low
    assert bounds.proof is not None


@pytest.mark.slow
def test_six_parameters_are_proved():
    loop = VehicleLoop(
        "sway_roll_yaw", ("mass", "roll_inertia", "yaw_inertia", "current_force", "gap_force", "lag"), "0.5"
    )
    family = family_of(loop)
    for proof in (prove_hurwitz(family), prove_damping(family, "0.1"), prove_decay(family, "0.1")):
        assert proof.proved
