"""Reading files that may be anything: bounded before they are parsed, data only, one sentence on failure.

    path --LARGEST_FILE bytes at most--> text --strings, comments taken out--> depth, keys, lengths counted --> mapping

The decoders take time and memory with the square of a key's parts (a key of 100 000 dots: 21 GB) and recurse as deep as
the brackets go, so both are counted first, in one pass over the text.
"""

import json
import math
import re
import tomllib
from collections import Counter
from pathlib import Path
from typing import Any

from workbench.errors import InputError

LARGEST_FILE = 4_000_000  # bytes; a problem is 5 kB, a gain table with evidence below 1 MB
DEEPEST = 32  # brackets in brackets; a gain table has seven
MOST_PARTS = 16  # of a dotted key; a study's longest has four
MOST_KEYS = 100_000  # and tables, of a file; a gain table with its promises has some thousands
LARGEST = 1e100  # of a data file's numbers, and the inverse of the smallest; SI quantities stay far within
LONGEST_WORD = 1000  # letters outside quotation marks; a double has 25

# Each alternative takes what is left of the text where the closing marks are missing: one pass, whatever is given.
_TOML_QUOTED = re.compile(
    r'"""(?:(?!""")(?:[^\\]|\\.))*+(?:""")?'
    r"|'''(?:(?!''').)*+(?:''')?"
    r'|"(?:[^"\\\n]|\\.)*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
_JSON_QUOTED = re.compile(r'"(?:[^"\\]|\\.)*+"?', re.DOTALL)
_WORD = re.compile(r"[^\s=\[\]{},:]+")


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


def read_mapping(path: Path, kind: str = "") -> dict[str, Any]:
    """The mapping in a file of a kind, "TOML" or "JSON"; by its name if left out: .toml, or anything else."""
    kind = kind or ("TOML" if path.suffix == ".toml" else "JSON")
    text = read_text(path)
    _check_size(text, path, kind)
    try:
        if kind == "TOML":
            document = tomllib.loads(text)
        else:
            document = json.loads(text, parse_constant=_refuse_constant, object_pairs_hook=_without_repeats)
    except ValueError as error:  # both decoders' errors
        raise InputError(f"{path} must be valid {kind}; {error}. Mend it there.") from error
    if not isinstance(document, dict):
        raise InputError(f"{path} must hold a {kind} mapping; got a {type(document).__name__}.")
    if kind == "TOML":
        _check_numbers(document, path, "")
    return document


def shown(value: Any) -> str:
    """A value as a sentence may quote it: a scalar shortened, anything larger by its kind."""
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}" if len(value) > 3 or any(map(_has_parts, value)) else str(value)[:60]
    return str(value)[:60]


def _has_parts(value: Any) -> bool:
    return isinstance(value, dict | list | tuple)


def _check_size(text: str, path: Path, kind: str) -> None:
    """Refuses what the decoders would take too long for, or recurse too deep in."""
    quoted, sign = (_TOML_QUOTED, "=") if kind == "TOML" else (_JSON_QUOTED, ":")
    bare = quoted.sub("q", text)
    keys = bare.count(sign) + (bare.count("\n[") if kind == "TOML" else 0)
    if keys > MOST_KEYS:
        raise InputError(f"{path} must have at most {MOST_KEYS} keys; it has {keys}. Give the problem or table itself.")
    words = [*_WORD.findall(bare.replace(" ", "").replace("\t", "") if kind == "TOML" else bare), ""]
    if kind == "TOML" and max(word.count(".") for word in words) >= MOST_PARTS:
        raise InputError(f"{path} must not be nested deeply; a key has more than {MOST_PARTS} parts. Shorten it.")
    if max(map(len, words)) > LONGEST_WORD:
        raise InputError(f"{path} must be valid {kind}; a number has thousands of digits. Mend it there.")
    if _depth(bare) > DEEPEST:
        raise InputError(f"{path} must not be nested deeply; give a flat {kind} mapping.")


def _check_numbers(value: Any, path: Path, key: str) -> None:
    """Refuses finite numbers whose squares and products leave the doubles; no quantity of a data file needs them."""
    parts = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for name, part in parts:
        _check_numbers(part, path, f"{key}.{name}" if key and isinstance(name, str) else key or str(name))
    if isinstance(value, int | float) and 0 < abs(value) < math.inf and not 1 / LARGEST <= abs(value) <= LARGEST:
        raise InputError(
            f"{path}: {key} must be 0 or of a size from {1 / LARGEST:g} to {LARGEST:g}; got {shown(value)}. "
            "Choose other units, or mend the exponent."
        )


def _depth(bare: str) -> int:
    """How deep brackets stand in brackets; no more than one beyond what is allowed."""
    depth = deepest = 0
    for bracket in re.findall(r"[\[\]{}]", bare):
        depth += 1 if bracket in "[{" else -1
        deepest = max(deepest, depth)
        if deepest > DEEPEST:
            break
    return deepest


def _refuse_constant(name: str):
    raise ValueError(f"{name} is not a number JSON allows")


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The pairs as a mapping; a repeated key would quietly win or lose, so it is refused, as TOML does."""
    mapping = dict(pairs)
    if len(mapping) < len(pairs):
        ((twice, _),) = Counter(key for key, _ in pairs).most_common(1)
        raise ValueError(f"key {twice[:60]!r} is given twice")
    return mapping
