"""Groups of motion: heave and pitch move with symmetric currents, sway, roll and yaw with antisymmetric ones.

    commands u = patterns · v,   v of a group: its orthonormal current patterns

A vehicle with its sets in right-left pairs has one symmetric and one antisymmetric pattern per pair.
"""

from dataclasses import dataclass

import numpy as np

from workbench.errors import InputError, unknown_name

GROUPS = ("heave_pitch", "sway_roll_yaw")


@dataclass(frozen=True, slots=True)
class Group:
    """One group: its coordinates, the modal channels that steer it, and its current patterns (n, k), orthonormal."""

    name: str
    coordinates: tuple[str, ...]
    channels: tuple[str, ...]
    patterns: np.ndarray


def group(name: str, positions: tuple[tuple[float, float], ...]) -> Group:
    """The named group of a vehicle with coil sets at (x, y)."""
    if name == "heave_pitch":
        return Group(name, ("Z", "Theta"), ("heave", "pitch"), _patterns(positions, +1))
    if name == "sway_roll_yaw":
        return Group(name, ("Y", "Phi", "Psi"), ("roll", "sway", "yaw"), _patterns(positions, -1))
    raise unknown_name("group", name, GROUPS)


def _patterns(positions, parity: int) -> np.ndarray:
    stations = sorted({x for x, _ in positions}, reverse=True)
    columns = []
    for x in stations:
        column = np.array([(1.0 if y > 0 else float(parity)) if at == x else 0.0 for at, y in positions])
        if column.sum() != (2.0 if parity > 0 else 0.0):
            raise InputError(f"coil sets must come in right-left pairs; at x = {x} m they do not. Give every set its mirror image.")
        columns.append(column / np.sqrt(2.0))
    pairs = np.column_stack(columns)
    # sum and difference of the pairs, so that the first pattern moves all sets alike
    if pairs.shape[1] == 2:
        pairs = pairs @ np.array([[1, 1], [1, -1]]) / np.sqrt(2.0)
    return pairs
