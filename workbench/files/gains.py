"""Gains from files: a mapping of the seventeen names, a gain table, a schedule in one.

path --digest checked where there is one--> Gains | Schedule | None
"""

from pathlib import Path

from workbench.control import Gains
from workbench.control.schedule import Schedule
from workbench.errors import InputError
from workbench.files.digest import check_digest
from workbench.machine.reading import read_mapping


def read_gains(path: Path, *, speed: float | None = None) -> Gains:
    """Gains from a gain table, unchanged since it was signed, or from a TOML or JSON mapping of the seventeen names.

    speed : where a table holds a schedule, the speed [m/s] its gains are taken at; those of the table if left out
    """
    mapping = _unchanged(path)
    inner = mapping.get("gains", mapping)
    if not isinstance(inner, dict):
        raise InputError(f"'gains' in {path} must be a mapping of the seventeen names; got a {type(inner).__name__}.")
    try:
        if speed is not None and mapping.get("schedule") is not None:
            return Schedule.from_dict(mapping["schedule"]).gains_at(speed)
        return Gains.from_mapping({name: _number(name, value) for name, value in inner.items()})
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def read_schedule(path: Path) -> Schedule | None:
    """The schedule in a gain table; None where it holds one set of gains."""
    part = _unchanged(path).get("schedule")
    return None if part is None else Schedule.from_dict(part)


def _unchanged(path: Path) -> dict:
    """The mapping in a file; where it is a gain table, with the digest that belongs to it."""
    mapping = read_mapping(path)
    if "digest" in mapping or "format" in mapping:
        check_digest(mapping, path)
    return mapping


def approved_gains(path: Path, speed: float) -> Gains | None:
    """The approved gains at a speed; None where an approved schedule does not reach it."""
    schedule = read_schedule(path)
    if schedule is None:
        return read_gains(path)
    low, high = schedule.range
    return schedule.gains_at(speed) if low <= speed <= high else None


def _number(name: str, value) -> float:
    if isinstance(value, str):  # decimal strings carry the exact digits that a certificate speaks about
        try:
            return float(value)
        except ValueError as error:
            raise InputError(f"{name} must be a number; got {value[:60]!r}.") from error
    return value
