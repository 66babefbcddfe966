"""Typesets formulas as MathML while the site is built: `$…$` in a line, `$$…$$` on its own.

Browsers draw MathML themselves, so pages need neither a script nor fonts nor a network.
"""

import html
import re

from latex2mathml.converter import convert


def on_page_content(content: str, **_: object) -> str:
    """What pymdownx.arithmatex marked in a page becomes MathML."""

    def inline(match: re.Match[str]) -> str:
        return convert(html.unescape(match[1]))

    def display(match: re.Match[str]) -> str:
        formula = convert(html.unescape(match[1]), display="block")
        return f'<div class="formula">{formula}</div>'

    content = re.sub(
        r'<div class="arithmatex">\s*\\\[(.*?)\\\]\s*</div>', display, content, flags=re.DOTALL
    )
    return re.sub(
        r'<span class="arithmatex">\\\((.*?)\\\)</span>', inline, content, flags=re.DOTALL
    )
