"""The five minutes of the guide's first page, typed: every line that it shows is printed."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from guide_page import fences

TIMING = re.compile(r"\b\d+\.\d\d\b")  # seconds of a proof, the only figures with two decimals and no unit


def lines(text: str) -> list[str]:
    """Lines without what may differ: timings, spacing, the … of a shortened output."""
    cut = (" ".join(TIMING.sub("", line).replace("─", "").split()) for line in text.splitlines())
    return [line for line in cut if line and line != "…"]


@pytest.mark.slow
def test_the_first_page_shows_what_its_commands_print(tmp_path):
    command = Path(sys.executable).with_name("workbench")
    ran = 0
    for fence in fences("console"):
        asked, *shown = fence.text.splitlines()
        if fence.page != "index.md" or not asked.startswith("$ workbench ") or not shown or shown[0].startswith("$"):
            continue
        done = subprocess.run(
            [command, *asked.split()[2:]], cwd=tmp_path, env=os.environ | {"COLUMNS": "96"},
            capture_output=True, text=True, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        printed = iter(lines(done.stdout))
        for line in lines("\n".join(shown)):
            start = line.removesuffix("…")  # of a line that is shortened at its end
            assert any(other.startswith(start) for other in printed), f"{fence.place}: {line!r} is not printed here"
        ran += 1
    assert ran == 4
