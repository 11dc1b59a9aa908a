"""The report of a study: one HTML file that needs nothing else, in the style of a design's report.

StudyResult --> failing share, distributions, sensitivity, fronts, parameters, provenance
"""

import json
from html import escape
from pathlib import Path

import numpy as np

from workbench.handover.report.style import NAMED_FRAME, WIDE_FRAME, figure_block, style_sheet, svg_figure, table_block
from workbench.machine.writing import write_text
from workbench.result import figure as digits
from workbench.study.definition import spread
from workbench.study.pareto import objectives
from workbench.study.plot import histogram, plot_front, plot_histogram, plot_scatter, plot_sensitivity, thinned
from workbench.study.run import StudyResult
from workbench.study.sensitivity import Index
from workbench.study.summary import LEVELS

MOST_FIGURES = 8  # quantities with pictures of their own; the others are in the tables
LISTED = 40  # rows of the table behind a scatter


def study_report_html(result: StudyResult) -> str:
    """The report's text."""
    study = result.study
    front = study.task == "pareto"
    sections = [
        ("Failing rows", "" if front else _failing(result)),
        ("The front", _fronts(result) if front else ""),
        ("What moves what", _sensitivity(result)),
        ("Distributions", "" if front else _distributions(result)),
        ("Quantities", _quantities(result)),
        ("Parameters", table_block(["parameter", "spread"], [[p.name, spread(p)] for p in study.parameters])),
        ("Provenance", _provenance(result)),
    ]
    body = "".join(f"<section><h2>{title}</h2>{content}</section>" for title, content in sections if content)
    title = escape(f"Study of {result.provenance['problem']}: {study.rows_planned} × {study.task}")
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">"
        f"<title>{title}</title><style>{style_sheet()}</style></head><body>"
        f"<header>{_header(result, title)}</header><main>{body}</main></body></html>\n"
    )


def write_study_report(result: StudyResult, path: Path) -> None:
    """Writes `study_report_html` to a file."""
    write_text(path, study_report_html(result))


def _header(result: StudyResult, title: str) -> str:
    f, p = result.failing, result.provenance
    share = f"{100 * f.share:.3g} %"
    interval = "" if f.low is None or f.high is None else f"{100 * f.low:.2g} … {100 * f.high:.2g} %"
    tiles = [
        ("rows", str(f.rows_in_all), ""),
        ("failing", share, interval),
        ("parameters", str(len(result.study.parameters)), result.study.sampling.replace("_", " ")),
        ("computing time", digits(p["compute_seconds"]), "s"),
    ]
    cells = "".join(
        f'<div class="tile">{escape(n)}<b>{escape(v)} <small>{escape(u)}</small></b></div>' for n, v, u in tiles
    )
    return f'<p class="quiet">{escape(p["finished"])}</p><h1>{title}</h1><div class="tiles">{cells}</div>'


def _failing(result: StudyResult) -> str:
    f = result.failing
    rows = [[reason, str(count), f"{100 * count / max(f.rows_in_all, 1):.3g} %"] for reason, count in f.by.items()]
    if f.low is None or f.high is None:
        words = "These rows are no random sample: their share says nothing of a probability."
    else:
        words = (
            f"{100 * result.study.confidence:g} % interval of the share: {100 * f.low:.3g} to {100 * f.high:.3g} % "
            "(Clopper and Pearson, as for independent rows)."
        )
    return f'<p class="quiet">{escape(words)}</p>' + table_block(["reason", "rows", "share"], rows)


def _sensitivity(result: StudyResult) -> str:
    """Bars of every quantity, and its scatter over the parameter that moves it most."""
    blocks = []
    for k, (quantity, own) in enumerate(list(_telling(result).items())[:MOST_FIGURES]):
        svg = svg_figure(
            lambda ax, own=own: plot_sensitivity(own, ax=ax), f"moves-{k}", f"Sensitivity of {quantity}",
            size=(5.4, 1.6 + 0.32 * len({i.parameter for i in own})), frame=NAMED_FRAME,
        )  # fmt: skip
        rows = [[i.parameter, i.kind, digits(i.value), digits(i.low), digits(i.high)] for i in own]
        caption = f"{quantity}: {own[0].used} {'base points' if result.study.sampling == 'sobol' else 'rows'} used."
        blocks.append(figure_block(svg, caption, ["parameter", "index", "value", "from", "to"], rows))
        blocks.append(_scatter(result, quantity, max(own, key=lambda i: abs(i.value)).parameter, k))
    if not blocks:
        return ""
    words = (
        "First order: share of the variance that goes with the parameter alone; total order: with all it takes part in."
        if result.study.sampling == "sobol"
        else "Regression: change in deviations of the quantity per deviation of the parameter. Rank correlation: the "
        "same of ranks, freed of the other parameters."
    )
    return f'<p class="quiet">{escape(words)}</p><div class="figures">{"".join(blocks)}</div>'


def _scatter(result: StudyResult, quantity: str, parameter: str, k: int) -> str:
    x, y = result.numbers(parameter), result.numbers(quantity)
    limits = [limit for limit in result.limits if limit.quantity == quantity]
    svg = svg_figure(
        lambda ax: plot_scatter(x, y, (parameter, quantity), failed=result.failed, limits=limits, ax=ax),
        f"scatter-{k}", f"{quantity} over {parameter}", frame=WIDE_FRAME,
    )  # fmt: skip
    shown = np.flatnonzero(np.isfinite(y))
    listed = thinned(shown)[:LISTED]
    rows = [[str(r), digits(float(x[r])), digits(float(y[r])), "yes" if result.failed[r] else "no"] for r in listed]
    note = f"{len(listed)} of {len(shown)} rows"
    return figure_block(svg, f"{len(thinned(shown))} of {len(shown)} rows drawn.",
                        ["row", parameter, quantity, "failing"], rows, note)  # fmt: skip


def _distributions(result: StudyResult) -> str:
    blocks = []
    drawn = [s.quantity for s in result.spreads if s.count and s.quantity != "stable" and s.deviation]
    for k, quantity in enumerate(drawn[:MOST_FIGURES]):
        values = result.numbers(quantity)
        limits = [limit for limit in result.limits if limit.quantity == quantity]
        svg = svg_figure(
            lambda ax, v=values, q=quantity, x=limits: plot_histogram(v, q, limits=x, ax=ax), f"spread-{k}",
            f"Distribution of {quantity}",
        )  # fmt: skip
        counts, edges = histogram(values)
        rows = [[digits(float(a)), digits(float(b)), str(c)] for a, b, c in zip(edges, edges[1:], counts, strict=False)]
        caption = f"{int(np.isfinite(values).sum())} of {len(values)} rows have a value."
        blocks.append(figure_block(svg, caption, ["from", "to", "rows"], rows))
    return f'<div class="figures">{"".join(blocks)}</div>' if blocks else ""


def _quantities(result: StudyResult) -> str:
    heads = [f"{100 * level:g} %" for level in LEVELS]
    rows = [
        [s.quantity, str(s.count), digits(s.mean), digits(s.deviation), *(digits(q) for q in s.quantiles)]
        + [""] * (len(LEVELS) - len(s.quantiles))
        for s in result.spreads
    ]
    return table_block(["quantity", "rows", "mean", "deviation", *heads], rows)


def _fronts(result: StudyResult) -> str:
    names, values = objectives(result.columns, result.front)
    best = np.array(result.columns["nondominated"], bool)
    if not best.any() or not names:
        return "<p>No design was found within these limits.</p>"
    cost = 0  # of a vehicle's ride, or the first soft goal
    blocks = []
    for k, name in enumerate(names):
        if k == cost:
            continue
        svg = svg_figure(
            lambda ax, k=k, name=name: plot_front(values[:, k], values[:, cost], (name, names[cost]), best, ax=ax),
            f"front-{k}", f"{names[cost]} against {name}",
        )  # fmt: skip
        blocks.append(f"<figure>{svg}<figcaption>{escape(name)}</figcaption></figure>")
    rows = [
        [str(r), result.columns["requirement"][r], digits(result.columns["limit"][r]), *map(digits, values[r].tolist()),
         "yes" if best[r] else "no"]
        for r in range(len(best))
    ]  # fmt: skip
    table = table_block(["row", "requirement swept", "limit [SI]", *names, "on the front"], rows)
    return f'<div class="figures">{"".join(blocks)}</div>{table}'


def _provenance(result: StudyResult) -> str:
    p = result.provenance
    shown = (
        "study_sha256",
        "problem",
        "data_sha256",
        "seed",
        "finished",
        "wall_seconds_of_last_run",
        "compute_seconds",
    )
    rows = [[name.replace("_", " "), str(p[name])] for name in shown]
    rows += [[name, text] for name, text in p["versions"].items()]
    rows.append(["table", result.table.name])
    facts = "".join(f'<tr><th scope="row">{escape(n)}</th><td class="text mono">{escape(v)}</td></tr>' for n, v in rows)
    definition = escape(json.dumps(p["definition"], indent=1, ensure_ascii=False)[:20_000])
    return (
        f'<div class="wide"><table><tbody>{facts}</tbody></table></div>'
        f'<details><summary>The study as it was read</summary><pre class="mono">{definition}</pre></details>'
    )


def _telling(result: StudyResult) -> dict[str, list[Index]]:
    """Indices by quantity, without those that are a yes or a no: their shares stand under the failing rows."""
    out: dict[str, list[Index]] = {}
    for one in result.indices:
        if not set(result.columns[one.quantity]) <= {True, False, None}:
            out.setdefault(one.quantity, []).append(one)
    return out
