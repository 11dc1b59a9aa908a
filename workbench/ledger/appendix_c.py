"""Appendix C, stability and gain selection: our number for every row of appendix_c.toml."""

import numpy as np

from workbench.control.filters import combined_fraction
from workbench.control.loop.determinant import point_ratio
from workbench.control.loop.polynomial import roots_of
from workbench.design.procedure import double_root, heave_choice, unfiltered
from workbench.ledger.baseline import report_gains, report_law, report_model
from workbench.lti import PolynomialMatrix

PAIRS = range(2, 9)
FILTER = (0.7, 0.4, 2.1, 0.15, 0.02, 0.29, 0.47)  # t1 … t7 at which Table C-1 is compared: any will do


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
        **_rounded_rate_gain(plant, law, bare),
        "C.5.one_root_of_the_rate_gain": _share_of_heave(plant, law, bare),
        "C.6.opposite_changes": _past_the_double_root(plant, law, gains),
        **_signal_filters(),
        "C.6.K_Y": double.values[0],
        "C.6.rate_gain": double.values[1],
        "C.6.double_frequency": double.frequency_hz,
        "C.6.double_damping": double.damping,
        "C.6.yaw_frequency": yaw[0],
        "C.6.yaw_damping": yaw[1],
    }  # fmt: skip


def _signal_filters() -> dict[str, float]:
    """Coefficients d_0 … k_4 of K_0(s) for the four columns of Table C-1, at `FILTER`."""
    t1, t2, t3, t4, t5, t6, t7 = FILTER
    columns = {
        "both": combined_fraction(t3, t4, t1, t5, t6, t2), "equal": _over_one_filter(t3, t4, t1, t5, t6),
        "gap_unfiltered": combined_fraction(t3, t4, 0.0, t5, t6, t2),
        "unfiltered": combined_fraction(t3, t7, 0.0, t5, 0.0, 0.0),  # t7 is the one rate that is left
    }  # fmt: skip
    out = {}
    for column, (top, bottom) in columns.items():
        for letter, coefficients, size in (("d", bottom, 3), ("k", top, 5)):
            padded = np.zeros(size)
            padded[: len(coefficients)] = coefficients
            out |= {f"C-1.{column}.{letter}_{k}": float(value) for k, value in enumerate(padded)}
    return out


def _over_one_filter(t3, t4, t1, t5, t6) -> tuple[np.ndarray, np.ndarray]:
    """K_0 with equal time constants: the common factor 1 + t1 s of both sides divided out."""
    top, bottom = combined_fraction(t3, t4, t1, t5, t6, t1)
    factor = np.array([t1, 1.0])
    (top, rest), (bottom, none) = (np.polydiv(np.array(side)[::-1], factor) for side in (top, bottom))
    assert max(abs(rest).max(), abs(none).max()) < 1e-12
    return top[::-1], bottom[::-1]


def _rounded_rate_gain(plant, law, bare) -> dict[str, float]:
    """Pitch damping in the middle of the rate gains that print as 0.15 and give every other number of C.5."""
    inside = [rate for rate in np.linspace(0.145, 0.155, 201) if _prints_c5(plant, law, bare, rate)]
    middle = (inside[0] + inside[-1]) / 2
    (_, pitch) = _modes(roots_of(plant, law, "heave_pitch", _with_rate(bare, middle)))[0]
    return {"C.5.pitch_damping": pitch, "C.5.rate_gain_range": float(inside[-1] - inside[0])}


def _prints_c5(plant, law, bare, rate: float) -> bool:
    """Whether a rate gain gives pitch at 0.56 Hz with damping 0.55, and heave with damping 0.6, as C.5 prints them."""
    moved = _with_rate(bare, rate)
    (pitch_hz, pitch), (_, heave) = _modes(roots_of(plant, law, "heave_pitch", moved))
    return abs(pitch_hz - 0.56) <= 0.005 and abs(pitch - 0.55) <= 0.005 and abs(heave - 0.6) <= 0.05


def _with_rate(bare, rate: float):
    """The unfiltered gains with another vertical rate gain."""
    return bare.with_values(K_hdot=rate * bare.K_hdot / 0.15, K_zdot=rate * bare.K_zdot / 0.15)


def _share_of_heave(plant, law, bare) -> float:
    """How far the root that moves least goes over the one that moves most, as K_θ grows by a tenth."""
    from scipy.optimize import linear_sum_assignment

    before, after = (
        np.array([r for r in roots_of(plant, law, "heave_pitch", gains) if r.imag > 0])
        for gains in (bare, bare.with_values(K_pitch=1.1 * bare.K_pitch))
    )
    distance = np.abs(before[:, None] - after[None, :])
    moved = distance[linear_sum_assignment(distance)]
    return float(moved.min() / moved.max())


def _past_the_double_root(plant, law, gains) -> float:
    """Product of the signs of the damping changes of the two modes that met, as K_Y grows on; yaw is left out."""
    dampings = []
    for step in (1.05, 1.10):
        modes = _modes(roots_of(plant, law, "sway_roll_yaw", gains.with_values(K_sway=step * gains.K_sway)))
        yaw = min(modes, key=lambda m: abs(m[0] - 1.02) + abs(m[1] - 0.68))  # printed in C.6
        dampings.append([damping for frequency, damping in modes if (frequency, damping) != yaw])
    return float(np.prod(np.sign(np.subtract(*dampings))))


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
