"""MkDocs hook: equations as MathML, which browsers show without a script."""

from __future__ import annotations

import html
import re
from typing import Any

from latex2mathml.converter import convert

INLINE = re.compile(r'<span class="arithmatex">\\\((.*?)\\\)</span>', re.DOTALL)
"""Equation in a line, as the Markdown extension `arithmatex` leaves it."""
BLOCK = re.compile(r'<div class="arithmatex">\\\[(.*?)\\\]</div>', re.DOTALL)
"""Equation on a line of its own."""


def on_page_content(content: str, **_: Any) -> str:
    """Return a page's HTML with its equations in MathML."""
    content = INLINE.sub(lambda m: convert(html.unescape(m[1])), content)
    return BLOCK.sub(lambda m: convert(html.unescape(m[1]).strip(), display="block"), content)
