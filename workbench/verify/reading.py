"""A gain table's file, read as if anybody could have written it: bounded, strict JSON, and its digest checked.

bytes --size, UTF-8, strict JSON--> document --SHA-256 of the canonical JSON--> digest holds or not
"""

import hashlib
import json
import re
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, TypeVar

from flint import fmpq, fmpq_mat

from workbench.verify.exact.failure import TableError

T = TypeVar("T")
FORMAT = "maglev-workbench gain table"
VERSIONS = (1, 2)  # of vehicles; of any plant
LARGEST_FILE = 4_000_000  # bytes; a table with evidence is below 1 MB
LONGEST_DECIMAL = 60  # characters; a double needs 24, and the work grows with their number
LARGEST_EXPONENT = 330
LARGEST_SIZE = 40  # powers of ten from 1 to any number but zero: beyond lies no vehicle, only work without end
DECIMAL = re.compile(r"(-?)([0-9]+)(?:\.([0-9]+))?(?:[eE]([-+]?[0-9]{1,3}))?")


def read_document(path: Path) -> dict[str, Any]:
    """The JSON mapping in a file, of the right format and version; its digest not yet checked."""
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)  # no more, whatever the file says of its size
        text = content.decode("utf-8")
    except OSError as error:
        raise TableError(f"{path} must be a readable file; {error.strerror or error}. Check the path.") from error
    except UnicodeDecodeError as error:
        raise TableError(f"{path} must be UTF-8 text; byte {error.start} is not. Save it as UTF-8.") from error
    if len(content) > LARGEST_FILE:
        raise TableError(f"{path} must be at most {LARGEST_FILE} bytes; it has more. Give the table itself.")
    try:
        document = json.loads(text, parse_constant=_refused, object_pairs_hook=_without_repeats)
    except RecursionError as error:
        raise TableError(f"{path} must not be nested deeply; it is. Get the table again from its source.") from error
    except ValueError as error:  # the decoder's errors, and Python's own on an integer of thousands of digits
        fault = "a number has thousands of digits" if "integer string conversion" in str(error) else error
        raise TableError(f"{path} must be valid JSON; {fault}. Get the table again from its source.") from error
    if not isinstance(document, dict):
        raise TableError(f"{path} must hold a JSON mapping; got a {type(document).__name__}. Give a gain table.")
    version = document.get("version")
    if document.get("format") != FORMAT or type(version) is not int or version not in VERSIONS:
        given = str(document.get("format"))[:60], str(version)[:20]
        raise TableError(
            f"{path} must be of format {FORMAT!r}, version 1 or 2; got {given[0]!r}, version {given[1]}. "
            "Give the JSON that 'workbench design' wrote, or use the workbench that wrote this one."
        )
    return document


def digest_of(document: dict[str, Any]) -> str:
    """SHA-256 of the canonical JSON: everything but the digest, keys sorted, no spaces, UTF-8."""
    content = {key: value for key, value in document.items() if key != "digest"}
    try:
        text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    except (ValueError, RecursionError) as error:  # an overflowing number such as 1e999, or nesting without end
        raise TableError(
            "a gain table must hold finite numbers, not deeply nested; it does not. Get it again from its source."
        ) from error
    return hashlib.sha256(text.encode("utf-8", errors="surrogatepass")).hexdigest()


def decimal(text: Any, place: str) -> fmpq:
    """The exact value of a decimal string."""
    found = DECIMAL.fullmatch(text) if isinstance(text, str) and len(text) <= LONGEST_DECIMAL else None
    if found is None or abs(int(found[4] or 0)) > LARGEST_EXPONENT:
        raise TableError(
            f"{place} must be a decimal string of a double such as '-1.25e-3'; got {str(text)[:40]!r}. Mend it there."
        )
    sign, whole, fraction, exponent = found.groups()
    fraction = fraction or ""
    digits, power = (whole + fraction).lstrip("0"), int(exponent or 0) - len(fraction)
    if not digits:
        return fmpq(0)
    if abs(len(digits) + power) > LARGEST_SIZE:  # asked of the text: the number is not made before it is known small
        raise TableError(
            f"{place} must be zero or of a size between 1e-{LARGEST_SIZE} and 1e{LARGEST_SIZE}; got {text[:40]!r}. "
            "Mend it there."
        )
    value = fmpq(int(digits), 1) * fmpq(10) ** power
    return -value if sign else value


def number(value: Any, place: str) -> fmpq:
    """The exact value of a JSON number, which is a double or an integer."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 10.0**LARGEST_SIZE:
        raise TableError(
            f"{place} must be a finite number below 1e{LARGEST_SIZE}; got {str(value)[:40]!r}. Mend it there."
        )
    if value != 0 and abs(value) < 10.0**-LARGEST_SIZE:
        raise TableError(f"{place} must be zero or at least 1e-{LARGEST_SIZE}; got {value!r}. Mend it there.")
    return fmpq(*value.as_integer_ratio())


def matrix_of(value: Any, place: str, rows: int, columns: int) -> fmpq_mat:
    """A matrix of decimals of a given shape."""
    entries: list[fmpq] = []
    for i, row in enumerate(entries_of(value, place, rows, rows)):
        entries += [decimal(x, f"{place}.{i}") for x in entries_of(row, f"{place}.{i}", columns, columns)]
    return fmpq_mat(rows, columns, entries)


def optional(value: Any, read: Callable[[Any], T]) -> T | None:
    """None stays None; anything else is read."""
    return None if value is None else read(value)


def as_printed(value: Any, place: str) -> fmpq:
    """A JSON number as the decimal it is printed as: 0.85 is 17/20."""
    number(value, place)
    return decimal(repr(value), place)


def mapping(value: Any, place: str) -> dict[str, Any]:
    """A JSON mapping, or a refusal that names its place."""
    if not isinstance(value, dict):
        raise TableError(f"{place} must be a mapping; got {str(value)[:40]!r}. Get the table again from its source.")
    return value


def keyed(value: Any, place: str, keys: Collection[str], may: Collection[str] = ()) -> dict[str, Any]:
    """A JSON mapping that has these keys, perhaps some of `may`, and no others."""
    given = mapping(value, place)
    for word, odd in (("lacks", [k for k in keys if k not in given]),
                      ("does not know", [k for k in given if k not in keys and k not in may])):  # fmt: skip
        if odd:
            raise TableError(
                f"{place} must have the keys of a gain table and no others; it {word} {odd[0][:40]!r}. "
                "Get the table again from its source."
            )
    return given


def entries_of(value: Any, place: str, most: int, least: int = 0) -> list[Any]:
    """A JSON list of a bounded length, or a refusal that names its place."""
    if not isinstance(value, list) or not least <= len(value) <= most:
        given = f"{len(value)} entries" if isinstance(value, list) else f"{str(value)[:40]!r}"
        raise TableError(f"{place} must be a list of {least} to {most} entries; got {given}. Get the table again.")
    return value


def text_of(value: Any, place: str) -> str:
    """A text of bounded length, or a refusal that names its place."""
    if not isinstance(value, str) or len(value) > 1000:
        raise TableError(f"{place} must be a text; got {str(value)[:40]!r}. Get the table again from its source.")
    return value


def _refused(name: str):
    raise ValueError(f"{name} is not a number JSON allows")


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """The pairs as a mapping; a repeated key would quietly win or lose."""
    mapping = dict(pairs)
    if len(mapping) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"key {next(k for k in keys if keys.count(k) > 1)[:60]!r} is given twice")
    return mapping
