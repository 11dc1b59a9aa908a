"""The shell of a report: one HTML file that needs nothing else, its sections, and the tables that every report has."""

from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from html import escape

from workbench.design.problem import Problem
from workbench.design.record import Design
from workbench.goals.verdict import Verdict
from workbench.handover.report.style import style_sheet, table_block
from workbench.handover.table.plant import PlantTable
from workbench.handover.table.table import GainTable
from workbench.result import figure as digits

Table = GainTable | PlantTable


def page(title: str, header: str, sections: Sequence[tuple[str, str]]) -> str:
    """The document: header and the sections that have content, each (title, HTML).

    Nothing is fetched, and the page forbids itself to try.
    """
    body = "".join(f"<section><h2>{name}</h2>{content}</section>" for name, content in sections if content)
    title = escape(title)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">"
        f"<title>{title}</title><style>{style_sheet()}</style></head><body>"
        f"<header>{header}</header><main>{body}</main></body></html>\n"
    )


def requirement_table(verdicts: Sequence[Verdict]) -> str:
    """Every goal with what was asked, what was found, how much of the limit is used, and where."""
    if not verdicts:
        return "<p>This problem asks for nothing.</p>"
    rows = "".join(_requirement_row(v) for v in verdicts)
    columns = ("requirement", "asked", "found", "used", "", "where it is tightest")
    head = "".join(f'<th scope="col"{" class=text" if c.startswith("where") else ""}>{c}</th>' for c in columns)
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'


def _requirement_row(v: Verdict) -> str:
    unit, factor = ("mm", 1e3) if v.unit == "m" else ("" if v.unit == "1" else v.unit, 1.0)
    used = None
    if v.value is not None and v.limit:
        used = v.value / v.limit if v.sense == "<=" else v.limit / v.value if v.value > 0 else None
    word, kind = ("met", "met") if v.met else ("missed", "missed")
    bar = (
        ""
        if used is None
        else f'<span class="bar {kind}"><i style="width:{min(100.0, 100 * used):.0f}%"></i></span> {100 * used:.0f} %'
    )
    sense = "≤" if v.sense == "<=" else "≥"
    found = "–" if v.value is None else digits(factor * v.value)
    return (
        f'<tr><th scope="row">{escape(v.name)}</th><td>{sense} {factor * v.limit:g} {escape(unit)}</td>'
        f'<td>{found} {escape(unit)}</td><td>{bar}</td><td class="{kind}">{word}</td>'
        f'<td class="text">{escape(v.where)}</td></tr>'
    )


def when(table: Table | None, created: datetime | None) -> str:
    """The time a report shows: that given, else the table's, else now."""
    return table.created if table and created is None else (created or datetime.now(UTC)).strftime("%Y-%m-%dT%H:%M:%SZ")


def head(problem: Problem, time: str, word: str, kind: str, tiles: Sequence[tuple[str, str, str]]) -> str:
    """Name and title, the verdict in a word, figures in tiles (name, digits, unit).

    kind : "met", "missed", or "" where nothing is asked
    """
    cells = "".join(
        f'<div class="tile">{escape(n)}<b>{escape(v)} <small>{escape(u)}</small></b></div>' for n, v, u in tiles
    )
    return (
        f'<p class="quiet">{escape(problem.name)} · {escape(time)}</p><h1>{escape(problem.title or problem.name)}</h1>'
        f'<p><span class="verdict {kind}">{escape(word)}</span></p><div class="tiles">{cells}</div>'
    )


def figures(blocks: Sequence[str]) -> str:
    """Pictures side by side, where there are any."""
    return f'<div class="figures">{"".join(blocks)}</div>' if blocks else ""


def provenance(design: Design, table: Table | None, cost: str) -> str:
    """Facts by name, what is at its limit, how the starts ended, where the numbers come from.

    cost : what is made small, as the starts' table heads it
    """
    problem = design.problem
    facts = [["problem", problem.name]]
    facts += [["problem data, SHA-256", problem.data_sha256]] if problem.data_sha256 else []
    facts += [["solver", design.solver], ["seed", str(design.seed)]]
    if table is not None:
        facts += [["gain table, SHA-256", table.digest], *([n, v] for n, v in table.versions.model_dump().items())]
    starts = [
        [str(s.number), digits(s.cost), digits(s.violation), str(s.evaluations), s.message] for s in design.starts
    ]
    heads = ["start", cost, "violation", "evaluations", "how it ended"]

    def listed(rows: Iterable[Sequence[str]], kind: str) -> str:
        cells = (f'<tr><th scope="row">{escape(n)}</th><td class="{kind}">{escape(v)}</td></tr>' for n, v in rows)
        return f'<div class="wide"><table><tbody>{"".join(cells)}</tbody></table></div>'

    return (
        f"{listed(facts, 'text mono')}<p>At their limits: {escape(', '.join(design.binding) or 'none')}.</p>"
        f"{table_block(heads, starts) if starts else ''}<details><summary>Where the numbers come from</summary>"
        f"{listed(problem.sources.items(), 'text')}</details>"
    )
