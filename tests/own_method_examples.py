"""Classes of the guides on own methods and arms, as modules of a folder."""

from __future__ import annotations

import shutil
from pathlib import Path

METHODS = Path(__file__).parents[1] / "examples/methods"
"""Folder of the files that the guides link."""


def write_examples(folder: Path) -> None:
    """Copy the files into a folder from which Python imports."""
    shutil.copytree(METHODS, folder, dirs_exist_ok=True)
