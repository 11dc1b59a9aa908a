"""Schedules between their points, with closed loops whose truth is a formula; one on the vehicle."""

from dataclasses import replace

import pytest
from box_vehicle import VehicleLoop
from flint import fmpq, fmpq_mat

from workbench.verify.family.box import (
    largest_damping,
    prove_damping,
    prove_decay,
    prove_hurwitz,
    prove_peak_sensitivity,
)
from workbench.verify.family.polynomial import ParameterBox, rational
from workbench.verify.family.schedule import GainSchedule, schedule_family
from workbench.verify.vehicle.loop import closed_loop

POINTS = ("0", "1/2", "1")


def schedule(wiggle: str) -> GainSchedule:
    """Stiffness 1; damping gain 1 + c v (v - 1/2) (v - 1): 1 at all three points, less than 1 between the last two."""
    c = rational(wiggle)
    polynomials = {"k": (fmpq(1),), "d": (fmpq(1), c / 2, -3 * c / 2, c)}
    return GainSchedule("speed", fmpq(0), fmpq(1), fmpq(0), fmpq(1), polynomials)


def proofs_of(family, zeta=None, sigma=None, gamma=None):
    """Stability, and what else is asked for, at every value of the variable."""
    stable = prove_hurwitz(family.p)
    return (
        stable,
        *([prove_damping(family.p, zeta)] if zeta else []),
        *([prove_decay(family.p, sigma)] if sigma else []),
        *([prove_peak_sensitivity(family, gamma, stable=stable)] if gamma else []),
    )


def double_integrator(v, gains, theta):
    """x'' = u, u = -k x - d x': damping d/(2 √k), sensitivity s²/(s² + d s + k); θ multiplies the force."""
    force = theta[0] if theta else fmpq(1)
    row = [-gains["k"], -gains["d"]]
    return fmpq_mat([[0, 1], [force * row[0], force * row[1]]]), fmpq_mat([[0], [force]]), fmpq_mat([row])


def test_a_schedule_that_holds_at_its_points_and_fails_between_them_is_caught():
    bad = schedule("8")  # least gain: 1 - 8 √3/36 = 0.615 at v = 0.789
    for point in POINTS:
        assert bad.at(point)["d"] == 1
    stable, damped = proofs_of(schedule_family(double_integrator, bad, 6), zeta="0.45")
    assert stable.proved
    assert not damped.proved
    assert damped.counterexample is not None
    assert fmpq(1, 2) < damped.counterexample[0] < 1
    # damping below 0.45 is d < 0.9: v(v - 1/2)(v - 1) < -1/80, which is 0.526 < v < 0.973
    assert damped.undecided >= 0.447


def test_a_schedule_that_holds_everywhere_is_proved_everywhere():
    family = schedule_family(double_integrator, schedule("1"), 6)  # least gain 1 - √3/36 = 0.9519
    proofs = proofs_of(family, zeta="0.475", sigma="0.47", gamma="1.25")
    assert [p.proved for p in proofs] == [True] * 4
    worst = (1 - 3**0.5 / 36) / 2
    bounds = largest_damping(family.p)
    assert bounds.low <= worst <= bounds.high
    assert bounds.low > 0.997 * worst


def test_the_peak_of_a_second_order_loop_is_the_textbook_one():
    # |S| = s²/(s² + 2ζs + 1) peaks at 1/(2ζ√(1 - ζ²)), here ζ = d/2 at the least d
    family = schedule_family(double_integrator, schedule("1"), 6)
    zeta = (1 - 3**0.5 / 36) / 2
    peak = 1 / (2 * zeta * (1 - zeta**2) ** 0.5)
    assert proofs_of(family, gamma=1.001 * peak)[1].proved
    refused = proofs_of(family, gamma=0.999 * peak)[1]
    assert not refused.proved
    assert refused.undecided > 0


def test_a_box_is_proved_together_with_the_speed():
    box = ParameterBox.of(force=("0.8", "1.2"))
    family = schedule_family(double_integrator, schedule("1"), 6, box=box, degrees=(2,))
    worst = (1 - 3**0.5 / 36) / 2 * 0.8**0.5  # damping d √force/2
    assert proofs_of(family, zeta=0.999 * worst)[1].proved
    assert not proofs_of(family, zeta=1.001 * worst)[1].proved


def test_a_schedule_without_range_is_refused():
    with pytest.raises(ValueError, match="range that rises"):
        GainSchedule("speed", fmpq(1), fmpq(1), fmpq(0), fmpq(1), {})


@pytest.mark.slow
def test_the_vehicle_under_a_quadratic_schedule_is_proved_at_every_speed():
    loop = VehicleLoop("heave_pitch", ("mass",))
    table, slope = loop.table, {"K_h": "0.05", "K_hdot": "-0.04", "tau_h": "0.01", "K_zdot": "0.02", "tau_z": "0.01"}
    share = {name: rational(slope.get(name, "0")) for name in table.gains}
    coefficients = {name: (g, g * share[name], g * share[name] / 3) for name, g in table.gains.items()}
    plan = GainSchedule("speed", fmpq(30), fmpq(134), fmpq(82), fmpq(52), coefficients)

    def at(speed, gains, theta):
        u = (speed - 82) / 52
        factors = {"current_force": 1 + u / 20 - u * u / 50, "gap_force": 1 + u / 50}
        seen = closed_loop(replace(table, gains=gains), "heave_pitch", factors).sensitivity
        return seen.A, seen.B, seen.C

    def multiplier(speed, gains, theta):
        return (gains["tau_h"] * gains["tau_z"]) ** 2

    family = schedule_family(at, plan, 24, multiplier=multiplier, lengths=loop.lengths)
    proofs = proofs_of(family, zeta="0.2", sigma="0.1", gamma="3")
    assert [p.proved for p in proofs] == [True] * 4
    bounds = largest_damping(family.p)
    assert bounds.low > 0.998 * bounds.high  # the tolerance of 1e-3, twice
