"""Three phases: from the components of one phase to waves that travel, to constant forces and ripple, balanced or not.

    f_n of one phase  --(4)-->  three phases  --(8)-->  travelling waves  --z = ωt/κ − s (10)-->  lines at 0, 6ω, 12ω

The functions of equations (4), (8) and (10) take scalars or SX for angles. With any currents, balanced or not, a coil
that keeps pace feels lines at even multiples of ω only, because the space harmonics are odd (`force_lines`).

Corrected here: equation (5) lacks f_n, and its last term, as the last line of the report's Appendix I, has the wrong
sign (+ for −); the terms cancel in the sum. Equation (7) reads nκz for "mlz". The fifth harmonic travels backward, as
the report's equation (8) says and its section 5.3 does not.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from workbench.errors import InputError
from workbench.physics.motor.lin_motor import CENTRED, components
from workbench.physics.motor.pose import COMPONENTS, UNITS
from workbench.physics.motor.winding import REPORT_COIL, REPORT_WINDING, VehicleCoil, Winding
from workbench.result import Result, Row

PHASES = (0, 1, 2)
BALANCED = tuple(np.exp(-2j * np.pi * m / 3) for m in PHASES)


def three_phase_sum(amplitudes, electrical, time):
    """Force of three balanced phases, term by term.

    Parameters
    ----------
    amplitudes : mapping of harmonic n to f_n
        [N] or [N m].
    electrical, time : scalar or SX
        κz and ωt [rad].

    Source: report, Appendix F, eq. (4).
    """
    total = 0
    for n, f in amplitudes.items():
        for m in PHASES:
            shift = 2 * m * ca.pi / 3
            total = total + f * ca.cos(n * (electrical - shift)) * ca.cos(time - shift)
    return total


def phase_product(n: int, m: int, electrical, time):
    """cos n(κz − 2mπ/3)·cos(ωt − 2mπ/3) as four products, with the correct sign of the last.

    Source: report, Appendix F, Appendix I, last line; its fourth term is printed with +.
    """
    shift = 2 * m * ca.pi / 3
    ahead, behind = time + n * electrical, time - n * electrical
    return 0.5 * (
        ca.cos(ahead) * ca.cos((n + 1) * shift)
        + ca.cos(behind) * ca.cos((n - 1) * shift)
        + ca.sin(ahead) * ca.sin((n + 1) * shift)
        - ca.sin(behind) * ca.sin((n - 1) * shift)
    )


def direction(n: int) -> int:
    """+1 if space harmonic n of three balanced phases travels forward, −1 backward, 0 if it vanishes.

    It travels at 1/n of the fundamental's speed. Source: report, Appendix F, eq. (8).

    Examples
    --------
    >>> {n: direction(n) for n in (1, 3, 5, 7)}
    {1: 1, 3: 0, 5: -1, 7: 1}
    """
    if n < 1 or n % 2 == 0:
        raise InputError(f"a space harmonic must be odd and positive; got {n!r}. An alternating row has no others.")
    return {1: 1, 2: -1, 0: 0}[n % 3]


def travelling_sum(amplitudes, electrical, time):
    """3/2 Σ f_n cos(ωt ∓ nκz): the same force as `three_phase_sum`. Source: report, Appendix F, eq. (8)."""
    moving = [(f, direction(n) * n) for n, f in amplitudes.items() if direction(n)]
    return 1.5 * sum(f * ca.cos(time - wave * electrical) for f, wave in moving)


def synchronous_sum(amplitudes, lag, time):
    """The force on a coil at z = ωt/κ − s; `lag` = κs, `time` = ωt [rad]. Source: report, Appendix F, eq. (10)."""
    moving = [(f, n, direction(n)) for n, f in amplitudes.items() if direction(n)]
    return 1.5 * sum(f * ca.cos((1 - way * n) * time + way * n * lag) for f, n, way in moving)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class ForceLines(Result):
    """Spectrum of the forces on a coil that keeps pace with the fundamental.

    multiple : (k,)  even multiples of ω, 0 first
    complex : (k, 6)  F_x … T_z(t) = Re Σ_k complex[k] e^{i multiple[k] ωt} [N, N m]; row 0 is the constant force
    """

    multiple: np.ndarray
    complex: np.ndarray

    @property
    def amplitude(self) -> np.ndarray:
        """(k, 6) amplitudes; row 0 the magnitude of the constant force."""
        return np.abs(self.complex)

    def line(self, multiple: int) -> np.ndarray:
        """(6,) complex amplitude at `multiple`·ω; zeros where there is no line."""
        rows = np.flatnonzero(self.multiple == multiple)
        return self.complex[rows[0]] if len(rows) else np.zeros(6, complex)

    def rows(self) -> list[Row]:
        return [
            (f"{name} at {k} ω", float(value), unit)
            for k, row in zip(self.multiple, self.amplitude, strict=True)
            for name, value, unit in zip(COMPONENTS, row, UNITS, strict=True)
        ]


def force_lines(
    pose=CENTRED,
    *,
    slip: float = 0.0,
    currents=BALANCED,
    winding: Winding = REPORT_WINDING,
    coil: VehicleCoil = REPORT_COIL,
    pivot=(0.0, 0.0, 0.0),
    highest: int = 25,
) -> ForceLines:
    """Constant force and ripple of three phases on one coil, balanced or not.

    Parameters
    ----------
    pose, winding, coil, pivot
        As in `components`.
    slip : float
        Distance the coil lags behind the crest of thrust [m].
    currents : (3,) array_like of complex
        Phase currents over the winding's rated current: phase m, displaced by 2m/3 of a pole pitch, carries
        Re(currents[m] e^{iωt}). Balanced unless given.
    highest : int
        Last space harmonic.

    Returns
    -------
    ForceLines
        Up to (highest + 1)ω. With balanced currents only 0, 6ω, 12ω … differ from zero. The third harmonic acts as
        soon as the currents are unbalanced, at 2ω and 4ω; an unbalanced fundamental adds to 2ω.

    Raises
    ------
    InputError
        If there are not three finite currents.

    Source: report, Appendix F, eqs. (4), (10) and 7.4 e.
    """
    phase = np.asarray(currents, dtype=complex)
    if phase.shape != (3,) or not np.all(np.isfinite(phase)):
        raise InputError(f"currents must be three finite complex numbers; got {currents!r}. Give one for each phase.")
    single = components(pose, winding=winding, coil=coil, pivot=pivot, highest=highest)
    lag = single.wave_number * (winding.pole_pitch / 2 + slip)
    lines = {k: np.zeros(6, complex) for k in range(0, highest + 2, 2)}
    for n, component in zip(single.harmonic.tolist(), single.complex, strict=True):
        placed = 0.5 * component * np.exp(-1j * n * lag)
        shift = np.exp(-2j * np.pi * n * np.arange(3) / 3)
        lines[n + 1] += placed * (shift @ phase)
        lines[n - 1] += placed * (shift @ phase.conj())
    lines[0] = lines[0].real.astype(complex)
    return ForceLines(multiple=np.array(list(lines)), complex=np.array(list(lines.values())))


def symmetrical_components(currents) -> np.ndarray:
    """(3,) zero, positive and negative sequence of three phase currents, so that balanced currents give (0, 1, 0)."""
    return np.fft.ifft(np.asarray(currents, dtype=complex))
