"""Sphinx configuration of the user guide; `make guide` builds it into results/guide."""

import sys
from pathlib import Path

from docutils.nodes import SkipNode
from docutils.utils.math import latex2mathml

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

project = "maglev-workbench"
copyright = "The maglev-workbench developers"
extensions = ["myst_parser"]
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "maglev-workbench"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["guide.css"]
html_math_renderer = "mathml"  # of the browser itself: a page needs no network
html_theme_options = {
    name: {"code-font-size": "0.76rem"}  # 96 columns of a terminal fit
    for name in ("light_css_variables", "dark_css_variables")
}
smartquotes = False  # or --speed becomes a dash
nitpicky = True


def setup(app):
    """The reference pages are written from the code before anything is read; formulas become MathML."""
    from reference import write_reference

    app.connect("builder-inited", lambda _: write_reference(HERE / "reference"))
    app.add_html_math_renderer("mathml", (inline_math, None), (display_math, None))


def inline_math(translator, node):
    """A formula within a line."""
    translator.body.append(mathml(node.astext(), as_block=False))
    raise SkipNode


def display_math(translator, node):
    """A formula of its own, which scrolls where a screen is too narrow."""
    translator.body.append(f'<div class="math">{mathml(node.astext(), as_block=True)}</div>')
    raise SkipNode


def mathml(tex, as_block):
    """The formula for the browser; an unknown command fails the build."""
    return latex2mathml.tex2mathml(tex.strip(), as_block=as_block)
