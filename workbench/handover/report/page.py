"""The shell of a report: one HTML file that needs nothing else, its sections, and the tables that every report has."""

from collections.abc import Mapping, Sequence
from html import escape

from workbench.goals.verdict import Verdict
from workbench.handover.report.style import style_sheet, table_block
from workbench.result import figure as digits


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


def facts_table(
    facts: Sequence[Sequence[str]], binding: Sequence[str], heads: list[str], starts: list[list[str]],
    sources: Mapping[str, str],
) -> str:  # fmt: skip
    """Provenance: facts by name, what is at its limit, how the starts ended, where the numbers come from."""
    found = "".join(
        f'<tr><th scope="row">{escape(n)}</th><td class="text mono">{escape(v)}</td></tr>' for n, v in facts
    )
    listed = "".join(
        f'<tr><th scope="row">{escape(n)}</th><td class="text">{escape(v)}</td></tr>' for n, v in sources.items()
    )
    return (
        f'<div class="wide"><table><tbody>{found}</tbody></table></div>'
        f"<p>At their limits: {escape(', '.join(binding) or 'none')}.</p>{table_block(heads, starts) if starts else ''}"
        "<details><summary>Where the numbers come from</summary>"
        f'<div class="wide"><table><tbody>{listed}</tbody></table></div></details>'
    )
