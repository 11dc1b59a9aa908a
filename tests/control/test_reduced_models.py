"""The one- and two-degree-of-freedom models of Appendix B.5 against the whole group and against printed roots."""

import casadi as ca
import numpy as np
import pytest

from workbench.control.loop.polynomial import loop_polynomial, roots_of
from workbench.control.loop.reduced import REDUCED, reduced_model
from workbench.errors import InputError
from workbench.ledger.baseline import report_gains, report_law, report_model, report_vehicle
from workbench.physics.vehicle import linearise


def general_gains():
    """Every gain present, one time constant."""
    tau = dict.fromkeys(("tau_h", "tau_hp", "tau_z", "tau_y"), 0.5)
    return report_gains().with_values(K_h=-1.1, K_hdot=0.35, K_zddot=0.17, K_zdot=0.33, K_hp=0.3, K_yddot=0.05, **tau)


def guideway_motion(name: str) -> dict[str, float]:
    """How the guideway moves under the four sets for one input of a reduced model."""
    law = report_law()
    kinds = {
        "Z_g": {"zeta": np.ones(4)},
        "theta_g": {"zeta": [x for x, _ in law.positions]},
        "psi_g": {"eta": [s * x for s, (x, _) in zip(law.side, law.positions, strict=True)]},
        "y_g": {"eta": law.side},
        "phi_g": {"zeta": [-y for _, y in law.positions], "eta": -law.side * law.depth, "bank": np.ones(4)},
    }[name]
    return {f"{kind}_{i + 1}": float(w) for kind, weights in kinds.items() for i, w in enumerate(weights)}


def modes(roots) -> list[tuple[float, float]]:
    above = sorted((p for p in roots if p.imag > 1e-5 * abs(p)), key=abs)
    return [(abs(p) / (2 * np.pi), -p.real / abs(p)) for p in above]


@pytest.mark.parametrize("reading", ["twist", "section"])
@pytest.mark.parametrize("gravity", [False, True])
@pytest.mark.parametrize("name", REDUCED)
def test_the_printed_coefficients_are_the_vehicle_with_its_other_coordinates_held(name, gravity, reading):
    plant = linearise(report_vehicle().with_extras(gravity_term=gravity, bank_reading=reading)).plant
    model = reduced_model(plant, report_law(), name, general_gains())
    held = loop_polynomial(plant, report_law(), name, general_gains())
    s = 1j * np.array([0.1, 2.0, 9.0])
    for output in model.unknowns:
        for given in model.inputs:
            expected = held.transfer(output, guideway_motion(given))(s)
            assert model.transfer(output, given)(s) == pytest.approx(expected, rel=1e-10)  # order 8, simple roots


def test_the_heave_root_is_the_printed_one():
    # C.5: 0.6 Hz at damping 0.6, one printed digit each
    ((frequency, damping),) = modes(reduced_model(report_model().plant, report_law(), "heave", report_gains()).roots())
    assert frequency == pytest.approx(0.6, abs=0.005)
    assert damping == pytest.approx(0.6, abs=0.005)


def test_reduced_models_miss_the_group_by_the_offset_of_the_centre_of_gravity():
    # the coupling is called small in B.5; it is not where modes lie close together
    plant, law, gains = report_model().plant, report_law(), report_gains()
    alone = [modes(reduced_model(plant, law, name, gains).roots())[0][0] for name in ("heave", "pitch")]
    together = [f for f, _ in modes(roots_of(plant, law, "heave_pitch", gains))]
    assert alone == pytest.approx([0.6005, 0.5750], abs=5e-5)  # our own numbers, four digits
    assert sorted(together) == pytest.approx([0.5601, 0.6144], abs=5e-5)
    centred = report_vehicle().with_values(positions=((8.3, 0.965), (8.3, -0.965), (-8.3, 0.965), (-8.3, -0.965)))
    plant = linearise(centred).plant
    law = type(law)(centred.positions, centred.depth)
    alone = [modes(reduced_model(plant, law, name, gains).roots())[0] for name in ("heave", "pitch")]
    together = modes(roots_of(plant, law, "heave_pitch", gains))
    # what is left is drag: 4 c X_h couples one way only, so it moves no root at all
    assert np.array(sorted(together)) == pytest.approx(np.array(sorted(alone)), rel=1e-6)


def test_without_control_the_vehicle_follows_a_raised_guideway():
    passive = report_gains().with_values(
        **{n: 0.0 for n in report_gains().as_dict() if n.startswith("K_") and n[2] in "hzy"}
    )
    plant, law = report_model().plant, report_law()
    still = 1e-9j
    assert reduced_model(plant, law, "heave", passive).transfer("Z", "Z_g")(still) == pytest.approx(-1.0)  # Z is down
    pitch = reduced_model(plant, law, "pitch", passive).transfer("Theta", "theta_g")(still)
    assert pitch.real == pytest.approx(1.0, abs=5e-3)  # less the tilting lift 4 c F_L0, 0.2 % of the stiffness


def test_the_two_readings_of_a_bank_differ_by_the_lift():
    law = report_law()
    twist, section = (
        reduced_model(linearise(report_vehicle().with_extras(bank_reading=r)).plant, law, "sway_roll", report_gains())
        for r in ("twist", "section")
    )
    difference = float(section.load[0][0, 1] - twist.load[0][0, 1])
    assert difference == pytest.approx(4 * 1.1120e5, rel=1e-9)  # e_y = F_Gφ against F_Gφ + F_L0, four sets


def test_coefficients_are_symbolic_in_the_gains():
    theta = ca.SX.sym("theta", 17)
    model = reduced_model(report_model().plant, report_law(), "heave", theta)
    gains = report_gains()
    numbers = ca.Function("a", [theta], [ca.vertcat(*model.characteristic())])(list(gains.as_dict().values()))
    expected = reduced_model(report_model().plant, report_law(), "heave", gains).characteristic()
    assert numbers.full().ravel() == pytest.approx(expected, rel=1e-13)


def test_lag_and_unequal_time_constants_are_refused():
    lagged = linearise(report_vehicle().with_extras(current_lag=0.01)).plant
    with pytest.raises(InputError, match=r"no current-loop lag; got 0\.01 s"):
        reduced_model(lagged, report_law(), "heave", report_gains())
    with pytest.raises(InputError, match="one time constant for all four filters"):
        reduced_model(report_model().plant, report_law(), "sway_roll", report_gains().with_values(tau_y=0.2))
    with pytest.raises(InputError, match="unknown reduced model 'roll'"):
        reduced_model(report_model().plant, report_law(), "roll", report_gains())
