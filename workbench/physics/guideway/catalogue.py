"""Railway spectra from the literature, as comparison for a guideway that has none of its own.

    american(track_class, kind)         FRA classes 1 (worst) … 6 (best)
    german(level, kind, track_width)    ERRI B176, "low" and "high" disturbance

`kind` is "vertical", "alignment", "cross_level" or "gauge". The first two are the height and the lateral place of a
rail [m]; the last two are differences between the two sides [m]: right minus left height, and change of width. The
amplitudes A2 and A4 of `irregularity` are half of such a difference and take a quarter of its spectrum (`roughness`).

The numbers, their sources and which of them are unverified: spectra.toml.
"""

import tomllib
from functools import cache
from importlib.resources import files
from typing import Any, Literal

from workbench.errors import InputError, unknown_name
from workbench.physics.guideway.spectrum import Rational

Kind = Literal["vertical", "alignment", "cross_level", "gauge"]
Level = Literal["low", "high"]
KINDS = ("vertical", "alignment", "cross_level", "gauge")

_CM2 = 1e-4  # cm² in m²


def american(track_class: int, kind: Kind, *, extrapolate: bool = False) -> Rational:
    """FRA spectrum of a track class, S(Ω) [m²/(rad/m)].

    Parameters
    ----------
    track_class : 1 … 6
    kind : what is rough; cross-level and gauge share one form, which leans on the vertical roughness
    extrapolate : whether wavelengths outside 1.524 … 304.8 m may be asked for

    Raises
    ------
    InputError
        If class or kind is not one of those.

    Source: spectra.toml, block american.
    """
    if track_class not in range(1, 7):
        raise InputError(f"FRA track class must be one of 1…6; got {track_class!r}. Class 6 is the smoothest.")
    data, at = _data()["american"], track_class - 1
    corner = data["corner_rad_m"]
    table = data["alignment" if _known(kind) == "alignment" else "vertical"]
    strength = data["k"] * table["roughness_cm2_rad_m"][at] * _CM2 * corner**2
    corners, source, verified = (0.0, corner), table["source"], table["verified"]
    if kind in ("cross_level", "gauge"):
        difference = data["difference"]
        strength, corners = 4 * strength, (corner, difference["corner_rad_m"][at])
        source, verified = difference["source"], difference["verified"]
    return Rational(
        strength=strength,
        corners=corners,
        provenance=f"class {track_class} {kind}; {source}; limits of wavelength: {data['wavelength_source']}",
        verified=verified,
        wavelength_min=data["wavelength_min_m"],
        wavelength_max=data["wavelength_max_m"],
        extrapolate=extrapolate,
    )


def german(level: Level, kind: Kind, *, track_width: float | None = None) -> Rational:
    """German spectrum of a disturbance level, S(Ω) [m²/(rad/m)].

    Parameters
    ----------
    level : "low" (high-speed lines) or "high"
    kind : what is rough
    track_width : distance between the two sides [m]; times its square the cross-level spectrum, printed as that of an
        angle [rad²/(rad/m)], is that of the height difference. Needed there, not used elsewhere.

    Raises
    ------
    InputError
        If a name is unknown or the cross-level lacks its track width.

    Source: spectra.toml, block german.

    Examples
    --------
    >>> rough = german("high", "vertical")
    >>> turn = 6.283185307179586  # rad
    >>> print(f"{turn * rough.psd(turn / 50.0):.5e} m²/(1/m) at a wavelength of 50 m")
    4.08975e-04 m²/(1/m) at a wavelength of 50 m
    """
    data = _data()["german"]
    if level not in ("low", "high"):
        raise unknown_name("disturbance level", str(level), ("low", "high"))
    numbers = data[level]
    r, c, s = (data[f"corner_{name}_rad_m"] for name in "rcs")
    strength = numbers[f"{'vertical' if _known(kind) == 'cross_level' else kind}_m_rad"] * c**2
    if kind == "cross_level":
        if track_width is None or not 0 < track_width < float("inf"):
            raise InputError(
                f"the German cross-level is an angle and needs track_width > 0 [m]; got {track_width!r}. "
                "Give the distance between the two lines whose heights differ."
            )
        strength *= (track_width / data["half_contact_distance_m"]) ** 2
    pair = kind in ("cross_level", "gauge")
    return Rational(
        strength=strength,
        corners=(r, c, s) if pair else (r, c),
        zeros=1 if pair else 0,
        provenance=f"{level} disturbance, {kind}; {data['source']}",
        verified=data["verified"],
    )


def _known(kind: str) -> str:
    if kind not in KINDS:
        raise unknown_name("kind of roughness", str(kind), KINDS)
    return kind


@cache
def _data() -> dict[str, Any]:
    return tomllib.loads(files("workbench.physics.guideway").joinpath("spectra.toml").read_text(encoding="utf-8"))
