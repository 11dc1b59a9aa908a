"""A single attraction magnet, voltage-fed with a current of one direction: closed forms, a design, the nonlinear fall.

Closed forms: k_i = μ₀N²A i/(2 gap²), k_x = μ₀N²A i²/(2 gap³), m z̈ = k_x z − k_i i (Sinha, Electromagnetic Suspension,
1987, ch. 3; Schweitzer & Maslen, Magnetic Bearings, 2009, ch. 4).
"""

import casadi as ca
import numpy as np
import pytest
import scipy.linalg
import scipy.signal

from workbench.constants import GRAVITY, MU_0
from workbench.control.structure.blocks import gain, pid
from workbench.control.structure.structure import Structure
from workbench.design.tuner.tune import tune
from workbench.errors import InfeasibleError, InputError
from workbench.goals.gain import Gain
from workbench.goals.loop_shape import Sensitivity
from workbench.goals.poles import Poles
from workbench.physics.dynamics import Dynamics
from workbench.physics.forces.actuator import Actuator, CurrentLoop, VoltageFed
from workbench.physics.forces.attraction import AttractionMagnet
from workbench.physics.vehicle.suspension import suspension
from workbench.simulation.controlled import simulate_controlled

MASS, GAP = 250.0, 0.010  # [kg], [m]
MAGNET = AttractionMagnet(turns=270, pole_area=0.0110)
SUPPLY = VoltageFed(resistance=0.8, limits=(-60.0, 60.0), least_current=0.0)
STRENGTH = MU_0 * MAGNET.turns**2 * MAGNET.pole_area  # [H m]


def hovering(magnet=MAGNET, supply=SUPPLY, mass=MASS):
    solve_for = ("current", supply.command)
    return suspension(mass, magnet, supply).rest({"gap": GAP, "current": 10.0}, solve_for)


def stiffnesses(rest):
    """k_i [N/A] and k_x [N/m] in closed form at the current of the rest."""
    i = rest["current"]
    return STRENGTH * i / (2 * GAP**2), STRENGTH * i**2 / (2 * GAP**3)


def test_the_trim_carries_the_weight_in_closed_form():
    rest = hovering()
    assert rest["current"] == pytest.approx(2 * GAP * np.sqrt(MASS * GRAVITY / STRENGTH), rel=1e-12)
    assert rest["voltage"] == pytest.approx(SUPPLY.resistance * rest["current"], rel=1e-12)
    assert MAGNET.force(GAP, rest["current"]) == pytest.approx(MASS * GRAVITY, rel=1e-12)


def test_the_linear_magnet_is_the_one_of_the_textbooks():
    rest = hovering()
    k_i, k_x = stiffnesses(rest)
    L = STRENGTH / (2 * GAP)
    plant = rest.linearise().plant
    expected = [[0, 1, 0], [k_x / MASS, 0, -k_i / MASS], [0, k_i / L, -SUPPLY.resistance / L]]
    np.testing.assert_allclose(plant.A, expected, rtol=1e-12, atol=1e-9)
    np.testing.assert_allclose(plant.B[:, 0], [0, 0, 1 / L], rtol=1e-12)
    assert plant.B[:, 2] == pytest.approx([-1, 0, -k_i / L], rel=1e-12)  # a rail that moves down closes the gap


def test_of_ideal_iron_the_open_loop_has_no_term_in_s():
    # k_i² = k_x L: motion at constant flux costs no force, so s³ + (R/L) s² − (R/L)(k_x/m) remains
    rest = hovering()
    ratio = SUPPLY.resistance / (STRENGTH / (2 * GAP))
    poly = np.poly(rest.linearise().poles() if hasattr(rest.linearise(), "poles") else rest.linearise().plant.poles())
    k_x = stiffnesses(rest)[1]
    np.testing.assert_allclose(poly, [1, ratio, 0, -ratio * k_x / MASS], rtol=1e-9, atol=1e-9 * ratio * k_x / MASS)
    assert np.sum(np.roots(poly).real > 0) == 1


def test_force_voltage_and_inductance_come_from_one_co_energy_with_iron_and_leakage_too():
    magnet = AttractionMagnet(turns=270, pole_area=0.011, iron=0.001, leakage=0.02)
    gap, current, h = 0.012, 9.0, 1e-6
    force = -(magnet.co_energy(gap + h, current) - magnet.co_energy(gap - h, current)) / (2 * h)
    linkage = (magnet.co_energy(gap, current + h) - magnet.co_energy(gap, current - h)) / (2 * h)
    assert magnet.force(gap, current) == pytest.approx(force, rel=1e-7)  # differences: h² and rounding
    assert magnet.flux_linkage(gap, current) == pytest.approx(linkage, rel=1e-7)
    by_current = ca.SX.sym("i")
    pull_per_ampere = ca.Function("k", [by_current], [ca.gradient(magnet.force(gap, by_current), by_current)])
    assert float(pull_per_ampere(current)) == pytest.approx(-magnet.flux_per_gap(gap, current), rel=1e-12)  # Maxwell
    assert magnet.inductance(gap, current) == pytest.approx(linkage / current, rel=1e-7)


def test_a_current_loop_takes_the_place_of_the_voltage():
    loop = CurrentLoop(lag=0.002)
    assert isinstance(loop, Actuator)
    assert isinstance(SUPPLY, Actuator)
    rest = hovering(supply=loop)
    _, k_x = stiffnesses(rest)
    poles = np.sort(rest.linearise().plant.poles().real)
    np.testing.assert_allclose(poles, [-500, -np.sqrt(k_x / MASS), np.sqrt(k_x / MASS)], rtol=1e-9)


def test_what_does_not_carry_the_weight_is_refused():
    with pytest.raises(InfeasibleError, match=r"'velocity' still changes at 9\.8"):
        suspension(MASS, MAGNET, SUPPLY).rest({"gap": GAP}, ())
    with pytest.raises(InputError, match="did you mean 'current'"):
        suspension(MASS, MAGNET, SUPPLY).rest({"curent": 1.0}, ())
    with pytest.raises(InputError, match="function of 'd' must take its 2 states"):
        Dynamics(name="d", states=("a", "b"), inputs=(), outputs=(), function=suspension(1.0, MAGNET, SUPPLY).function)


@pytest.fixture(scope="module")
def tuned():
    """A cascade: PD of the gap asks for a current, a gain of what is missing makes the voltage."""
    rest = hovering()
    k_i, k_x = stiffnesses(rest)
    structure = Structure((
        pid("gap_sensor", "wanted", Kp=2 * k_x / k_i, Kd=100.0, Tf=0.002, parts="PD"),
        gain("wanted - current_sensor", "voltage", 40.0, name="K_i"),
    )).freeze("Tf")  # fmt: skip
    goals = [
        Poles(name="decay", decay=5.0, damping=0.4, hard=True),
        Sensitivity(name="sensitivity of the gap", points=("gap_sensor",), limit=1.8, hard=True),
        Gain(name="noise into the voltage", inputs=("gap_sensor",), outputs=("voltage",), limit=5e5),
    ]
    return rest, tune(rest.linearise(), structure, goals, starts=1, seed=0, budget_seconds=10)


def test_the_unstable_magnet_is_designed_on_the_road_of_any_plant(tuned):
    rest, found = tuned
    assert found.met
    k_i, k_x = stiffnesses(rest)
    assert found.values["Kp"] > k_x / k_i  # what a position gain must overcome


def test_a_small_push_moves_the_nonlinear_magnet_as_the_linear_one(tuned):
    rest, found = tuned
    v, push = found.values, 1e-6
    motion = simulate_controlled(rest, found.structure, duration=0.05, step=1e-4, start={"gap": push})
    # the loop by hand: states gap, velocity, current, filtered gap
    k_i, k_x = stiffnesses(rest)
    L = STRENGTH / (2 * GAP)
    wanted = np.array([v["Kp"] + v["Kd"] / v["Tf"], 0, 0, -v["Kd"] / v["Tf"]])
    A = np.array([
        [0, 1, 0, 0],
        [k_x / MASS, 0, -k_i / MASS, 0],
        np.array([0, k_i, -SUPPLY.resistance - v["K_i"], 0]) / L + v["K_i"] / L * wanted,
        [1 / v["Tf"], 0, 0, -1 / v["Tf"]],
    ])  # fmt: skip
    exact = np.array([scipy.linalg.expm(A * t) @ [push, 0, 0, 0] for t in motion.time])
    scale = np.abs(exact).max(axis=0)
    # a ten-thousandth of the gap: the products of deviations are as small; the integrator adds (λh)⁵/120
    assert np.abs(motion["gap"] - GAP - exact[:, 0]).max() < 1e-3 * scale[0]
    assert np.abs(motion["current"] - rest["current"] - exact[:, 2]).max() < 1e-3 * scale[2]


def test_a_large_push_is_caught_with_a_current_of_one_direction_and_a_larger_one_is_not(tuned):
    rest, found = tuned
    bounds = {"gap": (0.001, 0.030)}

    def pushed(by):
        start = {"gap": by}
        return simulate_controlled(rest, found.structure, duration=0.8, step=1e-4, start=start, within=bounds)

    caught, touched, fell = pushed(0.002), pushed(-0.006), pushed(0.012)
    assert caught.left is None
    assert caught["gap"][-1] == pytest.approx(GAP, rel=1e-3)
    assert 0 < caught.limited < 1
    for motion in (caught, touched, fell):
        assert motion["current"].min() >= 0.0
        assert np.abs(motion["voltage"]).max() <= SUPPLY.limits[1]
    assert touched["gap"][-1] < 0.001 or touched["current"].min() == 0.0
    assert fell.left is not None
    assert fell["gap"][-1] > 0.030


def sampled_radius(rest, structure):
    """Largest |z| of the linear loop: held voltage, the cascade's matrices by hand."""
    plant, K = rest.linearise().plant, structure.controller()
    A, B, *_ = scipy.signal.cont2discrete((plant.A, plant.B[:, :1], np.eye(3), np.zeros((3, 1))), structure.sample_time)
    wanted = np.hstack([[K.D[0, 0], 0, 0], K.C[0]])
    voltage = K.D[1, 1] * (wanted - np.eye(4)[2])
    A_closed = np.vstack([np.hstack([A, np.zeros((3, 1))]) + B * voltage, [K.B[0, 0], 0, 0, K.A[0, 0]]])
    return np.abs(np.linalg.eigvals(A_closed)).max()


def test_a_sampled_law_holds_its_voltage_and_one_too_slow_lets_the_magnet_go(tuned):
    rest, found = tuned
    held = []
    for h in (2e-4, 4e-3, 30e-3):
        law = found.structure.sampled(h)
        motion = simulate_controlled(
            rest, law, duration=1.2, step=1e-4, start={"gap": 2e-5}, within={"gap": (1e-3, 0.03)}
        )
        held.append(motion.left is None and abs(motion["gap"][-1] - GAP) < 1e-6)
        assert held[-1] == (sampled_radius(rest, law) < 1)
        steps = np.diff(motion["voltage"]) != 0
        assert not steps[np.arange(len(steps)) % round(h / 1e-4) != round(h / 1e-4) - 1].any()
    assert held == [True, True, False]


def test_rest_and_poles_are_the_same_in_other_units():
    # gap in micrometres, current in megaamperes: twelve decades between them
    scale = {"gap": 1e-6, "velocity": 1.0, "current": 1e6}
    plain, rest = suspension(MASS, MAGNET, SUPPLY), hovering()
    x, u = {name: ca.SX.sym(name) for name in plain.states}, {name: ca.SX.sym(name) for name in plain.inputs}
    rates, seen = plain.function(ca.vertcat(*(scale[n] * x[n] for n in plain.states)), ca.vertcat(*u.values()))
    other = Dynamics.of(
        "scaled",
        states={n: (x[n], rates[i] / scale[n]) for i, n in enumerate(plain.states)},
        inputs=u, outputs={n: seen[i] for i, n in enumerate(plain.outputs)},
    )  # fmt: skip
    found = other.rest({"gap": GAP * 1e6, "current": 1e-5}, ("current", "voltage"))
    assert found["current"] * 1e6 == pytest.approx(rest["current"], rel=1e-12)
    assert found["voltage"] == pytest.approx(rest["voltage"], rel=1e-12)
    poles = [np.sort_complex(r.linearise().plant.poles()) for r in (rest, found)]
    np.testing.assert_allclose(poles[1], poles[0], rtol=1e-9)  # LAPACK balances; the middle pair is well apart
    with pytest.raises(InfeasibleError, match="'velocity' still changes"):  # a ten-millionth too little current
        other.rest({"gap": GAP * 1e6, "current": found["current"] * (1 - 1e-7)}, ("voltage",))
