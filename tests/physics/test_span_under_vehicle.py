"""A magnet under a span of the guideway: modes against finite elements, deflections against the beam's own formulas,
and a loop that is stable on a rigid guideway and not on a light span.
"""

import numpy as np
import pytest
import scipy.linalg

from tests.physics.test_attraction_magnet import GAP, MAGNET, MASS, SUPPLY, hovering, stiffnesses
from workbench.constants import GRAVITY
from workbench.control.structure.blocks import gain, pid
from workbench.control.structure.structure import Structure
from workbench.errors import InputError
from workbench.physics.forces.actuator import CurrentLoop
from workbench.physics.guideway.span import Span
from workbench.physics.vehicle.suspension import suspension
from workbench.simulation.controlled import simulate_controlled

SPAN = Span(length=24.0, bending_stiffness=2.0e8, mass_per_length=200.0, damping=0.0)
WEIGHT = MASS * GRAVITY


def finite_elements(span, count=60):
    """Mass and stiffness (2·count, 2·count) of the hinged beam in Hermite's elements, and which row is the middle."""
    h, rho, EI = span.length / count, span.mass_per_length, span.bending_stiffness
    k = EI / h**3 * np.array([[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2],
                              [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]])  # fmt: skip
    m = rho * h / 420 * np.array([[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2],
                                  [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]])  # fmt: skip
    M, K = np.zeros((2, 2 * count + 2, 2 * count + 2))
    for e in range(count):
        M[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += m
        K[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += k
    kept = [i for i in range(2 * count + 2) if i not in (0, 2 * count)]
    return M[np.ix_(kept, kept)], K[np.ix_(kept, kept)], kept.index(count)


def on_span(span, place=12.0, supply=SUPPLY, **more):
    d = suspension(MASS, MAGNET, supply, span=span, **more)
    modes = tuple(f"mode_{k + 1}" for k in range(span.modes))
    return d.rest({"gap": GAP, "current": 30.0, "place": place}, ("current", supply.command, *modes))


def test_frequencies_are_those_of_finite_elements():
    M, K, _ = finite_elements(SPAN)
    found = np.sqrt(scipy.linalg.eigh(K, M, eigvals_only=True)[:3])
    np.testing.assert_allclose(SPAN.frequencies, found, rtol=1e-6)  # cubic elements: (k/60)⁴


def test_at_rest_the_span_bends_as_a_beam_under_the_weight():
    for place in (12.0, 7.0):
        a, b, L = place, 24.0 - place, 24.0
        exact = WEIGHT * a**2 * b**2 / (3 * SPAN.bending_stiffness * L)
        for modes, left in ((3, 1.5e-2), (15, 5e-4)):  # what the higher modes would add: Σ 1/k⁴ beyond
            rest = on_span(Span(length=24.0, bending_stiffness=2.0e8, mass_per_length=200.0, modes=modes), place)
            deflection = rest.seen[rest.dynamics.outputs.index("deflection")]
            assert deflection == pytest.approx(exact, rel=left)
            assert deflection < exact
    # in the middle, exactly: (96/π⁴)(1 + 1/81) of it with three modes
    rest = on_span(SPAN)
    share = 96 / np.pi**4 * (1 + 1 / 81)
    exact = WEIGHT * 24.0**3 / (48 * SPAN.bending_stiffness)
    assert rest.seen[rest.dynamics.outputs.index("deflection")] == pytest.approx(share * exact, rel=1e-10)


def test_the_coupled_loop_has_the_roots_of_a_sprung_mass_on_finite_elements():
    # a quick current loop and PD of the gap make a spring and a damper between mass and beam
    span = Span(length=24.0, bending_stiffness=2.0e8, mass_per_length=200.0, damping=0.0, modes=3)
    supply = CurrentLoop(lag=1e-6)
    rest = on_span(span, supply=supply)
    k_i, k_x = stiffnesses(rest)
    Kp, Kd = 2 * k_x / k_i, 60.0
    spring, damper = k_i * Kp - k_x, k_i * Kd
    plant = rest.linearise().plant
    gap_row = plant.A[0]  # d(gap)/dt from the states: the PD's rate, without a filter
    B = plant.B[:, :1]
    sensed = np.eye(len(plant.A))[0]
    roots = np.linalg.eigvals(plant.A + B * (Kp * sensed + Kd * gap_row))
    M, K, middle = finite_elements(span)
    n = len(M)
    values, shapes = scipy.linalg.eigh(K, M)
    for kept, tolerance in ((3, 1e-4), (n, 2e-2)):  # the same three modes; every mode, which three leave out
        V = shapes[:, :kept]
        Mc = np.eye(kept + 1)
        Mc[kept, kept] = MASS
        couple = np.append(V[middle], -1.0)  # deflection of the beam less that of the mass: closes the gap
        Kc = np.diag(np.append(values[:kept], 0.0)) + spring * np.outer(couple, couple)
        Dc = damper * np.outer(couple, couple)
        full = np.block([[np.zeros((kept + 1, kept + 1)), np.eye(kept + 1)],
                         [-np.linalg.solve(Mc, Kc), -np.linalg.solve(Mc, Dc)]])  # fmt: skip
        theirs = np.linalg.eigvals(full)
        for root in theirs[(np.abs(theirs) < 1.05 * span.frequencies[0]) & (theirs.imag >= 0)]:
            assert np.abs(roots - root).min() < tolerance * abs(root)


@pytest.mark.slow
def test_a_load_that_creeps_bends_the_span_statically_and_a_quick_one_more():
    # at v → 0 the deflection under the load follows a²b²/(3EIL); at v/v_critical = 0.5 the middle bends up to 1.7 of it
    def middle(speed):
        force, L = WEIGHT, 24.0
        duration = L / speed
        critical = L / np.pi * SPAN.frequencies[0]
        rest = on_span(SPAN, place=0.0, speed=speed)
        law = Structure((pid("gap_sensor", "wanted", Kp=2 * np.divide(*stiffnesses(rest)[::-1]), Kd=110.0, Tf=0.002,
                             parts="PD"), gain("wanted - current_sensor", "voltage", 8.0)))  # fmt: skip
        motion = simulate_controlled(
            rest, law, duration=duration, step=2e-4, courses={"place": lambda t: speed * t},
            within={"gap": (1e-3, 0.03)},
        )  # fmt: skip
        assert motion.left is None
        static = force * L**3 / (48 * SPAN.bending_stiffness)
        return (motion["mode_1"] - motion["mode_3"]).max() / static, speed / critical

    creeping, ratio = middle(2.0)
    assert ratio < 0.02
    assert creeping == pytest.approx(
        96 / np.pi**4 * (1 + 1 / 81), rel=0.02
    )  # what is left swings by twice v/v_critical
    quick, ratio = middle(0.4 * 24.0 / np.pi * SPAN.frequencies[0])
    assert ratio == pytest.approx(0.4)
    assert 1.2 < quick < 1.7  # Frýba, ch. 1: 1/(1 − α) at most, less what the mass gives way


def test_a_loop_that_holds_on_a_rigid_guideway_may_shake_a_light_span():
    # the same frequencies, a hundredth of the mass: the quick loop's lag drives the second mode from below
    rigid = hovering()
    gains = 2 * np.divide(*stiffnesses(rigid)[::-1]), 110.0, 8.0
    assert np.linalg.eigvals(closed(rigid, *gains)).real.max() < -10
    for mass_per_length, holds in ((500.0, True), (5.0, False)):
        stiffness = mass_per_length * 40.0**2 * (24.0 / np.pi) ** 4  # first mode at 40 rad/s
        span = Span(length=24.0, bending_stiffness=stiffness, mass_per_length=mass_per_length)
        assert (np.linalg.eigvals(closed(on_span(span), *gains)).real.max() < 0) == holds


def closed(rest, Kp, Kd, K_i, Tf=0.002):
    """State matrix of the cascade, with the filtered gap as the last state."""
    plant = rest.linearise().plant
    n = len(plant.A)
    wanted = np.zeros(n + 1)
    wanted[[0, n]] = Kp + Kd / Tf, -Kd / Tf
    voltage = K_i * (wanted - np.eye(n + 1)[2])
    A = np.block([[plant.A, np.zeros((n, 1))], [np.eye(n + 1)[0][None, :n] / Tf, np.array([[-1 / Tf]])]])
    A[:n] += plant.B[:, :1] * voltage
    return A


def test_refusals_name_what_a_span_must_have():
    with pytest.raises(InputError, match=r"Span\.length must be positive and finite; got 0 m"):
        Span(length=0, bending_stiffness=1.0, mass_per_length=1.0)
    with pytest.raises(InputError, match=r"Span\.damping must be a ratio"):
        Span(length=1, bending_stiffness=1.0, mass_per_length=1.0, damping=1.0)
