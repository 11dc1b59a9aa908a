"""What a proof needs of a gain table, in exact rationals: gains, law, plant, what it is driven by, what is promised.

document --table_of--> Table: every part checked for type, shape and size; one sentence names what is not usable
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from flint import fmpq, fmpq_mat

from workbench.verify.failure import TableError
from workbench.verify.law import GAIN_NAMES, GROUPS, Actuator, Law
from workbench.verify.physics import Physics
from workbench.verify.reading import as_printed, decimal, entries_of, mapping, matrix_of, number, optional, text_of
from workbench.verify.system import System

MOST_STATES = 60  # the vehicles have 10 to 18; beyond this a proof would take minutes
MOST_SIGNALS = 200
MOST_PROMISES = 500
TYPES = ("A1", "A2", "A3", "A4")
TIME_CONSTANTS = ("tau_h", "tau_hp", "tau_z", "tau_y")


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
class Undecided:
    """What a table says it does not promise over a box: a limit, the share of the box it stays open on, and why."""

    name: str
    sense: str
    limit: fmpq
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
    requirements: tuple[tuple[str, str, fmpq], ...]  # name, sense, limit
    certificate: Certificate | None
    schedule: Mapping[str, Any] | None
    undecided: tuple[Undecided, ...]


def table_of(document: Mapping[str, Any]) -> Table:
    """The checked parts of a document.

    Raises
    ------
    TableError
        If a part is missing, of the wrong type, shape or size; the sentence names it.
    """
    gains = mapping(document.get("gains"), "gains")
    if sorted(gains) != sorted(GAIN_NAMES):
        wrong = sorted(set(gains) ^ set(GAIN_NAMES))
        raise TableError(f"gains must be the seventeen names; {str(wrong[0])[:40]!r} is missing or unknown. Mend it.")
    values = {name: decimal(gains[name], f"gains.{name}") for name in GAIN_NAMES}
    for name in TIME_CONSTANTS:
        if values[name] < 0:
            raise TableError(f"gains.{name} must not be negative; got {gains[name][:40]}. Get the table again.")
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
    )  # fmt: skip


def _names(value: Any, place: str, most: int) -> tuple[str, ...]:
    names = tuple(text_of(name, place) for name in entries_of(value, place, most, 1))
    if len(set(names)) < len(names):
        raise TableError(f"{place} must be distinct names; one is given twice. Get the table again from its source.")
    return names


def _law(value: Any) -> Law:
    law = mapping(value, "law")
    places = []
    for i, pair in enumerate(entries_of(law.get("positions_m"), "law.positions_m", 100, 4)):
        x, y = (decimal(c, f"law.positions_m.{i}") for c in entries_of(pair, f"law.positions_m.{i}", 2, 2))
        if y == 0:
            raise TableError(f"law.positions_m.{i} must lie on one side, y ≠ 0; got y = 0. Get the table again.")
        places.append((x, y))
    actuators = []
    for i, one in enumerate(entries_of(law.get("actuators"), "law.actuators", 2)):
        a, place = mapping(one, f"law.actuators.{i}"), f"law.actuators.{i}"
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
    plant = mapping(value, "plant")
    states = _names(plant.get("states"), "plant.states", MOST_STATES)
    inputs = _names(plant.get("inputs"), "plant.inputs", MOST_SIGNALS)
    outputs = _names(plant.get("outputs"), "plant.outputs", MOST_SIGNALS)
    shapes = {"A": (states, states), "B": (states, inputs), "C": (outputs, states), "D": (outputs, inputs)}
    read = {}
    for name, (rows, columns) in shapes.items():
        read[name] = matrix_of(plant.get(name), f"plant.{name}", len(rows), len(columns))
    return System(**read, states=states, inputs=inputs, outputs=outputs)


def _promise(value: Any, place: str) -> Promise:
    p = mapping(value, place)
    if p.get("sense") not in ("<=", ">="):
        raise TableError(f"{place}.sense must be '<=' or '>='; got {str(p.get('sense'))[:40]!r}. Get the table again.")
    ends = [number(x, f"{place}.enclosure") for x in entries_of(p.get("enclosure"), f"{place}.enclosure", 2, 2)]
    box = {}
    for name, interval in mapping(p.get("box"), f"{place}.box").items():
        low, high = (as_printed(x, f"{place}.box") for x in entries_of(interval, f"{place}.box", 2, 2))
        box[name] = (low, high)
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


def _requirement(value: Any, place: str) -> tuple[str, str, fmpq]:
    r = mapping(value, place)
    return (
        text_of(r.get("name"), f"{place}.name"),
        text_of(r.get("sense"), f"{place}.sense"),
        number(r.get("limit"), f"{place}.limit"),
    )


def _undecided(value: Any, place: str) -> Undecided:
    u = mapping(value, place)
    return Undecided(
        text_of(u.get("name"), f"{place}.name"), text_of(u.get("sense"), f"{place}.sense"),
        number(u.get("limit"), f"{place}.limit"), number(u.get("share"), f"{place}.share"),
        text_of(u.get("reason"), f"{place}.reason"),
    )  # fmt: skip


def _certificate(value: Any) -> Certificate:
    c = mapping(value, "certificate")
    groups = _names(c.get("groups"), "certificate.groups", len(GROUPS))
    unknown = [name for name in groups if name not in GROUPS]
    if unknown:
        raise TableError(f"certificate.groups must be of {', '.join(GROUPS)}; got {unknown[0][:40]!r}. Mend it.")
    s = mapping(c.get("sensors"), "certificate.sensors")
    keys = ("accelerometer_bias_m_s2", "gap_noise_m_per_root_hz", "acceleration_noise_m_s2_per_root_hz")
    return Certificate(
        groups=groups,
        guideway=optional(c.get("guideway"), _guideway),
        sensors=Sensors(*(decimal(s.get(key), f"certificate.sensors.{key}") for key in keys)),
        motor=optional(c.get("motor"), _motor),
        physics=optional(c.get("physics"), Physics.read),
    )


def _motor(value: Any) -> Motor:
    m = mapping(value, "certificate.motor")
    return Motor(*(decimal(m.get(k), f"certificate.motor.{k}") for k in ("rated_current_a", "working_current_a")))


def _guideway(value: Any) -> Guideway:
    g, place = mapping(value, "certificate.guideway"), "certificate.guideway"
    speed = decimal(g.get("speed_m_s"), f"{place}.speed_m_s")
    spectra = {}
    for name, one in mapping(g.get("spectra"), f"{place}.spectra").items():
        s, at = mapping(one, f"{place}.spectra"), f"{place}.spectra.{name[:20]}"
        corners = tuple(
            decimal(x, f"{at}.corners") for x in entries_of(s.get("corners_rad_m"), f"{at}.corners_rad_m", 3, 1)
        )
        strength, zeros = decimal(s.get("strength"), f"{at}.strength"), s.get("zeros")
        if (
            name not in TYPES
            or strength < 0
            or min(corners) <= 0
            or type(zeros) is not int
            or not 0 <= zeros < len(corners)
        ):
            raise TableError(
                f"{at} must be A1 … A4 with a strength, positive corners and fewer zeros than corners; "
                "it is not. Get the table again."
            )
        spectra[name] = Spectrum(strength, corners, zeros)
    if not speed > 0 or not spectra:
        raise TableError(f"{place} must have a positive speed and a spectrum; it has not. Get the table again.")
    correlation = optional(g.get("correlation"), lambda m: matrix_of(m, f"{place}.correlation", 4, 4))
    return Guideway(speed, spectra, correlation)
