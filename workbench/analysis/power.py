"""Mean control power: what the control forces do to the body, what the currents' supply gives, what resistance takes.

    to_body     Σ_i E[α_i (F_Lα ż_i + F_Gα ẏ_i + L_α φ̇_i)]   with the coil sets' own velocities
    electrical  the same with the rates of the gaps instead: the port between control coils and guideway
    resistive   R (main current)² Σ E[α_i²]

Source: report, Table D-2, with the sign that makes power delivered to the body positive (the printed order P12 − P21
gives the power absorbed from it).
"""

import numpy as np

from workbench.analysis.response import Driven
from workbench.analysis.setting import Setting
from workbench.lti.signals import numbered
from workbench.lti.variance import Stationary


def mechanical_power(setting: Setting, driven: Driven, state: Stationary) -> tuple[np.ndarray, np.ndarray]:
    """(to_body, electrical) [W] of one group under each type, two (types,) arrays."""
    law = setting.law
    n = law.count
    lift, lateral, moment = setting.current_forces
    current = driven.rows(numbered("current", n))
    Q = law.displacement_matrix()
    rates = driven.rows([f"{name}_rate" for name in ("Z", "Theta", "Y", "Phi", "Psi")])
    velocity = Q @ rates  # of the coil sets: n vertical, n lateral, away from the guideway
    roll = -law.side[:, None] * rates[3]
    to_body = state.power(current, lift * velocity[:n] + lateral * velocity[n:] + moment * roll)
    surface = lift * _surface_product(driven, state, current, slice(0, n)) + lateral * _surface_product(
        driven, state, current, slice(n, 2 * n)
    )
    return to_body, to_body - surface


def _surface_product(driven: Driven, state: Stationary, current: np.ndarray, sets: slice) -> np.ndarray:
    """Σ_i E[α_i dσ_i/dt] (types,) for the surface displacement σ_i under each set, whose rate contains white noise.

    E[x(t) w(t − T_j)'] = B_j/2 + Σ_{i<j} e^{A(T_j − T_i)} B_i, for arrivals in the order of their delays.
    """
    from scipy.linalg import expm

    smooth = state.power(current, driven.surface_rate[sets])
    white = np.zeros(len(smooth))
    for j, (delay, B) in enumerate(driven.arrivals):
        met = B / 2 + sum(expm(driven.A * (delay - before)) @ earlier for before, earlier in driven.arrivals[:j])
        white += np.einsum("ik,ik->k", current @ met, driven.surface[sets] @ B)
    return smooth + white


def resistive_power(setting: Setting, sum_alpha_squared: float) -> float:
    """I²R of all control coils [W]."""
    return setting.coil_resistance * setting.main_current**2 * sum_alpha_squared
