"""Files written whole or not at all, and never through a link that somebody planted.

    content --> a new file of a random name in the target's folder --sync, rename--> the target

A file is the old one or the whole new one, whatever ends the program meanwhile. What was begun is removed when writing
fails. `check_file` and `check_folder` ask before the work whether its result will find room.
"""

import os
import secrets
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from workbench.errors import InputError

BEGUN = ".workbench-*.part"  # the names of what is being written; a kill leaves one behind
PROBE = bytes(4096)  # a full disk may still take a name, but no block


def write_text(path: Path, text: str) -> None:
    """Replaces a file by a text in UTF-8; makes its folder where there is none."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Replaces a file by some bytes; makes its folder where there is none."""
    with replacing(path) as file:
        file.write(content)


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A file to write to, which takes the place of `path` when the block ends well, and is gone when it does not."""
    with _refusing(path):
        _check_kind(path)
        path.parent.mkdir(parents=True, exist_ok=True)
        with _new_file(path.parent) as (file, begun):
            yield file
            file.flush()
            os.fsync(file.fileno())
            os.replace(begun, path)
        _sync_folder(path.parent)


def check_file(path: Path) -> None:
    """Refuses a file that cannot be written, before the work that it is to hold; leaves no folder behind."""
    with _refusing(path):
        _check_kind(path)
        _probe(path.parent)


def check_folder(folder: Path) -> None:
    """Refuses a folder in which nothing can be written; one that is not there yet is not left behind."""
    with _refusing(folder, "a folder that can be written to"):
        _probe(folder)


def place_of(out: str, name: str, ending: str) -> Path:
    """The file that `--out` means: in a folder that is there, or whose name ends in "/" or has no ending; else itself.

    name, ending : of the file in such a folder

    Examples
    --------
    >>> [str(place_of(out, "gains", ".h")) for out in ("new/", "new", "law.h", "law.hpp")]
    ['new/gains.h', 'new/gains.h', 'law.h', 'law.hpp']
    """
    path = Path(out)
    named = out.endswith(("/", os.sep)) or (not path.suffix and not path.is_file())
    return path / f"{name}{ending}" if named or path.is_dir() else path


def write_folder(folder: Path, files: Mapping[str, bytes]) -> None:
    """A new folder with files in it, by name: all of them or none; refused where something has that name already."""
    if "\0" in str(folder) or not folder.name:
        raise InputError(f"a new folder must have a name; got {str(folder)!r}. Give one.")
    if os.path.lexists(folder):
        raise InputError(f"{folder} must not be there yet; it is. Choose another name, or take it away first.")
    with _refusing(folder, "a place for a new folder"):
        folder.parent.mkdir(parents=True, exist_ok=True)
        begun = folder.parent / BEGUN.replace("*", secrets.token_hex(8))
        begun.mkdir()
        try:
            for name, content in files.items():
                write_bytes(begun / name, content)
            begun.rename(folder)
        finally:
            shutil.rmtree(begun, ignore_errors=True)
        _sync_folder(folder.parent)


def open_lock(path: Path) -> int:
    """Descriptor of a file that is there to be locked, made where there is none; a link is refused."""
    with _refusing(path):
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)


@contextmanager
def _new_file(folder: Path) -> Iterator[tuple[BinaryIO, Path]]:
    """A new file that nobody could name before, with its path; removed at the end if it still has that name."""
    path = folder / BEGUN.replace("*", secrets.token_hex(8))
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
    try:
        with os.fdopen(descriptor, "wb") as file:
            yield file, path
    finally:
        with suppress(FileNotFoundError):
            path.unlink()


def _check_kind(path: Path) -> None:
    """Only a file can be replaced by one; a device would be replaced too, by whoever may write to its folder."""
    if "\0" in str(path):
        raise InputError("a file's path must not hold a zero byte; one does. Give another.")
    if path.exists() and not path.is_file():
        kind = "a folder" if path.is_dir() else "a device or pipe"
        raise InputError(f"{path} must be a file's path; {kind} is there. Give another, or leave the option out.")


def _probe(folder: Path) -> None:
    """Writes a block in the folder, and takes away again whatever was made for it."""
    made = [place for place in (folder, *folder.parents) if not place.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with _new_file(folder) as (file, _):
            file.write(PROBE)
            file.flush()
            os.fsync(file.fileno())
    finally:
        with suppress(OSError):  # another has put something there meanwhile
            for place in made:
                place.rmdir()


def _sync_folder(folder: Path) -> None:
    """Makes a rename last through a power cut, on file systems that can."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


@contextmanager
def _refusing(path: Path, wanted: str = "writable") -> Iterator[None]:
    """The system's refusals as one sentence."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{path} must be {wanted}; {error.strerror or error}. Choose another place with --out."
        ) from error
