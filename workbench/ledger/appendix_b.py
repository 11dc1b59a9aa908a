"""Appendix B, vehicle and reduced models: our number for every row of appendix_b.toml.

Matrices come from the linearised nonlinear equations, reduced models from `loop.reduced`, P from the pseudo-inverse.
"""

import numpy as np

from workbench.ledger.baseline import report_gains, report_law, report_model, report_vehicle
from workbench.ledger.tables import compare
from workbench.loop.polynomial import roots_of


def computed() -> dict[str, float]:
    """Row id → our number, in the unit of the row."""
    vehicle, law, gains = report_vehicle().with_extras(gravity_term=True), report_law(), report_gains()  # B.5 has it
    comparisons = compare(vehicle, law, gains).comparisons
    out = {}
    for c in comparisons:
        model = c.entry.table.startswith("B.5 ")
        if c.ours is not None and (not model or c.as_found is not None):
            out[f"{c.entry.table.replace(' ', '.').replace('/', '_')}.{c.entry.symbol}"] = c.ours
    models = [c for c in comparisons if c.entry.table.startswith("B.5 ")]
    # -s²H in place of +s²H is the same as acceleration gains of the other sign
    mirrored = gains.with_values(**{name: -getattr(gains, name) for name in ("K_zddot", "K_zdot", "K_yddot", "K_ydot")})
    P = np.linalg.pinv(law.displacement_matrix())  # rows Z, Θ, Y, Φ, Ψ; columns vertical 1…4, lateral 1…4
    return out | {
        "B.1.wheel_base": vehicle.front + vehicle.rear,
        "B.5.exact_coefficients": float(sum(c.agrees and c.as_found is None for c in models)),
        "B-3.filter_sign": float(roots_of(report_model().plant, law, "heave_pitch", mirrored).real.max()),
        "B-3.P_SS.heave_front": float(P[0, 0]),
        "B-3.P_SS.heave_rear": float(P[0, 2]),
        "B-3.P_SS.pitch": float(P[1, 0]),
        "B-3.P_AS.sway": float(P[2, 0]),
        "B-3.P_AS.roll": float(P[3, 0]),
        "B-3.P_AA.sway_front": float(P[2, 4]),
        "B-3.P_AA.yaw": float(P[4, 4]),
    }
