"""Code of a notebook."""

from __future__ import annotations

import json
from pathlib import Path


def code_of(notebook: Path) -> str:
    """Return the code of all cells, as one program."""
    cells = json.loads(notebook.read_text())["cells"]
    return "\n\n".join("".join(c["source"]) for c in cells if c["cell_type"] == "code")
