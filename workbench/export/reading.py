"""Reading files that may be anything: bounded size, bounded depth, data only, one sentence on failure."""

import json
import tomllib
from pathlib import Path
from typing import Any

from workbench.errors import InputError

LARGEST_FILE = 4_000_000  # bytes; a problem is 5 kB, a gain table with evidence below 1 MB


def read_text(path: Path) -> str:
    """The text of a file of reasonable size."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)  # no more, whatever the file says of its size
        if len(content) > LARGEST_FILE:
            raise InputError(
                f"{path} must be at most {LARGEST_FILE} bytes; it has more. Give the problem or table itself."
            )
        return content.decode("utf-8")
    except OSError as error:
        raise InputError(f"{path} must be a readable file; {error.strerror or error}. Check the path.") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path} must be UTF-8 text; byte {error.start} is not. Save it as UTF-8.") from error


def read_mapping(path: Path) -> dict[str, Any]:
    """The mapping in a TOML (.toml) or JSON (anything else) file."""
    text = read_text(path)
    kind = "TOML" if path.suffix == ".toml" else "JSON"
    try:
        if kind == "TOML":
            document = tomllib.loads(text)
        else:
            document = json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_without_repeats)
    except RecursionError as error:
        raise InputError(f"{path} must not be nested deeply; give a flat {kind} mapping.") from error
    except ValueError as error:  # both decoders' errors, and Python's own on an integer of thousands of digits
        fault = "a number has thousands of digits" if "integer string conversion" in str(error) else error
        raise InputError(f"{path} must be valid {kind}; {fault}. Mend it there.") from error
    if not isinstance(document, dict):
        raise InputError(f"{path} must hold a {kind} mapping; got a {type(document).__name__}.")
    return document


def _refuse_constant(name: str):
    raise ValueError(f"{name} is not a number JSON allows")


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The pairs as a mapping; a repeated key would quietly win or lose, so it is refused, as TOML does."""
    mapping = dict(pairs)
    if len(mapping) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"key {next(k for k in keys if keys.count(k) > 1)[:60]!r} is given twice")
    return mapping
