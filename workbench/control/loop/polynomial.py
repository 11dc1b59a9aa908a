"""The closed loop of a group as a polynomial matrix in s, numeric or symbolic in the seventeen parameters.

    vehicle:   (I s² − damping s − stiffness) q − B v        = C ζ + D η + E φ_g + loads
    currents:  (1 + T s) v − gains · (q, r, f)               = gains · (guideway seen by the gap sensors)
    gap rate:  (1 + τ s) r − s · gap                         = 0      one r per modal channel
    filtered:  (1 + τ s) f − acceleration                    = 0      one f per modal channel

Unknowns are the coordinates q, the currents v along the group's patterns, the filtered rates r and the filtered
accelerations f. Nothing is divided, so no root is added: the order is 4N (8 and 12) with all filters, one less per
filter at τ = 0, two more with the current-loop lag. Without lag the determinant is that of the report's
[s²I − A + B Q K K_0(s)] times the filters' denominators (report, Appendix C.2), coefficient by coefficient.
Source: report, Tables B-3 and C-1; the branches t_1 = 0, t_2 = 0 of Table C-1 are time constants of zero here.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.control.gains import GAIN_NAMES, Gains
from workbench.control.law import CHANNELS, PATHS, VERTICAL_CHANNELS, ModalLaw, modal_factors
from workbench.control.loop.mechanics import cleaned, mechanics
from workbench.control.loop.subject import SUBJECTS, subject
from workbench.errors import InputError, unknown_name
from workbench.lti import Plant, PolynomialMatrix
from workbench.lti.signals import COORDINATES, current_of
from workbench.result import Result, Row

HELD = {  # reduced models of Appendix B.5: coordinates that move, channels that act; all else is held at zero
    "pitch": ("heave_pitch", ("Theta",), ("pitch",)),
    "yaw": ("sway_roll_yaw", ("Psi",), ("yaw",)),
    "sway_roll": ("sway_roll_yaw", ("Y", "Phi"), ("roll", "sway")),
}
PARTS = (*SUBJECTS, *HELD)

Parameters = Gains | ca.SX | Mapping[str, ca.SX | float]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LoopPolynomial(Result):
    """matrix(s) · unknowns = load(s) · inputs.

    matrix : PolynomialMatrix, (n, n);  unknowns : n names (coordinates first);  inputs : m names
    load : tuple of (n, m) SX or DM, lowest power first
    """

    name: str
    matrix: PolynomialMatrix
    load: tuple
    unknowns: tuple[str, ...]
    inputs: tuple[str, ...]

    def characteristic(self) -> list:
        """Coefficients of the characteristic polynomial, lowest power first: SX, or correctly rounded floats."""
        return self.matrix.determinant()

    def roots(self) -> np.ndarray:
        """Roots of the characteristic polynomial [rad/s], without forming it."""
        return self.matrix.roots()

    def numerator(self, output: str, given: str | Mapping[str, float]) -> list:
        """Numerator of output/input over `characteristic()`, lowest power first, by Cramer's rule.

        output : one of `unknowns`;  given : one of `inputs`, or weights of several that move together.
        """
        if output not in self.unknowns:
            raise unknown_name("output", output, self.unknowns)
        weights = self._weights(given)
        column = self.unknowns.index(output)
        powers = max(len(self.matrix.coefficients), len(self.load))
        replaced = []
        for k in range(powers):
            before = (
                self.matrix.coefficients[k]
                if k < len(self.matrix.coefficients)
                else ca.DM(self.matrix.size, self.matrix.size)
            )
            right = ca.mtimes(self.load[k], weights) if k < len(self.load) else ca.DM(self.matrix.size, 1)
            replaced.append(ca.horzcat(before[:, :column], right, before[:, column + 1 :]))
        return PolynomialMatrix.of(replaced).determinant()

    def transfer(self, output: str, given: str | Mapping[str, float]):
        """The same as a python-control TransferFunction (numeric coefficients only)."""
        import control

        over, under = self.numerator(output, given), self.characteristic()
        if not self.matrix.numeric:
            raise InputError(
                "a transfer function in numbers needs gains in numbers; give a Gains record instead of symbols."
            )
        return control.TransferFunction(over[::-1] or [0.0], under[::-1])

    def _weights(self, given: str | Mapping[str, float]) -> ca.DM:
        chosen = {given: 1.0} if isinstance(given, str) else given
        for name in chosen:
            if name not in self.inputs:
                raise unknown_name("input", name, self.inputs)
        return ca.DM([chosen.get(name, 0.0) for name in self.inputs])

    def rows(self) -> list[Row]:
        if not self.matrix.numeric:
            return [("order", len(self.characteristic()) - 1, ""), ("symbolic", True, "")]
        return [(f"a_{k}", value, "") for k, value in enumerate(self.characteristic())]


def loop_polynomial(plant: Plant, law: ModalLaw, part: str, gains: Parameters) -> LoopPolynomial:
    """The closed loop of a part of the vehicle in polynomial form.

    Parameters
    ----------
    part : one of PARTS
        A group, "all", or a reduced model of Appendix B.5 ("heave", "pitch", "yaw", "sway_roll") with the other
        coordinates held at zero.
    gains : Gains, SX (17,) in the order of `GAIN_NAMES`, or mapping of the seventeen names to numbers and symbols
        In a Gains record a filter whose rate gain is zero is left out, as everywhere else.

    Raises
    ------
    InputError
        For an unknown part, parameters that do not fit, or a group of a vehicle that is not symmetric.
    """
    if part not in PARTS:
        raise unknown_name("part of the vehicle", part, PARTS)
    whole = subject(plant, law, HELD[part][0] if part in HELD else part)
    coordinates, channels = whole.coordinates, whole.channels
    if part in HELD:
        coordinates, channels = HELD[part][1], tuple(CHANNELS.index(c) for c in HELD[part][2])
    g = named_parameters(gains)
    m = mechanics(plant, law)
    q = [COORDINATES.index(name) for name in coordinates]
    U = whole.patterns
    N, k, c = len(q), U.shape[1], len(channels)
    at_v, at_r, at_f = N, N + k, N + k + c
    size = N + k + 2 * c
    M = [ca.SX(size, size) for _ in range(3)]
    load = [ca.SX(size, len(m.inputs)) for _ in range(2)]

    own = np.ix_(q, q)
    M[2][:N, :N] = _sparse(np.diag(m.inertia[q]))
    M[1][:N, :N] = _sparse(-m.damping[own])
    M[0][:N, :N] = _sparse(-m.stiffness[own])
    M[0][:N, at_v:at_r] = _sparse(-m.current[q] @ U)
    load[0][:N, :] = _sparse(m.exogenous[q])

    factors = modal_factors(ca.vertcat(*(g[name] for name in GAIN_NAMES)), split=law.split)
    onto = ca.mtimes(_sparse(U.T @ law.path_columns()), ca.diag(factors))
    for place, channel in enumerate(channels):
        vertical = channel < VERTICAL_CHANNELS
        K, K_rate, tau_gap = (g[n] for n in (("K_h", "K_hdot", "tau_h") if vertical else ("K_hp", "K_hpdot", "tau_hp")))
        K_acc, K_velocity, tau_acc = (
            g[n] for n in (("K_zddot", "K_zdot", "tau_z") if vertical else ("K_yddot", "K_ydot", "tau_y"))
        )
        into = ca.sum2(onto[:, [k for k, start in enumerate(PATHS[law.split]) if start == channel]])
        gap, accelerated, tilt = (_sparse(rows[[channel]][:, q]) for rows in (m.gap, m.acceleration, m.tilt))
        guideway = _sparse(m.guideway[[channel]])
        M[0][at_v:at_r, :N] -= ca.mtimes(into, K * gap + K_acc * tilt)
        M[2][at_v:at_r, :N] -= ca.mtimes(into, K_acc * accelerated)
        M[0][at_v:at_r, at_r + place] -= into * K_rate
        M[0][at_v:at_r, at_f + place] -= into * K_velocity * tau_acc
        load[0][at_v:at_r, :] += ca.mtimes(into, K * guideway)
        M[0][at_r + place, at_r + place] = 1
        M[1][at_r + place, at_r + place] = tau_gap
        M[1][at_r + place, :N] -= gap
        load[1][at_r + place, :] += guideway
        M[0][at_f + place, at_f + place] = 1
        M[1][at_f + place, at_f + place] = tau_acc
        M[0][at_f + place, :N] -= tilt
        M[2][at_f + place, :N] -= accelerated
    M[0][at_v:at_r, at_v:at_r] = ca.SX.eye(k)
    if m.lag:
        M[1][at_v:at_r, at_v:at_r] = m.lag * ca.SX.eye(k)
    names = tuple(CHANNELS[channel] for channel in channels)
    return LoopPolynomial(
        name=part,
        matrix=PolynomialMatrix.of([_number_if_constant(m) for m in M]),
        load=tuple(_number_if_constant(m) for m in load),
        unknowns=(
            *coordinates,
            *(current_of(f"pattern_{i + 1}") for i in range(k)),
            *(f"filtered rate of {n}" for n in names),
            *(f"filtered acceleration of {n}" for n in names),
        ),
        inputs=m.inputs,
    )


def characteristic_polynomial(plant: Plant, law: ModalLaw, part: str, gains: Parameters) -> list:
    """Coefficients of the characteristic polynomial of a part, lowest power first; SX if a gain is a symbol."""
    return loop_polynomial(plant, law, part, gains).characteristic()


def roots_of(plant: Plant, law: ModalLaw, part: str, gains: Gains) -> np.ndarray:
    """Roots of a part's characteristic polynomial [rad/s], by growing modulus; time constants may be zero."""
    roots = loop_polynomial(plant, law, part, gains).roots()
    return roots[np.lexsort((roots.imag, np.abs(roots)))]


def named_parameters(gains: Parameters) -> dict:
    """Name to number or symbol; in a Gains record the time constant of a filter without rate gain becomes zero."""
    if isinstance(gains, Gains):
        values = gains.as_dict()
        for rate, tau in (("K_hdot", "tau_h"), ("K_hpdot", "tau_hp"), ("K_zdot", "tau_z"), ("K_ydot", "tau_y")):
            if values[rate] == 0:
                values[tau] = 0.0
        return values
    if isinstance(gains, ca.SX):
        if gains.numel() != len(GAIN_NAMES):
            raise InputError(
                f"a column of parameters must have {len(GAIN_NAMES)} entries; got {gains.numel()}. "
                "Use the order of GAIN_NAMES."
            )
        return dict(zip(GAIN_NAMES, ca.vertsplit(ca.vec(gains)), strict=True))
    for name in gains:
        if name not in GAIN_NAMES:
            raise unknown_name("gain", name, GAIN_NAMES)
    missing = [name for name in GAIN_NAMES if name not in gains]
    if missing:
        raise InputError(f"parameters must name all seventeen gains; missing {', '.join(missing)}. Add them.")
    return dict(gains)


def _sparse(matrix: np.ndarray) -> ca.DM:
    return ca.sparsify(ca.DM(cleaned(matrix)))


def _number_if_constant(matrix: ca.SX):
    return ca.evalf(matrix) if matrix.is_constant() else matrix
