r"""Render formulas as SVG in the page when it is built, in Python alone, by ziamath and its STIX font.

Sphinx's own choices are MathJax, which every reader's browser fetches from the network, and images that need a TeX
installation; MathML is drawn well only where the reader has a mathematical font. ``\tag{2a}`` in a displayed formula
prints its number, which is the number that the code's docstrings cite, and makes it a target, ``#eq-2a``.
"""

import html
import re
from typing import Any

import ziamath
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.writers.html5 import HTML5Translator

TAG = re.compile(r"\\tag\{([^}]*)\}")
SIZE = 17.5  #: of the font in pixels, where the text's is 16
TEXT_SIZE = 16.0
WORD_JOINER = "\N{WORD JOINER}"  # keeps a comma on the line of the formula before it
OPENING = re.compile(r'<svg (?:xmlns[^ ]*="[^"]*" )+width="([\d.]+)" height="([\d.]+)"')

SYMBOL = re.compile(r'<symbol id="([^"]*)"[^>]*?(?:/>|>.*?</symbol>)', re.DOTALL)  # a blank closes itself


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer as ``svg``."""
    app.add_html_math_renderer("svg", (visit_inline, None), (visit_block, None))
    return {"version": "1.0", "parallel_read_safe": True, "parallel_write_safe": True}


def visit_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write a formula in a line of text."""
    translator.body.append(_svg(translator, node, node.astext(), block=False) + WORD_JOINER)
    raise nodes.SkipNode


def visit_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write a displayed formula, scrolling by itself where it is wider than the page, and its number."""
    text = node.astext()
    tags = TAG.findall(text)
    if len(tags) > 1:
        msg = f"A displayed formula has one number at most, not {tags}: {text}"
        raise ExtensionError(msg)
    formula = _svg(translator, node, TAG.sub("", text), block=True)
    anchor, number = (f' id="eq-{tags[0]}"', f'<span class="eqno">({tags[0]})</span>') if tags else ("", "")
    translator.body.append(f'<div class="math"{anchor}><div class="formula">{formula}</div>{number}</div>\n')
    raise nodes.SkipNode


def _svg(translator: HTML5Translator, node: nodes.Element, text: str, *, block: bool) -> str:
    """Draw a formula in the colour of the text, its sizes in units of the text's font."""
    text = " ".join(text.split())
    try:
        formula = ziamath.Latex(text, size=SIZE, color="currentColor", inline=not block)
        svg, descent = formula.svg(), formula.getyofst()
    except Exception as error:  # whatever the parser stumbles over, say where
        msg = f"{node.source}:{node.line}: formula {text!r} cannot be drawn: {error!r}"
        raise ExtensionError(msg) from error
    found = OPENING.match(svg)
    if found is None:
        msg = f"Unexpected beginning of a drawing: {svg[:80]}"
        raise ExtensionError(msg)
    width, height = (float(size) / TEXT_SIZE for size in found.groups())
    place = f"width:{width:.3f}em;height:{height:.3f}em" + (
        "" if block else f";vertical-align:{descent / TEXT_SIZE:.3f}em"
    )
    label = html.escape(text, quote=True)
    drawing = _with_new_symbols(svg[found.end() :], translator.__dict__.setdefault("drawn_symbols", {}))
    return f'<svg xmlns="http://www.w3.org/2000/svg" role="img" aria-label="{label}" style="{place}"{drawing}'


def _with_new_symbols(drawing: str, drawn: dict[str, str]) -> str:
    """Leave out shapes that the page has already, since an identifier must not stand twice in it."""

    def kept(symbol: re.Match[str]) -> str:
        name, shape = symbol[1], symbol[0]
        if name not in drawn:
            drawn[name] = shape
            return shape
        if drawn[name] != shape and not shape.endswith("/>"):
            msg = f"Two shapes are called {name}."
            raise ExtensionError(msg)
        return ""

    return SYMBOL.sub(kept, drawing)
