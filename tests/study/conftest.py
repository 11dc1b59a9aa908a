"""What tests of studies share: small studies as files."""

from pathlib import Path

import pytest

HEAD = """
[study]
problem = "heave"
seed = 5
output = "csv"
"""
DRAWN = """sampling = "latin_hypercube"
count = {count}
"""
BODY = """
[[parameter]]
name = "K_h"
range = [1.0, 4.0]

[[parameter]]
name = "K_zdot"
range = [1.0, 1.5]
"""


@pytest.fixture
def study_file(tmp_path):
    """Writes a study of `heave` with given rows, extra lines in [study] and extra tables; its path."""

    def write(count: int = 40, more: str = "", tables: str = BODY) -> Path:
        path = tmp_path / "one.toml"
        drawn = "" if "pareto" in more else DRAWN.format(count=count)
        path.write_text(HEAD + drawn + more + tables, encoding="utf-8")
        return path

    return write
