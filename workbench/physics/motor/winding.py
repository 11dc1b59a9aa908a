"""The two halves of the motor: one phase of the guideway winding and one coil of the vehicle.

    Winding (an endless row of rectangles of alternating polarity)  ~  VehicleCoil (one rectangle)

Axes of every motor module are those of the report's Figure 3: x lateral, y normal to the winding and positive towards
the vehicle (the gap), z longitudinal. Pitch turns about x, yaw about y, roll about z.

    z
    ^   +---+---+---+---
    |   | + | - | + |        each rectangle carries the phase current on its own sides, so that a pair of
    |   +---+---+---+---     touching sides carries it twice; the pole pitch is the distance of two centres
"""

from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError


@dataclass(frozen=True, slots=True, kw_only=True)
class Winding:
    """One phase of the guideway: an endless row of rectangular coils of alternating polarity in the plane y = 0.

    Parameters
    ----------
    pole_pitch : float
        Distance of two neighbouring centres [m].
    width, length : float
        Of one rectangle, along x and z [m]; the length does not exceed the pole pitch.
    current : float
        Peak phase current in each rectangle [A].
    filaments : tuple of (inset, depth)
        The conductor's cross-section: how far each filament lies inside the rectangle and below the plane [m]. Every
        filament carries the same share of the current. One filament on the rectangle itself is the report's model.

    Source: report, Appendix F, 5.1.3 and 5.2.
    """

    pole_pitch: float
    width: float
    length: float
    current: float = 1500.0
    filaments: tuple[tuple[float, float], ...] = ((0.0, 0.0),)

    def __post_init__(self) -> None:
        _positive("Winding", pole_pitch=self.pole_pitch, width=self.width, length=self.length, current=self.current)
        if not self.filaments:
            raise InputError("Winding.filaments must hold at least one (inset, depth); got none. Use ((0.0, 0.0),).")
        for filament in self.filaments:
            if len(filament) != 2 or not np.all(np.isfinite(filament)):
                raise InputError(
                    f"a filament must be two finite lengths (inset, depth); got {filament!r}. Give metres."
                )
            if filament[1] < 0:
                raise InputError(
                    f"a filament's depth must not be negative; got {filament[1]!r} m. Put y = 0 at the uppermost one."
                )
            if 2 * filament[0] >= min(self.width, self.length):
                raise InputError(
                    f"a filament must lie inside its coil; an inset of {filament[0]!r} m leaves nothing of "
                    f"{self.width!r} m × {self.length!r} m. Make it smaller."
                )
            if self.length - 2 * filament[0] > self.pole_pitch * (1 + 1e-12):
                raise InputError(
                    f"coils of one phase must not overlap; got length {self.length - 2 * filament[0]!r} m at a pole "
                    f"pitch of {self.pole_pitch!r} m. Shorten the coil or lengthen the pitch."
                )

    @property
    def wave_number(self) -> float:
        """κ = π/pole pitch [rad/m], of the fundamental."""
        return np.pi / self.pole_pitch


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleCoil:
    """One rectangular vehicle coil of one filament: `width` along x, `length` along z [m], `ampere_turns` [A].

    Positive current makes a moment along +y, as the winding's rectangle at z = 0 does.
    """

    width: float
    length: float
    ampere_turns: float = 500e3

    def __post_init__(self) -> None:
        _positive("VehicleCoil", width=self.width, length=self.length, ampere_turns=self.ampere_turns)


def rectangular_bundle(thickness: float, height: float, across: int, down: int) -> tuple[tuple[float, float], ...]:
    """Filaments of a conductor of rectangular section: `across` × `down` equal cells, one filament in each.

    The bundle lies inside the rectangle's outline (`thickness` [m], inwards) and below y = 0 (`height` [m]).
    """
    _positive("rectangular_bundle", thickness=thickness, height=height)
    if across < 1 or down < 1:
        raise InputError(f"a bundle must have at least one cell each way; got {across!r} × {down!r}. Use 1 or more.")
    return tuple(
        (thickness * (i + 0.5) / across, height * (j + 0.5) / down) for i in range(across) for j in range(down)
    )


def _positive(record: str, **sizes: float) -> None:
    for name, value in sizes.items():
        if not 0 < value < np.inf:
            raise InputError(f"{record}.{name} must be positive and finite; got {value!r}. Use SI units.")


REPORT_WINDING = Winding(pole_pitch=1.1, width=1.0, length=1.1)  # report, Appendix F, 5.2: 1 m × 1.1 m, 1500 A
REPORT_COIL = VehicleCoil(width=1.0, length=1.1)  # the same rectangle, 500 000 ampere-turns
REPORT_GAP = 0.30  # [m], report, Appendix F, 5.2
