"""Classes of the guides on own methods and arms, as modules of a folder."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

ROOT = Path(__file__).parents[1]
GUIDE = ROOT / "docs/guide/own-methods.md"
"""Guide whose Python blocks begin with the names of their files."""
FILES = [ROOT / f"examples/methods/{name}.py" for name in ("shape_servo", "carried", "lagging_arm")]
"""Files that the guides link."""


def write_examples(folder: Path) -> None:
    """Write the guide's blocks and the linked files into a folder."""
    for name, text in re.findall(r"```python\n# (\w+\.py)\n(.*?)```", GUIDE.read_text(), re.S):
        (folder / name).write_text(text)
    for file in FILES:
        shutil.copy(file, folder)
