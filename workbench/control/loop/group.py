"""Groups of motion: heave and pitch move with symmetric currents, sway, roll and yaw with antisymmetric ones.

    commands u = patterns · v,   v of a group: its orthonormal current patterns

A vehicle with its sets in right-left pairs has one symmetric and one antisymmetric pattern per pair; an actuator on
each side adds an antisymmetric one, in the units of its commands.
"""

from dataclasses import dataclass, replace

import numpy as np

from workbench.control.law import MODAL, ModalLaw
from workbench.errors import InputError, unknown_name

UNUSED = 1e-9  # of the largest: a coil pattern that a law commands less than this is rounding
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


def commanded(name: str, law: ModalLaw, *, unused: bool = False) -> Group:
    """The named group with patterns over all commands of a law, (commands, k): coil patterns, then one per actuator.

    Of a law with actuators the coil patterns that it never commands are left out, unless `unused` asks for them.
    """
    coils = group(name, law.positions)
    if not law.split:
        return coils
    own = [MODAL.index(channel) for channel in coils.channels]
    spread = law.modal_spread()
    reach = np.abs(coils.patterns.T @ spread[: law.count, own]).max(axis=1)
    kept = coils.patterns if unused else coils.patterns[:, reach > UNUSED * reach.max()]
    pairs = [k for k, actuator in enumerate(law.actuators) if actuator.signal in coils.channels]
    out = np.zeros((len(law.commands), kept.shape[1] + len(pairs)))
    out[: law.count, : kept.shape[1]] = kept
    for column, k in enumerate(pairs, kept.shape[1]):
        out[law.count + 2 * k : law.count + 2 * k + 2, column] = np.array([1.0, -1.0]) / np.sqrt(2.0)
    return replace(coils, patterns=out)


def _patterns(positions, parity: int) -> np.ndarray:
    stations = sorted({x for x, _ in positions}, reverse=True)
    columns = []
    for x in stations:
        column = np.array([(1.0 if y > 0 else float(parity)) if at == x else 0.0 for at, y in positions])
        if column.sum() != (2.0 if parity > 0 else 0.0):
            raise InputError(
                f"coil sets must come in right-left pairs; at x = {x} m they do not. Give every set its mirror image."
            )
        columns.append(column / np.sqrt(2.0))
    pairs = np.column_stack(columns)
    # sum and difference of the pairs, so that the first pattern moves all sets alike
    if pairs.shape[1] == 2:
        pairs = pairs @ np.array([[1, 1], [1, -1]]) / np.sqrt(2.0)
    return pairs
