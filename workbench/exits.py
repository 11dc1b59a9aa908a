"""Doors upwards: what a record hands to a room above it, by the door's name.

    record on a lower floor --through("table")--> function of an upper room, imported when the door is first used

The face (`workbench/__init__.py`, which every import runs) names what stands behind each door; no room imports upwards.
"""

from collections.abc import Callable

TYPE_CHECKING = False  # `typing` would be most of what an import of the workbench costs
if TYPE_CHECKING:
    from typing import Any

_doors: "dict[str, Callable[[], Callable[..., Any]]]" = {}


def opened(name: str, find: "Callable[[], Callable[..., Any]]") -> None:
    """Sets what stands behind a door; find : imports it and hands it over."""
    _doors[name] = find


def through(name: str) -> "Callable[..., Any]":
    """The function behind a door."""
    return _doors[name]()
