"""Classes of the guide `docs/guide/own-methods.md`, written out as the modules that it names."""

from __future__ import annotations

import re
from pathlib import Path

GUIDE = Path(__file__).parents[1] / "docs/guide/own-methods.md"
"""The guide."""


def write_examples(folder: Path) -> dict[str, str]:
    """Write every Python block that begins with the name of its file; return texts by name."""
    blocks = re.findall(r"```python\n# (\w+\.py)\n(.*?)```", GUIDE.read_text(), re.S)
    for name, text in blocks:
        (folder / name).write_text(text)
    return dict(blocks)
