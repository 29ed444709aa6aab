r"""Render formulas as MathML at build time, with the converter that docutils itself uses for HTML.

Sphinx's own choices are MathJax, which every reader's browser fetches from the network, and images, which need a
TeX installation. All current browsers draw MathML. ``\tag{2a}`` at the end of a displayed formula prints
its number, which is the number that the code's docstrings cite, and makes it a target, ``#eq-2a``.
"""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.writers.html5 import HTML5Translator

TAG = re.compile(r"\\tag\{([^}]*)\}")


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer as ``mathml``."""
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
    return {"version": "1.0", "parallel_read_safe": True, "parallel_write_safe": True}


def visit_inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write a formula in a line of text."""
    translator.body.append(f'<span class="math">{_mathml(node, node.astext(), block=False)}</span>')
    raise nodes.SkipNode


def visit_block(translator: HTML5Translator, node: nodes.math_block) -> None:
    """Write a displayed formula, scrolling by itself where it is wider than the page, and its number."""
    text = node.astext()
    tags = TAG.findall(text)
    if len(tags) > 1:
        msg = f"A displayed formula has one number at most, not {tags}: {text}"
        raise ExtensionError(msg)
    formula = _mathml(node, TAG.sub("", text).strip(), block=True)
    anchor, number = (f' id="eq-{tags[0]}"', f'<span class="eqno">({tags[0]})</span>') if tags else ("", "")
    translator.body.append(f'<div class="math"{anchor}><div class="formula">{formula}</div>{number}</div>\n')
    raise nodes.SkipNode


def _mathml(node: nodes.Element, text: str, *, block: bool) -> str:
    try:
        return str(tex2mathml(text, as_block=block))
    except MathError as error:
        msg = f"{node.source}:{node.line}: formula {text!r} cannot be written as MathML: {error}"
        raise ExtensionError(msg) from error
