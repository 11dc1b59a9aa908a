"""The table of a study in a file: Parquet or CSV, with where it comes from inside it.

columns --write_study--> table.parquet (provenance under the metadata key "workbench")
                         table.csv     (provenance in comment lines before the header)
"""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from workbench.errors import InputError
from workbench.machine.writing import replacing, write_text

METADATA = b"workbench"


def write_study(path: Path, columns: Mapping[str, Sequence], provenance: Mapping[str, Any]) -> None:
    """Writes the table; the kind of file follows from its name."""
    if path.suffix == ".csv":
        write_text(path, _csv(columns, provenance))
        return
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise InputError(
            'a Parquet table needs the package pyarrow; install maglev-workbench[tables], or ask for output = "csv".'
        ) from error
    table = pa.table({name: _typed(pa, name, list(values)) for name, values in columns.items()})
    text = json.dumps(provenance, sort_keys=True, ensure_ascii=False)
    table = table.replace_schema_metadata({METADATA: text.encode()})
    with replacing(path) as file:
        pq.write_table(table, file)


def _typed(pa, name: str, values: list):
    """Text, yes or no, whole number or real; so that an empty column has the type of a full one."""
    if name == "error":
        return pa.array(values, pa.string())
    if name == "row":
        return pa.array(values, pa.int64())
    if any(isinstance(v, str) for v in values):
        return pa.array(values, pa.string())
    if name == "stable" or (values and all(isinstance(v, bool) for v in values)):
        return pa.array(values, pa.bool_())
    return pa.array([None if v is None else float(v) for v in values], pa.float64())


def _csv(columns: Mapping[str, Sequence], provenance: Mapping[str, Any]) -> str:
    out = io.StringIO()
    for name, value in provenance.items():
        out.write(f"# {name}: {json.dumps(value, ensure_ascii=False, sort_keys=True)}\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(columns)
    for row in zip(*columns.values(), strict=True):
        writer.writerow(["" if v is None else repr(v) if isinstance(v, float) else v for v in row])
    return out.getvalue()
