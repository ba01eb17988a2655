"""Kind of a file by its content, to name one that was given in place of another."""

from __future__ import annotations

from pathlib import Path

MAGIC_NUMBERS = {
    b"\x89MCAP0\r\n": "a recording (MCAP)",
    b"PK\x03\x04": "a ZIP archive, as .npz files are",
    b"\x93NUMPY": "a single array (.npy)",
    b"\x89PNG": "a PNG image",
    b"\xff\xd8\xff": "a JPEG image",
    b"%PDF": "a PDF document",
    b"\x1f\x8b": "a gzip archive",
    b"\x7fELF": "a program",
    b"#ROSBAG": "a bag of ROS 1",
    b"SQLite format 3": "an SQLite database, as bags of ROS 2 may be",
    b"\x28\xb5\x2f\xfd": "an archive of Zstandard",
    b"ply\n": "a mesh in PLY format",
    b"ply\r": "a mesh in PLY format",
    b"ISO-10303-21": "a CAD model (STEP)",
    b"version https://git-lfs": "a pointer of Git LFS, whose file `git lfs pull` fetches",
}
"""Kinds by the first bytes of the file."""
TEXT_KINDS = {
    ".md": "a text in Markdown",
    ".toml": "a TOML file, as scenarios are",
    ".csv": "a table (CSV)",
    ".py": "a Python program",
    ".json": "a JSON file",
    ".urdf": "a robot's description (URDF)",
    ".dae": "a mesh in COLLADA format",
}
"""Kinds of texts by the ending of the name."""
HEAD_SIZE = 4096
"""Number of bytes that are read [bytes]."""


def kind_of(path: Path) -> str:
    """Return the kind of a file in words, e.g. `a PNG image`."""
    try:
        with path.open("rb") as stream:
            head = stream.read(HEAD_SIZE)
    except OSError:
        return "a file that cannot be read"
    if not head:
        return "an empty file"
    if kind := known_kind(head):
        return kind
    if b"\0" in head:
        return "a binary file of an unknown kind"
    return TEXT_KINDS.get(path.suffix.lower(), "a text")


def known_kind(head: bytes) -> str:
    """Return the kind of a file by its first bytes; empty where they tell none."""
    return next((kind for magic, kind in MAGIC_NUMBERS.items() if head.startswith(magic)), "")
