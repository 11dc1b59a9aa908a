"""Appendix D, frequency responses: our number for every row of appendix_d.toml."""

import numpy as np

from workbench.control.loop import close
from workbench.ledger.baseline import report_gains, report_law, report_model, report_vehicle
from workbench.lti import Plant
from workbench.lti.signals import numbered
from workbench.physics.guideway.irregularity import UNIT_INPUTS, Wave, phasors, table_d1

TABLE_D1 = {  # as printed, rows ζ_1…ζ_4, η_1…η_4; cos and sin column of each type
    "A1": ("1111 0000", "11-- 0000"),
    "A4": ("0000 1111", "0000 11--"),
    "A2": ("1-1- 0000", "1--1 0000"),
    "A3": ("0000 1-1-", "0000 1--1"),
}
WAVELENGTH = 134.0  # [m], 1 Hz at 134 m/s


def computed() -> dict[str, float]:
    """Row id → our number, in the unit of the row."""
    vehicle, law, gains = report_vehicle(), report_law(), report_gains()
    speed = vehicle.speed
    omega = Wave(wavelength=WAVELENGTH, amplitudes=(1.0, 0.0, 0.0, 0.0)).omega(speed)
    at_front = np.angle(phasors(vehicle.positions, speed, omega, "midpoint")[0, 0])
    place = 3.0  # any point ahead of the centre of gravity [m]
    centre = (vehicle.front - vehicle.rear) / 2
    at_place = np.angle(phasors(((place, 1.0),), speed, omega, centre)[0, 0])
    loop = close(report_model().plant, law, gains).system
    return {
        "D.2.omega_factor": omega * WAVELENGTH / speed,
        "D-1.omega_factor": omega * WAVELENGTH / (2 * np.pi * speed),
        "D.2.beta_factor": at_front * WAVELENGTH / (vehicle.front + vehicle.rear) / np.pi,
        "D.2.beta_of_x_factor": at_place * WAVELENGTH / (2 * place - vehicle.front + vehicle.rear),
        "D-1.entries": float(np.sum(np.sign(table_d1(np.pi / 4)) == _printed_table())),
        **_phases(vehicle.positions, speed),
        "D-2.power_sign": _power_ratio(loop, omega),
        "D.1.lateral_zeta_term": _error_of_printed_zeta_term(loop, omega),
    }


def _printed_table() -> np.ndarray:
    signs = {"1": 1, "-": -1, "0": 0}
    columns = [
        [signs[mark] for mark in TABLE_D1[name[:2]][name.endswith("sin")].replace(" ", "")] for name in UNIT_INPUTS
    ]
    return np.array(columns).T


def _phases(positions, speed: float) -> dict[str, float]:
    """Phase of both parts of each type relative to A3, whose own is 0, where every other type's φ is 0.7 rad."""
    phi = np.array([0.7, 0.7, 0.0, 0.7])
    out = {}
    for k in range(4):
        unit = np.eye(4)[k]
        wave = Wave(wavelength=WAVELENGTH, amplitudes=tuple(unit), phases=tuple(phi))
        c = wave.inputs(positions, speed)
        shape = phasors(positions, speed, 0.0)[:, k].real  # alike front and rear
        end = np.tile([1.0, 1.0, -1.0, -1.0], 2)
        for name, part in (("in_phase", shape), ("out_of_phase", shape * end)):
            out[f"D-1.phase.A{k + 1}.{name}"] = float(np.angle(part @ c))
    return out


def _power_ratio(loop: Plant, omega: float) -> float:
    """The printed lift term of Table D-2 over the time average of lift times velocity, under A1."""
    sets = report_vehicle().count
    wave = phasors(report_vehicle().positions, report_vehicle().speed, omega)[:sets, 0]
    response = loop.response(omega)[0][:, loop.index("inputs", numbered("zeta", sets))] @ wave
    alpha = response[loop.index("outputs", numbered("current", sets))]
    coordinates = response[loop.index("outputs", ("Z", "Theta"))]
    motion = report_law().displacement_matrix()[:sets, :2] @ coordinates
    P = np.array([alpha.real, alpha.imag]) @ np.column_stack([motion.real, motion.imag])
    printed = omega / 2 * (P[0, 1] - P[1, 0])
    turn = np.exp(1j * np.arange(8) * np.pi / 4)  # eight instants average a product of two sines exactly
    force, velocity = (np.real(np.multiply.outer(turn, c)) for c in (alpha, 1j * omega * motion))
    return float(printed / np.mean(np.sum(force * velocity, axis=1)))


def _error_of_printed_zeta_term(loop: Plant, omega: float) -> float:
    """Change of Φ/ζ_1 if ζ enters the currents through P_AA H_h instead of P_AS H_h."""
    law, gains, s = report_law(), report_gains(), 1j * omega
    n, K = law.count, np.diag([gains.K_sway, gains.K_roll, gains.K_yaw])
    P = np.linalg.pinv(law.displacement_matrix())[2:]
    H_h = gains.K_h + gains.K_hdot * s / (1 + gains.tau_h * s)
    Q = law.displacement_matrix()[n:, 2:]
    wrong = Q @ K @ (P[:, n:] - P[:, :n])[:, 0] * H_h  # what the printed term adds to the commands, per ζ_1
    phi = loop.index("outputs", ["Phi"])[0]
    right = loop.response(omega)[0]
    errors = loop.index("inputs", [f"error_{name}" for name in law.commands])
    added = right[phi, errors] @ wrong
    own = right[phi, loop.index("inputs", ["zeta_1"])[0]]
    return float(abs(added) / abs(own))
