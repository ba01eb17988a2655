"""Triangle meshes from STL and OBJ files."""

from __future__ import annotations

import codecs
import io
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.files.bounded_file import read_file
from lariat.files.file_kind import kind_of, known_kind

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
    content = read_file(path, MAX_MESH_SIZE)
    if suffix not in SUFFIXES or known_kind(content):
        raise ValueError(f"{path} is {kind_of(path)}; give a mesh as {' or '.join(SUFFIXES)}")
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        content = content.decode("utf-16", "replace").encode()
    try:
        triangles = _obj(content) if suffix == ".obj" else _stl(content)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
    if not len(triangles):
        raise ValueError(f"{path} holds no triangle")
    if not np.all(np.isfinite(triangles)):
        raise ValueError(f"{path} holds a number that is not finite")
    return triangles


def _stl(content: bytes) -> Float64[np.ndarray, "m 3 3"]:
    """Triangles of an STL file; a binary one has at least the size that its header says."""
    count = int.from_bytes(content[HEADER_SIZE - 4 : HEADER_SIZE], "little")
    if count and len(content) >= HEADER_SIZE + RECORD.itemsize * count:
        _check_count(count)
        return np.frombuffer(content, RECORD, count, HEADER_SIZE)["corners"].astype(float)
    if b"\0" in content:
        raise ValueError(
            f"it is damaged or no STL file: {count} triangles by its header, which {len(content)} "
            "bytes are too few for"
        )
    if content.lstrip(b"\xef\xbb\xbf \t\r\n")[:5].lower() != b"solid":
        raise ValueError("it is no STL file: as a text it would begin with 'solid'")
    corners: list[list[float]] = []
    key = ""
    for key, *words in _lines(content):
        if key == "vertex":
            corners.append(_point(words))
            _check_count(len(corners) // 3)
    if key != "endsolid" or len(corners) % 3:
        raise ValueError("it is damaged: it ends before 'endsolid', or within a triangle")
    return np.array(corners, float).reshape(-1, 3, 3)


def _obj(content: bytes) -> Float64[np.ndarray, "m 3 3"]:
    """Triangles of an OBJ file; faces of more corners are cut into fans."""
    vertices: list[list[float]] = []
    faces: list[tuple[int, int, int]] = []
    for key, *words in _lines(content):
        if key == "v":
            vertices.append(_point(words))
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


def _point(words: Sequence[str]) -> list[float]:
    """Return coordinates, with decimal points or commas.

    Raises:
        ValueError: They are no three numbers.
    """
    try:
        x, y, z = (float(word.replace(",", ".")) for word in words[:3])
    except ValueError as error:
        raise ValueError(f"{' '.join(words)[:60]!r} is no point x y z") from error
    return [x, y, z]


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
    indices = []
    for word in words:
        try:
            index = int(word.split("/")[0])
        except ValueError as error:
            raise ValueError(f"a face names {word[:60]!r}, which is no vertex") from error
        if not (0 < index <= count or -count <= index < 0):
            raise ValueError(f"a face names vertex {index} of {count}")
        indices.append(index - 1 if index > 0 else count + index)
    return indices
