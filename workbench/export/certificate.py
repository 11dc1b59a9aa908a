"""What the proofs of a gain table rest on besides gains, law and plant, as decimals.

    Problem --certificate_of--> groups, guideway, sensors, motor, and the vehicle from which the plant follows
    Problem --speed_forces--> coil forces over the speeds of a schedule, as printed polynomials
    GainTable, Problem --agreement--> whether a table is of that problem: data, plant, law, certificate, limits, forces

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

FORCE_DEGREE = 8  # of the printed polynomials: leaves 4e-5 from 30 to 134 m/s, each degree more a third of it
FORCE_NODES = 8  # exact trims, at Chebyshev nodes in the logarithm of the speed: leave 3e-7
FITTED = 30  # speeds that the polynomials are fitted through, and as many between them where they are compared
COMPARED = 21  # speeds at which `agreement` compares them with exact trims
COMPARISON = 1.05  # times the stated error: a maximum met between the speeds at which it was stated
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


def speed_forces(problem, range: tuple[float, float], *, nodes: int = FORCE_NODES) -> dict[str, Any]:
    """Forces of one coil set in level flight over a range of speeds: the `forces` of a table's schedule.

    Polynomials of the speed, as printed, fitted to an interpolation between `nodes` exact trims; `relative_error` is
    the largest difference between the two, over the largest value of that number, plus what the interpolation leaves,
    measured between its nodes. A second for two trims.
    """
    from workbench.design.speed_family import force_numbers, speed_family

    def exact(u: float) -> dict[str, float]:
        speed = float(np.clip(np.exp(middle + u * half), low, high))
        return force_numbers(problem.at({"speed_m_s": speed}).vehicle.force_law)

    low, high = range
    middle, half = np.log(low * high) / 2, np.log(high / low) / 2
    places = np.cos((np.arange(nodes) + 0.5) * np.pi / nodes)
    found = [exact(float(u)) for u in places]
    names = [name for name in found[0] if name != "drag_ratio"]  # the inverse of "lift_to_drag", and not as smooth
    curves = np.polynomial.chebyshev.chebfit(places, [[one[name] for name in names] for one in found], nodes - 1)

    def numbers(speed: float) -> dict[str, float]:
        values = np.polynomial.chebyshev.chebval((np.log(speed) - middle) / half, curves)
        return dict(zip(names, map(float, values), strict=True))

    family = speed_family(numbers, (low, high), degree=FORCE_DEGREE, nodes=FITTED)
    between = exact(-1.0), exact(float(places[nodes // 2] + places[nodes // 2 - 1]) / 2), exact(1.0)
    speeds = low, float(np.exp(middle + half * (places[nodes // 2] + places[nodes // 2 - 1]) / 2)), high
    document = family.to_dict()
    for name in names:
        size = max(abs(one[name]) for one in found) or 1.0
        left = max(abs(numbers(v)[name] - one[name]) for v, one in zip(speeds, between, strict=True)) / size
        document["relative_error"][name] = float(f"{document['relative_error'][name] + left:.3g}")
    document["nodes"] = sorted((repr(float(np.exp(middle + u * half))) for u in places), key=float)
    return document


def force_difference(forces: dict[str, Any], problem, *, speeds: int = COMPARED) -> tuple[float, str]:
    """How far printed polynomials lie from a problem's coil forces, and what is farther off than the table states.

    The difference is the largest, relative to the largest value of its number; the sentence is empty if all are as
    stated. A second for two speeds.
    """
    from workbench.design.speed_family import force_numbers

    low, high = (float(v) for v in forces["range"])
    centre, scale = float(forces["centre"]), float(forces["scale"])
    places = np.linspace(low, high, speeds)
    found = [force_numbers(problem.at({"speed_m_s": float(v)}).vehicle.force_law) for v in places]
    largest, excess, sentence = 0.0, 0.0, ""
    for name, coefficients in forces["coefficients"].items():
        values = np.array([one[name] for one in found])
        printed = np.polynomial.polynomial.polyval((places - centre) / scale, [float(c) for c in coefficients])
        off = np.abs(printed - values) / (np.abs(values).max() or 1.0)
        k, stated = int(np.argmax(off)), float(forces["relative_error"].get(name, 0.0))
        largest = max(largest, float(off[k]))
        if off[k] - COMPARISON * stated - SAME > excess:
            excess = float(off[k] - COMPARISON * stated - SAME)
            sentence = f"{name!r} at {places[k]:.4g} m/s differs by {off[k]:.2g}, {stated:.2g} is stated"
    return largest, sentence


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
    force_difference : of a schedule, largest relative difference of the printed polynomials of the coil forces from the
        problem's, at 21 speeds; else None
    disagreements : one sentence for each thing that differs
    """

    problem: str
    data_sha256_ok: bool
    plant_difference: float | None
    disagreements: tuple[str, ...]
    force_difference: float | None = None

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
            *(
                [("largest difference of the forces over speed", self.force_difference, "of the largest value")]
                if self.force_difference is not None
                else []
            ),
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
        (p["name"].split(", heave")[0].split(", sway")[0], p["sense"], p["limit"])
        for p in document["promises"]
        if not p["box"]
    }
    lacking = [r for r in problem.requirements if (r.name, r.sense, r.limit) not in promised]
    if lacking:
        r = lacking[0]
        sentences.append(
            f"every requirement of {problem.name!r} must be promised; {r.name!r} {r.sense} {r.limit:g} is not"
        )
    forces = (document.get("schedule") or {}).get("forces")
    off = None
    if forces and same_data:
        off, wrong = force_difference(forces, problem)
        if wrong:
            sentences.append(f"the coil forces over speed must be those of {problem.name!r} as far as stated; {wrong}")
    return Agreement(
        problem=problem.name, data_sha256_ok=same_data, plant_difference=difference, disagreements=tuple(sentences),
        force_difference=off,
    )  # fmt: skip


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
