"""Random response of a group: guideway spectrum, wheel base, closed loop and comfort weights as one linear system.

    white noise --shaping filter--> irregularity at the front sets, and after the wheel-base delay at the rear sets
      --> closed loop of the group --> outputs, weighted accelerations --> mean squares (exact Lyapunov equation)

Mean squares run over all frequencies from zero to infinity.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.analysis.ride import weight
from workbench.analysis.setting import Setting
from workbench.analysis.variance import Stationary, stationary
from workbench.control import Gains
from workbench.errors import InputError
from workbench.guideway.irregularity import TYPES, patterns
from workbench.loop import Subject
from workbench.loop import subject as subject_of
from workbench.lti import Plant
from workbench.lti.signals import numbered

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

    A : (n, n);  B_front, B_rear : (n, types);  types : names (of independent sources where the types are correlated)
    surface, surface_rate : (2 sets, n) and the part of the rates that is white, (2 sets, types) at once
    outputs : row of C over the augmented state, by name of the loop's output
    weighted : rows of the weighted accelerations, by (direction, point)
    """

    A: np.ndarray
    B_front: np.ndarray
    B_rear: np.ndarray
    types: tuple[str, ...]
    delay: float
    outputs: Mapping[str, np.ndarray]
    weighted: Mapping[tuple[str, str], np.ndarray]
    surface: np.ndarray
    surface_rate: np.ndarray
    front_sets: np.ndarray

    def stationary(self) -> Stationary:
        """Covariance under each type, or independent source, on its own."""
        return stationary(self.A, self.B_front, self.B_rear, delay=self.delay)

    def rows(self, names: Sequence[str]) -> np.ndarray:
        """C rows of named outputs."""
        return np.array([self.outputs[name] for name in names])


def exciting_types(setting: Setting, subject: Subject) -> tuple[str, ...]:
    """The irregularity types that move the group's coordinates or reach its commands."""
    plant = subject.plant
    wave = patterns(subject.law.positions)
    moved = plant.index("outputs", subject.coordinates)
    reach = plant.response([1.0])[0][np.ix_(moved, _irregularities(plant, subject.law.count))] @ wave
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
    """The augmented system of a group for a guideway whose spectrum has a shaping filter.

    Raises InputError for coil sets at more than two stations, since one delay separates two.
    """
    law = subject.law
    n = law.count
    x = np.array([p[0] for p in law.positions])
    stations = sorted(set(x), reverse=True)
    if len(stations) > 2:
        raise InputError(
            f"mean squares take coil sets at one or two stations along the vehicle; got {len(stations)}. "
            "Group them in two."
        )
    types = exciting_types(setting, subject)
    if not types:
        raise InputError(
            f"{subject.name} needs an irregularity type that moves it; none of {', '.join(setting.types)} does. "
            "Let another type act, or leave the group out."
        )
    shaping = [spectrum_of(setting, t).shaping_filter(setting.speed) for t in types]
    As, Bs, Cs = (_block_diagonal([filters[part] for filters in shaping]) for part in range(3))
    k, ns = len(types), len(As)
    front = x == stations[0]
    wave = patterns(law.positions)[:, [TYPES.index(t) for t in types]]
    # states: front filter of each type, rear filter of each type, loop, weights
    at_front = np.concatenate([front, front])[:, None] * wave
    surface = np.hstack([at_front @ Cs, (wave - at_front) @ Cs])
    filters = _block_diagonal([As, As])
    noise, nothing = Bs, np.zeros_like(Bs)
    w = _irregularities(closed, n)
    A = np.block([[filters, np.zeros((2 * ns, len(closed.A)))], [closed.B[:, w] @ surface, closed.A]])
    C = np.hstack([closed.D[:, w] @ surface, closed.C])
    B_front = np.vstack([noise, nothing, np.zeros((len(closed.A), k))])
    B_rear = np.vstack([nothing, noise, np.zeros((len(closed.A), k))])
    if setting.guideway.correlation is not None:  # independent sources, mixed into the types
        mixing = setting.guideway.mixing()[[TYPES.index(t) for t in types]]
        B_front, B_rear = B_front @ mixing, B_rear @ mixing
        types = tuple(f"source {j + 1}" for j in range(mixing.shape[1]))
    surface_state = np.hstack([surface, np.zeros((2 * n, len(closed.A)))])
    wanted = {}
    for direction in WEIGHTS:
        for name, place in setting.points.items():
            row = point_acceleration(closed.outputs, place, direction) @ C
            if np.abs(row).max() > 0:
                wanted[direction, name] = row
    A, B_front, B_rear, C, weighted, surface_state = _weigh(A, B_front, B_rear, C, wanted, surface_state)
    return Driven(
        A=A, B_front=B_front, B_rear=B_rear, types=types, delay=setting.delay if len(stations) == 2 else 0.0,
        outputs=dict(zip(closed.outputs, C, strict=True)), weighted=weighted,
        surface=surface_state, surface_rate=surface_state @ A, front_sets=np.concatenate([front, front]),
    )  # fmt: skip


def _block_diagonal(blocks: Sequence[np.ndarray]) -> np.ndarray:
    from scipy.linalg import block_diag

    return block_diag(*blocks)


def _irregularities(plant: Plant, count: int) -> list[int]:
    return plant.index("inputs", numbered("zeta", count) + numbered("eta", count))


def _weigh(A, B_front, B_rear, C, wanted, surface):
    """Appends one comfort weight per wanted acceleration row."""
    size, extra = len(A), 0
    weights = []
    for (direction, _), row in wanted.items():
        Aw, Bw, Cw, Dw = weight(WEIGHTS[direction]).state_space()
        weights.append(
            (row, np.atleast_2d(Aw), np.reshape(Bw, (-1, 1)), np.reshape(Cw, (1, -1)), float(np.reshape(Dw, ())))
        )
        extra += len(weights[-1][1])
    total = size + extra
    big = np.zeros((total, total))
    big[:size, :size] = A
    rows, at = {}, size
    for key, (row, Aw, Bw, Cw, Dw) in zip(wanted, weights, strict=True):
        span = slice(at, at + len(Aw))
        big[span, :size], big[span, span] = Bw * row, Aw
        out = np.zeros(total)
        out[:size], out[span] = Dw * row, Cw
        rows[key] = out
        at += len(Aw)
    pad = ((0, extra), (0, 0))
    wide = ((0, 0), (0, extra))
    return big, np.pad(B_front, pad), np.pad(B_rear, pad), np.pad(C, wide), rows, np.pad(surface, wide)
