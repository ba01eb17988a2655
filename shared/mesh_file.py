"""Triangle meshes from STL and OBJ files."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from shared.bounded_file import read_file

MAX_MESH_SIZE = 64 * 2**20
"""Largest file of a mesh [bytes]."""
MAX_TRIANGLES = 500_000
"""Largest number of triangles of a mesh."""
HEADER_SIZE = 84
"""Bytes before the first triangle of a binary STL file: comment and number of triangles."""
RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
"""Triangle of a binary STL file."""
SUFFIXES = (".stl", ".obj")
"""Endings of the files that are read."""


def read_mesh(path: Path) -> Float64[np.ndarray, "m 3 3"]:
    """Return the corners of a mesh's triangles, in the unit of the file.

    Args:
        path: STL file, binary or text, or OBJ file.

    Raises:
        ValueError: The file is of another kind, too large, or damaged; the text says which.
        OSError: The file cannot be read.
    """
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{path} ends in {suffix!r}; give a mesh as {' or '.join(SUFFIXES)}")
    content = read_file(path, MAX_MESH_SIZE)
    try:
        triangles = _obj(content) if suffix == ".obj" else _stl(content)
    except (ValueError, IndexError, UnicodeDecodeError) as error:
        raise ValueError(f"{path} is damaged: {error}") from error
    if not len(triangles):
        raise ValueError(f"{path} holds no triangle")
    if len(triangles) > MAX_TRIANGLES:
        raise ValueError(f"{path} holds {len(triangles)} triangles, more than {MAX_TRIANGLES}")
    if not np.all(np.isfinite(triangles)):
        raise ValueError(f"{path} holds a number that is not finite")
    return triangles


def _stl(content: bytes) -> Float64[np.ndarray, "m 3 3"]:
    """Triangles of an STL file; a binary one has the size that its header says."""
    count = int.from_bytes(content[HEADER_SIZE - 4 : HEADER_SIZE], "little")
    if len(content) >= HEADER_SIZE and len(content) == HEADER_SIZE + RECORD.itemsize * count:
        return np.frombuffer(content, RECORD, offset=HEADER_SIZE)["corners"].astype(float)
    if not content.lstrip().startswith(b"solid"):
        raise ValueError(f"its header says {count} triangles, which it is too short or long for")
    words = content.decode().split()
    corners = [words[k + 1 : k + 4] for k, word in enumerate(words) if word == "vertex"]
    return np.array(corners, float).reshape(-1, 3, 3)


def _obj(content: bytes) -> Float64[np.ndarray, "m 3 3"]:
    """Triangles of an OBJ file; faces of more corners are cut into fans."""
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for line in content.decode().splitlines():
        key, *words = line.split() or [""]
        if key == "v":
            vertices.append([float(word) for word in words[:3]])
        elif key == "f":
            corners = _corners(words, len(vertices))
            faces += [(corners[0], b, c) for b, c in pairwise(corners[1:])]
    return np.array(vertices, float).reshape(-1, 3)[np.array(faces, int).reshape(-1, 3)]


def _corners(words: Sequence[str], count: int) -> list[int]:
    """Indices of a face's vertices; those of the file begin at 1, negative ones count backwards.

    Raises:
        ValueError: There is no such vertex.
    """
    found = []
    for word in words:
        index = int(word.split("/")[0])
        if not (0 < index <= count or -count <= index < 0):
            raise ValueError(f"a face names vertex {index} of {count}")
        found.append(index - 1 if index > 0 else count + index)
    return found
