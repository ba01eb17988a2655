"""Classes of the guides on own methods and arms, written out as the modules that they name."""

from __future__ import annotations

import re
from pathlib import Path

GUIDES = [Path(__file__).parents[1] / f"docs/guide/own-{name}.md" for name in ("methods", "arm")]
"""The guides."""


def write_examples(folder: Path) -> dict[str, str]:
    """Write every Python block that begins with the name of its file; return texts by name."""
    text = "".join(guide.read_text() for guide in GUIDES)
    blocks = re.findall(r"```python\n# (\w+\.py)\n(.*?)```", text, re.S)
    for name, text in blocks:
        (folder / name).write_text(text)
    return dict(blocks)
