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
from workbench.lti.join import beside, series
from workbench.lti.realisation import Realisation
from workbench.lti.variance import Stationary, arriving
from workbench.physics.guideway.irregularity import TYPES, patterns, stations

REACH = 1e-12  # [m/m] below which a coordinate does not follow a type at 1 rad/s: rounding of an exact zero
WEIGHTS = {"z": "Wk", "y": "Wd"}  # ISO 2631-1, vertical and lateral, seated
WEIGHTING = {f"acceleration_{direction}": name for direction, name in WEIGHTS.items()}
COST_SCALE = 1e4  # J = 10⁴ Σ mean squares in g²
COST_POINTS = ("cg", "front", "rear")


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
    omega, n = np.asarray(omega, float), len(setting.sets)
    met = plant.select(inputs=[plant.inputs[k] for of in irregularities(plant, n) for k in of])
    return seen_guideway(setting, met, omega, met.response(omega), waves)


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
    parts = [[np.atleast_2d(part) for part in filters[:3]] for filters in shaping]
    source = beside(*(Realisation(A, B, C, np.zeros((len(C), B.shape[1]))) for A, B, C in parts))
    places = stations(setting.sets, setting.speed)
    waves = [wave[:, [TYPES.index(t) for t in types]] for _, wave in places]
    mixing = np.eye(len(types))
    if setting.guideway.correlation is not None:  # independent sources, mixed into the types
        mixing = setting.guideway.mixing()[[TYPES.index(t) for t in types]]
        types = tuple(f"source {j + 1}" for j in range(mixing.shape[1]))
    # states: the filters of each station, loop, weights
    source = source._replace(B=source.B @ mixing, D=source.D @ mixing)
    each = beside(*[source] * len(places))
    surface = np.column_stack([wave @ source.C for wave in waves])
    heights, rates = irregularities(closed, len(setting.sets))
    met, jump = surface, np.zeros((len(surface), each.B.shape[1]))  # and the white part of the surface's rate
    if rates:
        met, jump = np.concatenate([surface, surface @ each.A]), np.concatenate([jump, surface @ each.B])
    felt = [*heights, *rates]
    loop = series(
        Realisation(closed.A, closed.B[:, felt], closed.C, closed.D[:, felt]), Realisation(each.A, each.B, met, jump)
    )
    wanted = {}
    for direction in WEIGHTS:
        for name, place in setting.points.items():
            row = point_acceleration(closed.outputs, place, direction)
            if np.abs(row @ loop.C).max() > 0:
                wanted[direction, name] = row
    return _weighed(loop, wanted, np.kron(np.eye(2), setting.under) @ surface, places, tuple(types), closed.outputs)


def _weighed(loop: Realisation, wanted, surface: np.ndarray, places, types, names) -> Driven:
    """The loop with a comfort weight for each wanted row over its outputs."""
    p, s = len(names), len(surface)
    ends = np.concatenate([loop.C, np.pad(surface, ((0, 0), (0, len(loop.A) - surface.shape[1])))])
    seen = Realisation(loop.A, loop.B, ends, np.pad(loop.D, ((0, s), (0, 0))))
    weights = beside(*(_single(weight(WEIGHTS[direction]).state_space()) for direction, _ in wanted))
    rows = np.zeros((len(wanted), p + s))
    rows[:, :p] = np.array(list(wanted.values())).reshape(-1, p)
    A, B, C, D = series(
        Realisation(
            weights.A, weights.B @ rows, np.pad(weights.C, ((p + s, 0), (0, 0))),
            np.concatenate([np.eye(p + s), weights.D @ rows]),
        ), seen,
    )  # fmt: skip
    m = B.shape[1] // len(places)
    noise = [slice(j * m, (j + 1) * m) for j in range(len(places))]
    return Driven(
        A=A, arrivals=tuple((delay, B[:, own]) for (delay, _), own in zip(places, noise, strict=True)), types=types,
        outputs=dict(zip(names, C[:p], strict=True)), white=tuple(D[:p, own] for own in noise),
        weighted=dict(zip(wanted, C[p + s :], strict=True)), surface=C[p : p + s], surface_rate=C[p : p + s] @ A,
    )  # fmt: skip


def _single(filter_) -> Realisation:
    """A filter of one input and output as four matrices."""
    A, B, C, D = filter_
    return Realisation(np.atleast_2d(A), np.reshape(B, (-1, 1)), np.reshape(C, (1, -1)), np.reshape(D, (1, 1)))
