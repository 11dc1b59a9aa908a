"""Numbers of a model that lie in files beside data.toml: matrices (.mat, .csv), a measured frequency response (.csv).

plant.mat   A, B, C and, unless zero, D
plant.csv   the rows of [[A, B], [C, D]], commas between the numbers, no header
tests.csv   a header and rows: frequency_hz and real, imaginary; or magnitude (or magnitude_db), phase_deg
"""

import io
from pathlib import Path

import numpy as np

from workbench.errors import InputError
from workbench.machine.reading import LARGEST_FILE, read_text

MOST_STATES = 400
MOST_POINTS = 10_000
COLUMNS = (("real", "imaginary"), ("magnitude", "phase_deg"), ("magnitude_db", "phase_deg"))


def beside(folder: Path, name: str) -> Path:
    """The path of a file in the folder; a name that leads elsewhere is refused, so that the folder is whole."""
    path = Path(name)
    if path.is_absolute() or ".." in path.parts or "\x00" in name:
        raise InputError(f"a model's file must lie in the folder of its data.toml; got {name!r}. Put it there.")
    return folder / path


def read_matrices(folder: Path, name: str, m: int, p: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A (n, n), B (n, m), C (p, n), D (p, m) from a .mat or .csv file in the folder."""
    path = beside(folder, name)
    if path.suffix == ".mat":
        return _of_mat(path, m, p)
    if path.suffix != ".csv":
        raise InputError(f"a file of matrices must end in .mat or .csv; got {name!r}.")
    rows = _numbers(read_text(path).splitlines(), path)
    n = len(rows) - p
    if n < 0 or n > MOST_STATES or rows.shape[1] != n + m:
        raise InputError(
            f"{path} must hold the rows of [[A, B], [C, D]]: states + {p} rows of states + {m} numbers, at most "
            f"{MOST_STATES} states; got {rows.shape[0]} rows of {rows.shape[1]}."
        )
    return rows[:n, :n], rows[:n, n:], rows[n:, :n], rows[n:, n:]


def _of_mat(path: Path, m: int, p: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    from scipy.io import loadmat

    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
        if len(content) > LARGEST_FILE:
            raise InputError(f"{path} must be at most {LARGEST_FILE} bytes; it has more. Save A, B, C and D alone.")
        found = loadmat(io.BytesIO(content), variable_names=["A", "B", "C", "D"])
    except OSError as error:
        raise InputError(f"{path} must be a readable file; {error.strerror or error}. Check the path.") from error
    except InputError:
        raise
    except Exception as error:  # the decoder raises whatever the bytes lead it to
        raise InputError(
            f"{path} must be a MATLAB file of version 4 to 7.2; it cannot be read ({type(error).__name__}). "
            "Save it with '-v7', or as .csv."
        ) from error
    if missing := [key for key in "ABC" if key not in found]:
        raise InputError(f"{path} must hold A, B, C and D; it lacks {', '.join(missing)}. Save them by these names.")
    parts = []
    n = len(found["A"])
    for key, shape in (("A", (n, n)), ("B", (n, m)), ("C", (p, n)), ("D", (p, m))):
        given = found.get(key, np.zeros(shape))
        whole = isinstance(given, np.ndarray) and given.dtype.kind in "fiu" and given.shape == shape
        if not whole or n > MOST_STATES or not np.isfinite(given).all():
            raise InputError(
                f"{key} of {path} must hold {shape[0]} × {shape[1]} real, finite numbers, for at most {MOST_STATES} "
                f"states, {m} inputs and {p} outputs; got {getattr(given, 'shape', type(given).__name__)}."
            )
        parts.append(np.array(given, float))
    return parts[0], parts[1], parts[2], parts[3]


def read_response(folder: Path, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (k,) [Hz], rising, and the complex response (k,) from a .csv file in the folder."""
    path = beside(folder, name)
    lines = read_text(path).splitlines()
    header = tuple(word.strip().strip('"') for word in lines[0].split(",")) if lines else ()
    pair = next((pair for pair in COLUMNS if set(header) == {"frequency_hz", *pair}), None)
    if pair is None or len(header) != 3:
        raise InputError(
            f"{path} must begin with a header: frequency_hz and real, imaginary, or magnitude, phase_deg, or "
            f"magnitude_db, phase_deg; got {', '.join(header)[:80]!r}."
        )
    rows = _numbers(lines[1:], path)
    if rows.shape[1] != 3 or not 2 <= len(rows) <= MOST_POINTS:
        raise InputError(f"{path} must have 2 to {MOST_POINTS} rows of three numbers; got {rows.shape}.")
    frequency, first, second = (rows[:, header.index(key)] for key in ("frequency_hz", *pair))
    if frequency[0] <= 0 or (np.diff(frequency) <= 0).any():
        raise InputError(f"frequencies of {path} must rise from above 0 Hz; they do not. Sort them, each once.")
    if pair[0] == "real":
        return frequency, first + 1j * second
    size = 10 ** (np.clip(first, -1e4, 1e3) / 20) if pair[0] == "magnitude_db" else first
    return frequency, size * np.exp(1j * np.deg2rad(second))


def _numbers(lines: list[str], path: Path) -> np.ndarray:
    """(rows, columns) of the lines that are not empty."""
    try:
        rows = [[float(word) for word in line.split(",")] for line in lines if line.strip()]
    except ValueError as error:
        raise InputError(f"{path} must hold numbers between commas; {str(error)[:80]}. Mend it there.") from error
    if not rows or len({len(row) for row in rows}) != 1:
        raise InputError(f"{path} must hold rows of equal length; got {sorted({len(row) for row in rows})[:5]}.")
    found = np.array(rows)
    if not np.isfinite(found).all() or np.abs(found).max() > 1e60:
        raise InputError(f"{path} must hold finite numbers; it does not. Mend it there.")
    return found
