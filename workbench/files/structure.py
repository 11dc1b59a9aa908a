"""A structure in a data file: blocks by kind, their parameters with start, bounds and freedom.

[structure] references, [[structure.block]] --schema--> record --.structure()--> control.structure.Structure
Structure --structure_data--> the same tables
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

from pydantic import Field

from workbench.control.structure.block import Block, Parameter
from workbench.control.structure.registry import make_block
from workbench.control.structure.structure import Structure
from workbench.errors import InputError
from workbench.files.table import MOST, Name, Names, Number, Table, Text, read_table, si_keys

SUFFIX = {"s": "_s", "rad/s": "_rad_s"}  # what the key of a parameter with this unit ends in


class ParameterTable(Table):
    """A parameter: its start or value, bounds, whether it is tuned, another name than the block gives it."""

    value: Number
    low: Number | None = None
    high: Number | None = None
    free: Annotated[bool, Field(strict=True)] | None = None
    name: Name | None = None


class BlockTable(Table):
    """One block; its parameters are called as in the block's formula, with the unit of a time or frequency behind."""

    kind: Annotated[str, Field(max_length=60)]
    name: Annotated[str, Field(max_length=60)] = ""
    inputs: Annotated[Names, Field(min_length=1)]
    outputs: Annotated[Names, Field(min_length=1)]
    options: dict[str, Any] = Field(default={}, max_length=20)
    parameters: dict[str, Any] = Field(default={}, max_length=MOST * MOST)

    def block(self) -> Block:
        """The block."""
        shape = make_block(self.kind, self.inputs, self.outputs, self.options, {}, name=self.name)
        keys = _keys(shape)
        try:
            given = si_keys(self.parameters, tuple(keys))
        except ValueError as error:
            raise InputError(f"{error}.") from error
        tables = {keys[key]: self._table(key, value) for key, value in given.items()}
        starts = {slot: table.value for slot, table in tables.items()}
        block = make_block(self.kind, self.inputs, self.outputs, self.options, starts, name=self.name)
        return block.with_parameters(
            [_placed(p, tables.get(slot)) for slot, p in zip(block.slots, block.parameters, strict=True)]
        )

    def _table(self, key: str, given: Any) -> ParameterTable:
        return read_table(ParameterTable, given if isinstance(given, Mapping) else {"value": given}, key)


def _placed(old: Parameter, given: ParameterTable | None) -> Parameter:
    """The block's own parameter with what a file says of it."""
    if given is None:
        return old
    said = {key: value for key in ("name", "low", "high", "free") if (value := getattr(given, key)) is not None}
    return replace(old, **said)


class StructureTable(Table):
    """The blocks and what comes from outside."""

    references: Names = ()
    block: Annotated[tuple[BlockTable, ...], Field(min_length=1, max_length=60)]
    source: Text | None = None

    def structure(self, place: str) -> Structure:
        """The structure; a block that cannot be is named by its number."""
        blocks = []
        for number, table in enumerate(self.block):
            try:
                blocks.append(table.block())
            except InputError as error:
                raise InputError(f"{place}: structure.block.{number}: {error}") from error
        try:
            return Structure(tuple(blocks), self.references)
        except InputError as error:
            raise InputError(f"{place}: structure: {error}") from error


def _keys(block: Block) -> dict[str, str]:
    """Key of a file to slot; the gains of a vehicle's law are called as they are everywhere."""
    plain = block.kind == "modal_law"
    return {
        slot + ("" if plain else SUFFIX.get(p.unit, "")): slot
        for slot, p in zip(block.slots, block.parameters, strict=True)
    }


def structure_data(structure: Structure) -> dict[str, Any]:
    """What [structure] of a data file says for a structure.

    Raises InputError for a block that no file can state.
    """
    blocks = []
    for block in structure.blocks:
        # what cannot be made again, such as an expression, is refused here
        make_block(block.kind, block.inputs, block.outputs, block.options, block.parameters)
        keys = _keys(block)
        parameters = {key: _parameter_data(p) for key, p in zip(keys, block.parameters, strict=True)}
        options = {key: value for key, value in block.options.items() if value is not None}
        blocks.append({
            "kind": block.kind, "inputs": list(block.inputs), "outputs": list(block.outputs),
            **({"options": options} if options else {}), "parameters": parameters,
        })  # fmt: skip
    return {"references": list(structure.references), "block": blocks}


def _parameter_data(parameter: Parameter) -> dict[str, Any]:
    bounds = {end: getattr(parameter, end) for end in ("low", "high") if math.isfinite(getattr(parameter, end))}
    return {"value": parameter.value, **bounds, "free": parameter.free, "name": parameter.name}
