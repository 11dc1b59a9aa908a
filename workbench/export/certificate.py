"""What the proofs of a gain table rest on besides gains, law and plant, as decimals.

    Problem --certificate_of--> groups, guideway, sensors, motor, and the vehicle from which the plant follows
    GainTable, Problem --agreement--> whether a table is of that problem: data, plant, law, certificate, limits

The independent checker (`workbench.verify`) reads this part and nothing else of the problem. What it could not use is
left out (None): spectra without rational form, and vehicles whose plant it would not rebuild (a trim away from the
nominal pose, a lost set). The promises that need it are then floating point, and say so.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.constants import GRAVITY
from workbench.guideway.irregularity import TYPES
from workbench.guideway.spectrum import PowerLaw, Rational
from workbench.lti import Plant
from workbench.result import Result, Row

SAME = 1e-9  # of the largest entry in the same row; rebuilt by the same code, a plant is the same to 1e-13


def certificate_of(problem) -> dict[str, Any]:
    """The certificate part of a problem's gain table; problem: `workbench.design.problem.Problem`."""
    setting = problem.setting
    gap_noise, acceleration_noise = setting.sensor_noise
    motor = setting.motor
    return {
        "groups": list(setting.groups),
        "guideway": _guideway(setting),
        "sensors": {
            "accelerometer_bias_m_s2": _decimal(setting.accelerometer_bias),
            "gap_noise_m_per_root_hz": _decimal(gap_noise),
            "acceleration_noise_m_s2_per_root_hz": _decimal(acceleration_noise),
        },
        "motor": None
        if motor is None
        else {
            "rated_current_a": _decimal(motor.rated_current),
            "working_current_a": _decimal(motor.working_current),
        },
        "physics": _physics(problem),
    }


def _decimal(value) -> str:
    return repr(float(value))


def _decimals(matrix) -> list[list[str]]:
    return [[_decimal(x) for x in row] for row in np.atleast_2d(np.asarray(matrix, float))]


def _guideway(setting) -> dict[str, Any] | None:
    """Spectra as the vehicle meets them at its speed; None where one has no shaping filter of rational poles."""
    spectra = {}
    for name, spectrum in zip(TYPES, setting.guideway.spectra, strict=True):
        if spectrum is None:
            continue
        if isinstance(spectrum, PowerLaw):
            spectrum = spectrum.at_speed(setting.speed)
        if not isinstance(spectrum, Rational) or min(spectrum.corners) <= 0:
            return None
        spectra[name] = {
            "strength": _decimal(spectrum.strength),
            "corners_rad_m": [_decimal(corner) for corner in spectrum.corners],
            "zeros": int(spectrum.zeros),
        }
    correlation = setting.guideway.correlation
    return {
        "speed_m_s": _decimal(setting.speed),
        "spectra": spectra,
        "correlation": None if correlation is None else _decimals(correlation),
    }


def _physics(problem) -> dict[str, Any] | None:
    """The vehicle behind the plant, if it rests in its nominal pose and the checker rebuilds this plant from it."""
    from workbench.forces.law import FirstOrderLaw
    from workbench.vehicle import Vehicle
    from workbench.vehicle.assembly import tangent

    vehicle = problem.vehicle
    if not isinstance(vehicle, Vehicle):
        return None
    law, extras = vehicle.force_law, vehicle.extras
    if isinstance(law, FirstOrderLaw):
        rows = [law.lift, law.lateral, law.moment]
    else:
        values, slopes = tangent(law, np.zeros(3), 0.0)
        rows = np.column_stack([np.ravel(values), slopes])
    lift, lateral, moment = _decimals(rows)
    document: dict[str, Any] = {
        "mass_kg": _decimal(vehicle.mass),
        "roll_inertia_kg_m2": _decimal(vehicle.roll_inertia),
        "pitch_inertia_kg_m2": _decimal(vehicle.pitch_inertia),
        "yaw_inertia_kg_m2": _decimal(vehicle.yaw_inertia),
        "positions_m": _decimals(vehicle.positions),
        "depth_m": _decimal(vehicle.depth),
        "joined": [list(group) for group in vehicle.joined],
        "lift": lift,
        "lateral": lateral,
        "moment": moment,
        "drag_ratio": _decimal(law.drag_ratio),
        "gravity_m_s2": _decimal(GRAVITY),
        "gravity_term": bool(extras.gravity_term),
        "current_lag_s": _decimal(extras.current_lag),
        "coil_length_m": _decimal(extras.coil_length),
        "thrust_n": _decimal(extras.thrust),
        "lift_damping_n_s_m": _decimal(extras.lift_damping),
        "lateral_damping_n_s_m": _decimal(extras.lateral_damping),
        "bank_reading": extras.bank_reading,
    }
    return document if plant_follows(problem.setting.plant, document) else None


def plant_follows(plant: Plant, physics: dict[str, Any]) -> bool:
    """Whether the checker rebuilds a plant from the vehicle's numbers."""
    from workbench.verify.physics import Physics, differences

    return not differences(exact_plant(plant), Physics.read(physics))


def exact_plant(plant: Plant):
    """The plant as the checker takes it from the printed decimals: `workbench.verify.system.System`."""
    from workbench.verify.table import plant_of

    return plant_of(plant_part(plant))


def plant_part(plant: Plant) -> dict[str, Any]:
    """The plant part of a gain table."""
    matrices = {k: [[_decimal(x) for x in row] for row in getattr(plant, k)] for k in "ABCD"}
    return {"states": list(plant.states), "inputs": list(plant.inputs), "outputs": list(plant.outputs), **matrices}


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Agreement(Result):
    """Whether a gain table is one of a problem.

    plant_difference : largest difference of an entry, of the largest entry in its row; None if the signals differ
    disagreements : one sentence for each thing that differs
    """

    problem: str
    data_sha256_ok: bool
    plant_difference: float | None
    disagreements: tuple[str, ...]

    @property
    def holds(self) -> bool:
        """Whether nothing differs."""
        return not self.disagreements

    def rows(self) -> list[Row]:
        """What was compared."""
        return [
            ("problem", self.problem, ""),
            ("data as in the table", self.data_sha256_ok, ""),
            ("largest difference of the plants", self.plant_difference, "of its row"),
            *(("differs", sentence, "") for sentence in self.disagreements),
        ]


def agreement(document: dict[str, Any], problem) -> Agreement:
    """A table's content (as `read_table(...).to_dict()` has it) held against a problem rebuilt from its data."""
    from workbench.export.table import law_part

    plant, sentences = problem.setting.plant, []
    same_data = document["data_sha256"] == problem.data_sha256
    if not same_data:
        sentences.append(
            f"the data of {problem.name!r} must be those the table was made from; their SHA-256 is "
            f"{problem.data_sha256[:12]}…, the table's {document['data_sha256'][:12]}…"
        )
    difference, place = _plant_difference(document["plant"], plant)
    if difference is None or not difference <= SAME:
        how = "their signals differ" if difference is None else f"{place} differs by {difference:.2g} of its row"
        sentences.append(f"the plant rebuilt from {problem.name!r} must be the table's to 1e-9; {how}")
    if document["law"] != law_part(problem.law, problem.sample_time):
        sentences.append(f"the control law's places and sample time must be those of {problem.name!r}; they differ")
    given = document.get("certificate")
    if given is not None and given != certificate_of(problem):
        wrong = [key for key, value in certificate_of(problem).items() if given.get(key) != value]
        sentences.append(f"the certificate must rest on the numbers of {problem.name!r}; {', '.join(wrong)} differ")
    promised = {
        (p["name"].split(", heave")[0].split(", sway")[0], p["sense"], p["limit"]) for p in document["promises"]
    }
    lacking = [r for r in problem.requirements if (r.name, r.sense, r.limit) not in promised]
    if lacking:
        r = lacking[0]
        sentences.append(
            f"every requirement of {problem.name!r} must be promised; {r.name!r} {r.sense} {r.limit:g} is not"
        )
    return Agreement(
        problem=problem.name,
        data_sha256_ok=same_data,
        plant_difference=difference,
        disagreements=tuple(sentences),
    )


def _plant_difference(printed: dict[str, Any] | None, plant: Plant) -> tuple[float | None, str]:
    """Largest relative difference and its place."""
    names = {kind: tuple(printed[kind]) if printed else () for kind in ("states", "inputs", "outputs")}
    if printed is None or any(names[kind] != getattr(plant, kind) for kind in names):
        return None, ""
    worst, place = 0.0, ""
    for letter, row_kind, column_kind in (
        ("A", "states", "states"), ("B", "states", "inputs"), ("C", "outputs", "states"), ("D", "outputs", "inputs"),
    ):  # fmt: skip
        ours, theirs = getattr(plant, letter), np.array(printed[letter], float).reshape(getattr(plant, letter).shape)
        size = np.maximum(np.abs(ours), np.abs(theirs)).max(axis=1, keepdims=True, initial=0.0)
        off = np.abs(ours - theirs) / np.where(size > 0, size, 1.0)
        i, j = np.unravel_index(int(np.argmax(off)), off.shape)
        if off[i, j] > worst:
            worst, place = float(off[i, j]), f"{letter}({names[row_kind][i]}, {names[column_kind][j]})"
    return worst, place
