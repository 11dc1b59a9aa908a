"""Models with one and two degrees of freedom (report, Appendix B.5), coefficient by coefficient, errata mended.

    heave, pitch, yaw:   (a_0 s⁴ + a_1 s³ + a_2 s² + a_3 s + a_4) x = (b_0 s² + b_1 s + b_2) x_g
    sway/roll:           (a_0 s³ + a_1 s² + a_2 s + a_3) (Y, Φ)     = (b_0 s + b_1) (y_g, φ_g)      a_k, b_k : (2, 2)

The guideway moves under all sets as the vehicle's own coordinate would: up by Z_g, nose up by θ_g, nose right by ψ_g,
sideways by y_g, or it is turned by φ_g. A bank tilts the coils against their image (e_y = F_Gφ) or turns the section
with its forces (e_y = F_Gφ + F_L0), as the vehicle's `bank_reading` says. The coupling between pitch and heave and
between yaw and sway/roll is left out; `loop.polynomial` has the whole group.
"""

from collections.abc import Mapping

import casadi as ca
import numpy as np

from workbench.control.gains import TIME_CONSTANTS, Gains
from workbench.control.law import CHANNELS, ModalLaw
from workbench.control.loop.mechanics import Mechanics, mechanics
from workbench.control.loop.polynomial import LoopPolynomial, Parameters, named_parameters
from workbench.errors import InputError, unknown_name
from workbench.lti import Plant, PolynomialMatrix
from workbench.lti.signals import COORDINATES

REDUCED = ("heave", "pitch", "yaw", "sway_roll")


def reduced_model(plant: Plant, law: ModalLaw, name: str, gains: Parameters) -> LoopPolynomial:
    """One of the report's reduced models under the modal law.

    Parameters
    ----------
    name : one of REDUCED
    gains : as `loop_polynomial` takes them; sway/roll needs one time constant for all four filters

    Returns
    -------
    LoopPolynomial
        Its matrix holds a_4 … a_0 (or a_3 … a_0), its load b_2 … b_0, lowest power of s first.

    Raises
    ------
    InputError
        For a vehicle with current-loop lag, which these models do not have, and unequal time constants in sway/roll.
    """
    if name not in REDUCED:
        raise unknown_name("reduced model", name, REDUCED)
    m = mechanics(plant, law)
    if m.lag != 0:
        raise InputError(
            f"the reduced models have no current-loop lag; got {m.lag} s. "
            "Linearise with current_lag=0, or use loop_polynomial."
        )
    g = named_parameters(gains)
    return _sway_roll(m, law, gains, g) if name == "sway_roll" else _single(m, law, name, g)


def single_coefficients(
    inertia, stiffness, control, guideway, seen, K_modal, K, K_rate, tau_gap, K_acc, K_velocity, tau_acc
):
    """a_0 … a_4 and b_0 … b_2 of one degree of freedom; numbers or symbols.

    Parameters
    ----------
    inertia, stiffness : m and a_zz, B and a_θθ, C and a_ψψ
    control : −4 b_z, 2(b_θF a_F − b_θR a_R), 2(b_ψF a_F − b_ψR a_R): restoring force per unit of command
    guideway : 4 c_z, 2(c_θF a_F − c_θR a_R), 2(d_ψF a_F − d_ψR a_R)
    seen : −1 where the gap sensors see x + x_g (heave: the guideway rises, the vehicle sinks), +1 where x − x_g

    Source: report, B.5, with the factor 4 of c_z, K_θ in b_1 and b_2 and the sign of a_ψψ mended.
    """
    both, product = tau_acc + tau_gap, tau_acc * tau_gap
    B = control * K_modal
    a = (
        inertia * product + B * K_acc * product,
        inertia * both + B * (K_acc * both + K_velocity * product),
        inertia - stiffness * product + B * (K * product + (K_rate + K_velocity) * tau_acc + K_acc),
        -stiffness * both + B * (K * both + K_rate),
        -stiffness + B * K,
    )
    b = (
        tau_acc * (guideway * tau_gap + seen * B * (K * tau_gap + K_rate)),
        guideway * both + seen * B * (tau_gap * K + K_rate + tau_acc * K),
        guideway + seen * B * K,
    )
    return a, b


def _single(m: Mechanics, law: ModalLaw, name: str, g: Mapping) -> LoopPolynomial:
    coordinate = {"heave": "Z", "pitch": "Theta", "yaw": "Psi"}[name]
    row = COORDINATES.index(coordinate)
    x = np.array([p for p, _ in law.positions])
    under, pattern, seen = {
        "heave": (m.by_set("zeta"), np.ones(law.count), -1),
        "pitch": (m.by_set("zeta"), x, 1),
        "yaw": (m.by_set("eta"), law.side * x, 1),
    }[name]
    filters = ("K_hp", "K_hpdot", "tau_hp", "K_yddot", "K_ydot", "tau_y") if name == "yaw" else (
        "K_h", "K_hdot", "tau_h", "K_zddot", "K_zdot", "tau_z")  # fmt: skip
    a, b = single_coefficients(
        m.inertia[row],
        m.stiffness[row, row],
        -m.current[row] @ law.command_columns()[:, CHANNELS.index(name)],
        under[row] @ pattern,
        seen,
        g[f"K_{name}"],
        *(g[n] for n in filters),
    )
    return LoopPolynomial(
        name=name,
        matrix=PolynomialMatrix.of(a[::-1]),
        load=tuple(c if isinstance(c, ca.SX) else ca.DM(c) for c in b[::-1]),
        unknowns=(coordinate,),
        inputs=({"heave": "Z_g", "pitch": "theta_g", "yaw": "psi_g"}[name],),
    )


def _sway_roll(m: Mechanics, law: ModalLaw, gains: Parameters, g: Mapping) -> LoopPolynomial:
    tau = _common_time_constant(gains, g)
    Y, Phi = COORDINATES.index("Y"), COORDINATES.index("Phi")
    c, side = law.depth, law.side
    b = np.array([m.current[i] @ side for i in (Y, Phi)])  # 4 b_y, 4 b_φ
    d = np.array([m.by_set("eta")[i] @ side for i in (Y, Phi)])  # 4 d_y, 4 d_φ
    half_track = np.array([y for _, y in law.positions])
    e = np.array([m.by_set("bank")[i].sum() - m.by_set("zeta")[i] @ half_track for i in (Y, Phi)])  # 4 e − 4 b c_y
    gravity = -m.tilt[CHANNELS.index("sway"), Phi]  # g where the accelerometers feel it
    a = m.stiffness[np.ix_((Y, Phi), (Y, Phi))]
    inertia = m.inertia[[Y, Phi]]

    # every filter over the common denominator 1 + τ s, lowest power first
    H_gap = (g["K_h"], g["K_h"] * tau + g["K_hdot"])
    H_lateral = (g["K_hp"], g["K_hp"] * tau + g["K_hpdot"])
    H_z = (g["K_zddot"] + g["K_zdot"] * tau, g["K_zddot"] * tau)
    H_y = (g["K_yddot"] + g["K_ydot"] * tau, g["K_yddot"] * tau)
    K_Y, K_r = g["K_sway"], g["K_roll"] - g["K_sway"]
    vertical, lateral = ((p[0], p[1], 0, 0) for p in (H_gap, H_lateral))
    upward, sideways = ((0, 0, p[0], p[1]) for p in (H_z, H_y))
    tilt = (H_y[0], H_y[1], 0, 0)
    left, right = [], []
    for k in range(4):
        rows = []
        for i in range(2):
            mass = inertia[i] * (tau if k == 3 else 1) if k >= 2 else 0
            spring = -a[i] * (tau if k == 1 else 1) if k <= 1 else np.zeros(2)
            swing = K_Y * (lateral[k] + sideways[k])
            rolled = c * (K_r * (vertical[k] + upward[k]) + swing) + gravity * K_Y * tilt[k]
            rows.append(
                ca.horzcat(
                    (mass if i == 0 else 0) + spring[0] + b[i] * swing,
                    (mass if i == 1 else 0) + spring[1] - b[i] * rolled,
                )
            )
        left.append(ca.vertcat(*rows))
    for k in range(2):
        share = tau if k == 1 else 1
        rows = []
        for i in range(2):
            to_y = b[i] * K_Y * H_lateral[k] + d[i] * share
            to_phi = -b[i] * c * (K_r * H_gap[k] + K_Y * H_lateral[k]) + (e[i] - c * d[i]) * share
            rows.append(ca.horzcat(to_y, to_phi))
        right.append(ca.vertcat(*rows))
    return LoopPolynomial(
        name="sway_roll",
        matrix=PolynomialMatrix.of(left),
        load=tuple(r if isinstance(r, ca.SX) else ca.DM(r) for r in right),
        unknowns=("Y", "Phi"),
        inputs=("y_g", "phi_g"),
    )


def _common_time_constant(gains: Parameters, g: Mapping):
    given = gains.as_dict() if isinstance(gains, Gains) else g
    taus = [given[n] for n in TIME_CONSTANTS]
    first = taus[0]
    same = all((t is first) or (not isinstance(t, ca.SX) and not isinstance(first, ca.SX) and t == first) for t in taus)
    if not same:
        raise InputError(
            f"the sway/roll model of B.5 has one time constant for all four filters; "
            f"got {', '.join(str(t) for t in taus)} s. "
            "Make them equal, or use loop_polynomial with part 'sway_roll'."
        )
    return first
