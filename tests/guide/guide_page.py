"""The pages of the guide, cut into fenced blocks."""

import re
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]
GUIDE = ROOT / "notebooks" / "guide"
PAGES = tuple(
    sorted(path.relative_to(GUIDE).as_posix() for room in (GUIDE, GUIDE / "how_to_add") for path in room.glob("*.md"))
)
FENCE = re.compile(r"^```([^\n`]*)\n(.*?)^```$", re.M | re.S)


class Fence(NamedTuple):
    """A fenced block: what stands behind the backticks, its text, its page and line."""

    kind: str
    text: str
    page: str
    line: int

    @property
    def place(self) -> str:
        return f"{self.page}:{self.line}"


def fences(kind: str = "") -> list[Fence]:
    """Every fenced block of a kind ("toml study"), or whose kind begins with it and a blank."""
    found = []
    for page in PAGES:
        text = (GUIDE / page).read_text("utf-8")
        for match in FENCE.finditer(text):
            name = match[1].strip()
            if not kind or name == kind or name.startswith(kind + " "):
                found.append(Fence(name, match[2], page, text[: match.start()].count("\n") + 1))
    return found
