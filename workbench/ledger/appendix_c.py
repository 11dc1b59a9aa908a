"""Appendix C, stability and gain selection: our number for every row of appendix_c.toml."""

import numpy as np

from workbench.design.procedure import double_root, heave_choice, unfiltered
from workbench.ledger.baseline import report_gains, report_law, report_model, report_vehicle
from workbench.loop.determinant import point_ratio
from workbench.loop.polynomial import roots_of
from workbench.lti import PolynomialMatrix
from workbench.vehicle import linearise

PAIRS = range(2, 9)


def computed() -> dict[str, float]:
    """Row id → our number, in the unit of the row."""
    plant, law, gains = report_model().plant, report_law(), report_gains()
    filtered = gains.with_values(K_hp=0.1, K_zddot=0.01)  # every gain present: the largest order
    bare = unfiltered(gains)
    heave = _modes(roots_of(plant, law, "heave", bare))[0]
    pitch, coupled = _modes(roots_of(plant, law, "heave_pitch", bare))
    double = double_root(plant, law, gains, free=("K_sway", ("K_hpdot", "K_ydot")))
    choice = heave_choice(plant, law, frequency_hz=0.6, damping=0.6)
    yaw = _modes(roots_of(plant, law, "sway_roll_yaw", gains))[2]
    tilted = linearise(report_vehicle().with_extras(gravity_term=True)).plant
    orders = {
        f"C.2.{name}_{part}": float(len(roots_of(plant, law, part, chosen)))
        for name, chosen in (("order", filtered), ("lowest_order", bare))
        for part in ("heave_pitch", "sway_roll_yaw")
    }
    return orders | {f"C.3.beta_{M}": point_ratio(M) for M in PAIRS} | {
        "C.2.roll_correction_sign": float(roll_correction_roots(-1).real.max()),
        "C.5.K_h": choice.K_h,
        "C.5.rate_gain": choice.rate,
        "C.5.heave_frequency": heave[0],
        "C.5.heave_damping": heave[1],
        "C.5.heave_frequency_coupled": coupled[0],
        "C.5.heave_damping_coupled": coupled[1],
        "C.5.pitch_frequency": pitch[0],
        "C.5.pitch_damping": pitch[1],
        "C.6.K_Y": double.values[0],
        "C.6.rate_gain": double.values[1],
        "C.6.double_frequency": double.frequency_hz,
        "C.6.double_damping": double.damping,
        "C.6.yaw_frequency": yaw[0],
        "C.6.yaw_damping": yaw[1],
        "C.6.tilt": _modes(roots_of(tilted, law, "sway_roll_yaw", gains))[0][1],
        "C-2.K_h_reading": _modes(roots_of(plant, law, "sway_roll_yaw", gains.with_values(K_h=0.0)))[0][1],
    }  # fmt: skip


def _modes(roots: np.ndarray) -> list[tuple[float, float]]:
    """(frequency [Hz], damping) of the oscillating roots, by frequency."""
    above = sorted(roots[roots.imag > 1e-5 * np.abs(roots)], key=abs)
    return [(float(abs(p)) / (2 * np.pi), float(-p.real / abs(p))) for p in above]


def roll_correction_roots(sign: int) -> np.ndarray:
    """Roots in sway/roll/yaw with K_0A = K~_0A + sign · [K_0S − K~_0A] P_AS Q_SA; C.2 prints −1, Table B-3 has +1.

    In the form of C.2, whose K_0 is a polynomial in s here: equal time constants, one rate gain for both sensors.
    """
    law, linear, gains = report_law(), report_model(), report_gains()
    antisymmetric = [2, 3, 4]
    K = np.diag([gains.K_sway, gains.K_roll, gains.K_yaw])
    R = linear.current[antisymmetric] @ law.displacement_matrix()[law.count :, antisymmetric] @ K
    share = np.array([[0.0, law.depth, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])  # P_AS Q_SA
    lateral, vertical = (gains.K_hp, gains.K_hpdot, gains.K_yddot), (gains.K_h, gains.K_hdot, gains.K_zddot)
    powers = [R @ (w * np.eye(3) + sign * (v - w) * share) for w, v in zip(lateral, vertical, strict=True)]
    stiffness = linear.stiffness[np.ix_(antisymmetric, antisymmetric)]
    return PolynomialMatrix.of(
        [powers[0] - stiffness, powers[1], powers[2] + np.diag(linear.inertia[antisymmetric])]
    ).roots()
