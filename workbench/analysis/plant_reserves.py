"""What the loops of any plant keep in reserve: changed in one thing, or as a computer runs them.

    Loop, Change --that signal times a factor--> Loop --K--> damping, decay, peak of S at the commands
    Loop, (T, samples of delay) --held, exact between samples; Tustin--> Loop --sampled K--> the same

Of several models each figure is that of the worst. Source: guide, Definitions: Variations and losses; Sampled loop.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from workbench.analysis.break_points import ALL, Break
from workbench.analysis.change import COMMAND, KINDS, SENSOR, VEHICLE, Change
from workbench.analysis.loop_channel import lined
from workbench.analysis.sampled_cases import CASES, PASSED, SampledCase
from workbench.analysis.variations import Varied, damping_of
from workbench.control.structure.block import Controller
from workbench.control.structure.loop import Loop
from workbench.control.structure.structure import Structure
from workbench.errors import InputError, unknown_name
from workbench.lti.hold import held
from workbench.lti.measure import beyond, peak

MOST_LISTED = 500  # samples of a dead time in a listed case: each is a state, and faster sampling changes nothing more
LISTED = ("scale", "lost", "dead", "weak")  # a stuck sensor is a dead one, and one that drifts changes no root


def points_of_loop(loop: Loop) -> Mapping[Break, tuple[str, ...]]:
    """Break points of a loop and the signals broken there: each alone, and all commands or all sensors at once."""
    kinds = {"command": loop.commands, "sensor": loop.sensors}
    kinds["signal"] = tuple(name for name in loop.analysis_points if not any(name in own for own in kinds.values()))
    found = {Break(kind, name): (name,) for kind, own in kinds.items() for name in own}
    return found | {Break(ALL, f"{kind}s"): own for kind, own in kinds.items() if len(own) > 1}


def listed(loop: Loop) -> tuple[Change, ...]:
    """The changes that an analysis of a loop lists."""
    found = []
    for kind in LISTED:
        amounts = KINDS[kind].amounts or (None,)
        names = loop.sensors if KINDS[kind].on == SENSOR else loop.commands
        found += [Change(kind, name, amount) for name in names for amount in amounts]
    return tuple(found)


def check_change(loop: Loop, change: Change) -> None:
    """Refuses a change on what a loop does not have."""
    if change.on == VEHICLE:
        raise InputError(
            f"the variation {change.name!r} is one of a vehicle; a plant of its own has those of its signals, such as "
            f"{', '.join(c.name for c in listed(loop)[:3])}. Other plants are models of their own."
        )
    names = loop.sensors if change.on == SENSOR else loop.commands
    if change.target not in names:
        raise unknown_name("variation", change.name, [replace(change, target=name).name for name in names])


def changed(loop: Loop, change: Change) -> Loop:
    """The loop with one signal times a factor; a loss may leave it unstable whatever the controller."""
    factor = {change.target: change.factor}
    scaled = loop.model.scaled(inputs=factor) if change.on == COMMAND else loop.model.scaled(outputs=factor)
    return Loop(scaled, loop.structure, checked=False)


def sampled(loop: Loop, sample_time: float, delay_samples: float) -> Loop:
    """The loop that a computer closes, exact between the samples; its controller is the structure's, by Tustin's rule.

    Raises InputError where no finite number of samples holds a dead time, or the model is sampled otherwise.
    """
    model = held(loop.model, sample_time, delay_samples * sample_time)
    return Loop(model, _sampled(loop.structure, sample_time), checked=False)


def _sampled(structure: Structure, sample_time: float) -> Structure:
    return structure if structure.sample_time is not None else structure.sampled(sample_time)


def variations(loops: Sequence[Loop], K: Controller, changes: Sequence[Change] | None = None) -> tuple[Varied, ...]:
    """The loops of every model under each change; under those listed if left out."""
    every = listed(loops[0]) if changes is None else changes
    return tuple(_varied(change, [changed(loop, change) for loop in loops], K) for change in every)


def _varied(change: Change, loops: Sequence[Loop], K: Controller) -> Varied:
    damping, decay, peaks = _figures(_located(loops, K), K)
    return Varied(name=change.name, damping=damping, decay=decay, peaks=peaks)


def sampled_cases(
    loops: Sequence[Loop], structure: Structure, own: Sequence[tuple[float, float]] = ()
) -> tuple[SampledCase, ...]:
    """The loops at every sample time [s] and delay [samples] of `CASES`, and at their own ones.

    A sampled plant has its own sample time alone; a listed case that takes more than `MOST_LISTED` samples of a dead
    time is left out. A case without numbers cannot be: a filter faster than the sampling,
    a dead time of more samples than are held.
    """
    h = loops[0].sample_time
    longest = max((line.dead_time for loop in loops for line in loop.model.lines), default=0.0)
    usual = [case for case in CASES if longest <= MOST_LISTED * case[0]]
    cases = (*usual, *own) if h is None else ((h, 0.0), (h, 1.0))
    return tuple(_case(loops, structure, *case) for case in dict.fromkeys(cases))


def _case(loops: Sequence[Loop], structure: Structure, sample_time: float, delay: float) -> SampledCase:
    damping = decay = None
    peaks: dict[str, float | None] = dict.fromkeys(loop.name for loop in loops)
    try:
        K = _sampled(structure, sample_time).controller()
        there = _located([sampled(loop, sample_time, delay) for loop in loops], K)
    except InputError:
        pass
    else:
        damping, decay, peaks = _figures(there, K)
    return SampledCase(
        sample_time=sample_time, delay_samples=delay, damping=damping, decay=decay, peak_sensitivity=peaks
    )


def _located(loops: Sequence[Loop], K: Controller) -> list[tuple[Loop, np.ndarray]]:
    """The loops and their poles (k,), with dead times those that are located."""
    return [(loop, np.asarray(loop.poles(K), complex)) for loop in loops]


def _figures(found: Sequence[tuple[Loop, np.ndarray]], K: Controller) -> tuple[float, float, dict[str, float | None]]:
    """Least damping and decay of loops with their poles, and the peak of S of each by its name."""
    roots = [_roots(poles, loop.sample_time) for loop, poles in found]
    peaks = {loop.name: _peak(loop, K, poles) for loop, poles in found}
    return min(damping for damping, _ in roots), min(decay for _, decay in roots), peaks


def _roots(poles: np.ndarray, h: float | None) -> tuple[float, float]:
    """Damping and decay of a loop with poles (k,)."""
    if h is not None:
        poles = np.log(poles[np.abs(poles) > PASSED]) / h
    return (damping_of(poles), float(0.0 - poles.real.max())) if len(poles) else (1.0, float("inf"))


def _peak(loop: Loop, K: Controller, poles: np.ndarray) -> float | None:
    """The peak of S at all commands; None if unstable, which dead times leave to a count."""
    unstable = loop.unstable_poles(K) if loop.model.delayed else beyond(poles, loop.sample_time)
    return None if unstable or not loop.commands else peak(lined(loop.sensitivity(loop.commands), K)).upper
