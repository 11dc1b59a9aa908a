"""Whether a data file states a vehicle or a plant of its own: the one question asked before either is read."""

from collections.abc import Mapping
from typing import Any

OF_A_VEHICLE = ("vehicle", "inertia", "force_law", "physics", "guideway")  # one of these makes a file a vehicle's


def is_own(document: Mapping[str, Any]) -> bool:
    """Whether a document states a plant of its own, and not a vehicle."""
    return not any(key in document for key in OF_A_VEHICLE)
