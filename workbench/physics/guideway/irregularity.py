"""What a vehicle feels of an uneven guideway: four types of irregularity at the coil sets, front before rear.

    A1 vertical profile   ζ_right = ζ_left                 ┐
    A2 cross-level        ζ_right = −ζ_left = A2           ├─ patterns (2n, 4) ──× phase of each set──▶ phasors (2n, 4)
    A3 alignment          η_right = −η_left = A3           │
    A4 gauge              η_right = η_left = A4            ┘

    ζ_right,left = A1 ± A2 (surface up)        η_right,left = A4 ± A3 (each wall outward)

A coil set at x meets at time t what one at x_ref meets (x − x_ref)/V later, so it leads by that time: phase
exp(jω(x − x_ref)/V). Inputs are ordered ζ_1…ζ_n, η_1…η_n; a set stands on the right where y > 0. The report's four
sets are 1 front right, 2 front left, 3 rear right, 4 rear left, and its phases refer to the midpoint of front and
rear.

Source: report, Appendix D.2, D.3 and Table D-1 (its printed ω = 2V/L is 2πV/L, β(x) = π(2x − a_F + a_R)/L).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError
from workbench.physics.guideway.validity import check_speed

TYPES = ("A1", "A2", "A3", "A4")
UNIT_INPUTS = ("A1 cos", "A1 sin", "A4 cos", "A4 sin", "A2 cos", "A2 sin", "A3 cos", "A3 sin")  # columns of Table D-1

Positions = Sequence[Sequence[float]]  # (n, 2 or 3): x forward, y right (, z down) of each coil set [m]


def patterns(positions: Positions) -> np.ndarray:
    """Which way each input moves with each type of irregularity, without the wheel base.

    Parameters
    ----------
    positions : (n, ≥2) coil sets, x forward and y right [m]; y decides the side and must not be 0

    Returns
    -------
    (2n, 4) of −1, 0, 1
        Rows ζ_1…ζ_n, η_1…η_n; columns A1…A4.

    Examples
    --------
    >>> corners = ((9.0, 1.0), (9.0, -1.0), (-7.65, 1.0), (-7.65, -1.0))
    >>> patterns(corners)[:4].astype(int).tolist()  # floors: A1 together, A2 right against left
    [[1, 1, 0, 0], [1, -1, 0, 0], [1, 1, 0, 0], [1, -1, 0, 0]]
    """
    side = np.sign(_checked(positions)[:, 1])
    one, none = np.ones_like(side), np.zeros_like(side)
    return np.vstack([np.column_stack([one, side, none, none]), np.column_stack([none, none, side, one])])


def leads(positions: Positions, speed: float, reference: str | float = "front") -> np.ndarray:
    """Time by which each input meets an irregularity before the reference point does.

    Parameters
    ----------
    positions : (n, ≥2) [m]
    speed : V [m/s], positive
    reference : "front" (foremost set; every lead is then ≤ 0), "midpoint" (of foremost and hindmost) or x [m]

    Returns
    -------
    (2n,) seconds, ζ_1…ζ_n, η_1…η_n

    Examples
    --------
    >>> corners = ((9.0, 1.0), (9.0, -1.0), (-7.65, 1.0), (-7.65, -1.0))
    >>> leads(corners, 134.0)[:4].round(3).tolist()
    [0.0, 0.0, -0.124, -0.124]
    """
    check_speed(speed)
    x = _checked(positions)[:, 0]
    known = {"front": x.max(), "midpoint": (x.max() + x.min()) / 2}
    if isinstance(reference, str) and reference not in known:
        raise InputError(
            f"phase reference must be 'front', 'midpoint' or a place x [m]; got {reference!r}. Use 'front'."
        )
    origin = known[reference] if isinstance(reference, str) else float(reference)
    return np.tile((x - origin) / speed, 2)


def phasors(positions: Positions, speed: float, omega, reference: str | float = "front") -> np.ndarray:
    """Complex inputs per unit amplitude of each type at angular frequencies.

    Parameters
    ----------
    positions : (n, ≥2) [m];  speed : V [m/s];  reference : as in `leads`
    omega : scalar or (k,) [rad/s]

    Returns
    -------
    (2n, 4) or (k, 2n, 4) complex
        `patterns` times exp(jω·lead); an amplitude A of a type at the reference gives the input phasor × A.
    """
    turn = np.exp(1j * np.multiply.outer(np.asarray(omega, float), leads(positions, speed, reference)))
    return turn[..., None] * patterns(positions)


def stations(positions: Positions, speed: float) -> tuple[tuple[float, np.ndarray], ...]:
    """The coil sets grouped by their place along the vehicle, foremost first.

    Returns
    -------
    tuple of (delay [s] behind the foremost station, pattern (2n, 4) with the other stations' rows zero)
        The patterns add up to `patterns`; with two stations the second delay is T = (a_F + a_R)/V.
    """
    lag = -leads(positions, speed)
    whole = patterns(positions)
    return tuple((float(delay), np.where((lag == delay)[:, None], whole, 0.0)) for delay in np.unique(lag))


def table_d1(beta) -> np.ndarray:
    """The eight unit inputs of Table D-1 for the report's four coil sets.

    Parameters
    ----------
    beta : half the phase between front and rear, β = ω(a_F + a_R)/(2V) [rad]

    Returns
    -------
    (8, 8)
        Rows ζ_1…ζ_4, η_1…η_4; columns `UNIT_INPUTS`: in phase with the midpoint (× cos β, alike front and rear) and a
        quarter period ahead of it (× sin β, opposite front and rear). A type's phasor is its cos column + j its sin
        column.
    """
    whole = patterns(((1, 1), (1, -1), (-1, 1), (-1, -1)))
    ahead = np.tile([1.0, 1.0, -1.0, -1.0], 2)[:, None] * whole
    order = [TYPES.index(name[:2]) for name in UNIT_INPUTS[::2]]
    both = np.stack([np.cos(beta) * whole[:, order], np.sin(beta) * ahead[:, order]], axis=-1)
    return both.reshape(8, 8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Wave:
    """Irregularity of one wavelength: A_k sin(ωt − φ_k) of each type at the reference point.

    Source: report, Appendix D.2, where φ_3 = 0 and the others are φ_0, φ_z, φ_y.
    """

    wavelength: float  # L [m]
    amplitudes: tuple[float, float, float, float]  # A1…A4 [m]
    phases: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)  # φ_1…φ_4 [rad]

    def __post_init__(self) -> None:
        if not 0 < self.wavelength < np.inf:
            raise InputError(f"Wave.wavelength must be positive and finite [m]; got {self.wavelength!r}. Give metres.")
        if not all(len(v) == 4 and np.all(np.isfinite(v)) for v in (self.amplitudes, self.phases)):
            raise InputError(
                f"a Wave takes four finite amplitudes [m] and phases [rad], A1…A4; got {self.amplitudes!r} and "
                f"{self.phases!r}. Give 0 for a type that is absent."
            )

    def omega(self, speed: float) -> float:
        """Angular frequency 2πV/L [rad/s] at which a vehicle meets the wave."""
        check_speed(speed)
        return 2 * np.pi * speed / self.wavelength

    def inputs(self, positions: Positions, speed: float, reference: str | float = "midpoint") -> np.ndarray:
        """(2n,) complex amplitudes c of the inputs [m]: input(t) = Im(c e^{jωt})."""
        amplitude = np.asarray(self.amplitudes) * np.exp(-1j * np.asarray(self.phases))
        return phasors(positions, speed, self.omega(speed), reference) @ amplitude

    def history(self, positions: Positions, speed: float, time, reference: str | float = "midpoint") -> np.ndarray:
        """(2n, k) inputs [m] at times (k,) [s]."""
        turn = np.exp(1j * self.omega(speed) * np.asarray(time, float))
        return np.imag(self.inputs(positions, speed, reference)[:, None] * turn)


def _checked(positions: Positions) -> np.ndarray:
    places = np.asarray(positions, float)
    if places.ndim != 2 or places.shape[0] == 0 or places.shape[1] < 2 or not np.all(np.isfinite(places)):
        raise InputError(
            f"coil positions must be rows (x, y) of finite metres, one per coil set; got shape {places.shape}. "
            "List each set's place from the centre of gravity."
        )
    if np.any(places[:, 1] == 0):
        raise InputError("a coil set must stand right (y > 0) or left (y < 0) of the middle; got y = 0. Give its side.")
    return places
