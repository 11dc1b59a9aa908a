"""Numbers of a data file by their dotted paths: "model.0.A.0.0", or "factor.model.0.A.0.0" for a multiple of it."""

import copy
from collections.abc import Mapping
from typing import Any

FACTOR = "factor."  # before the path of a number: its value is multiplied


def numbers(document: Mapping[str, Any]) -> dict[str, float]:
    """Dotted path to value of every number."""
    out: dict[str, float] = {}

    def walk(value: Any, path: str) -> None:
        if isinstance(value, Mapping | list):
            pairs = value.items() if isinstance(value, Mapping) else enumerate(value)
            for key, item in pairs:
                walk(item, f"{path}.{key}" if path else str(key))
        elif isinstance(value, int | float) and not isinstance(value, bool):
            out[path] = value

    walk(document, "")
    return out


def with_numbers(document: Mapping[str, Any], changes: Mapping[str, float]) -> dict[str, Any]:
    """A copy with numbers changed; the paths are there (`numbers`)."""
    out: Any = copy.deepcopy(dict(document))
    for name, value in changes.items():
        *way, last = name.removeprefix(FACTOR).split(".")
        at = out
        for step in way:
            at = at[int(step)] if isinstance(at, list) else at[step]
        place: Any = int(last) if isinstance(at, list) else last
        value = value * at[place] if name.startswith(FACTOR) else value
        at[place] = int(value) if isinstance(at[place], int) and float(value).is_integer() else float(value)
    return out
