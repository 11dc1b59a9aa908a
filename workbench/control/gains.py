"""The seventeen control parameters: names, units, checks, and the two directions that change nothing.

Eight filter gains, four time constants, five modal gains. Source: report, Appendix C.1; Table B-3.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

from workbench.errors import InputError, unknown_name
from workbench.result import Result, Row

GAIN_UNITS = {
    "K_h": "1/m", "K_hdot": "s/m", "tau_h": "s",
    "K_hp": "1/m", "K_hpdot": "s/m", "tau_hp": "s",
    "K_zddot": "s²/m", "K_zdot": "s/m", "tau_z": "s",
    "K_yddot": "s²/m", "K_ydot": "s/m", "tau_y": "s",
    "K_heave": "1", "K_pitch": "1", "K_sway": "1", "K_roll": "1", "K_yaw": "1",
}  # fmt: skip
GAIN_NAMES = tuple(GAIN_UNITS)
TIME_CONSTANTS = ("tau_h", "tau_hp", "tau_z", "tau_y")
VERTICAL = ("K_h", "K_hdot", "K_zddot", "K_zdot")
LATERAL = ("K_hp", "K_hpdot", "K_yddot", "K_ydot")
LARGEST = 1e6  # beyond this a gain is a slip of the unit: a gap of 1 µm would ask for the full main-coil current


def checked_gain(name: str, value) -> float:
    """The value of one of the seventeen as a float; an InputError for an unknown name or an unusable value.

    Examples
    --------
    >>> checked_gain("tau_h", 0.637)
    0.637
    >>> checked_gain("tau_h", -0.1)
    Traceback (most recent call last):
        ...
    workbench.errors.InputError: tau_h must not be negative; got -0.1 s. A filter that grows in time is unstable.
    """
    if name not in GAIN_UNITS:
        raise unknown_name("gain", str(name), GAIN_UNITS)
    unit = GAIN_UNITS[name]
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if not number or not -math.inf < value < math.inf:
        raise InputError(f"{name} must be a finite number [{unit}]; got {str(value)[:60]!r}. Give a plain number.")
    if abs(value) > LARGEST:
        given = f"{value:.6g}" if abs(value) < 1e300 else "a number beyond 1e300"  # an int may be too large to print
        raise InputError(f"{name} must lie within ±{LARGEST:g} {unit}; got {given}. Check its unit.")
    if name in TIME_CONSTANTS and value < 0:
        raise InputError(f"{name} must not be negative; got {value!r} s. A filter that grows in time is unstable.")
    return float(value)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Gains(Result):
    """The seventeen parameters, with the names and units of `GAIN_UNITS`.

    A time constant of zero means no filter. Raises InputError for NaN, infinity and negative time constants.
    """

    K_h: float
    K_hdot: float
    tau_h: float
    K_hp: float
    K_hpdot: float
    tau_hp: float
    K_zddot: float
    K_zdot: float
    tau_z: float
    K_yddot: float
    K_ydot: float
    tau_y: float
    K_heave: float
    K_pitch: float
    K_sway: float
    K_roll: float
    K_yaw: float

    def __post_init__(self) -> None:
        for name in GAIN_NAMES:
            object.__setattr__(self, name, checked_gain(name, getattr(self, name)))

    @classmethod
    def from_mapping(cls, mapping: Mapping[str, float]) -> "Gains":
        """From exactly the seventeen names; an unknown or missing name is refused by name."""
        for name in mapping:
            if name not in GAIN_UNITS:
                raise unknown_name("gain", str(name), GAIN_UNITS)
        missing = [name for name in GAIN_NAMES if name not in mapping]
        if missing:
            raise InputError(f"gains must name all seventeen parameters; missing {', '.join(missing)}. Add them.")
        return cls(**{name: mapping[name] for name in GAIN_NAMES})

    def as_dict(self) -> dict[str, float]:
        """Name to value, in the order of `GAIN_NAMES`."""
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def with_values(self, **changed: float) -> "Gains":
        """The same gains with some replaced."""
        return replace(self, **changed)

    def rescaled(self, *, vertical: float = 1.0, lateral: float = 1.0) -> "Gains":
        """The same loop with other numbers: vertical filter gains × λ, lateral × μ, modal gains compensated.

        K_roll → K_sway/μ + (K_roll − K_sway)/λ, because roll acts through the vertical channel only as far as it
        differs from sway. Source: guide, Definitions: Invariance; the modal transformation of Table B-3.

        Examples
        --------
        >>> gains = Gains.from_mapping({name: 1.0 for name in GAIN_NAMES})
        >>> other = gains.rescaled(vertical=2.0)
        >>> other.K_h, other.K_heave, other.tau_h
        (2.0, 0.5, 1.0)
        """
        if not (vertical > 0 and lateral > 0):
            raise InputError(f"scale factors must be positive; got {vertical!r} and {lateral!r}.")
        changed = {name: getattr(self, name) * vertical for name in VERTICAL}
        changed |= {name: getattr(self, name) * lateral for name in LATERAL}
        return self.with_values(
            **changed,
            K_heave=self.K_heave / vertical,
            K_pitch=self.K_pitch / vertical,
            K_sway=self.K_sway / lateral,
            K_yaw=self.K_yaw / lateral,
            K_roll=self.K_sway / lateral + (self.K_roll - self.K_sway) / vertical,
        )

    def normalised(self) -> "Gains":
        """The same loop with K_heave = K_sway = 1, where both are positive; as given otherwise."""
        vertical = self.K_heave if self.K_heave > 0 else 1.0
        lateral = self.K_sway if self.K_sway > 0 else 1.0
        return self.rescaled(vertical=vertical, lateral=lateral)

    def rows(self) -> list[Row]:
        return [(name, getattr(self, name), GAIN_UNITS[name]) for name in GAIN_NAMES]
