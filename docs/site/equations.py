"""Equations as drawings in the page, which need no script, no font and no network."""

from html import escape
from xml.etree import ElementTree

import ziafont
import ziamath
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import SphinxError
from sphinx.writers.html5 import HTML5Translator

SIZE = 17
"""Of the letters, in pixels; text has 16."""

# Letters that are used twice would be drawn once and named, and a page has many equations: names
# would clash.
ziafont.config.svg2 = False


def drawn(node: nodes.math | nodes.math_block, inline: bool) -> str:
    """Return an equation as SVG, with its LaTeX for those who do not see it."""
    latex = node.astext()
    try:
        equation = ziamath.Latex(latex, size=SIZE, color="currentColor", inline=inline)
        picture = equation.svgxml()
    except Exception as error:  # The library has no errors of its own.
        raise SphinxError(
            f"{node.source}:{node.line}: cannot draw the equation {latex!r}: {error}"
        ) from error
    _, top, _, height = (float(number) for number in picture.attrib["viewBox"].split())
    picture.attrib |= {
        "role": "img",
        "aria-label": latex,
        "style": f"vertical-align: {-(top + height):.2f}px",
    }
    return ElementTree.tostring(picture, encoding="unicode")


def visit_inline(self: HTML5Translator, node: nodes.math) -> None:
    """Write an equation in a line of text."""
    self.body.append(
        f'<span class="math" title="{escape(node.astext())}">{drawn(node, inline=True)}</span>'
    )
    raise nodes.SkipNode


def visit_block(self: HTML5Translator, node: nodes.math_block) -> None:
    """Write an equation in a block of its own."""
    self.body.append(f'<div class="equation">{drawn(node, inline=False)}</div>')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.add_html_math_renderer("drawn", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True}
