"""Plants of the COMPleib library, read from the wheel of `controlgym` (MIT), which is downloaded when a benchmark runs.

    pip download --> wheel in a cache folder --zip, .mat--> A, B1, B2, C1, C, D11, D12, D21

Nothing of it is kept in this repository. The wheel renumbers the problems; each file carries the library's own name.
"""

import io
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

PACKAGE, VERSION = "controlgym", "1.0.0"
FOLDER = "controlgym/envs/linear_control_src/"


class Problem(NamedTuple):
    """One plant under the library's name; `matrices` in the order of `static_feedback`."""

    name: str
    matrices: tuple[np.ndarray, ...]

    @property
    def states(self) -> int:
        return len(self.matrices[0])


def wheel(cache: Path | None = None) -> Path:
    """The wheel, downloaded unless it is in the cache folder already."""
    folder = cache or Path(tempfile.gettempdir()) / "workbench-bench"
    folder.mkdir(parents=True, exist_ok=True)
    found = sorted(folder.glob(f"{PACKAGE}-{VERSION}-*.whl"))
    if not found:
        command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", str(folder)]
        subprocess.run([*command, f"{PACKAGE}=={VERSION}"], check=True)
        found = sorted(folder.glob(f"{PACKAGE}-{VERSION}-*.whl"))
    return found[0]


def problems(most_states: int, cache: Path | None = None) -> list[Problem]:
    """Every plant with at most so many states, by name."""
    from scipy.io import loadmat

    found = []
    with zipfile.ZipFile(wheel(cache)) as archive:
        for member in archive.namelist():
            if not (member.startswith(FOLDER) and member.endswith(".mat")):
                continue
            data = loadmat(io.BytesIO(archive.read(member)))
            if data["A"].shape[0] <= most_states:
                matrices = tuple(_dense(data[key]) for key in ("A", "B1", "B2", "C1", "C", "D11", "D12", "D21"))
                found.append(Problem(str(data["complib_id"][0]).upper(), matrices))
    return sorted(found, key=lambda problem: problem.name)


def _dense(matrix) -> np.ndarray:
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix, float)
