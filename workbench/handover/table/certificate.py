"""What the proofs of a gain table rest on besides gains, law and plant, as decimals.

    Problem --certificate_of--> groups, guideway, sensors, motor, and the vehicle from which the plant follows
    Problem --speed_forces--> coil forces over the speeds of a schedule, as printed polynomials
    Problem, printed polynomials --force_difference--> how far these lie from the coils' own forces

The independent checker (`workbench.verify`) reads this part and nothing else of the problem. What it could not use is
left out (None): spectra without rational form, and vehicles whose plant it would not rebuild (a trim away from the
nominal pose, a lost set). The promises that need it are then floating point, and say so.
"""

from typing import Any

import numpy as np

from workbench.constants import GRAVITY
from workbench.lti import Plant
from workbench.physics.guideway.irregularity import TYPES
from workbench.physics.guideway.spectrum import PowerLaw, Rational

FORCE_DEGREE = 10  # of the printed polynomials: leaves 4e-6 from 30 to 134 m/s, each degree more a third of it
FORCE_NODES = 8  # exact trims, at Chebyshev nodes in the logarithm of the speed: leave 3e-7
FITTED = 30  # speeds that the polynomials are fitted through, and as many between them where they are compared
COMPARED = 21  # speeds at which `agreement` compares them with exact trims
COMPARISON = 1.05  # times the stated error: a maximum met between the speeds at which it was stated
ROUNDED = 1e-12  # of the largest entry in a row: what doubles leave where right and left are the same
NOUGHT = 1e-20  # of the same: no double of a sum is so small but where a zero belongs
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
        else {"rated_current_a": _decimal(motor.rated_current), "working_current_a": _decimal(motor.working_current)},
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
    from workbench.physics.vehicle import Vehicle

    vehicle = problem.vehicle
    if not isinstance(vehicle, Vehicle):
        return None
    law, extras = vehicle.force_law, vehicle.extras
    lift, lateral, moment = _decimals(np.hstack(law.tangent(np.zeros((3, 1)), np.zeros(1))))
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
    from workbench.verify.vehicle.physics import Physics, differences

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
    # Chebyshev's points: between equal steps a polynomial can be five times as far off as at them, here hardly farther
    places = (low + high) / 2 + (high - low) / 2 * np.cos(np.arange(speeds) * np.pi / (speeds - 1))
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
    """The plant as the checker takes it from the printed decimals: `workbench.verify.exact.system.System`."""
    from workbench.verify.vehicle.table import plant_of

    return plant_of(plant_part(plant))


def plant_part(plant: Plant, positions=(), sets=()) -> dict[str, Any]:
    """The plant part of a gain table.

    positions, sets : (x, y) of commands, and of coil sets where several share one; where the plant is the same right
        and left but for rounding, it is printed so in every digit, for only then may its groups be proved apart
    """
    blocks = _symmetric(plant, positions, sets) if positions else {k: getattr(plant, k) for k in "ABCD"}
    matrices = {k: [[_decimal(x) for x in row] for row in block] for k, block in blocks.items()}
    return {"states": list(plant.states), "inputs": list(plant.inputs), "outputs": list(plant.outputs), **matrices}


def _symmetric(plant: Plant, positions, sets) -> dict[str, np.ndarray]:
    """The plant's matrices, each entry the mean of itself and its mirror image where they differ by rounding alone."""
    from workbench.verify.exact.failure import NotProved
    from workbench.verify.vehicle.mirror import BLOCKS, mirror

    blocks = {letter: np.asarray(getattr(plant, letter), float) for letter in "ABCD"}
    try:
        turned = {kind: mirror(getattr(plant, kind), positions, sets) for kind in ("states", "inputs", "outputs")}
    except NotProved:  # no partner on the other side: nothing to make alike
        return blocks
    out = {}
    for letter, row_kind, column_kind in BLOCKS:
        (rows, row_signs), (columns, column_signs) = (
            (np.array([k for k, _ in turned[kind]], int), np.array([s for _, s in turned[kind]], float))
            for kind in (row_kind, column_kind)
        )
        own = blocks[letter]
        other = row_signs[:, None] * own[np.ix_(rows, columns)] * column_signs
        size = np.abs(own).max(axis=1, keepdims=True, initial=0.0)
        if np.any(np.abs(own - other) > ROUNDED * size):
            return blocks  # a vehicle that differs from right to left
        mean = (own + other) / 2 + 0.0  # no negative zeros
        out[letter] = np.where(np.abs(mean) < NOUGHT * size, 0.0, mean)
    return out
