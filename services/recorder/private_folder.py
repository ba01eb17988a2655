"""Folder of the recordings, which show a lab and who is in it."""

from __future__ import annotations

from pathlib import Path


def make_folder(folder: Path) -> None:
    """Create the folder, where it is missing, for its owner alone; one that exists stays."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
