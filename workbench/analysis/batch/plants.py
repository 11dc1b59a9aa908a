"""The part of a group's plant that an analysis reads, as stacks of matrices: one plant, or one for each row of a study.

    Setting --read--> Reading: dx/dt = A x + B v + front/rear noise,  modal signals, outputs, gaps
    some vehicles --fit--> Family: the same for any mass, inertias and force factors, exactly and in one product

A plant about the nominal pose is linear in known functions of the factors: with the inverse of mass or an inertia in
front of (1, mass, current force, gap force). The coefficients come from a few vehicles, and more vehicles prove them;
where the proof fails (the pose moves with the load) there is no family.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from workbench.analysis.response import exciting_types, point_acceleration
from workbench.analysis.setting import Setting
from workbench.control.loop import Subject
from workbench.lti.signals import numbered
from workbench.physics.guideway.irregularity import TYPES, patterns

FACTORS = ("mass", "roll_inertia", "pitch_inertia", "yaw_inertia", "current_force", "gap_force")
SPARE = 2  # vehicles more than terms, for a fit that rounding cannot spoil
PROOFS = 3  # vehicles that the fitted family must reproduce
AGREEMENT = 1e-10  # of the largest entry of a matrix; rounding of the fit leaves 1e-13


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """Matrices (…, rows, columns) of one group; y are its modal signals, outputs those asked for by key.

    A, B : states, patterns;  B_front, B_rear : states by noise types
    C_y, D_y, D_y_front, D_y_rear : modal signals;  C_z, D_z, D_z_front, D_z_rear : outputs
    C_sensed : gaps, lateral gaps, currents of all sets
    """

    A: np.ndarray
    B: np.ndarray
    B_front: np.ndarray
    B_rear: np.ndarray
    C_y: np.ndarray
    D_y: np.ndarray
    D_y_front: np.ndarray
    D_y_rear: np.ndarray
    C_z: np.ndarray
    D_z: np.ndarray
    D_z_front: np.ndarray
    D_z_rear: np.ndarray
    C_sensed: np.ndarray


SENSED = ("gap", "gap_lateral", "current")  # at every coil set
ACCELERATIONS = {"acceleration_z": "z", "acceleration_y": "y"}  # quantity to direction
Key = tuple[str, str]  # quantity and place, as in `Analysis.rms`


def output_keys(setting: Setting, subject: Subject) -> list[Key]:
    """The outputs a group contributes to, in order; currents of every set come last, by number."""
    keys = []
    for quantity, direction in ACCELERATIONS.items():
        for name, place in setting.points.items():
            row = point_acceleration(subject.plant.outputs, place, direction)
            if np.abs(row @ np.hstack([subject.plant.C, subject.plant.D])).max() > 0:
                keys.append((quantity, name))
    kinds = ["gap"] if set(setting.groups) <= {"heave", "heave_pitch"} else ["gap", "gap_lateral"]
    keys += [(kind, end) for kind in kinds for end in ("front", "rear")]
    return keys + [("current", name) for name in numbered("current", setting.law.count)]


def read(setting: Setting, subject: Subject, keys: list[Key]) -> Reading:
    """The matrices of one vehicle's group."""
    plant, law, n = subject.plant, subject.law, subject.law.count
    places = np.array([p[0] for p in law.positions])
    at_front = np.tile(places == places.max(), 2)[:, None]
    wave = patterns(law.positions)[:, [TYPES.index(t) for t in exciting_types(setting, subject)]]
    w = plant.index("inputs", numbered("zeta", n) + numbered("eta", n))
    u = plant.index("inputs", subject.commands)
    measure = law.measurement_matrix()[subject.modal_rows]
    sensors = plant.index("outputs", law.sensors)
    rows = np.array([_row(setting, subject, key) for key in keys]).reshape(len(keys), len(plant.outputs))
    sensed = plant.index("outputs", [name for kind in SENSED for name in numbered(kind, n)])
    front, rear = at_front * wave, ~at_front * wave
    C_y, D_y = measure @ plant.C[sensors], measure @ plant.D[sensors]
    C_z, D_z = rows @ plant.C, rows @ plant.D
    return Reading(
        A=plant.A, B=plant.B[:, u], B_front=plant.B[:, w] @ front, B_rear=plant.B[:, w] @ rear,
        C_y=C_y, D_y=D_y[:, u], D_y_front=D_y[:, w] @ front, D_y_rear=D_y[:, w] @ rear,
        C_z=C_z, D_z=D_z[:, u], D_z_front=D_z[:, w] @ front, D_z_rear=D_z[:, w] @ rear,
        C_sensed=plant.C[sensed],
    )  # fmt: skip


def _row(setting: Setting, subject: Subject, key: Key) -> np.ndarray:
    """Row over the plant's outputs of one output."""
    names = subject.plant.outputs
    quantity, place = key
    if quantity in ACCELERATIONS:
        return point_acceleration(names, setting.points[place], ACCELERATIONS[quantity])
    first, last = setting.ends
    name = place if quantity == "current" else f"{quantity}_{(first if place == 'front' else last) + 1}"
    row = np.zeros(len(names))
    row[names.index(name)] = 1.0
    return row


@dataclass(frozen=True, slots=True)
class Family:
    """The readings of every group as functions of the factors; those not in `varied` stay 1."""

    varied: tuple[str, ...]
    coefficients: tuple[Reading, ...]  # each matrix (terms, rows, columns)

    def __call__(self, factors: np.ndarray) -> tuple[Reading, ...]:
        """Stacks for factors (b, varied)."""
        terms = _terms(self.varied, factors)
        return tuple(_map(lambda c: np.einsum("bt,tij->bij", terms, c), group) for group in self.coefficients)


def fit(varied: Sequence[str], make: Callable[[dict[str, float]], tuple[Reading, ...]]) -> Family | None:
    """The family behind `make`, which gives the readings of one vehicle with some factors; None where there is none."""
    rng = np.random.default_rng(0)
    terms = _terms(varied, np.ones((1, len(varied)))).shape[1]
    points = np.exp(rng.uniform(-0.3, 0.3, (terms + SPARE + PROOFS, len(varied))))
    made = [make(dict(zip(varied, p.tolist(), strict=True))) for p in points]
    inverse = np.linalg.pinv(_terms(varied, points[:-PROOFS]), rcond=1e-13)
    groups = []
    for k in range(len(made[0])):
        stacks = {f.name: np.array([getattr(m[k], f.name) for m in made]) for f in fields(Reading)}
        found = {name: np.einsum("tb,bij->tij", inverse, stack[:-PROOFS]) for name, stack in stacks.items()}
        for name, stack in stacks.items():
            said = np.einsum("bt,tij->bij", _terms(varied, points[-PROOFS:]), found[name])
            if np.abs(said - stack[-PROOFS:]).max(initial=0) > AGREEMENT * np.abs(stack).max(initial=1e-300):
                return None
        groups.append(Reading(**found))
    return Family(tuple(varied), tuple(groups))


def _terms(varied: Sequence[str], factors: np.ndarray) -> np.ndarray:
    """(b, terms): 1, and the inverse of mass and each inertia times (1, mass, current force, gap force), each once."""
    values = dict(zip(varied, factors.T, strict=True))
    one = np.ones(len(factors))
    columns: dict[tuple[str, ...], np.ndarray] = {(): one}
    for below in ("", *FACTORS[:4]):
        for above in ("", "mass", *FACTORS[4:]):
            names = tuple(f"{sign}{n}" for sign, n in (("/", below), ("", above)) if n in values)
            if below and above == below:
                continue  # a factor over itself
            columns.setdefault(names, values.get(above, one) / values.get(below, one))
    return np.column_stack(list(columns.values()))


def _map(change: Callable[[np.ndarray], np.ndarray], reading: Reading) -> Reading:
    return replace(reading, **{f.name: change(getattr(reading, f.name)) for f in fields(reading)})
