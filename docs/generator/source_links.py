"""MkDocs hook: links that leave `docs/`, to source files.

On a code host they open the file; the site has no source files, so there they become the file's
path, or a link to `repo_url` where the configuration names one.
"""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.pages import Page

CODE_OR_LINK = re.compile(
    r"^```.*?^```|`[^`\n]+`(?!\])|(?<!!)\[(?P<text>[^\]\n]+)\]\((?P<target>[^)\s]+)\)",
    re.MULTILINE | re.DOTALL,
)
"""Code, which is left as it is, or a link of Markdown."""


def on_page_markdown(markdown: str, *, page: Page, config: MkDocsConfig, **_: Any) -> str:
    """Return a page's Markdown with its links to source files replaced."""
    folder = os.path.dirname(page.file.src_uri)

    def replaced(match: re.Match[str]) -> str:
        text, target = match["text"], match["target"]
        if text is None or re.match(r"[a-z]+:|#|/", target):
            return match[0]
        path = os.path.normpath(os.path.join("docs", folder, target.partition("#")[0]))
        if path.startswith("docs/"):
            return match[0]
        if config.repo_url:
            return f"[{text}]({config.repo_url.rstrip('/')}/blob/main/{path})"
        return f"`{path}`" if text.strip("`") in path else f"{text} (`{path}`)"

    return CODE_OR_LINK.sub(replaced, markdown)
