"""Comfort boundaries: how much vibration is too much, band by band or as a density.

    boundary("1 h", "vertical") --rms(f)--> limit per third octave      --mask()--> density limit
    read_mask(file, direction)  --psd(f)--> density limit
    acceleration PSD, mask --worst_ratio--> largest ratio and where

ISO 2631:1974 drew its boundaries for the rms of one-third octaves; a limit a(f) there is the density a²/Δf of a smooth
spectrum, with the band's width Δf = (10^0.05 − 10^−0.05) f = 0.2308 f. Any other mask comes from a file the user names:
the density mask once specified for tracked air-cushion vehicles (UTACV) has its place there; this project does not have
its numbers. Numbers, sources and what is unverified: comfort.toml.
"""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import numpy as np

from workbench.analysis.density import Psd, band, value
from workbench.analysis.ride import Direction, ThirdOctaves
from workbench.constants import GRAVITY
from workbench.errors import InputError, unknown_name
from workbench.lti.peak_search import local_peaks
from workbench.machine.reading import read_mapping
from workbench.physics.guideway.interpolation import LogLog
from workbench.result import Result, Row

Level = Literal["reduced_comfort", "fatigue", "exposure"]
LEVELS = ("reduced_comfort", "fatigue", "exposure")
DIRECTIONS = ("vertical", "lateral")
BAND_WIDTH = 10**0.05 - 10**-0.05  # width of a one-third octave over its centre frequency [1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Mask:
    """A limit on the one-sided acceleration density, straight lines on log-log paper, valid between its end points."""

    name: str
    direction: Direction
    frequency_hz: tuple[float, ...]  # (k,) increasing
    g2_per_hz: tuple[float, ...]  # (k,) [g²/Hz]
    provenance: str
    verified: bool = False

    def __post_init__(self) -> None:
        table = LogLog(self.frequency_hz, self.g2_per_hz)
        object.__setattr__(self, "frequency_hz", table.x)
        object.__setattr__(self, "g2_per_hz", table.y)
        if self.direction not in DIRECTIONS:
            raise unknown_name("direction", str(self.direction), DIRECTIONS)
        if not self.provenance.strip():
            raise InputError("provenance must name the source of a mask; got an empty text. Write 'assumed' if it is.")

    def psd(self, frequency_hz):
        """The limit [(m/s²)²/Hz] at f [Hz], elementwise; numbers outside the mask's points are refused."""
        _check_within("mask", frequency_hz, self.frequency_hz)
        return LogLog(self.frequency_hz, self.g2_per_hz).value(frequency_hz) * GRAVITY**2


@dataclass(frozen=True, slots=True, kw_only=True)
class Boundary:
    """A limit on the rms acceleration of one-third octaves, 1 … 80 Hz."""

    name: str
    direction: Direction
    frequency_hz: tuple[float, ...]  # (k,)
    limit: tuple[float, ...]  # (k,) [m/s²]
    provenance: str
    verified: bool

    def rms(self, frequency_hz):
        """The limit [m/s²] for the band centred at f [Hz], elementwise; numbers outside 1 … 80 Hz are refused."""
        _check_within("boundary", frequency_hz, self.frequency_hz)
        return LogLog(self.frequency_hz, self.limit).value(frequency_hz)

    def mask(self) -> Mask:
        """The same as a density, a²/(0.2308 f), for spectra that are smooth over a third octave."""
        density = (a**2 / (BAND_WIDTH * f) / GRAVITY**2 for f, a in zip(self.frequency_hz, self.limit, strict=True))
        return Mask(
            name=self.name,
            direction=self.direction,
            frequency_hz=self.frequency_hz,
            g2_per_hz=tuple(density),
            provenance=f"{self.provenance}; turned into a density over a one-third octave of 0.2308 f",
            verified=self.verified,
        )


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class LimitRatio(Result):
    """An acceleration beside a limit."""

    name: str  # of the limit
    ratio: float  # largest value over limit: of densities for a mask, of rms for a boundary
    frequency_hz: float  # where
    low_hz: float  # compared from
    high_hz: float  # to
    verified: bool  # whether the limit's numbers were checked

    @property
    def met(self) -> bool:
        """Whether the limit is kept."""
        return self.ratio <= 1

    def rows(self) -> list[Row]:
        """Ratio, place and band."""
        return [
            (f"worst ratio to {self.name}", self.ratio, ""),
            ("at", self.frequency_hz, "Hz"),
            ("compared from", self.low_hz, "Hz"),
            ("compared to", self.high_hz, "Hz"),
            ("met", self.met, ""),
            ("limit verified", self.verified, ""),
        ]


def boundary(duration: str, direction: Direction, level: Level = "reduced_comfort") -> Boundary:
    """A boundary of ISO 2631:1974 for an exposure.

    Parameters
    ----------
    duration : "1 min", "16 min", "25 min", "1 h", "2.5 h", "4 h", "8 h", "16 h" or "24 h"
    direction : "vertical" (flat 4 … 8 Hz, ∝ f^−½ below, ∝ f above) or "lateral" (flat 1 … 2 Hz, ∝ f above)
    level : "reduced_comfort" (fatigue/3.15), "fatigue" (decreased proficiency) or "exposure" (fatigue × 2)

    Source: comfort.toml, block iso_2631_1974 (unverified).
    """
    data = criteria()["iso_2631_1974"]
    if duration not in data["durations"]:
        raise unknown_name("duration", str(duration), data["durations"])
    if direction not in DIRECTIONS:
        raise unknown_name("direction", str(direction), DIRECTIONS)
    if level not in LEVELS:
        raise unknown_name("level", str(level), LEVELS)
    factor = {"fatigue": 1.0}.get(level) or data[
        f"{level}_{'factor' if level == 'reduced_comfort' else 'limit_factor'}"
    ]
    flat = factor * data[f"{direction}_m_s2"][data["durations"].index(duration)]
    if direction == "vertical":
        points, limits = (1.0, 4.0, 8.0, 80.0), (2 * flat, flat, flat, 10 * flat)
    else:
        points, limits = (1.0, 2.0, 80.0), (flat, flat, 40 * flat)
    return Boundary(
        name=f"ISO 2631:1974 {duration} {direction} {level.replace('_', ' ')}",
        direction=direction,
        frequency_hz=points,
        limit=limits,
        provenance=data["source"],
        verified=data["verified"],
    )


def read_mask(path: str | Path, direction: Direction) -> Mask:
    """A density mask from a TOML file.

    The file holds `name`, `provenance`, `verified` (true or false), `frequency_hz = […]` and one or both of
    `vertical_g2_per_hz = […]` and `lateral_g2_per_hz = […]`, equally long, and nothing else.

    Raises
    ------
    InputError
        If the file cannot be read, lacks a key, has another, or holds no mask in this direction.
    """
    path = Path(path)
    try:
        data = read_mapping(path, "TOML")
    except InputError as error:
        raise InputError(f"a mask file must be TOML and must be readable; {error}") from error
    if direction not in DIRECTIONS:
        raise unknown_name("direction", str(direction), DIRECTIONS)
    kinds = {"name": str, "provenance": str, "verified": bool, "frequency_hz": list}
    column = f"{direction}_g2_per_hz"
    optional = {f"{name}_g2_per_hz" for name in DIRECTIONS}
    for key in data:
        if key not in kinds and key not in optional:
            raise unknown_name(f"key in mask file {path.name}", key, {*kinds, *optional})
    for key, kind in {**kinds, column: list}.items():
        if not isinstance(data.get(key), kind):
            raise InputError(
                f"mask file {path.name} needs {key} as {_NAMES[kind]}; got {data.get(key)!r:.60}. Mend that line."
            )
    for key in ("frequency_hz", column):
        if not all(isinstance(number, int | float) and not isinstance(number, bool) for number in data[key]):
            raise InputError(f"{key} in mask file {path.name} must list numbers; got {data[key]!r:.60}. Mend it.")
    return Mask(
        name=data["name"],
        direction=direction,
        frequency_hz=tuple(data["frequency_hz"]),
        g2_per_hz=tuple(data[column]),
        provenance=data["provenance"],
        verified=data["verified"],
    )


_NAMES = {str: "text", bool: "true or false", list: "a list of numbers"}


def worst_ratio(psd: Psd, mask: Mask) -> LimitRatio:
    """The largest ratio of a density to a mask, over the frequencies both cover.

    Exact for an array, since both are power laws between their points; a function is searched on 96 points per octave
    and refined around the highest.
    """
    low, high = mask.frequency_hz[0], mask.frequency_hz[-1]
    if callable(psd):
        f = np.geomspace(low, high, int(96 * np.log2(high / low)) + 2)
        f[0], f[-1] = low, high
        f = np.unique(np.concatenate([f, mask.frequency_hz]))
    else:
        ends = band(psd, None, None)
        low, high = max(low, ends[0]), min(high, ends[1])
        if not low < high:
            raise InputError(
                f"the PSD must overlap the mask's {mask.frequency_hz[0]:g}…{mask.frequency_hz[-1]:g} Hz; got "
                f"{ends[0]:g}…{ends[1]:g} Hz. Give it over that band."
            )
        f = np.unique(np.concatenate([[low, high], np.asarray(psd[0], float), mask.frequency_hz]))
        f = f[(f >= low) & (f <= high)]

    def ratio(at: np.ndarray) -> np.ndarray:
        return value(psd, at) / mask.psd(at)

    if callable(psd):
        place, best = local_peaks(ratio, f)[0]
    else:
        ratios = ratio(f)
        place, best = float(f[np.argmax(ratios)]), float(ratios.max())
    return LimitRatio(name=mask.name, ratio=best, frequency_hz=place, low_hz=low, high_hz=high, verified=mask.verified)


def worst_band(bands: ThirdOctaves, limit: Boundary) -> LimitRatio:
    """The largest ratio of band rms to a boundary, over the bands centred in it: the comparison the standard means."""
    low, high = limit.frequency_hz[0] * (1 - 1e-9), limit.frequency_hz[-1] * (1 + 1e-9)  # centres are rounded 10^(n/10)
    inside = (bands.frequency_hz >= low) & (bands.frequency_hz <= high)
    if not np.any(inside):
        raise InputError(
            f"a band must be centred within {low:g}…{high:g} Hz, where the boundary holds; got none. Give bands there."
        )
    f = bands.frequency_hz[inside]
    ratio = bands.rms[inside] / limit.rms(np.clip(f, *limit.frequency_hz[:: len(limit.frequency_hz) - 1]))  # pyright: ignore[reportCallIssue]
    at = int(np.argmax(ratio))
    return LimitRatio(
        name=limit.name, ratio=float(ratio[at]), frequency_hz=float(f[at]), low_hz=float(f[0]), high_hz=float(f[-1]),
        verified=limit.verified,
    )  # fmt: skip


def comfort_verdict(rms_weighted: float) -> str:
    """ISO 2631-1:1997's words for a weighted rms [m/s²]; where its ranges overlap, both, joined by "to".

    Source: comfort.toml, block iso_2631_1997_comfort (unverified).
    """
    if not 0 <= rms_weighted < np.inf:
        raise InputError(f"a weighted rms must be finite and not negative [m/s²]; got {rms_weighted!r}. Use ride.rms.")
    scale = criteria()["iso_2631_1997_comfort"]
    ranges = zip(scale["words"], scale["from_m_s2"], scale["to_m_s2"], strict=True)
    return " to ".join(word for word, low, high in ranges if low <= rms_weighted < high)


def step_of_scale(block: str, index: float) -> str:
    """The word of a scale without overlaps (blocks en_12299 and sperling of comfort.toml) for an index."""
    if not 0 <= index < np.inf:
        raise InputError(f"a comfort index must be finite and not negative; got {index!r}. Compute it from a PSD.")
    scale = criteria()[block]
    return scale["words"][int(np.searchsorted(scale["from_index"], index, side="right")) - 1]


@cache
def criteria() -> dict[str, Any]:
    """The contents of comfort.toml."""
    return tomllib.loads(files("workbench.analysis").joinpath("comfort.toml").read_text(encoding="utf-8"))


def _check_within(what: str, frequency_hz, points: tuple[float, ...]) -> None:
    import casadi as ca

    if isinstance(frequency_hz, ca.SX | ca.MX):
        return
    f = np.array(frequency_hz, float)
    if not np.all((f >= points[0]) & (f <= points[-1])):
        raise InputError(
            f"a {what} holds from {points[0]:g} to {points[-1]:g} Hz; got {f.min():g}…{f.max():g} Hz. Stay within."
        )
