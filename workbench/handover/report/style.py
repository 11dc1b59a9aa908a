"""How the report looks: one style sheet for screen, phone, dark rooms and paper; figures that follow it.

    draw(ax) --matplotlib in a reserved palette--> SVG --colours become CSS variables, ids become unique--> inline <svg>

Each colour of a figure is one of `PALETTE`, light and dark; text stays text. Nothing refers to anything outside.
"""

import re
from collections.abc import Callable, Sequence
from html import escape
from importlib.resources import files
from io import StringIO
from typing import Any

from workbench.analysis.first_tables import Cell, MarkedTable

# CSS variable: (what figures are drawn with and what light screens and paper show, what dark screens show)
PALETTE = {
    "--series-0": ("#1d5fa6", "#82b6f2"),
    "--series-1": ("#b8560a", "#f2a65e"),
    "--series-2": ("#2b7a4b", "#7fd3a0"),
    "--series-3": ("#b0281f", "#ff8f84"),
    "--series-4": ("#6b4aa0", "#c3a6f5"),
    "--series-5": ("#0e7480", "#6fd2de"),
    "--ink": ("#1b1e23", "#e7e9ec"),
    "--rule": ("#b9bec6", "#4a5058"),
}
SERIES = [light for name, (light, _) in PALETTE.items() if name.startswith("--series")]

_RC = {
    "svg.fonttype": "none",
    "svg.hashsalt": "maglev-workbench",
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "savefig.facecolor": "none",
    "text.color": PALETTE["--ink"][0],
    "axes.labelcolor": PALETTE["--ink"][0],
    "axes.edgecolor": PALETTE["--ink"][0],
    "axes.titlecolor": PALETTE["--ink"][0],
    "xtick.color": PALETTE["--ink"][0],
    "ytick.color": PALETTE["--ink"][0],
    "grid.color": PALETTE["--rule"][0],
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "font.size": 9.5,
    "legend.fontsize": 8.5,
}
FRAME = (0.13, 0.13, 0.85, 0.78)  # of the axes in a figure: room for labels of the sizes above
WIDE_FRAME = (0.19, 0.13, 0.79, 0.78)  # where numbers of many digits do
NAMED_FRAME = (0.34, 0.13, 0.64, 0.78)  # where words stand at the left


def svg_figure(
    draw: Callable[[Any], Any], name: str, label: str, *, size: tuple[float, float] = (5.4, 3.7), frame=FRAME
) -> str:
    """What `draw(ax)` draws, as an inline <svg> that follows the style sheet.

    name : prefix of the ids inside, unique in the document;  label : for those who cannot see it;  size : inches
    frame : left, bottom, width, height of the axes, as shares of the size
    """
    import matplotlib
    from cycler import cycler
    from matplotlib.figure import Figure

    with matplotlib.rc_context({**_RC, "axes.prop_cycle": cycler(color=SERIES)}):
        figure = Figure(figsize=size)
        draw(figure.add_axes(frame))
        stream = StringIO()
        figure.savefig(stream, format="svg", metadata={"Date": None})
    svg = stream.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"\s*<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r'\bid="', f'id="{name}-', svg)
    svg = re.sub(r'href="#', f'href="#{name}-', svg)
    svg = svg.replace("url(#", f"url(#{name}-").replace(' target="_blank"', "")  # links lead within the page
    for variable, (light, _) in PALETTE.items():
        svg = svg.replace(light, f"var({variable})")
    svg = svg.replace("#000000", "var(--ink)")  # black of a picture that chooses its own
    return svg.replace("<svg", f'<svg role="img" aria-label="{escape(label)}"', 1).strip()


def figure_block(svg: str, caption: str, columns: list[str], rows: list[list[str]], note: str = "") -> str:
    """A figure with its caption, and its numbers folded away beneath."""
    words = f"Numbers{f' ({note})' if note else ''}"
    return (
        f"<figure>{svg}<figcaption>{escape(caption)}</figcaption>"
        f"<details><summary>{escape(words)}</summary>{table_block(columns, rows)}</details></figure>"
    )


def table_block(columns: Sequence[str], rows: Sequence[Sequence[str | Cell]], *, caption: str = "") -> str:
    """A table; the first column names the row. Cells are text, marked or not."""
    head = "".join(f'<th scope="col">{escape(c)}</th>' for c in columns)
    body = "".join(f"<tr>{_cell(row[0], 'th', 'row')}{''.join(_cell(c) for c in row[1:])}</tr>" for row in rows)
    title = f"<caption>{escape(caption)}</caption>" if caption else ""
    return f'<div class="wide"><table>{title}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'


def _cell(cell: str | Cell, tag: str = "td", scope: str = "") -> str:
    named = f' scope="{scope}"' if scope else ""
    if isinstance(cell, str):
        return f"<{tag}{named}>{escape(cell)}</{tag}>"
    kinds = " ".join(["worst"] * cell.worst + ["missed"] * cell.bad)
    text = f"<b>{escape(cell.text)}</b>" if cell.worst else escape(cell.text)
    return f"<{tag}{named}{f' class={chr(34)}{kinds}{chr(34)}' if kinds else ''}>{text}</{tag}>"


def first_blocks(tables: Sequence[MarkedTable]) -> str:
    """The tables that are read first, each with the line that sums it up; the worst of a column in bold."""
    blocks = (
        f"<div><h3>{escape(t.title)}</h3>{f'<p>{escape(t.words)}</p>' if t.words else ''}"
        f"{table_block(t.columns, t.rows)}</div>"
        for t in tables
    )
    return f'<div class="figures">{"".join(blocks)}</div>' if tables else ""


def style_sheet() -> str:
    """The whole CSS."""
    light = "".join(f"{name}:{colour};" for name, (colour, _) in PALETTE.items())
    dark = "".join(f"{name}:{colour};" for name, (_, colour) in PALETTE.items())
    text = (files("workbench.handover.report") / "style.css").read_text(encoding="utf-8")
    return text.replace("/*light*/", light).replace("/*dark*/", dark)
