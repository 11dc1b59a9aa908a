"""Random response of a group: guideway spectrum, wheel base, closed loop and comfort weights as one linear system.

    white noise --shaping filter--> irregularity at the foremost sets, and after each station's delay at the others
      --> closed loop of the group --> outputs, weighted accelerations --> mean squares (exact Lyapunov equation)

Mean squares run over all frequencies from zero to infinity.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.analysis.ride import weight
from workbench.analysis.setting import Setting
from workbench.control import Gains
from workbench.control.loop import Subject
from workbench.control.loop import subject as subject_of
from workbench.errors import InputError
from workbench.lti import Plant
from workbench.lti.variance import Stationary, arriving
from workbench.physics.guideway.irregularity import TYPES, patterns, stations

REACH = 1e-12  # [m/m] below which a coordinate does not follow a type at 1 rad/s: rounding of an exact zero
WEIGHTS = {"z": "Wk", "y": "Wd"}  # ISO 2631-1, vertical and lateral, seated


def point_acceleration(names: Sequence[str], place: Sequence[float], direction: str) -> np.ndarray:
    """Row over a vehicle plant's outputs of the acceleration at (x, y, z) from the cg: "z" down or "y" right."""
    x, y, z = place
    parts = {"z": {"Z": 1.0, "Theta": -x, "Phi": y}, "y": {"Y": 1.0, "Psi": x, "Phi": -z}}[direction]
    row = np.zeros(len(names))
    for coordinate, factor in parts.items():
        row[names.index(f"{coordinate}_acceleration")] = factor
    return row


@dataclass(frozen=True, slots=True)
class Driven:
    """A group's closed loop driven by white noises, one per irregularity type.

    A : (n, n);  arrivals : (delay [s], B (n, types)) of each station, foremost first
    types : names (of independent sources where the types are correlated)
    surface, surface_rate : (2 commands, n) heights under the sensors, and the part of their rates that is not white
    outputs : row of C over the augmented state, by name of the loop's output
    white : (outputs, types) at each arrival, the noise that reaches an output directly: its mean square is infinite
    weighted : rows of the weighted accelerations, by (direction, point)
    """

    A: np.ndarray
    arrivals: tuple[tuple[float, np.ndarray], ...]
    types: tuple[str, ...]
    outputs: Mapping[str, np.ndarray]
    white: tuple[np.ndarray, ...]
    weighted: Mapping[tuple[str, str], np.ndarray]
    surface: np.ndarray
    surface_rate: np.ndarray

    def stationary(self) -> Stationary:
        """Covariance under each type, or independent source, on its own."""
        return arriving(self.A, self.arrivals)

    def rows(self, names: Sequence[str]) -> np.ndarray:
        """C rows of named outputs."""
        return np.array([self.outputs[name] for name in names])

    def finite(self, row: np.ndarray) -> bool:
        """Whether a combination of the loop's outputs has a mean square."""
        return not any(np.any(row @ white) for white in self.white)


def irregularities(plant: Plant, count: int) -> tuple[list[int], list[int]]:
    """Inputs of a plant that are the guideway's ζ, η under `count` coil sets, and those that are their rates."""
    heights, rates = (
        [f"{kind}{rate}_{i + 1}" for kind in ("zeta", "eta") for i in range(count)] for rate in ("", "_rate")
    )
    return plant.index("inputs", heights), plant.index("inputs", rates) if rates[0] in plant.inputs else []


def guideway_response(setting: Setting, plant: Plant, omega, waves: np.ndarray) -> np.ndarray:
    """(K, outputs, types) response of a plant to unit irregularities at angular frequencies (K,) [rad/s].

    waves : (2n, types) or (K, 2n, types) what the sets meet of each type
    """
    omega = np.asarray(omega, float)
    return seen_guideway(setting, plant, omega, plant.response(omega), waves)


def seen_guideway(setting: Setting, plant: Plant, omega: np.ndarray, response: np.ndarray, waves) -> np.ndarray:
    """The same from the response (K, outputs, inputs) of the plant."""
    heights, rates = irregularities(plant, len(setting.sets))
    seen = response[:, :, heights]
    return (seen + 1j * omega[:, None, None] * response[:, :, rates] if rates else seen) @ waves


def exciting_types(setting: Setting, subject: Subject) -> tuple[str, ...]:
    """The irregularity types that move the group's coordinates or reach its commands."""
    plant = subject.plant
    moved = plant.index("outputs", subject.coordinates)
    reach = guideway_response(setting, plant, [1.0], patterns(setting.sets))[0, moved]
    return tuple(t for t in setting.types if np.abs(reach[:, TYPES.index(t)]).max() > REACH)


def random_loops(setting: Setting, gains: Gains) -> list[tuple[Subject, Plant]]:
    """What random responses are computed from: each group closed, or the whole vehicle where types are correlated."""
    subjects = setting.subjects
    if setting.guideway.correlation is not None and len(subjects) > 1:
        subjects = (subject_of(setting.plant, setting.law, "all"),)
    return [(s, s.close(gains)) for s in subjects]


def spectrum_of(setting: Setting, kind: str) -> Any:
    """The spectrum of one type of irregularity that acts."""
    return setting.guideway.spectra[TYPES.index(kind)]


def driven(setting: Setting, subject: Subject, closed: Plant) -> Driven:
    """The augmented system of a group for a guideway whose spectrum has a shaping filter: one of each for each station.

    Where magnetic damping feels the rate of the guideway, the white part of that rate acts on the loop directly.
    """
    types = exciting_types(setting, subject)
    if not types:
        raise InputError(
            f"{subject.name} needs an irregularity type that moves it; none of {', '.join(setting.types)} does. "
            "Let another type act, or leave the group out."
        )
    shaping = [spectrum_of(setting, t).shaping_filter(setting.speed) for t in types]
    As, Bs, Cs = (_block_diagonal([filters[part] for filters in shaping]) for part in range(3))
    places = stations(setting.sets, setting.speed)
    waves = [wave[:, [TYPES.index(t) for t in types]] for _, wave in places]
    mixing = np.eye(len(types))
    if setting.guideway.correlation is not None:  # independent sources, mixed into the types
        mixing = setting.guideway.mixing()[[TYPES.index(t) for t in types]]
        types = tuple(f"source {j + 1}" for j in range(mixing.shape[1]))
    # states: the filters of each station, loop, weights
    n, ns, k = len(closed.A), len(As), len(places)
    heights, rates = irregularities(closed, len(setting.sets))
    surface, filters = np.hstack([wave @ Cs for wave in waves]), _block_diagonal([As] * k)
    jumps = [wave @ Cs @ Bs @ mixing for wave in waves]  # white part of the surface's rate
    into, onto = closed.B[:, heights] @ surface, closed.D[:, heights] @ surface
    if rates:
        into, onto = into + closed.B[:, rates] @ surface @ filters, onto + closed.D[:, rates] @ surface @ filters
    A = np.block([[filters, np.zeros((k * ns, n))], [into, closed.A]])
    C = np.hstack([onto, closed.C])
    inputs = [
        np.vstack([np.zeros((j * ns, jump.shape[1])), Bs @ mixing, np.zeros(((k - 1 - j) * ns, jump.shape[1])),
                   closed.B[:, rates] @ jump if rates else np.zeros((n, jump.shape[1]))])
        for j, jump in enumerate(jumps)
    ]  # fmt: skip
    white = [closed.D[:, rates] @ jump if rates else np.zeros((len(C), jump.shape[1])) for jump in jumps]
    wanted = {}
    for direction in WEIGHTS:
        for name, place in setting.points.items():
            row = point_acceleration(closed.outputs, place, direction)
            if np.abs(row @ C).max() > 0:
                wanted[direction, name] = row
    under = _block_diagonal([setting.under] * 2)
    surface_state = np.hstack([under @ surface, np.zeros((len(under), n))])
    A, inputs, C, weighted, surface_state = _weigh(A, inputs, C, white, wanted, surface_state)
    return Driven(
        A=A, arrivals=tuple((delay, B) for (delay, _), B in zip(places, inputs, strict=True)), types=types,
        outputs=dict(zip(closed.outputs, C, strict=True)), white=tuple(white), weighted=weighted,
        surface=surface_state, surface_rate=surface_state @ A,
    )  # fmt: skip


def _block_diagonal(blocks: Sequence[np.ndarray]) -> np.ndarray:
    from scipy.linalg import block_diag

    return block_diag(*blocks)


def _weigh(A, inputs, C, white, wanted, surface):
    """Appends one comfort weight per wanted row over the outputs; white noise on one enters its weight directly."""
    size = len(A)
    filters = {key: weight(WEIGHTS[key[0]]).state_space() for key in wanted}
    parts = {
        key: (np.atleast_2d(Aw), np.reshape(Bw, (-1, 1)), np.reshape(Cw, (1, -1)), float(np.reshape(Dw, ())))
        for key, (Aw, Bw, Cw, Dw) in filters.items()
    }
    total = size + sum(len(Aw) for Aw, *_ in parts.values())
    big = np.zeros((total, total))
    big[:size, :size] = A
    grown = [np.pad(B, ((0, total - size), (0, 0))) for B in inputs]
    rows, at = {}, size
    for key, row in wanted.items():
        Aw, Bw, Cw, Dw = parts[key]
        span = slice(at, at + len(Aw))
        big[span, :size], big[span, span] = Bw * (row @ C), Aw
        for B, noise in zip(grown, white, strict=True):
            B[span] = Bw * (row @ noise)
        out = np.zeros(total)
        out[:size], out[span] = Dw * (row @ C), Cw
        rows[key] = out
        at += len(Aw)
    wide = ((0, 0), (0, total - size))
    return big, grown, np.pad(C, wide), rows, np.pad(surface, wide)
