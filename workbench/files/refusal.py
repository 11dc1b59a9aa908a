"""What a schema refuses, as one sentence: where, what must hold, what was given, and the nearest word that is known.

ValidationError, schema --first fault--> "data.toml: key 'vehicle.gpa_m' is not known; …: did you mean 'gap_m'? …"
"""

from collections.abc import Sequence
from typing import Any, Literal, get_args, get_origin

from pydantic import BaseModel, ValidationError

from workbench.errors import nearest
from workbench.machine.reading import shown


def sentence(error: ValidationError, place: str, schema: type[BaseModel]) -> str:
    """One sentence on the first fault of a document that a schema refused; place : its file."""
    first = error.errors(include_url=False)[0]
    way, given = first["loc"], first.get("input")
    key = ".".join(str(part)[:60] for part in way)
    more = f" ({error.error_count() - 1} more after it)" if error.error_count() > 1 else ""
    match first["type"]:
        case "extra_forbidden":
            known = [name for table in _tables(schema, way[:-1]) for name in table.model_fields]
            return f"{place}: key {key!r} is not known; check its name and unit: {nearest(str(way[-1]), known)}{more}."
        case "missing":
            return f"{place}: key {key!r} is missing; add it, with its unit in the name{more}."
        case "union_tag_invalid":
            known, word = _kinds(_tables(schema, way)), str(first.get("ctx", {}).get("tag"))
            return f"{place}: {key} is not usable: unknown kind {word[:60]!r}; {nearest(word, known)}{more}."
        case "literal_error" if isinstance(given, str):
            known = _words(_annotations(schema, way))
            return f"{place}: {key} is not usable: unknown word {given[:60]!r}; {nearest(given, known)}{more}."
    message = first["msg"].removeprefix("Value error, ").rstrip(".")
    if not key:
        return f"{place}: {message}{more}."
    return f"{place}: {key} is not usable: {message}; got {shown(given)}{more}."


def _tables(schema: type[BaseModel], way: Sequence[str | int]) -> list[type[BaseModel]]:
    """The tables that may stand at the end of a way through a document."""
    return [table for annotation in _annotations(schema, way) for table in _models(annotation)]


def _annotations(schema: type[BaseModel], way: Sequence[str | int]) -> list[Any]:
    """Types of what may stand there; a step of a way is a key, a number in a list, or the kind of a table."""
    found: list[Any] = [schema]
    for step in way:
        tables = [table for annotation in found for table in _models(annotation)]
        inner = [table.model_fields[step].annotation for table in tables if step in table.model_fields]
        kinds = [table for table in tables if step in _kinds([table])]
        found = inner or kinds or found
    return found


def _models(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [table for part in get_args(annotation) for table in _models(part)]


def _kinds(tables: Sequence[type[BaseModel]]) -> list[str]:
    return [word for table in tables if "kind" in table.model_fields
            for word in _words([table.model_fields["kind"].annotation])]  # fmt: skip


def _words(annotations: Sequence[Any]) -> list[str]:
    """The words of every Literal among types."""
    found: list[str] = []
    for annotation in annotations:
        parts = get_args(annotation)
        found += map(str, parts) if get_origin(annotation) is Literal else _words(parts)
    return found
