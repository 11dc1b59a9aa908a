"""What every gain table can do: be signed, written, exported, shown."""

import json
from pathlib import Path
from typing import Any, Self

from workbench.exits import through
from workbench.files.digest import digest_of
from workbench.handover.table.schema import Part
from workbench.machine.writing import write_text
from workbench.result import Result


class SignedTable(Result, Part):
    """A gain table whose `digest` is the SHA-256 of all else."""

    def to_dict(self) -> dict[str, Any]:
        """What the file holds."""
        return self.model_dump(mode="json")

    def signed(self) -> Self:
        """The same table with the digest of its content."""
        return self.model_copy(update={"digest": digest_of(self.to_dict())})

    def text(self) -> str:
        """The text of the table's file, readable JSON."""
        return json.dumps(self.to_dict(), indent=1, ensure_ascii=False, allow_nan=False) + "\n"

    def write(self, path: Path | str) -> Self:
        """Writes the table, signed anew; returns what was written."""
        table = self.signed()
        write_text(Path(path), table.text())
        return table

    def export(self, format: str, path: Path | str, *, computing_delay: float = 0.0, accept: bool = False) -> Path:
        """Writes the table in a format of `handover.code.formats`, the sampled loop checked; returns the path."""
        return through("export")(self, format, path, computing_delay=computing_delay, accept=accept)

    def __str__(self) -> str:
        return repr(self)
