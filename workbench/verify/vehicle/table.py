"""What a proof needs of a gain table, in exact rationals: gains, law, plant, what it is driven by, what is promised.

document --table_of--> Table: every part checked for type, shape and size; one sentence names what is not usable
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

from flint import fmpq, fmpq_mat

from workbench.verify.exact.failure import TableError
from workbench.verify.exact.system import System, part
from workbench.verify.reading import (
    as_printed,
    decimal,
    entries_of,
    keyed,
    mapping,
    matrix_of,
    number,
    optional,
    text_of,
)
from workbench.verify.vehicle.kind import TOGETHER, kind_of
from workbench.verify.vehicle.law import GAIN_NAMES, GROUPS, Actuator, Law
from workbench.verify.vehicle.physics import Physics

MOST_STATES = 60  # the vehicles have 10 to 18; beyond this a proof would take minutes
MOST_SIGNALS = 200
MOST_PROMISES = 500
TYPES = ("A1", "A2", "A3", "A4")
TIME_CONSTANTS = ("tau_h", "tau_hp", "tau_z", "tau_y")
UNITS = {"K_h": "1/m", "K_hdot": "s/m", "tau_h": "s", "K_hp": "1/m", "K_hpdot": "s/m", "tau_hp": "s"} | {
    **dict.fromkeys(("K_zddot", "K_yddot"), "s²/m"), **dict.fromkeys(("K_zdot", "K_ydot"), "s/m"),
    **dict.fromkeys(("tau_z", "tau_y"), "s"),
    **dict.fromkeys(("K_heave", "K_pitch", "K_sway", "K_roll", "K_yaw"), "1"),
}  # fmt: skip
KEYS = (
    "format", "version", "problem", "title", "data_sha256", "created", "versions", "seed", "solver", "starts", "gains",
    "units", "invariance", "law", "plant", "measured", "requirements", "promises", "robustness", "digest",
)  # fmt: skip
LATER_KEYS = ("certificate", "schedule", "undecided")  # tables of the first weeks lack them


@dataclass(frozen=True, slots=True)
class Spectrum:
    """S(Ω) = strength · Ω^(2·zeros) / ∏ (Ω² + Ω_k²) of one type of irregularity [m²/(rad/m)]."""

    strength: fmpq
    corners: tuple[fmpq, ...]
    zeros: int


@dataclass(frozen=True, slots=True)
class Guideway:
    """Spectrum of each type that acts, at a speed; correlation of A1 … A4 if they are not independent."""

    speed: fmpq
    spectra: Mapping[str, Spectrum]
    correlation: fmpq_mat | None


@dataclass(frozen=True, slots=True)
class Sensors:
    """Constant error of an accelerometer [m/s²]; noise densities of gap sensors and accelerometers, one-sided."""

    bias: fmpq
    gap_noise: fmpq
    acceleration_noise: fmpq


@dataclass(frozen=True, slots=True)
class Motor:
    """Rated and working current of a motor whose commands count in rated currents [A]."""

    rated: fmpq
    working: fmpq


@dataclass(frozen=True, slots=True)
class Certificate:
    """What the promises rest on besides gains, law and plant."""

    groups: tuple[str, ...]
    guideway: Guideway | None
    sensors: Sensors
    motor: Motor | None
    physics: Physics | None


@dataclass(frozen=True, slots=True)
class Promise:
    """One promise as it stands in the table; `at`: the member of the box that is said to attain its end."""

    name: str
    sense: str
    limit: fmpq
    low: fmpq
    high: fmpq
    method: str
    box: Mapping[str, tuple[fmpq, fmpq]]
    at: Mapping[str, fmpq]


@dataclass(frozen=True, slots=True)
class Requirement:
    """One requirement as it stands in the table, with the value the author says it has; None for an unstable loop."""

    name: str
    sense: str
    limit: fmpq
    value: fmpq | None
    unit: str
    met: bool
    where: str


@dataclass(frozen=True, slots=True)
class Undecided:
    """What a table says it does not promise over a box: a limit, the share of the box it stays open on, and why."""

    name: str
    sense: str
    limit: fmpq
    box: Mapping[str, tuple[fmpq, fmpq]]
    share: fmpq
    reason: str


@dataclass(frozen=True, slots=True)
class Table:
    """The parts of a gain table that proofs start from."""

    problem: str
    data_sha256: str
    digest: str
    gains: dict[str, fmpq]
    law: Law
    plant: System
    promises: tuple[Promise, ...]
    requirements: tuple[Requirement, ...]
    certificate: Certificate | None
    schedule: Mapping[str, Any] | None
    undecided: tuple[Undecided, ...]
    measured: Mapping[str, Any]  # figures as the author states them; `statement` derives them again
    robustness: Mapping[str, Any]


def table_of(document: Mapping[str, Any]) -> Table:
    """The checked parts of a document.

    Raises
    ------
    TableError
        If a part is missing, of the wrong type, shape or size; the sentence names it.
    """
    keyed(document, "the table", KEYS, LATER_KEYS)
    gains = mapping(document.get("gains"), "gains")
    if sorted(gains) != sorted(GAIN_NAMES):
        wrong = sorted(set(gains) ^ set(GAIN_NAMES))
        raise TableError(f"gains must be the seventeen names; {str(wrong[0])[:40]!r} is missing or unknown. Mend it.")
    values = {name: decimal(gains[name], f"gains.{name}") for name in GAIN_NAMES}
    for name in TIME_CONSTANTS:
        if values[name] < 0:
            raise TableError(f"gains.{name} must not be negative; got {gains[name][:40]}. Get the table again.")
    if document["units"] != UNITS:
        raise TableError("units must be those of the seventeen gains, in SI; they are not. Get the table again.")
    return Table(
        problem=text_of(document.get("problem"), "problem"),
        data_sha256=text_of(document.get("data_sha256"), "data_sha256"),
        digest=text_of(document.get("digest"), "digest"), gains=values, law=_law(document.get("law")),
        plant=plant_of(document.get("plant")),
        promises=tuple(_promise(p, f"promises.{i}") for i, p in enumerate(
            entries_of(document.get("promises"), "promises", MOST_PROMISES))),
        requirements=tuple(
            _requirement(r, f"requirements.{i}")
            for i, r in enumerate(entries_of(document.get("requirements"), "requirements", MOST_PROMISES))
        ),
        certificate=optional(document.get("certificate"), _certificate),
        schedule=optional(document.get("schedule"), lambda s: mapping(s, "schedule")),
        undecided=tuple(
            _undecided(u, f"undecided.{i}")
            for i, u in enumerate(entries_of(document.get("undecided", []), "undecided", MOST_PROMISES))
        ),
        measured=mapping(document.get("measured"), "measured"),
        robustness=mapping(document.get("robustness"), "robustness"),
    )  # fmt: skip


def _names(value: Any, place: str, most: int) -> tuple[str, ...]:
    names = tuple(text_of(name, place) for name in entries_of(value, place, most, 1))
    if len(set(names)) < len(names):
        raise TableError(f"{place} must be distinct names; one is given twice. Get the table again from its source.")
    return names


def _law(value: Any) -> Law:
    law = keyed(value, "law", ("positions_m", "depth_m", "actuators", "sample_time_s"))
    if not decimal(law["sample_time_s"], "law.sample_time_s") > 0:
        raise TableError("law.sample_time_s must be positive; it is not. Get the table again from its source.")
    places = []
    for i, pair in enumerate(entries_of(law.get("positions_m"), "law.positions_m", 100, 4)):
        x, y = (decimal(c, f"law.positions_m.{i}") for c in entries_of(pair, f"law.positions_m.{i}", 2, 2))
        if y == 0:
            raise TableError(f"law.positions_m.{i} must lie on one side, y ≠ 0; got y = 0. Get the table again.")
        places.append((x, y))
    actuators = []
    for i, one in enumerate(entries_of(law.get("actuators"), "law.actuators", 2)):
        place = f"law.actuators.{i}"
        a = keyed(one, place, ("name", "signal", "lever"))
        if a.get("signal") not in ("sway", "yaw") or a["signal"] in [other.signal for other in actuators]:
            raise TableError(f"{place}.signal must be 'sway' or 'yaw', each once; got {str(a.get('signal'))[:40]!r}.")
        actuators.append(
            Actuator(text_of(a.get("name"), f"{place}.name"), a["signal"], decimal(a.get("lever"), f"{place}.lever"))
        )
    return Law(tuple(places), decimal(law.get("depth_m"), "law.depth_m"), tuple(actuators))


def plant_of(value: Any) -> System:
    """The plant in exact rationals."""
    if value is None:
        raise TableError("a table to verify must hold its plant; this one has none. Write it with 'workbench design'.")
    plant = keyed(value, "plant", ("states", "inputs", "outputs", "A", "B", "C", "D"))
    states = _names(plant.get("states"), "plant.states", MOST_STATES)
    inputs = _names(plant.get("inputs"), "plant.inputs", MOST_SIGNALS)
    outputs = _names(plant.get("outputs"), "plant.outputs", MOST_SIGNALS)
    shapes = {"A": (states, states), "B": (states, inputs), "C": (outputs, states), "D": (outputs, inputs)}
    read = {}
    for name, (rows, columns) in shapes.items():
        read[name] = matrix_of(plant.get(name), f"plant.{name}", len(rows), len(columns))
    return System(**read, states=states, inputs=inputs, outputs=outputs)


def _promise(value: Any, place: str) -> Promise:
    p = keyed(value, place, ("name", "sense", "limit", "enclosure", "method", "box"), ("at",))
    _require_kind(p, place)
    ends = [number(x, f"{place}.enclosure") for x in entries_of(p.get("enclosure"), f"{place}.enclosure", 2, 2)]
    box = _box(p.get("box"), f"{place}.box")
    given = p.get("at")
    at = {} if given is None else mapping(given, f"{place}.at")
    for low, high in ((ends[0], ends[1]), *box.values()):
        if low > high:
            raise TableError(f"{place} must hold intervals from low to high; one is not. Get the table again.")
    return Promise(
        text_of(p.get("name"), f"{place}.name"), p["sense"], number(p.get("limit"), f"{place}.limit"), ends[0], ends[1],
        text_of(p.get("method"), f"{place}.method"), box,
        {name: as_printed(value, f"{place}.at") for name, value in at.items()},
    )  # fmt: skip


def _box(value: Any, place: str) -> dict[str, tuple[fmpq, fmpq]]:
    """Name to [lowest, highest] factor."""
    box = {}
    for name, interval in mapping(value, place).items():
        low, high = (as_printed(x, place) for x in entries_of(interval, place, 2, 2))
        box[name] = (low, high)
    return box


def _require_kind(given: Mapping[str, Any], place: str) -> None:
    """A promise or requirement of a known kind has the sense of its kind; one of another kind is read, not proved."""
    name, sense = text_of(given.get("name"), f"{place}.name"), given.get("sense")
    kind = kind_of(name)
    if sense not in ((kind.sense,) if kind else ("<=", ">=")):
        raise TableError(
            f"{place}.sense must be {kind.sense if kind else '<= or >='!r}, as of every limit on {name[:60]!r}; got "
            f"{str(sense)[:40]!r}. Get the table again from its source."
        )


def _requirement(value: Any, place: str) -> Requirement:
    r = keyed(value, place, ("name", "sense", "limit", "value", "unit", "met", "where"))
    _require_kind(r, place)
    kind = kind_of(r["name"])
    known = kind is None or (kind.name == r["name"] and r["unit"] == kind.unit)
    if not known or type(r["met"]) is not bool or type(r["unit"]) is not str:
        raise TableError(
            f"{place} must be a requirement with its unit, met or not; got {r['name'][:60]!r} in "
            f"{str(r['unit'])[:20]!r}. Get the table again from its source."
        )
    return Requirement(
        r["name"], r["sense"], number(r["limit"], f"{place}.limit"),
        optional(r["value"], lambda v: number(v, f"{place}.value")), r["unit"], r["met"],
        text_of(r["where"], f"{place}.where"),
    )  # fmt: skip


def _undecided(value: Any, place: str) -> Undecided:
    u = keyed(value, place, ("name", "sense", "limit", "box", "share", "reason"))
    _require_kind(u, place)
    share = number(u["share"], f"{place}.share")
    if not 0 <= share <= 1:
        raise TableError(f"{place}.share must lie in 0 … 1; got {float(share):g}. Get the table again.")
    return Undecided(
        u["name"], u["sense"], number(u["limit"], f"{place}.limit"), _box(u["box"], f"{place}.box"), share,
        text_of(u["reason"], f"{place}.reason"),
    )  # fmt: skip


def _certificate(value: Any) -> Certificate:
    c = keyed(value, "certificate", ("groups", "guideway", "sensors", "motor", "physics"))
    groups = _names(c.get("groups"), "certificate.groups", len(GROUPS))
    unknown = [name for name in groups if name not in GROUPS]
    if unknown:
        raise TableError(f"certificate.groups must be of {', '.join(GROUPS)}; got {unknown[0][:40]!r}. Mend it.")
    if set(groups) not in TOGETHER:
        raise TableError(
            f"certificate.groups must move each motion once; got {', '.join(groups)}. Get the table again."
        )
    keys = ("accelerometer_bias_m_s2", "gap_noise_m_per_root_hz", "acceleration_noise_m_s2_per_root_hz")
    s = keyed(c.get("sensors"), "certificate.sensors", keys)
    if any(decimal(s[key], f"certificate.sensors.{key}") < 0 for key in keys):
        raise TableError("certificate.sensors must hold no negative bias or noise; one is. Get the table again.")
    return Certificate(
        groups=groups,
        guideway=optional(c.get("guideway"), _guideway),
        sensors=Sensors(*(decimal(s.get(key), f"certificate.sensors.{key}") for key in keys)),
        motor=optional(c.get("motor"), _motor),
        physics=optional(c.get("physics"), Physics.read),
    )


def _motor(value: Any) -> Motor:
    keys = ("rated_current_a", "working_current_a")
    m = keyed(value, "certificate.motor", keys)
    motor = Motor(*(decimal(m[k], f"certificate.motor.{k}") for k in keys))
    if not (motor.rated > 0 and motor.working >= 0):
        raise TableError("certificate.motor must hold a positive rated and no negative working current. Mend it there.")
    return motor


def _guideway(value: Any) -> Guideway:
    place = "certificate.guideway"
    g = keyed(value, place, ("speed_m_s", "spectra", "correlation"))
    speed = decimal(g.get("speed_m_s"), f"{place}.speed_m_s")
    spectra = {}
    for name, one in mapping(g.get("spectra"), f"{place}.spectra").items():
        at = f"{place}.spectra.{name[:20]}"
        s = keyed(one, at, ("strength", "corners_rad_m", "zeros"))
        corners = tuple(
            decimal(x, f"{at}.corners") for x in entries_of(s.get("corners_rad_m"), f"{at}.corners_rad_m", 3, 1)
        )
        strength, zeros = decimal(s.get("strength"), f"{at}.strength"), s.get("zeros")
        if (
            name not in TYPES
            or not strength > 0
            or min(corners) <= 0
            or type(zeros) is not int
            or not 0 <= zeros < len(corners)
        ):
            raise TableError(
                f"{at} must be A1 … A4 with a positive strength, positive corners and fewer zeros than corners; "
                "it is not. Get the table again."
            )
        spectra[name] = Spectrum(strength, corners, zeros)
    if not speed > 0 or not spectra:
        raise TableError(f"{place} must have a positive speed and a spectrum; it has not. Get the table again.")
    correlation = optional(g.get("correlation"), lambda m: matrix_of(m, f"{place}.correlation", 4, 4))
    if correlation is not None and not _correlates(correlation):
        raise TableError(
            f"{place}.correlation must be symmetric with a diagonal of ones and no negative eigenvalue; it is not. "
            "Get the table again."
        )
    return Guideway(speed, spectra, correlation)


def _correlates(m: fmpq_mat) -> bool:
    """Whether a matrix can be one of correlations: no principal minor is negative."""
    n = m.nrows()
    if m != m.transpose() or any(m[i, i] != 1 for i in range(n)):
        return False
    subsets = (k for size in range(2, n + 1) for k in combinations(range(n), size))
    return all(part(m, k, k).det() >= 0 for k in subsets)
