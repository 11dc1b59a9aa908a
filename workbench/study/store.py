"""The folder of a study: what was asked, and what is finished, safe against being killed at any moment.

    study.json        what the rows depend on, and its hash; written once
    rows/00000000.json  finished rows from that number on, signed; written beside, synced, renamed, never touched again

A file is there whole or not at all. The lock is the system's own: it goes with the process that holds it.
"""

import fcntl
import json
import math
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.errors import InputError
from workbench.machine.reading import read_mapping
from workbench.machine.writing import BEGUN, open_lock, write_text
from workbench.study.definition import sha256

FORMAT = "maglev-workbench study"
MANIFEST, ROWS, LOCK = "study.json", "rows", "study.lock"


@dataclass(frozen=True)
class Piece:
    """Finished rows: the number of the first, their values, and the seconds they took."""

    first: int
    values: list[list[Any]]
    seconds: float


class Store:
    """A study's folder, held by one process at a time."""

    def __init__(self, folder: Path, identity: dict[str, Any], *, fresh: bool = False) -> None:
        """Opens or begins the study `identity`, a JSON document; a folder of another study is refused unless fresh."""
        self.folder, self.sha256 = folder, sha256(identity)
        try:
            (folder / ROWS).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(
                f"{folder} must be a folder that can be written to; {error.strerror or error}. "
                "Choose another with --out."
            ) from error
        self._lock = os.fdopen(open_lock(folder / LOCK), "w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self._lock.close()
            raise InputError(
                f"{folder} is in use by another run of a study; wait for it, or choose another --out."
            ) from error
        try:
            self._open(identity, fresh)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Lets another process have the folder."""
        self._lock.close()

    def _open(self, identity: dict[str, Any], fresh: bool) -> None:
        manifest = self.folder / MANIFEST
        if fresh:
            manifest.unlink(missing_ok=True)
            for path in self._files():
                path.unlink()
        for path in (self.folder / ROWS).glob(BEGUN):  # of a run that was killed while writing
            path.unlink()
        if not manifest.exists():
            if self._files():
                raise InputError(
                    f"{self.folder} holds rows of a study whose {MANIFEST} is gone; give --fresh to begin anew."
                )
            self._write(manifest, {"format": FORMAT, "sha256": self.sha256, "study": identity})
            return
        before = read_mapping(manifest)
        if before.get("format") != FORMAT or before.get("sha256") != self.sha256:
            raise InputError(
                f"{self.folder} holds another study ({_difference(before.get('study'), identity)}); "
                "choose another --out, or give --fresh to throw its rows away."
            )

    def _files(self) -> list[Path]:
        return sorted((self.folder / ROWS).glob("[0-9]*.json"))

    def pieces(self, width: int) -> Iterator[Piece]:
        """What is finished, in the order of rows; each row has so many entries, the last of them words."""
        for path in self._files():
            try:
                yield self._checked(read_mapping(path), int(path.stem), width)
            except InputError as error:
                raise InputError(f"{error} Or delete it: only its rows are computed again.") from error
            except (KeyError, TypeError, ValueError, RecursionError) as error:
                fault = f"it has no {error}" if isinstance(error, KeyError) else error
                raise InputError(
                    f"{path} must hold finished rows of this study; {fault}. "
                    "Delete it: only its rows are computed again."
                ) from error

    def _checked(self, document: dict[str, Any], first: int, width: int) -> Piece:
        """The rows of a file, every digit as it was written."""
        if document["sha256"] != self.sha256:
            raise ValueError("it belongs to another study")
        if document["checksum"] != _checksum(document):
            raise ValueError("its checksum does not fit its content")
        if document["first"] != first:
            raise ValueError(f"its rows begin at {document['first']}")
        rows = [_decoded(row, width) for row in document["rows"]]
        if not rows:
            raise ValueError("it has none")
        return Piece(first, rows, float(document["seconds"]))

    def add(self, piece: Piece) -> None:
        """Keeps finished rows."""
        rows = [[_encoded(v) for v in row] for row in piece.values]
        document = {"sha256": self.sha256, "first": piece.first, "seconds": piece.seconds, "rows": rows}
        document["checksum"] = _checksum(document)
        self._write(self.folder / ROWS / f"{piece.first:08d}.json", document)

    def _write(self, path: Path, document: dict[str, Any]) -> None:
        write_text(path, json.dumps(document, allow_nan=False, ensure_ascii=False))


INFINITE = {"Infinity": math.inf, "-Infinity": -math.inf}  # a margin that nothing limits; JSON has no number for it


def _encoded(value: Any) -> Any:
    return ("Infinity" if value > 0 else "-Infinity") if isinstance(value, float) and math.isinf(value) else value


def _decoded(row: Any, width: int) -> list[Any]:
    """One row: numbers, yes or no, or nothing; then words."""
    if not isinstance(row, list) or len(row) != width or not isinstance(row[-1], str):
        raise ValueError(f"a row must have {width} entries, the last of them words")
    values = [INFINITE.get(v, v) if isinstance(v, str) else v for v in row[:-1]]
    if not all(v is None or isinstance(v, bool | int | float) for v in values):
        raise ValueError("a row holds something that is no number")
    return [*values, row[-1]]


def _checksum(document: dict[str, Any]) -> str:
    """Of everything else in a file of rows."""
    return sha256({key: value for key, value in document.items() if key != "checksum"})


@contextmanager
def opened(folder: Path, identity: dict[str, Any], *, fresh: bool = False) -> Iterator[Store]:
    """A store for the length of a block."""
    store = Store(folder, identity, fresh=fresh)
    try:
        yield store
    finally:
        store.close()


def missing(total: int, pieces: Sequence[tuple[int, int]], size: int, block: int) -> list[tuple[int, int]]:
    """(first, last) ranges of at most `size` rows that no (first, last) piece holds; `size` a multiple of `block`."""
    out = []
    at = 0
    for first, last in [*sorted(pieces), (total, total)]:
        if first < at or (first % block and first != total):
            raise InputError(f"rows {first} to {last - 1} are kept twice or cut wrongly; give --fresh to begin anew.")
        out += [(k, min(k + size, first)) for k in range(at, first, size)]
        at = last
    return out


def _difference(before: Any, now: dict[str, Any], path: str = "") -> str:
    """The first entry in which two studies differ, for a sentence."""
    if not isinstance(before, dict):
        return f"{path or 'all of it'} differs"
    for key in sorted({*before, *now}):
        name = f"{path}.{key}" if path else key
        if before.get(key) != now.get(key):
            if isinstance(now.get(key), dict) and isinstance(before.get(key), dict):
                return _difference(before[key], now[key], name)
            return f"{name} differs"
    return "its format differs"
