"""The report's way to the gains (Appendices C.4 to C.6): closed forms in heave, a double root in sway/roll/yaw.

    wanted heave frequency  --> K_h         wanted heave damping --> rate gain, without filters
    unfiltered search       --> K_ḣ' = K_ẏ and K_sway where two oscillating roots coincide
    equal time constants    --> the same roots with filters (the rate gain serves both sensors), the start of a search

With τ_h = τ_z and K_ḣ = K_ż, K_0(s) is the polynomial K_h + K_ḣ s + K_z̈ s², so that filters change no root; C.2.
Two roots coincide where p(s) = p'(s) = 0: four real equations for two gains and the real and imaginary part of s.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.control.gains import GAIN_NAMES, Gains
from workbench.control.law import CHANNELS, ModalLaw
from workbench.control.loop.locus import Names
from workbench.control.loop.mechanics import mechanics
from workbench.control.loop.polynomial import characteristic_polynomial, roots_of
from workbench.errors import InfeasibleError, InputError, unknown_name
from workbench.lti import Plant
from workbench.lti.signals import COORDINATES
from workbench.result import Result, Row

OSCILLATING = 1e-5  # Im/|s| above which a root counts as oscillating; double real roots split by 1e-7 in rounding


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class HeaveChoice(Result):
    """Position and rate gain of the vertical channel for a wanted heave mode, K_heave = 1 unless given.

    K_h [1/m];  rate : K_ḣ, or K_ḣ = K_ż with filters [s/m];  passive_frequency_hz : without control
    """

    K_h: float
    rate: float
    frequency_hz: float
    damping: float
    passive_frequency_hz: float

    def rows(self) -> list[Row]:
        return [
            ("K_h", self.K_h, "1/m"),
            ("rate gain", self.rate, "s/m"),
            ("frequency without control", self.passive_frequency_hz, "Hz"),
            ("frequency", self.frequency_hz, "Hz"),
            ("damping", self.damping, ""),
        ]


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class DoubleRoot(Result):
    """Gains at which two oscillating roots coincide.

    names : two groups of tied gains;  values : their two values;  gains : all seventeen
    root : the double root, Im > 0 [rad/s];  others : (m, 2) frequency [Hz] and damping of the other oscillating roots
    """

    names: tuple[tuple[str, ...], tuple[str, ...]]
    values: tuple[float, float]
    gains: Gains
    root: complex
    others: np.ndarray

    @property
    def frequency_hz(self) -> float:
        """|s|/2π."""
        return abs(self.root) / (2 * np.pi)

    @property
    def damping(self) -> float:
        """−Re s/|s|."""
        return -self.root.real / abs(self.root)

    def rows(self) -> list[Row]:
        gains = [(" = ".join(names), value, "") for names, value in zip(self.names, self.values, strict=True)]
        double = [("double root frequency", self.frequency_hz, "Hz"), ("double root damping", self.damping, "")]
        rest = [
            (f"other root {k + 1} frequency, damping", f"{f:.4g} Hz, {d:.3g}", "")
            for k, (f, d) in enumerate(self.others)
        ]
        return [*gains, *double, *rest]


def heave_choice(
    plant: Plant, law: ModalLaw, *, frequency_hz: float, damping: float, K_heave: float = 1.0
) -> HeaveChoice:
    """K_h and rate gain that give the heave mode alone a wanted frequency and damping, without acceleration feedback.

    From m s² + B K_heave K_ḣ s + B K_heave K_h − a_zz, with B = −4 b_z. Source: report, C.5 and B.5.
    """
    if not (frequency_hz > 0 and damping > 0 and K_heave > 0):
        raise InputError(
            f"frequency, damping and K_heave must be positive; got {frequency_hz!r} Hz, {damping!r}, {K_heave!r}."
        )
    m = mechanics(plant, law)
    Z = COORDINATES.index("Z")
    control = float(-m.current[Z] @ law.command_columns()[:, CHANNELS.index("heave")]) * K_heave
    if control == 0:
        raise InputError("the currents must move the vehicle in heave; the lift's derivative by the current is zero.")
    omega = 2 * np.pi * frequency_hz
    mass, stiffness = float(m.inertia[Z]), float(m.stiffness[Z, Z])
    return HeaveChoice(
        K_h=(mass * omega**2 + stiffness) / control, rate=2 * damping * omega * mass / control,
        frequency_hz=frequency_hz, damping=damping,
        passive_frequency_hz=float(np.sqrt(max(-stiffness / mass, 0.0)) / (2 * np.pi)),
    )  # fmt: skip


def unfiltered(gains: Gains) -> Gains:
    """The same gains with all time constants zero: the search's own problem, of order 2N."""
    return gains.with_values(tau_h=0.0, tau_hp=0.0, tau_z=0.0, tau_y=0.0)


def filtered_start(gains: Gains, tau: float) -> Gains:
    """Gains with filters of one time constant and the unfiltered roots: each rate gain serves both sensors."""
    if not tau > 0:
        raise InputError(
            f"the time constant of the filters must be positive; got {tau!r} s. Use the unfiltered gains as they are."
        )
    return gains.with_values(tau_h=tau, tau_hp=tau, tau_z=tau, tau_y=tau, K_zdot=gains.K_hdot, K_ydot=gains.K_hpdot)


def double_root(
    plant: Plant,
    law: ModalLaw,
    gains: Gains,
    *,
    free: tuple[Names, Names],
    part: str = "sway_roll_yaw",
    near: complex | None = None,
) -> DoubleRoot:
    """Two gains at which two oscillating roots of a group coincide.

    Parameters
    ----------
    gains : start of the two free gains, values of the others
    free : two names, or two groups of names that share a value, e.g. ("K_sway", ("K_hpdot", "K_ydot"))
    near : complex
        Where the double root is sought [rad/s]; between the two closest oscillating roots at the start unless given.

    Raises
    ------
    InfeasibleError
        If no double root is found from this start.
    """
    import scipy.optimize

    groups = tuple((n,) if isinstance(n, str) else tuple(n) for n in free)
    for name in (n for group in groups for n in group):
        if name not in GAIN_NAMES:
            raise unknown_name("gain", name, GAIN_NAMES)
    start = [getattr(gains, group[0]) for group in groups]
    root = _between(roots_of(plant, law, part, gains)) if near is None else complex(near)
    scale = abs(root)
    residual = _residual(plant, law, part, gains, groups, scale)
    first = np.array([*start, root.real / scale, abs(root.imag) / scale])
    solution = scipy.optimize.root(
        lambda x: residual(x)[0].full().ravel(), first, jac=lambda x: residual(x)[1].full(), tol=1e-13
    )
    values, s = tuple(float(v) for v in solution.x[:2]), complex(*solution.x[2:]) * scale
    if (
        not np.all(np.isfinite(solution.x))
        or np.abs(residual(solution.x)[0].full()).max() > 1e-9
        or abs(s.imag) < OSCILLATING * abs(s)
    ):
        raise InfeasibleError(
            f"no double root was found near {root:.3g} rad/s from {dict(zip(groups, start, strict=True))}; "
            "start from gains whose roots lie closer together, or say where with near=."
        )
    s = complex(s.real, abs(s.imag))
    found = gains.with_values(**{name: value for group, value in zip(groups, values, strict=True) for name in group})
    roots = roots_of(plant, law, part, found)
    above = roots[roots.imag > OSCILLATING * np.abs(roots)]
    rest = np.delete(above, np.argsort(np.abs(above - s))[:2])
    modes = np.column_stack([np.abs(rest) / (2 * np.pi), -rest.real / np.abs(rest)])
    return DoubleRoot(names=groups, values=values, gains=found, root=s, others=modes)


def _between(roots: np.ndarray) -> complex:
    above = roots[roots.imag > OSCILLATING * np.abs(roots)]
    if len(above) < 2:
        raise InfeasibleError(
            f"a double root needs two oscillating roots to start from; the gains give {len(above)}. Change the start."
        )
    pairs = [(abs(p - q), (p + q) / 2) for i, p in enumerate(above) for q in above[:i]]
    return complex(min(pairs, key=lambda pair: pair[0])[1])


def _residual(plant, law, part, gains: Gains, groups: tuple[Sequence[str], ...], scale: float) -> ca.Function:
    """(Re p, Im p, Re p', Im p') and its Jacobian; s is in units of `scale`, p has a unit leading coefficient."""
    x = ca.SX.sym("x", 4)
    parameters: dict = dict(gains.as_dict())
    for k, group in enumerate(groups):
        parameters |= dict.fromkeys(group, x[k])
    coefficients = characteristic_polynomial(plant, law, part, parameters)
    a = [c * scale**k / (coefficients[-1] * scale ** (len(coefficients) - 1)) for k, c in enumerate(coefficients)]
    slope = [k * c for k, c in enumerate(a)][1:]
    out = ca.vertcat(*_complex_horner(a, x[2], x[3]), *_complex_horner(slope, x[2], x[3]))
    return ca.Function("double_root", [x], [out, ca.jacobian(out, x)])


def _complex_horner(coefficients, re, im) -> tuple:
    real, imaginary = ca.SX(0), ca.SX(0)
    for c in reversed(coefficients):
        real, imaginary = real * re - imaginary * im + c, real * im + imaginary * re
    return real, imaginary
