"""Reference pages of the guide, from the code itself: commands, files, problems, what the report prints wrong.

typer app, pydantic schemas, shipped problems, ledger --> Markdown
"""

import re
import tomllib
from pathlib import Path
from typing import Any


def write_reference(folder: Path) -> None:
    """Writes every reference page; one that says the same already is left alone."""
    pages = {
        "commands": commands(), "data_file": data_file(), "gain_table": gain_table(), "problems": problems(),
        "plant_file": plant_file(), "study_file": study_file(), "goals": goals(),
        "errata": errata(),
    }  # fmt: skip
    folder.mkdir(exist_ok=True)
    for name, text in pages.items():
        path = folder / f"{name}.md"
        if not path.exists() or path.read_text("utf-8") != text:
            path.write_text(text, "utf-8")


def commands() -> str:
    """Every command with its arguments and options."""
    import typer

    from workbench.cli import app

    out = [
        "# Commands",
        "",
        "Exit code 0: done; 1: a requirement or promise is not met, or a budget ended before an answer; 2: bad input;",
        "3: a defect of the workbench, its traceback in a file that is named; 130: interrupted; 143: terminated.",
        "Each but 0 says one sentence on stderr. A reader that leaves early (`| head`) changes nothing.",
        "`workbench --install-completion` teaches the shell to complete commands, options and problem names.",
    ]
    group: Any = typer.main.get_command(app)
    for name, command in group.commands.items():
        out += ["", f"## `workbench {name}`", "", " ".join((command.help or "").split()), ""]
        out += _table(
            ("argument or option", "default", "meaning"),
            [(_spelled(p), _default(p), p.help or "") for p in command.params if p.name != "help"],
        )
    return "\n".join(out) + "\n"


def _spelled(parameter) -> str:
    if parameter.param_type_name == "argument":
        return f"`{parameter.metavar or parameter.name.upper()}`"
    return ", ".join(f"`{o}`" for o in (*parameter.opts, *parameter.secondary_opts))


def _default(parameter) -> str:
    value = parameter.default
    if parameter.required:
        return "required"
    return "" if value is None or value is False or value == "" or callable(value) else f"`{value}`"


def data_file() -> str:
    """The blocks and keys of data.toml."""
    from workbench.control.gains import GAIN_UNITS
    from workbench.files.schema import ProblemFile
    from workbench.goals.ride.requirement import limit_keys, requirement_class

    requirements = [(f"`{key}`", name, requirement_class(name).sense) for key, name in limit_keys().items()]
    gains = [(f"`{name}`", unit) for name, unit in GAIN_UNITS.items()]
    more = ["", "## Keys of `[requirements]`, and of every `limits`", "", "Each a positive number.", ""]
    more += _table(("key", "quantity", "must be"), requirements)
    more += ["", "## Names in `[bounds]` and `[fixed]`", "", "Each in one of the two: an interval, or a number.", ""]
    more += _table(("name", "unit"), gains)
    return _schema(
        "The problem's data file",
        "`problems/NAME/data.toml`, strict: a key that is not here is refused by name. Every unit stands in the key.",
        ProblemFile.model_json_schema(),
    ) + "\n".join([*more, ""])


def goals() -> str:
    """Every kind of goal with its keys."""
    from workbench.goals.goal import COMMON
    from workbench.goals.registry import keys_of, known

    rows = []
    for kind, cls in sorted(known().items()):
        what = " ".join((cls.__doc__ or "").strip().split("\n\n")[0].split())
        own = [f"`{key.name}`" for key in keys_of(kind) if key not in COMMON]
        rows.append((f"`{kind}`", what, ", ".join(own)))
    head = [
        "# Kinds of goals",
        "",
        "What `kind` may say under `[[goal]]` of a plant's data file; requirements of a vehicle stand under "
        "`[requirements]` by their key alone. {doc}`../how_to_add/goal` shows how to add one's own.",
        f"Every goal of such a plant takes {', '.join(f'`{key.name}`' for key in COMMON)} too.",
        "",
    ]
    return "\n".join(head + _table(("kind", "what it asks", "keys"), rows)) + "\n"


def gain_table() -> str:
    """The parts and entries of a gain table."""
    from workbench.handover.table.table import schema

    return _schema(
        "The gain table",
        "The JSON that `workbench design` writes. Decimals are strings: the digits a proof starts from. The published "
        "JSON schema ships as `workbench/handover/table/gain_table.schema.json`.",
        schema(),
    )


def problems() -> str:
    """The problems that ship."""
    from workbench.files.problem import shipped_problems

    rows = []
    for name, folder in shipped_problems().items():
        data = tomllib.loads((folder / "data.toml").read_text("utf-8"))
        rows.append((f"`{name}`", data["problem"]["title"], data["problem"].get("source", "")))
    head = ["# Problems that ship", "", "`workbench problems` lists them too; `workbench design NAME` designs one.", ""]
    return "\n".join(head + _table(("name", "title", "source"), rows)) + "\n"


def study_file() -> str:
    """The tables and keys of a study file."""
    from workbench.study.file import StudyFile

    return _schema(
        "The study file",
        "What `workbench study` reads; strict like a data file. {doc}`../studies` shows whole ones.",
        StudyFile.model_json_schema(),
    )


def plant_file() -> str:
    """The tables and keys of a data file that states a plant of one's own."""
    from workbench.control.structure.registry import BLOCKS
    from workbench.files.own_plant import OwnFile
    from workbench.files.structure import ParameterTable

    kinds = [(f"`{name}`", ", ".join(f"`{option}`" for option in kind.options)) for name, kind in BLOCKS.items()]
    schema = OwnFile.model_json_schema()
    schema["$defs"]["ParameterTable"] = ParameterTable.model_json_schema()
    more = ["", "## Kinds of blocks", "", "{doc}`../tuning` says what they are.", ""]
    return _schema(
        "The data file of a plant",
        "A `data.toml` without a vehicle, strict: a key that is not here is refused by name. Every unit stands in the "
        "key; one in seconds may be in `_ms`, `_min` or `_h`, one in `_rad_s` in `_hz`. Keys of a goal: {doc}`goals`.",
        schema,
    ) + "\n".join([*more, *_table(("kind", "options"), kinds), ""])


def errata() -> str:
    """What the ledger does not reproduce."""
    from workbench.ledger.book import AGREEING, appendices, printed_rows

    rows = [row for name in appendices() for row in printed_rows(name) if row.verdict not in AGREEING]
    head = [
        "# Where the report as scanned does not hold",
        "",
        f"The {len(rows)} rows of the ledger that are not reproduced, by place. `workbench reproduce` prints all rows, "
        "each beside the number computed here. Where no right value is known, none is given. "
        "The print itself was never seen, only a scan of it: what the scan's reader lost is listed apart.",
    ]
    out = list(head)
    for verdict in _MEANS:
        out += ["", f"## {verdict.capitalize()}", "", _MEANS[verdict]]
        for r in (r for r in rows if r.verdict == verdict):
            right = "" if r.corrected is None else f"; right is {r.corrected:.6g}"
            printed = r.printed if isinstance(r.printed, str) else f"{r.printed:.6g}"
            unit = "" if r.unit in ("1", "see formula") else f" {r.unit}"
            out += [
                "",
                f"{_plain(r.place)}: {_plain(r.quantity)}",
                f": Printed {_plain(printed)}{right}{unit}. {_plain(r.note)}",
            ]
    return "\n".join(out) + "\n"


_MEANS = {
    "misprint": "A sign, digit or index, most likely wrong in the print; the text around it says what was meant.",
    "scan": "What the reader of the scan lost or mixed up, dots, primes and indices; the print is not to blame.",
    "report's own inconsistency": "The report contradicts itself, or its arithmetic its own numbers.",
    "not reproducible": "Nothing that the report prints leads to the number.",
}


def _plain(text: str) -> str:
    """Text whose marks mean nothing to Markdown."""
    return "".join(f"\\{c}" if c in "\\*_`[]<>~$" else c for c in text)


def _schema(title: str, lead: str, schema: dict[str, Any]) -> str:
    """A JSON schema as one table per object."""
    out = [f"# {title}", "", lead]
    parts = {"whole file": schema, **schema.get("$defs", {})}
    used = {}  # part to the keys of the whole file that hold it
    for key, entry in schema["properties"].items():
        for part in re.findall(r"\w+", _kind(entry)):
            used.setdefault(part, []).append(f"`{key}`")
    for name, part in parts.items():
        if "properties" not in part:
            continue
        out += [
            "",
            f"## {name}" + (f": {', '.join(used[name])}" if name in used else ""),
            "",
            " ".join(str(part.get("description", "")).split()),
            "",
        ]
        needed = set(part.get("required", ()))
        rows = [
            (f"`{key}`", _kind(entry), "required" if key in needed else _given(entry.get("default")))
            for key, entry in part["properties"].items()
        ]
        out += _table(("key", "type", "default"), rows)
    return "\n".join(out) + "\n"


def _given(value) -> str:
    return "none" if value is None else f"`{value}`"


def _kind(entry: dict[str, Any]) -> str:
    """What an entry may be, in words."""
    if "$ref" in entry:
        return entry["$ref"].rsplit("/", 1)[1]
    if "const" in entry:
        return f"`{entry['const']!r}`"
    if "enum" in entry:
        return " or ".join(f"`{v!r}`" for v in entry["enum"])
    for key in ("anyOf", "oneOf", "allOf"):
        if key in entry:
            return " or ".join(dict.fromkeys(_kind(e) for e in entry[key] if e.get("type") != "null"))
    kind = str(entry.get("type", "anything"))
    if kind == "array" and "prefixItems" in entry:
        kinds = dict.fromkeys(_kind(e) for e in entry["prefixItems"])
        return f"{len(entry['prefixItems'])} × {' or '.join(kinds)}"
    if kind == "array":
        return f"list of {_kind(entry.get('items', {}))}"
    if kind == "object" and isinstance(entry.get("additionalProperties"), dict):
        return f"names to {_kind(entry['additionalProperties'])}"
    limits = [f"{sign} {entry[key]:g}" for key, sign in _LIMITS.items() if abs(entry.get(key, FAR)) < FAR]
    return f"{kind} {' and '.join(limits)}".strip()


FAR = 1e12  # what every number of a data file keeps: not worth a word
_LIMITS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}


def _table(heads, rows) -> list[str]:
    """A Markdown table; bars inside cells are escaped."""
    lines = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    return lines + ["| " + " | ".join(" ".join(str(c).replace("|", "\\|").split()) for c in row) + " |" for row in rows]
