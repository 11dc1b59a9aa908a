"""The modal control law: sensors at the coil sets -> filters -> modal signals -> gains -> current commands.

    gap, gap_lateral, acceleration_z, acceleration_y      4 × n sensor signals
      --pseudo-inverse-->  heave, pitch, roll (from vertical signals); sway, yaw (from lateral signals)
      --one vertical and one lateral filter pair-->  five modal signals
      --K_heave … K_yaw, rigid-body resolution-->  n current commands

Filters of equal channels commute with the pseudo-inverse, so ten first-order filters stand for the 4 n of the
hardware, and nothing else of the hardware is controllable. Roll is measured by the vertical sensors: it corrects the
lateral signal Y − cΦ to the centre of gravity (report, P_AS), so the roll
channel's effective gain is c (K_sway − K_roll).
Source: report, Table B-3 with the signs +s²H (K_0) and +[K_0S − K̃_0A] P_AS Q_SA (K_0A).

Sway and yaw may each be handed to an actuator of their own, such as a component motor on each side (report, Appendix
F, 6). The coils then take no part in that motion; what changes nothing is then fewer directions: see `references`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from workbench.control.gains import GAIN_NAMES, TIME_CONSTANTS, Gains
from workbench.errors import InputError

CHANNELS = ("heave", "pitch", "roll", "sway", "yaw")
VERTICAL_CHANNELS = 3  # the first three are measured by vertical sensors
SENSORS = ("gap", "gap_lateral", "acceleration_z", "acceleration_y")
MODAL = ("heave", "pitch", "sway", "roll", "yaw")  # order of the scaled modal signals K_i q_i^c
ACTUATED = ("sway", "yaw")  # modal signals that an actuator may take over from the coils
# Channel at which each path from filtered channels to commands starts: a law with coils alone, one with actuators
PATHS = {False: (0, 1, 2, 3, 4), True: (0, 1, 2, 2, 3, 4)}


@dataclass(frozen=True, slots=True)
class Actuator:
    """Two equal actuators, one on each side, that one modal signal drives in opposite directions.

    name : of the commands `command_<name>_right`, `command_<name>_left` and of the `current_…` they ask for
    signal : "sway" or "yaw"
    lever : right-hand command per unit of the scaled modal signal: [1] for sway, [m] for yaw; the left-hand one is its
        negative
    """

    name: str
    signal: str
    lever: float

    def __post_init__(self) -> None:
        if self.signal not in ACTUATED:
            raise InputError(
                f"an actuator of its own must take one of {', '.join(ACTUATED)}; {self.name!r} got {self.signal!r}. "
                "Leave heave, pitch and roll to the coils."
            )
        if not (np.isfinite(self.lever) and self.lever != 0):
            raise InputError(
                f"the lever of {self.name!r} must be finite and not zero; got {self.lever!r}. "
                "Leave the actuator out instead."
            )

    @property
    def both(self) -> tuple[str, str]:
        """Name of the right-hand and of the left-hand one."""
        return f"{self.name}_right", f"{self.name}_left"


@dataclass(frozen=True, slots=True)
class ModalLaw:
    """The law of a vehicle whose coil sets sit at given places.

    Parameters
    ----------
    positions : (n, 2) nested tuples
        x (forward) and y (right) of the coil sets from the centre of gravity [m]; y > 0 is a right-hand set.
    depth : float
        Distance of the coil plane below the centre of gravity, c [m].
    actuators : tuple of Actuator
        Who takes sway or yaw instead of the coils; nobody unless given.
    """

    positions: tuple[tuple[float, float], ...]
    depth: float
    actuators: tuple[Actuator, ...] = ()

    def __post_init__(self) -> None:
        for kind in ("name", "signal"):
            given = [getattr(a, kind) for a in self.actuators]
            if len(set(given)) != len(given):
                raise InputError(
                    f"actuators must differ in their {kind}; got {', '.join(given)}. Give each {kind} to one of them."
                )
        if (
            len(self.positions) < 4
            or np.linalg.matrix_rank(self._vertical()) < 3
            or np.linalg.matrix_rank(self._lateral()) < 2
        ):
            raise InputError(
                "the modal law needs coil sets from which heave, pitch, roll, sway and yaw can be told apart; "
                f"got sets at {self.positions}. Place at least two on each side, at two stations."
            )

    @classmethod
    def with_motor(cls, positions: tuple[tuple[float, float], ...], depth: float) -> "ModalLaw":
        """The law of a hybrid motor: sway drives the antisymmetric i_d, yaw the antisymmetric i_q, the coils the rest.

        The yaw angle counts as the displacement at the coil sets' rms distance from the centre of gravity. A positive
        gain pushes back: i_d > 0 on the right and i_d < 0 on the left push left, so do i_q the nose.
        """
        arm = float(np.sqrt(np.mean([x**2 for x, _ in positions])))
        return cls(positions, depth, (Actuator("motor_d", "sway", 1.0), Actuator("motor_q", "yaw", arm)))

    @property
    def count(self) -> int:
        """Number of coil sets and of sensors of a kind."""
        return len(self.positions)

    @property
    def commands(self) -> tuple[str, ...]:
        """Names of the commands: one for each coil set, then two for each actuator, right and left."""
        return tuple(f"command_{name}" for name in self._driven())

    @property
    def currents(self) -> tuple[str, ...]:
        """Names of the currents that the commands ask for, in the same order."""
        return tuple(f"current_{name}" for name in self._driven())

    def _driven(self) -> list[str]:
        return [*(str(i + 1) for i in range(self.count)), *(name for a in self.actuators for name in a.both)]

    @property
    def split(self) -> bool:
        """Whether sway or yaw is handed to an actuator, so that roll has one path to the coils and one to sway."""
        return bool(self.actuators)

    @property
    def references(self) -> tuple[str, ...]:
        """Modal gains that may be set to 1 without loss, one for each direction of the seventeen that changes nothing.

        With coils alone: K_heave and K_sway (`Gains.rescaled`). Where sway has an actuator, the roll signal reaches it
        through the vertical filters and K_sway, and the coils through the same filters and K_roll: all eight filter
        gains × λ with all five modal gains / λ is then the only direction left, and K_sway a gain like the others.
        """
        return ("K_heave",) if any(a.signal == "sway" for a in self.actuators) else ("K_heave", "K_sway")

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the sensor signals, in the order the law takes them."""
        return tuple(f"{kind}_{i + 1}" for kind in SENSORS for i in range(self.count))

    def of_kinds(self, kinds: Sequence[str]) -> np.ndarray:
        """(4n,) of bool: which sensors are of these kinds, of `SENSORS`."""
        return np.isin(np.repeat(SENSORS, self.count), kinds)

    @property
    def side(self) -> np.ndarray:
        """+1 for right-hand sets, −1 for left-hand ones, (n,)."""
        return np.sign([y for _, y in self.positions])

    def _vertical(self) -> np.ndarray:
        x, y = np.array(self.positions, float).T
        return np.column_stack([-np.ones(self.count), x, -y])

    def _lateral(self) -> np.ndarray:
        x = np.array(self.positions, float)[:, 0]
        return self.side[:, None] * np.column_stack([np.ones(self.count), x])

    def displacement_matrix(self) -> np.ndarray:
        """Q (2n, 5): vertical then lateral displacements of the sets from (Z, Θ, Y, Φ, Ψ). Source: Table B-3."""
        v, w = self._vertical(), self._lateral()
        zero = np.zeros(self.count)
        top = np.column_stack([v[:, 0], v[:, 1], zero, v[:, 2], zero])
        return np.vstack([top, np.column_stack([zero, zero, w[:, 0], -self.depth * w[:, 0], w[:, 1]])])

    def measurement_matrix(self) -> np.ndarray:
        """(10, 4n): five modal gap signals, then five modal acceleration signals, from the sensors.

        Order within each five: `CHANNELS`. The sway row reads Y − cΦ.
        """
        n = self.count
        vertical, lateral = np.linalg.pinv(self._vertical()), np.linalg.pinv(self._lateral())
        out = np.zeros((10, 4 * n))
        for block, (v, w) in enumerate(((0, n), (2 * n, 3 * n))):
            rows = slice(5 * block, 5 * block + 5)
            out[rows][:VERTICAL_CHANNELS, v : v + n] = vertical
            out[rows][VERTICAL_CHANNELS:, w : w + n] = lateral
        return out

    def modal_spread(self) -> np.ndarray:
        """(commands, 5): commands per unit of each scaled modal signal K_i q_i^c; columns as `MODAL`."""
        v, w = self._vertical(), self._lateral()
        coils = -np.column_stack([v[:, 0], v[:, 1], w[:, 0], -self.depth * w[:, 0], w[:, 1]])
        pairs = np.zeros((2 * len(self.actuators), len(MODAL)))
        for k, actuator in enumerate(self.actuators):
            signal = MODAL.index(actuator.signal)
            coils[:, signal] = 0.0
            pairs[2 * k : 2 * k + 2, signal] = actuator.lever, -actuator.lever
        return np.vstack([coils, pairs])

    def command_columns(self) -> np.ndarray:
        """(n, 5): commands per unit of each filtered modal signal times its factor; columns as `CHANNELS`.

        Raises InputError for a law with actuators, whose roll signal acts in two ways: take `resolution`.
        """
        if self.split:
            raise InputError(
                "a law with actuators of its own for sway or yaw has no single column for each channel; "
                "use its resolution(theta), or a law with coils alone."
            )
        v, w = self._vertical(), self._lateral()
        return -np.column_stack([v[:, 0], v[:, 1], self.depth * w[:, 0], w[:, 0], w[:, 1]])

    def path_columns(self) -> np.ndarray:
        """(commands, paths): commands per unit of a filtered channel times its factor, one column for each path.

        Path k starts at channel `PATHS[split][k]`; its factor is entry k of `modal_factors(theta, split=…)`.
        """
        if not self.split:
            return self.command_columns()
        heave, pitch, sway, roll, yaw = self.modal_spread().T
        return np.column_stack([heave, pitch, roll, self.depth * sway, sway, yaw])

    def resolution(self, theta):
        """(commands, 5) DM or SX: commands per unit of each filtered channel, from the seventeen parameters."""
        weighted = ca.mtimes(ca.DM(self.path_columns()), ca.diag(modal_factors(theta, split=self.split)))
        if not self.split:
            return weighted
        onto = ca.DM(len(PATHS[True]), len(CHANNELS))
        for path, channel in enumerate(PATHS[True]):
            onto[path, channel] = 1
        return ca.mtimes(weighted, onto)

    def modal_matrix(self, gains: Gains) -> np.ndarray:
        """(5, 5): the scaled modal signals K_i q_i^c (heave, pitch, sway, roll, yaw) from the filtered channels."""
        return ca.DM(self.modal_resolution(ca.DM(list(gains.as_dict().values())))).full()

    def modal_resolution(self, theta):
        """The same as DM or SX, from the seventeen parameters."""
        g = dict(zip(GAIN_NAMES, ca.vertsplit(theta), strict=True))
        out = theta[0] * ca.DM(5, 5)
        heave, pitch, roll, sway, yaw = range(5)
        out[0, heave], out[1, pitch] = g["K_heave"], g["K_pitch"]
        out[2, sway], out[2, roll] = g["K_sway"], g["K_sway"] * self.depth
        out[3, roll], out[4, yaw] = g["K_roll"], g["K_yaw"]
        return out

    def state_space(self, theta):
        """(A, B, C, D) of the law as SX or DM, from the seventeen parameters in the order of `GAIN_NAMES`.

        States: five gap filters, five acceleration filters. Time constants must not be zero here.
        """
        A, B, C, D = self.filter_bank(theta)
        resolve = self.resolution(theta)
        return A, B, ca.mtimes(resolve, C), ca.mtimes(resolve, D)

    def filter_bank(self, theta):
        """(A, B, C, D) from the sensors to the five filtered channels (order of `CHANNELS`), before modal gains."""
        g = dict(zip(GAIN_NAMES, ca.vertsplit(theta), strict=True))
        v, w = VERTICAL_CHANNELS, 5 - VERTICAL_CHANNELS
        tau = ca.vertcat(*[g["tau_h"]] * v, *[g["tau_hp"]] * w, *[g["tau_z"]] * v, *[g["tau_y"]] * w)
        rate = ca.vertcat(*[g["K_hdot"]] * v, *[g["K_hpdot"]] * w)
        velocity = ca.vertcat(*[g["K_zdot"]] * v, *[g["K_ydot"]] * w)
        position = ca.vertcat(*[g["K_h"]] * v, *[g["K_hp"]] * w)
        direct = ca.vertcat(*[g["K_zddot"]] * v, *[g["K_yddot"]] * w)
        measure = ca.DM(self.measurement_matrix())
        A = ca.diag(-1 / tau)
        B = ca.mtimes(ca.diag(1 / tau), measure)
        through = ca.horzcat(ca.diag(position + rate / tau[:5]), ca.diag(direct))
        filtered = ca.horzcat(ca.diag(-rate / tau[:5]), ca.diag(velocity * tau[5:]))
        return A, B, filtered, ca.mtimes(through, measure)

    def numeric(self, gains: Gains, resolve: np.ndarray | None = None) -> tuple[np.ndarray, ...]:
        """(A, B, C, D) of the law as arrays; a filter whose gains are all zero is dropped.

        resolve : (k, 5) what makes the outputs of the five filtered channels; the commands if left out.

        Raises InputError for a time constant of zero whose rate gain is not: only roots exist then (`loop.roots`).
        """
        for rate, tau in (("K_hdot", "tau_h"), ("K_hpdot", "tau_hp")):
            if getattr(gains, tau) == 0 and getattr(gains, rate) != 0:
                raise InputError(
                    f"{tau} must be positive where responses are asked for; "
                    f"got 0 with {rate} = {getattr(gains, rate)}. "
                    f"An unfiltered rate has no finite response to noise: give {tau} a value, or ask for roots only."
                )
        kept = self.kept_filters(gains)
        A, B, C, D, spread = _numbers(self, gains)
        resolve = spread if resolve is None else resolve
        C, D = resolve @ C, resolve @ D
        return A[np.ix_(kept, kept)], B[kept], C[:, kept], D

    def numeric_resolution(self, gains: Gains) -> np.ndarray:
        """(commands, 5) of `resolution` as an array."""
        return _numbers(self, gains)[4]

    def kept_filters(self, gains: Gains) -> np.ndarray:
        """Indices of the ten filters whose gain is not zero (and whose time constant is not)."""
        gap = [gains.K_hdot != 0 and gains.tau_h > 0] * VERTICAL_CHANNELS + [
            gains.K_hpdot != 0 and gains.tau_hp > 0
        ] * 2
        acc = [gains.K_zdot != 0 and gains.tau_z > 0] * VERTICAL_CHANNELS + [gains.K_ydot != 0 and gains.tau_y > 0] * 2
        return np.flatnonzero(gap + acc)

    def filter_names(self, kept: Sequence[int]) -> tuple[str, ...]:
        """State names of the kept filters."""
        names = [f"{kind} filter of {channel}" for kind in ("gap", "acceleration") for channel in CHANNELS]
        return tuple(names[k] for k in kept)


@lru_cache(maxsize=64)
def _numbers(law: ModalLaw, gains: Gains) -> tuple[np.ndarray, ...]:
    """The filter bank (A, B, C, D) and the resolution of given gains, which every loop closed by them shares."""
    safe = gains.with_values(**{tau: getattr(gains, tau) or 1.0 for tau in TIME_CONSTANTS})
    unfiltered = {"K_zdot": 0.0} if gains.tau_z == 0 else {}
    unfiltered |= {"K_ydot": 0.0} if gains.tau_y == 0 else {}
    values = ca.DM(list(safe.with_values(**unfiltered).as_dict().values()))
    return tuple(ca.DM(m).full() for m in (*law.filter_bank(values), law.resolution(values)))


def modal_factors(theta, *, split: bool = False):
    """What multiplies each column of `ModalLaw.path_columns`: numbers or symbols, from the seventeen parameters.

    With coils alone (5,): roll counts as far as its gain differs from sway's. Split (6,): heave, pitch, roll to the
    coils, roll to sway's actuator, sway, yaw.
    """
    g = dict(zip(GAIN_NAMES, ca.vertsplit(theta), strict=True))
    if split:
        return ca.vertcat(g["K_heave"], g["K_pitch"], g["K_roll"], g["K_sway"], g["K_sway"], g["K_yaw"])
    return ca.vertcat(g["K_heave"], g["K_pitch"], g["K_sway"] - g["K_roll"], g["K_sway"], g["K_yaw"])
