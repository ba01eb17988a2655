"""Triangle meshes from STL and OBJ files."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.files.bounded_file import read_file

MAX_MESH_SIZE = 64 * 2**20
"""Largest file of a mesh [bytes]."""
MAX_TRIANGLES = 500_000
"""Largest number of triangles of a mesh."""
MAX_LINE_SIZE = 4096
"""Largest line of a text file; a bracket's faces take below 100 [bytes]."""
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
    except (ValueError, IndexError) as error:
        raise ValueError(f"{path} is damaged: {error}") from error
    if not len(triangles):
        raise ValueError(f"{path} holds no triangle")
    if not np.all(np.isfinite(triangles)):
        raise ValueError(f"{path} holds a number that is not finite")
    return triangles


def _stl(content: bytes) -> Float64[np.ndarray, "m 3 3"]:
    """Triangles of an STL file; a binary one has the size that its header says."""
    count = int.from_bytes(content[HEADER_SIZE - 4 : HEADER_SIZE], "little")
    if len(content) >= HEADER_SIZE and len(content) == HEADER_SIZE + RECORD.itemsize * count:
        _check_count(count)
        return np.frombuffer(content, RECORD, offset=HEADER_SIZE)["corners"].astype(float)
    head = content.lstrip(b"\xef\xbb\xbf \t\r\n")[:5].lower()
    if head != b"solid" or b"\0" in content:
        raise ValueError(f"its header says {count} triangles, which it is too short or long for")
    corners: list[list[float]] = []
    for key, *words in _lines(content):
        if key == "vertex":
            corners.append([float(word) for word in words[:3]])
            _check_count(len(corners) // 3)
    return np.array(corners, float).reshape(-1, 3, 3)


def _obj(content: bytes) -> Float64[np.ndarray, "m 3 3"]:
    """Triangles of an OBJ file; faces of more corners are cut into fans."""
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for key, *words in _lines(content):
        if key == "v":
            vertices.append([float(word) for word in words[:3]])
            _check_count(len(vertices) // 3)
        elif key == "f":
            corners = _corners(words, len(vertices))
            faces += [(corners[0], b, c) for b, c in pairwise(corners[1:])]
            _check_count(len(faces))
    return np.array(vertices, float).reshape(-1, 3)[np.array(faces, int).reshape(-1, 3)]


def _lines(content: bytes) -> Iterator[list[str]]:
    """Yield the words of each line that has some; the first one, its keyword, in small letters.

    A backslash at its end continues a line. Names and comments may be in any encoding.

    Raises:
        ValueError: A line is too long.
    """
    begun = b""
    for part in io.BytesIO(content.removeprefix(b"\xef\xbb\xbf")):
        line = begun + part.rstrip()
        if len(line) > MAX_LINE_SIZE:
            raise ValueError(f"a line has {len(line)} bytes, more than {MAX_LINE_SIZE}")
        begun = line[:-1] + b" " if line.endswith(b"\\") else b""
        if not begun and (words := line.decode(errors="replace").split()):
            yield [words[0].lower(), *words[1:]]


def _check_count(count: int) -> None:
    """Check a number of triangles while they are read.

    Raises:
        ValueError: There are too many.
    """
    if count > MAX_TRIANGLES:
        raise ValueError(f"it holds more than {MAX_TRIANGLES} triangles")


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
