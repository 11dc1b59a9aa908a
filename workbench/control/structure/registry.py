"""The kinds of blocks by name, so that a file or a gain table can say which one it means.

    kind, inputs, outputs, options, parameters by slot ──► make_block ──► Block (.kind, .options, .slots)

A slot is what a parameter is called in the formula of its kind ("Kp", "K_1_2"); the parameter may be called otherwise.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.control.gains import GAIN_NAMES, Gains
from workbench.control.law import Actuator, ModalLaw
from workbench.control.structure import blocks, space
from workbench.control.structure.block import Block, Parameter, Plain, plain
from workbench.errors import InputError, unknown_name

Numbers = Mapping[str, float]  # by slot
LARGEST = 60  # inputs, outputs or states of a block that a file may ask for


@dataclass(frozen=True, slots=True)
class BlockKind:
    """A kind of block.

    make : (inputs, outputs, options, start of each slot that is given, name) → Block
    options : the options it knows, besides "tustin_s"
    signals : how many inputs and outputs it must have; None: any number from one
    """

    make: Callable[[tuple[str, ...], tuple[str, ...], Mapping[str, Plain], Numbers, str], Block]
    options: tuple[str, ...] = ()
    signals: tuple[int, int] | None = (1, 1)


def make_block(
    kind: str,
    inputs: Sequence[str],
    outputs: Sequence[str],
    options: Mapping[str, Plain],
    parameters: Mapping[str, Parameter | float] | Sequence[Parameter],
    *,
    name: str = "",
) -> Block:
    """The block of a kind.

    Parameters
    ----------
    kind : one of `BLOCKS`
    inputs, outputs : names; inputs may be signed sums
    options : as `Block.options` of the kind; those left out as the maker has them
    parameters : by slot, a start or a Parameter; slots left out as the maker has them. Or one Parameter for each slot
    name : goes before the names of parameters that are no Parameter, as in the makers

    Raises
    ------
    InputError
        For a kind, option or slot that is not known, and whatever the maker refuses.
    """
    if kind == "expression":
        raise InputError(
            "a block read from data must be of a kind that data can state; an expression's formula lives in the "
            f"program that made it. Take one of {', '.join(BLOCKS)}."
        )
    entry = BLOCKS.get(kind) if isinstance(kind, str) else None
    if entry is None:
        raise unknown_name("kind of block", str(kind), BLOCKS)
    for option in options:
        if option not in (*entry.options, "tustin_s"):
            raise unknown_name(f"option of {kind}", str(option), (*entry.options, "tustin_s"))
    inputs, outputs, options = tuple(inputs), tuple(outputs), {key: plain(value) for key, value in options.items()}
    if entry.signals not in (None, (len(inputs), len(outputs))) or max(len(inputs), len(outputs)) > LARGEST:
        ny, nu = entry.signals or (f"1 to {LARGEST}",) * 2
        raise InputError(f"a {kind} must have {ny} inputs and {nu} outputs; got {len(inputs)} and {len(outputs)}.")
    named = parameters if isinstance(parameters, Mapping) else {}
    starts = {slot: p if isinstance(p, Parameter) else _number(p, slot) for slot, p in named.items()}
    block = entry.make(inputs, outputs, options, starts, name)
    for slot in named:
        if slot not in block.slots:
            raise unknown_name(f"parameter of {kind}", slot, block.slots)
    placed = parameters if not isinstance(parameters, Mapping) else [
        _placed(old, named.get(slot)) for slot, old in zip(block.slots, block.parameters, strict=True)
    ]  # fmt: skip
    block = block.with_parameters(placed)
    step = options.get("tustin_s")
    return block if step is None else block.sampled(_positive(step, "tustin_s"))


def _placed(old: Parameter, given: Parameter | float | None) -> Parameter:
    if isinstance(given, Parameter):
        return given
    return old if given is None else replace(old, value=given)


def _scalar(maker: Callable[..., Block], *options: str, reads: int = 1) -> BlockKind:
    """The kind of a maker that takes its signals one by one and each parameter by its slot."""
    slots = set(maker.__kwdefaults__) - {"parts", "name"}

    def make(inputs, outputs, given, starts, name) -> Block:
        known = {slot: start for slot, start in starts.items() if slot in slots}
        texts = {option: given[option] for option in options if option in given}
        block = maker(*inputs, *outputs, **known, **texts, name=name)
        for slot, made in zip(block.slots, block.parameters, strict=True):
            value = _value(known.get(slot, made))
            if value != made.value:
                raise InputError(f"{slot} is not among the parts that the block has; got {value:g}. Leave it out.")
        return block

    return BlockKind(make, options, (reads, 1))


def _gain(inputs, outputs, options, starts, name) -> Block:
    return blocks.gain(inputs, outputs, mask=_mask(inputs, outputs, options), name=name)


def _pid_matrix(inputs, outputs, options, starts, name) -> Block:
    mask, Tf = _mask(inputs, outputs, options), starts.get("Tf", 0.01)
    return blocks.pid_matrix(inputs, outputs, mask=mask, Tf=Tf, name=name)


def _mask(inputs, outputs, options) -> Sequence:
    """The rows of a mask, all ones if left out."""
    mask = options.get("mask", [[1] * len(inputs)] * len(outputs))
    rows = mask if isinstance(mask, Sequence) and all(isinstance(row, list) for row in mask) else [[mask]]
    if any(entry not in (0, 1) for row in rows for entry in row) or {len(r) for r in rows} != {len(inputs)}:
        raise InputError(f"a mask must have {len(outputs)} rows of {len(inputs)} entries 0 or 1; got {str(mask)[:60]}.")
    return rows


def _state_space(inputs, outputs, options, starts, name) -> Block:
    order = _count(options.get("order"), "order")
    return space.state_space(
        inputs, outputs, order, direct=_truth(options.get("direct", False), "direct"), name=name,
        sample_time=_sample_time(options),
    )  # fmt: skip


def _transfer_function(inputs, outputs, options, starts, name) -> Block:
    m, n = (_count(options.get(f"{part}_degree"), f"{part}_degree") for part in ("numerator", "denominator"))
    (into,), (out,) = inputs, outputs
    return space.transfer_function(
        into, out, np.eye(1, m + 1)[0], np.eye(1, n + 1)[0], sample_time=_sample_time(options), name=name
    )


def _modal_law(inputs, outputs, options, starts, name) -> Block:
    try:
        actuators = tuple(Actuator(a["name"], a["signal"], float(a["lever"])) for a in options.get("actuators", ()))
        law = ModalLaw(tuple((float(x), float(y)) for x, y in options["positions"]), float(options["depth"]), actuators)
    except InputError:
        raise
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(
            "a modal_law must have positions (x and y of each coil set), a depth and perhaps actuators (name, signal, "
            f"lever); got {str(options)[:120]}."
        ) from error
    if (inputs, outputs) != (law.sensors, law.commands):
        raise InputError(
            f"a modal_law must read {law.sensors[0]} … {law.sensors[-1]} and give {law.commands[0]} … "
            f"{law.commands[-1]}; got {len(inputs)} inputs and {len(outputs)} outputs of other names."
        )
    return space.modal_law(law, Gains(**{gain: _value(starts.get(gain, 1.0)) for gain in GAIN_NAMES}))


def _value(start: Parameter | float) -> float:
    return start.value if isinstance(start, Parameter) else start


def _number(value, slot: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < np.inf:
        raise InputError(f"parameter {slot!r} must be a finite number; got {str(value)[:40]!r}.")
    return float(value)


def _count(value, what: str) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value <= LARGEST:
        raise InputError(f"{what} must be a whole number from 0 to {LARGEST}; got {str(value)[:40]}.")
    return value


def _truth(value, what: str) -> bool:
    if not isinstance(value, bool):
        raise InputError(f"{what} must be true or false; got {str(value)[:40]}.")
    return value


def _positive(value, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < np.inf:
        raise InputError(f"{what} must be a positive number of seconds; got {str(value)[:40]}.")
    return float(value)


def _sample_time(options: Mapping[str, Plain]) -> float | None:
    given = options.get("sample_time_s")
    return None if given is None else _positive(given, "sample_time_s")


BLOCKS: dict[str, BlockKind] = {
    "gain": BlockKind(_gain, ("mask",), None),
    "pid_matrix": BlockKind(_pid_matrix, ("mask",), None),
    "pid": _scalar(blocks.pid, "parts"),
    "pid_two_degrees": _scalar(blocks.pid_two_degrees, "parts", reads=2),
    "lead_lag": _scalar(blocks.lead_lag),
    "low_pass": _scalar(blocks.low_pass),
    "low_pass_second": _scalar(blocks.low_pass_second),
    "notch": _scalar(blocks.notch),
    "washout": _scalar(blocks.washout),
    "state_space": BlockKind(_state_space, ("order", "direct", "sample_time_s"), None),
    "transfer_function": BlockKind(
        _transfer_function, ("numerator_degree", "denominator_degree", "sample_time_s")
    ),
    "modal_law": BlockKind(_modal_law, ("positions", "depth", "actuators"), None),
}  # fmt: skip
