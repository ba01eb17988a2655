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

METHOD = re.compile(r"^from examples\.methods\.(\w+) import", re.MULTILINE)
"""Import of a class that an example puts into the stack."""


def on_page_markdown(markdown: str, *, page: Page, **_: Any) -> str:
    """Return the page of the examples with their code, which is folded."""
    return PICTURE.sub(_with_code, markdown) if page.file.src_uri == PAGE else markdown


def _with_code(picture: re.Match[str]) -> str:
    code = (EXAMPLES / f"{picture[1]}.py").read_text()
    methods = METHOD.findall(code)
    files = [*(f"methods/{name}.py" for name in methods), f"{picture[1]}.py"]
    return "\n\n".join([picture[0], *map(_folded, files)])


def _folded(file: str) -> str:
    code = (EXAMPLES / file).read_text()
    body = "\n".join(f"    {line}" for line in f"```python\n{code}```".splitlines())
    return f'??? example "{file}"\n\n{body}'
