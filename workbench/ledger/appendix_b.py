"""Appendix B, vehicle and reduced models: our number for every row of appendix_b.toml.

Matrices come from the linearised nonlinear equations, reduced models from `loop.reduced`, P from the pseudo-inverse.
"""

import numpy as np

from workbench.control.loop.polynomial import roots_of
from workbench.ledger.baseline import report_gains, report_law, report_model, report_vehicle
from workbench.ledger.tables import compare

UNDEFINED = ("e_y", "e_phi")  # used in B.5 and defined nowhere: there is nothing printed to compare
AGREEMENT = 1e-12  # relative; a pseudo-inverse of eight rows


def computed() -> dict[str, float]:
    """Row id → our number, in the unit of the row."""
    vehicle, law, gains = report_vehicle().with_extras(gravity_term=True), report_law(), report_gains()  # B.5 has it
    comparisons = compare(vehicle, law, gains).comparisons
    out = {}
    for c in comparisons:
        model = c.entry.table.startswith("B.5 ")
        if c.ours is not None and c.entry.symbol not in UNDEFINED and (not model or c.as_found is not None):
            out[f"{c.entry.table.replace(' ', '.').replace('/', '_')}.{c.entry.symbol}"] = c.ours
    # -s²H in place of +s²H is the same as acceleration gains of the other sign
    mirrored = gains.with_values(**{name: -getattr(gains, name) for name in ("K_zddot", "K_zdot", "K_yddot", "K_ydot")})
    P = np.linalg.pinv(law.displacement_matrix())  # rows Z, Θ, Y, Φ, Ψ; columns vertical 1…4, lateral 1…4
    return out | {
        "B.1.wheel_base": vehicle.front + vehicle.rear,
        "B-3.filter_sign": float(roots_of(report_model().plant, law, "heave_pitch", mirrored).real.max()),
        "B-3.P_SS.heave_front": float(P[0, 0]),
        "B-3.P_SS.heave_rear": float(P[0, 2]),
        "B-3.P_SS.pitch": float(P[1, 0]),
        "B-3.P_AS.sway": float(P[2, 0]),
        "B-3.P_AS.roll": float(P[3, 0]),
        "B-3.P_AA.sway_front": float(P[2, 4]),
        "B-3.P_AA.yaw": float(P[4, 4]),
        **_matrices(law, P),
    }


def _matrices(law, P: np.ndarray) -> dict[str, float]:
    """Entries of each matrix of Table B-3 that ours agree with, as printed; P and Q by definition undo each other."""
    own = law.displacement_matrix()  # rows vertical 1…4, lateral 1…4; columns Z, Θ, Y, Φ, Ψ
    (a_F, b), (a_R, _) = law.positions[0], (-law.positions[-1][0], 0.0)
    c, D = law.depth, a_F + a_R
    side = np.array([1.0, -1.0, 1.0, -1.0])  # right, left
    along = np.array([a_F, a_F, -a_R, -a_R])
    share = np.array([a_R, a_R, a_F, a_F]) / (2 * D)
    end = np.array([1.0, 1.0, -1.0, -1.0]) / (2 * D)
    none = np.zeros(4)
    printed = {
        "Q_SS": np.column_stack([-np.ones(4), along]),
        "Q_SA": np.column_stack([none, -b * side, none]),
        "Q_AA": np.column_stack([side, -c * side, along * side]),
        "P_SS": np.array([-share, end]),
        "P_AS": np.array([-c * side / (4 * b), -side / (4 * b), none]),
        "P_AA": np.array([share * side, none, end * side]),
        "P_AS_times_Q_SA": np.array([[0, c, 0], [0, 1, 0], [0, 0, 0]]),
        "P_AA_times_Q_AA": np.array([[1, -c, 0], [0, 0, 0], [0, 0, 1]]),
    }
    ours = {
        "Q_SS": own[:4, :2], "Q_SA": own[:4, 2:], "Q_AA": own[4:, 2:],
        "P_SS": P[:2, :4], "P_AS": P[2:, :4], "P_AA": P[2:, 4:],
        "P_AS_times_Q_SA": P[2:, :4] @ own[:4, 2:], "P_AA_times_Q_AA": P[2:, 4:] @ own[4:, 2:],
    }  # fmt: skip
    size = {name: np.abs(matrix).max() for name, matrix in printed.items()}
    return {
        f"B-3.{name}": float(np.sum(np.abs(ours[name] - matrix) <= AGREEMENT * size[name]))
        for name, matrix in printed.items()
    }
