"""MkDocs hook: the code of each example below its picture."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mkdocs.structure.pages import Page

PAGE = "guide/examples.md"
"""Page that shows the examples."""
EXAMPLES = Path(__file__).parents[2] / "examples"
"""Folder of the examples."""
PICTURE = re.compile(r"^!\[[^\]]*\]\(examples/(\w+)\.png\)$", re.MULTILINE)
"""Line that shows the picture of an example."""


def on_page_markdown(markdown: str, *, page: Page, **_: Any) -> str:
    """Return the page of the examples with their code, which is folded.

    Args:
        markdown: Text of the page.
        page: Page of the site.
    """
    return PICTURE.sub(_with_code, markdown) if page.file.src_uri == PAGE else markdown


def _with_code(picture: re.Match[str]) -> str:
    code = (EXAMPLES / f"{picture[1]}.py").read_text()
    body = "\n".join(f"    {line}" for line in f"```python\n{code}```".splitlines())
    return f'{picture[0]}\n\n??? example "{picture[1]}.py"\n\n{body}'
