"""Ride comfort: how strongly a passenger feels the acceleration of the floor.

    floor PSD --weight--> felt PSD --integrate--> weighted rms
             --third octaves--> rms per band --> boundaries (comfort.py)

PSDs are one-sided and per hertz, (m/s²)²/Hz, given as a function of frequency (called with an array) or as arrays
(frequency_hz, psd): between its points an array is a straight line on log-log paper, linear beside a zero. Frequency
is in Hz here and in plots; upstream it is angular, rad/s.

The frequency weightings make a vehicle with 0.6 Hz modes look better than it is (Wk passes a quarter of the amplitude
there), so unweighted figures, figures below 1 Hz and motion sickness stand beside them.
"""

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from workbench.analysis.density import Psd, band, samples
from workbench.errors import InputError, unknown_name
from workbench.result import Result, Row

Direction = Literal["vertical", "lateral"]

WEIGHT_OF = {"vertical": "Wk", "lateral": "Wd"}

_HALF = 2**-0.5  # quality factor of the band limits (Butterworth)


@dataclass(frozen=True, slots=True, kw_only=True)
class Weight:
    """A frequency weighting H = H_h H_l H_t H_s: two band limits, acceleration-velocity transition, upward step.

    H_h = 1/(1 + ω1/(Q s) + (ω1/s)²)     H_t = K (1 + s/ω3)/(1 + s/(Q4 ω4) + (s/ω4)²)
    H_l = 1/(1 + s/(Q ω2) + (s/ω2)²)     H_s = (ω5/ω6)² (1 + s/(Q5 ω5) + (s/ω5)²)/(1 + s/(Q6 ω6) + (s/ω6)²)

    with Q = 1/√2, ω = 2πf. None for f3 drops 1 + s/ω3, None for f5 and f6 drops H_s.
    """

    name: str
    f1: float  # [Hz]
    f2: float
    f3: float | None
    f4: float
    Q4: float
    f5: float | None = None
    Q5: float = 1.0
    f6: float | None = None
    Q6: float = 1.0
    K: float = 1.0
    source: str

    def magnitude(self, frequency_hz):
        """|H(2πjf)| [1] at f [Hz], elementwise (scalar, array, DM, SX); square it to weight a PSD."""
        f = frequency_hz
        band = (f / self.f1) ** 2 / _quadratic(f, self.f1, _HALF) / _quadratic(f, self.f2, _HALF)
        transition = self.K / _quadratic(f, self.f4, self.Q4)
        if self.f3 is not None:
            transition = transition * (1 + (f / self.f3) ** 2) ** 0.5
        if self.f5 is None or self.f6 is None:
            return band * transition
        step = (self.f5 / self.f6) ** 2 * _quadratic(f, self.f5, self.Q5) / _quadratic(f, self.f6, self.Q6)
        return band * transition * step

    @property
    def sections(self) -> list[tuple[float, float, tuple[float, float, float]]]:
        """Factors (b0 + b1 s/ω + b2 (s/ω)²)/(1 + s/(Qω) + (s/ω)²) as (ω/2π [Hz], Q, (b0, b1, b2)), low-pass first."""
        transition = (self.K, 0.0 if self.f3 is None else self.K * self.f4 / self.f3, 0.0)
        sections = [
            (self.f2, _HALF, (1.0, 0.0, 0.0)),
            (self.f1, _HALF, (0.0, 0.0, 1.0)),
            (self.f4, self.Q4, transition),
        ]
        if self.f5 is not None and self.f6 is not None:
            ratio = self.f6 / self.f5
            sections.append((self.f6, self.Q6, (ratio**-2, ratio**-1 / self.Q5, 1.0)))
        return sections

    def state_space(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The weighting as x' = A x + B a, felt = C x + D a, exactly.

        Returns
        -------
        A : (n, n), B : (n, 1), C : (1, n), D : (1, 1)
            n = 8 with the upward step, 6 without; D = 0. Each factor is one block with states scaled by its ω.
        """
        sections = self.sections  # low-pass first: every later block then has D = 0 in front of it
        n = 2 * len(sections)
        A, B = np.zeros((n, n)), np.zeros((n, 1))
        signal, through = np.zeros(n), 1.0  # what the next block receives: signal·x + through·a
        for block, (frequency_hz, Q, (b0, b1, b2)) in enumerate(sections):
            omega, p, q = 2 * np.pi * frequency_hz, 2 * block, 2 * block + 1
            A[q] = omega * signal  # p' = ω q, q' = −ω p − (ω/Q) q + ω input: p = input/(1 + s/(Qω) + (s/ω)²)
            A[p, q] += omega
            A[q, p] -= omega
            A[q, q] -= omega / Q
            B[q, 0] = omega * through
            signal = b2 * signal  # (b0 + b1 s/ω + b2 (s/ω)²) p, with (s/ω)² p = input − p − q/Q
            signal[p] += b0 - b2
            signal[q] += b1 - b2 / Q
            through *= b2
        return A, B, signal.reshape(1, n), np.array([[through]])


def _quadratic(frequency_hz, corner, quality):
    """|1 + s/(Qω) + (s/ω)²| at s = 2πjf."""
    ratio = frequency_hz / corner
    return ((1 - ratio**2) ** 2 + (ratio / quality) ** 2) ** 0.5


def weight(name: str) -> Weight:
    """A frequency weighting by name.

    "Wk" vertical, seated or standing; "Wd" horizontal; "Wf" motion sickness (vertical); "Wb" vertical in rail vehicles;
    "We" rotation; "Wc" seat back; "Wb_en12299" the other set of numbers in use for Wb (unverified).

    Raises
    ------
    InputError
        If there is no weighting of that name.

    Source: ISO 2631-1:1997, Annex A; ISO 8041-1, Table 3.

    Examples
    --------
    >>> weight("Wk").magnitude(np.array([0.6, 1.0, 5.012])).round(3).tolist()
    [0.452, 0.482, 1.039]
    """
    if name not in _weights():
        raise unknown_name("frequency weighting", str(name), _weights())
    return _weights()[name]


@cache
def _weights() -> dict[str, Weight]:
    iso = "ISO 2631-1:1997, Annex A; ISO 8041-1, Table 3"
    horizontal = {"f1": 0.4, "f2": 100.0, "Q4": 0.63, "source": iso}
    rows = (
        Weight(name="Wk", f1=0.4, f2=100, f3=12.5, f4=12.5, Q4=0.63, f5=2.37, Q5=0.91, f6=3.35, Q6=0.91, source=iso),
        Weight(name="Wd", f3=2.0, f4=2.0, **horizontal),
        Weight(name="Wf", f1=0.08, f2=0.63, f3=None, f4=0.25, Q4=0.86, f5=0.0625, Q5=0.8, f6=0.1, Q6=0.8, source=iso),
        Weight(
            name="Wb", f1=0.4, f2=100, f3=16, f4=16, Q4=0.55, f5=2.5, Q5=0.9, f6=4, Q6=0.95, K=1.024,
            source="ISO 2631-4; ISO 8041-1, Table 3",
        ),
        Weight(name="We", f3=1.0, f4=1.0, **horizontal),
        Weight(name="Wc", f3=8.0, f4=8.0, **horizontal),
        # printed as K = 0.4 without the factor (ω5/ω6)² = 0.390625 of this form: 0.4 = 1.024 · 0.390625
        Weight(
            name="Wb_en12299", f1=0.4, f2=100, f3=16, f4=16, Q4=0.63, f5=2.5, Q5=0.8, f6=4, Q6=0.8, K=1.024,
            source="believed to be EN 12299's set; not checked against a primary source",
        ),
    )  # fmt: skip
    return {row.name: row for row in rows}


def rms(psd: Psd, weighting: str | None = None, *, low_hz: float | None = None, high_hz: float | None = None) -> float:
    """Root mean square of an acceleration, weighted or not.

    Parameters
    ----------
    psd : [(m/s²)²/Hz], function or (frequency_hz, psd)
    weighting : name of a `weight`, or None
    low_hz, high_hz : band [Hz]; default: the whole array, or 0.01 … 200 Hz of a function

    Returns
    -------
    float
        [m/s²]; the mean square of a function is right to about 1e-6 in every octave (`density.samples`)

    Raises
    ------
    InputError
        If the PSD is no PSD, the band leaves the array, or the function's peaks are too narrow to be resolved.

    Examples
    --------
    >>> flat = np.array([1.0, 10.0]), np.array([0.04, 0.04])  # (m/s²)²/Hz
    >>> print(f"{rms(flat):.4f} m/s², felt as {rms(flat, 'Wk'):.4f} m/s²")
    0.6000 m/s², felt as 0.5590 m/s²
    """
    f, width, density = samples(psd, low_hz, high_hz)
    felt = density if weighting is None else density * weight(weighting).magnitude(f) ** 2
    return float(np.sqrt(width @ felt))


@dataclass(frozen=True, slots=True, repr=False)
class ThirdOctaves(Result):
    """Rms acceleration in one-third-octave bands, centred at 10^(n/10) Hz, edges a factor 10^(±1/20) away."""

    frequency_hz: np.ndarray  # (k,) exact centres [Hz]
    rms: np.ndarray  # (k,) [m/s²]

    def rows(self) -> list[Row]:
        """One row per band."""
        return [(f"{f:.3g} Hz", float(a), "m/s²") for f, a in zip(self.frequency_hz, self.rms, strict=True)]


def third_octaves(
    psd: Psd, weighting: str | None = None, *, low_hz: float | None = None, high_hz: float | None = None
) -> ThirdOctaves:
    """The rms [m/s²] of each one-third-octave band that lies wholly within low_hz … high_hz (defaults as in `rms`).

    Source: bands of IEC 61260-1, base ten.
    """
    low, high = band(psd, low_hz, high_hz)
    edge = 10**0.05
    # 1e-9: a band edge given as the decimal of 10^(n/10 ± 1/20) counts as that edge
    first = int(np.ceil(10 * np.log10(low * edge) - 1e-9))
    last = int(np.floor(10 * np.log10(high / edge) + 1e-9))
    if last < first:
        raise InputError(f"a one-third-octave band must fit in; got {low:g}…{high:g} Hz. Widen it to a ratio of 1.6.")
    centre = 10 ** (np.arange(first, last + 1) / 10)
    lowest, highest = np.maximum(centre / edge, low), np.minimum(centre * edge, high)
    if callable(psd):
        bands = [rms(psd, weighting, low_hz=a, high_hz=b) for a, b in zip(lowest, highest, strict=True)]
        return ThirdOctaves(frequency_hz=centre, rms=np.array(bands))
    f, width, density = samples(psd, lowest[0], highest[-1], cuts=highest)
    felt = density if weighting is None else density * weight(weighting).magnitude(f) ** 2
    squares = np.bincount(np.searchsorted(highest, f), width * felt, len(centre))
    return ThirdOctaves(frequency_hz=centre, rms=np.sqrt(squares))


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Ride(Result):
    """How one place in the vehicle rides in one direction."""

    direction: Direction
    weighting: str  # Wk or Wd
    rms: float  # unweighted [m/s²]
    rms_weighted: float  # [m/s²]
    rms_below_1_hz: float  # unweighted, what the weighting hides [m/s²]
    rms_motion_sickness: float | None  # Wf-weighted, vertical only [m/s²]
    worst_band_hz: float  # centre of the third octave with the largest rms [Hz]
    worst_band_rms: float  # its rms [m/s²]

    def rows(self) -> list[Row]:
        """The figures, in m/s² and Hz."""
        rows: list[Row] = [
            (f"{self.direction} rms", self.rms, "m/s²"),
            (f"{self.weighting}-weighted rms", self.rms_weighted, "m/s²"),
            ("rms below 1 Hz", self.rms_below_1_hz, "m/s²"),
            ("largest third octave at", self.worst_band_hz, "Hz"),
            ("its rms", self.worst_band_rms, "m/s²"),
        ]
        if self.rms_motion_sickness is not None:
            rows.append(("Wf-weighted rms", self.rms_motion_sickness, "m/s²"))
        return rows


def ride(psd: Psd, direction: Direction) -> Ride:
    """The figures of a floor acceleration in one direction over the band of `rms`, which must span 1 Hz.

    Parameters
    ----------
    psd : [(m/s²)²/Hz], function or (frequency_hz, psd)
    direction : "vertical" (Wk, Wf) or "lateral" (Wd)
    """
    if direction not in WEIGHT_OF:
        raise unknown_name("direction", str(direction), WEIGHT_OF)
    bands = third_octaves(psd)
    worst = int(np.argmax(bands.rms))
    return Ride(
        direction=direction,
        weighting=WEIGHT_OF[direction],
        rms=rms(psd),
        rms_weighted=rms(psd, WEIGHT_OF[direction]),
        rms_below_1_hz=rms(psd, high_hz=1.0),
        rms_motion_sickness=rms(psd, "Wf") if direction == "vertical" else None,
        worst_band_hz=float(bands.frequency_hz[worst]),
        worst_band_rms=float(bands.rms[worst]),
    )


def motion_sickness_dose(psd: Psd, duration: float) -> float:
    """MSDV_z = (∫ a_Wf² dt)^½ [m/s^1.5] of a stationary vertical acceleration lasting `duration` seconds.

    Source: ISO 2631-1:1997, 9.2. About MSDV/3 percent of mixed unadapted adults may vomit (not checked against the
    text).
    """
    if not 0 < duration < np.inf:
        raise InputError(f"duration must be positive and finite [s]; got {duration!r}. Give the length of the ride.")
    return rms(psd, "Wf") * duration**0.5
